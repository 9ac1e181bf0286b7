//! `mimic`: from an animation clip to a physics character that performs it.

mod amount;
mod args;
mod checks;
mod cli;
mod clip_report;
mod failure;
mod locate;
mod other_names;
mod output;
mod plot;
mod prepare;
mod printer;
mod progress;
mod recording;
mod runs;
mod shell;
mod signals;
mod verbs;
mod viewer;

use clap::CommandFactory;
use cli::Cli;
use printer::Printer;
use std::process::ExitCode;

fn main() -> ExitCode {
    signals::report_large_files();
    if let Some(code) = verbs::completions::answer(Cli::command) {
        return code;
    }
    let cli = match cli::parse() {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    let printer = Printer::new(&cli.talk);
    let outcome = verbs::run(cli.verb, Cli::command(), &cli.library, &printer);
    printer.finish(outcome)
}
