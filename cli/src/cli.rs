//! The command line as a whole.

use crate::args::Talk;
use crate::failure::Failure;
use crate::printer;
use crate::verbs::Verb;
use clap::Parser;
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

Every command accepts the file of an earlier stage and does the missing steps itself: \
`mimic train kick.fbx` imports and retargets first. An input is a path, or a name in the library \
folder or in runs/. Without an input, commands use the newest file or run.

Results go to standard output, messages to standard error. Exit codes: 0 success, 1 the work failed, \
2 wrong usage or input.";

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
        default_value = "clips",
        help_heading = "Global options"
    )]
    pub library: PathBuf,
}

/// Reads the command line. Help and the version are printed and end the program well; a wrong line ends it with 2.
pub fn parse() -> Result<Cli, ExitCode> {
    Cli::try_parse().map_err(|error| {
        // If even this cannot be printed, nobody is left to tell.
        error.print().ok();
        if !error.use_stderr() {
            return ExitCode::SUCCESS;
        }
        let failure = usage(&error.render().to_string());
        // The flags could not be read, so `--json` is looked for by itself.
        if std::env::args_os().any(|argument| argument == "--json") {
            printer::json_error(&failure);
        }
        failure.code().into()
    })
}

/// What is wrong with a command line, from what clap says about it: the cause in the first paragraph, then its tips.
fn usage(said: &str) -> Failure {
    let cause = said.split("\n\n").next().unwrap_or(said);
    let tips: Vec<&str> = said
        .lines()
        .filter_map(|line| line.trim().strip_prefix("tip: "))
        .collect();
    let remedy = match tips.is_empty() {
        true => "see `mimic --help`".to_owned(),
        false => tips.join("; "),
    };
    Failure::user(cause.trim_start_matches("error: ")).with_remedy(remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }

    #[test]
    fn wrong_usage_has_its_parts() {
        let line = ["mimic", "info", "kick.fbx", "--jsno"];
        let said = Cli::try_parse_from(line)
            .err()
            .map(|e| e.render().to_string());
        let failure = usage(&said.expect("there is no such flag"));
        assert_eq!(failure.code(), 2);
        let json = failure.json();
        assert_eq!(json["remedy"], "a similar argument exists: '--json'");
        let message = json["message"].as_str().unwrap_or_default();
        assert!(
            message.starts_with("unexpected argument '--jsno' found; "),
            "{message}"
        );
    }
}
