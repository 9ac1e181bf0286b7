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
pub mod runs;
pub mod tracks;
pub mod train;

use crate::failure::Outcome;
use crate::printer::Printer;
use clap::{Command, Subcommand};
use std::path::Path;

/// What can be done.
#[derive(Subcommand)]
pub enum Verb {
    Info(info::Args),
    Import(import::Args),
    Edit(edit::Args),
    Retarget(retarget::Args),
    Tracks(tracks::Args),
    Train(train::Args),
    Runs(runs::Args),
    Eval(eval::Args),
    Replay(replay::Args),
    Plot(plot::Args),
    Bench(bench::Args),
    Doctor(doctor::Args),
    Completions(completions::Args),
    Man(man::Args),
}

/// Runs one verb. `command` is the whole command line, for those that describe it.
pub fn run(verb: Verb, command: Command, library: &Path, printer: &Printer) -> Outcome {
    if !matches!(verb, Verb::Train(_) | Verb::Eval(_) | Verb::Bench(_)) {
        crate::runs::bound_threads()?;
    }
    match verb {
        Verb::Info(args) => args.run(library, printer),
        Verb::Import(args) => args.run(library, printer),
        Verb::Edit(args) => args.run(library, printer),
        Verb::Retarget(args) => args.run(library, printer),
        Verb::Tracks(args) => args.run(library, printer),
        Verb::Train(args) => args.run(library, printer),
        Verb::Runs(args) => args.run(printer),
        Verb::Eval(args) => args.run(printer),
        Verb::Plot(args) => args.run(printer),
        Verb::Bench(args) => args.run(printer),
        Verb::Replay(args) => args.run(library, printer),
        Verb::Doctor(args) => args.run(library, printer),
        Verb::Completions(args) => args.run(printer),
        Verb::Man(args) => args.run(command, printer),
    }
}
