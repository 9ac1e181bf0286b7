//! One file per verb: its arguments, and what it does with them.

pub mod bench;
pub mod completions;
pub mod doctor;
pub mod edit;
pub mod eval;
pub mod import;
pub mod info;
pub mod man;
pub mod plot;
pub mod replay;
pub mod retarget;
pub mod tracks;
pub mod train;

use crate::args::Verb;
use crate::failure::Outcome;
use crate::printer::Printer;
use std::path::Path;

/// Runs one verb.
pub fn run(verb: Verb, library: &Path, printer: &Printer) -> Outcome {
    match verb {
        Verb::Info(args) => args.run(library, printer),
        Verb::Import(args) => args.run(library, printer),
        Verb::Edit(args) => args.run(library, printer),
        Verb::Retarget(args) => args.run(library, printer),
        Verb::Tracks(args) => args.run(library, printer),
        Verb::Train(args) => args.run(library, printer),
        Verb::Eval(args) => args.run(printer),
        Verb::Plot(args) => args.run(printer),
        Verb::Bench(args) => args.run(printer),
        Verb::Replay(args) => args.run(library, printer),
        Verb::Doctor(args) => args.run(library, printer),
        Verb::Completions(args) => args.run(printer),
        Verb::Man(args) => args.run(printer),
    }
}
