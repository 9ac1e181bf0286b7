//! `mimic completions`: prints completions for a shell.
//!
//! The script that a shell loads asks this program, at every press of the key, what could stand next. So completions know
//! the runs, clips and takes that are there at that moment.

mod candidates;

use crate::failure::{Failure, Outcome};
use crate::printer::Printer;
use candidates::Source;
use clap::Command;
use clap_complete::Shell;
use clap_complete::env::{CompleteEnv, Shells};
use serde_json::json;
use std::process::ExitCode;

const EXAMPLES: &str = "\
Examples:
  mimic completions bash > ~/.local/share/bash-completion/completions/mimic
  mimic completions zsh > ~/.zfunc/_mimic
  mimic completions fish > ~/.config/fish/completions/mimic.fish

Completions know your runs and clips, the takes of the file on the line, characters, presets and \
settings. Write the script again after an update of mimic.";

/// Says in the environment that a shell asks, and which.
const ASKED_BY: &str = "MIMIC_COMPLETE";

/// Print shell completions
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Shell to print completions for
    #[arg(value_enum)]
    shell: Shell,
}

impl Args {
    /// Runs the command.
    pub fn run(self, printer: &Printer) -> Outcome {
        let shell = self.shell.to_string();
        let unknown = || Failure::work(format!("completions for {shell} are missing"));
        let shells = Shells::builtins();
        let completer = shells.completer(&shell).ok_or_else(unknown)?;
        let mut script = Vec::new();
        completer
            .write_registration(ASKED_BY, "mimic", "mimic", "mimic", &mut script)
            .map_err(|e| Failure::print(&e))?;
        let script = String::from_utf8_lossy(&script).into_owned();
        printer.result(&json!({ "text": script }), || script.clone())
    }
}

/// Answers a shell that asks what could stand next; `None` if no shell does.
pub fn answer(command: impl Fn() -> Command) -> Option<ExitCode> {
    let words = std::env::args_os();
    let folder = std::env::current_dir().ok();
    let environment = CompleteEnv::with_factory(|| with_candidates(command())).var(ASKED_BY);
    match environment.try_complete(words, folder.as_deref()) {
        Ok(false) => None,
        Ok(true) => Some(ExitCode::SUCCESS),
        // A message would land in the line that is typed.
        Err(_) => Some(ExitCode::FAILURE),
    }
}

/// Arguments whose values are names that only we know: by verb, or in all verbs that have them.
const KNOWN: [(Option<&str>, &str, Source); 17] = [
    (Some("info"), "file", Source::Clips),
    (Some("import"), "files", Source::Clips),
    (Some("edit"), "clips", Source::Clips),
    (Some("retarget"), "clip", Source::Clips),
    (Some("tracks"), "motion", Source::Animations),
    (Some("train"), "inputs", Source::Animations),
    (Some("train"), "preset", Source::Presets),
    (Some("train"), "set", Source::Settings),
    (Some("train"), "resume", Source::Runs),
    (Some("runs"), "folder", Source::Runs),
    (Some("eval"), "run", Source::Runs),
    (Some("replay"), "what", Source::RunsAndAnimations),
    (Some("plot"), "runs", Source::Runs),
    (None, "take", Source::Takes),
    (None, "skeleton", Source::Skeletons),
    (None, "weight", Source::Slots),
    (None, "map", Source::Maps),
];

/// The command line, with what could stand in these arguments.
fn with_candidates(mut command: Command) -> Command {
    let verbs: Vec<String> = command
        .get_subcommands()
        .map(|c| c.get_name().to_owned())
        .collect();
    for verb in verbs {
        command = command.mut_subcommand(&verb, |mut command| {
            for (only, argument, source) in KNOWN {
                let has = command.get_arguments().any(|a| a.get_id() == argument);
                if has && only.is_none_or(|only| only == verb) {
                    command = command.mut_arg(argument, |a| a.add(source.completer()));
                }
            }
            command
        });
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Cli;
    use clap::CommandFactory;

    #[test]
    fn every_argument_with_known_names_exists() {
        let command = Cli::command();
        for (only, argument, _) in KNOWN {
            let mut verbs = command.get_subcommands();
            let has = |verb: &Command| verb.get_arguments().any(|a| a.get_id() == argument);
            let found =
                verbs.any(|verb| only.is_none_or(|only| verb.get_name() == only) && has(verb));
            assert!(found, "{only:?} {argument}");
        }
    }

    #[test]
    fn every_shell_has_a_script() {
        use clap::ValueEnum;
        let shells = Shells::builtins();
        for shell in Shell::value_variants() {
            assert!(shells.completer(&shell.to_string()).is_some(), "{shell}");
        }
    }
}
