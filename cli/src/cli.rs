//! The command line as a whole.

use crate::args::Talk;
use crate::failure::Failure;
use crate::other_names;
use crate::printer;
use crate::verbs::Verb;
use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Command, CommandFactory, Parser};
use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

const EXAMPLES: &str = "\
Examples:
  mimic info kick.fbx              show its takes, its joints and the joint map
  mimic retarget kick.fbx          retarget the clip to a physics character
  mimic train kick.fbx             train a policy that performs it (runs/kick)
  mimic replay kick --rerun        watch the trained agent and its reference
  mimic eval kick                  measure how well the agent performs
  mimic plot kick                  draw how it learned

`retarget`, `tracks`, `train` and `replay` accept the file of any earlier stage and do the missing \
steps themselves: `mimic train kick.fbx` imports and retargets first. An input is a path, a name in \
the library folder, or the name of a run in runs/. Without an input, `retarget` uses the newest clip, \
`tracks` and `train` use the newest motion, and `eval`, `replay` and `plot` the newest run.

Results go to standard output, messages to standard error. Exit codes: 0 success, 1 the work failed, \
2 wrong usage or input.";

/// The library folder if none is given.
pub const LIBRARY: &str = "clips";

/// The folder of an empty variable is the usual one: an empty variable is as good as none.
fn library(given: OsString) -> PathBuf {
    match given.is_empty() {
        true => LIBRARY.into(),
        false => given.into(),
    }
}

/// Turn animation clips into physics characters that perform them
#[derive(Parser)]
#[command(name = "mimic", version, after_help = EXAMPLES, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    pub verb: Verb,
    #[command(flatten)]
    pub talk: Talk,
    /// Folder in which inputs are found by name
    #[arg(
        long,
        global = true,
        value_name = "DIR",
        env = "MIMIC_LIBRARY",
        default_value = LIBRARY,
        value_parser = OsStringValueParser::new().map(library),
        help_heading = "Global options"
    )]
    pub library: PathBuf,
}

/// Reads the command line. Help and the version are printed and end the program well; a wrong line ends it with 2.
pub fn parse() -> Result<Cli, ExitCode> {
    Cli::try_parse().map_err(|mut error| {
        if !error.use_stderr()
            || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
        {
            let printed = error.print().and_then(|()| std::io::stdout().flush());
            if let Err(failure) = printed.map_err(|e| Failure::print(&e))
                && !error.use_stderr()
            {
                printer::usage_error(&failure);
                return failure.code().into();
            }
            if error.use_stderr() && wants_json() {
                let failure = Failure::user("there is no command");
                printer::json_error(&failure.with_remedy("see `mimic --help`"));
            }
            return (error.exit_code() as u8).into();
        }
        let arguments: Vec<_> = std::env::args_os().collect();
        other_names::explain(&mut error, &Cli::command(), &arguments);
        let failure = other_names::fixed(&error)
            .unwrap_or_else(|| usage(&error.render().to_string(), &arguments));
        printer::usage_error(&failure);
        if wants_json() {
            printer::json_error(&failure);
        }
        failure.code().into()
    })
}

/// Whether errors are JSON. The flags could not be read, so `--json` is looked for by itself.
fn wants_json() -> bool {
    let is_json = |argument: &OsString| {
        let text = argument.to_string_lossy();
        text == "--json" || text.starts_with("--json=")
    };
    std::env::args_os().any(|argument| is_json(&argument))
}

/// What is wrong with a command line, from what clap says about it: the cause in the first paragraph, then its tips. One of
/// its tips is always about a `--` that makes a wrong flag a file, which nobody means.
fn usage(said: &str, arguments: &[OsString]) -> Failure {
    let cause = said.split("\n\n").next().unwrap_or(said);
    let cause = cause.strip_prefix("error: ").unwrap_or(cause);
    let words: Vec<&str> = cause.split_whitespace().collect();
    let cause = words.join(" ");
    // A value's own reader may know what was meant.
    let (cause, question) = match cause.split_once("; did you mean ") {
        Some((cause, meant)) => (cause, Some(format!("did you mean {meant}"))),
        None => (cause.as_str(), None),
    };
    let tips: Vec<&str> = said
        .lines()
        .filter_map(|line| line.trim().strip_prefix("tip: "))
        .filter(|tip| !tip.starts_with("to pass "))
        .collect();
    let remedy = question.unwrap_or_else(|| match tips.is_empty() {
        true => format!("see `{} --help`", named_verb(arguments)),
        false => tips.join("; "),
    });
    Failure::user(cause).with_remedy(remedy)
}

/// `mimic VERB` for the first argument that is a verb, else `mimic`.
fn named_verb(arguments: &[OsString]) -> String {
    let command = Cli::command();
    let verbs: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
    let mut words = arguments.iter().filter_map(|argument| argument.to_str());
    match words.find(|word| verbs.contains(word)) {
        Some(verb) => format!("mimic {verb}"),
        None => "mimic".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }

    fn failure(line: &[&str]) -> Failure {
        let said = Cli::try_parse_from(line).err();
        let said = said.map(|e| e.render().to_string()).expect("it is wrong");
        usage(&said, &line.iter().map(OsString::from).collect::<Vec<_>>())
    }

    #[test]
    fn wrong_usage_has_its_parts() {
        let failure = failure(&["mimic", "info", "kick.fbx", "--jsno"]);
        assert_eq!(failure.code(), 2);
        let json = failure.json();
        assert_eq!(json["remedy"], "a similar argument exists: '--json'");
        let message = json["message"].as_str().unwrap_or_default();
        assert!(
            message.starts_with("unexpected argument '--jsno' found; "),
            "{message}"
        );
    }

    /// Where clap has no better advice than to take the flag for a file, the help of the verb is.
    #[test]
    fn what_nothing_resembles_leads_to_the_help_of_the_verb() {
        for (line, help) in [
            (
                &["mimic", "info", "a.fbx", "--zzz"][..],
                "see `mimic info --help`",
            ),
            (
                &["mimic", "eval", "--episodes", "0"],
                "see `mimic eval --help`",
            ),
            (&["mimic", "--zzz"], "see `mimic --help`"),
        ] {
            assert_eq!(failure(line).json()["remedy"], help, "{line:?}");
        }
        let message = failure(&["mimic", "import"]).message().unwrap_or_default();
        assert!(
            message.contains("not provided: <FILE>...; see"),
            "{message}"
        );
        let message = failure(&["mimic", "train", "--seed", "-1"]).message();
        let message = message.unwrap_or_default();
        assert!(
            message.contains("'-1'") && message.contains("--seed"),
            "{message}"
        );
    }
}
