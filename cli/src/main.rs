//! `mimic`: from an animation clip to a physics character that performs it.

mod args;
mod checks;
mod clip_report;
mod failure;
mod locate;
mod output;
mod plot;
mod prepare;
mod printer;
mod recording;
mod runs;
mod verbs;
mod viewer;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = args::Cli::parse();
    let printer = printer::Printer::new(&cli.talk);
    let outcome = verbs::run(cli.verb, &cli.library, &printer);
    printer.finish(outcome)
}
