//! `mimic completions`: prints completions for a shell.

use crate::failure::Outcome;
use crate::printer::Printer;
use clap::Command;
use clap_complete::Shell;
use serde_json::json;

const EXAMPLES: &str = "\
Examples:
  mimic completions bash > ~/.local/share/bash-completion/completions/mimic
  mimic completions zsh > ~/.zfunc/_mimic
  mimic completions fish > ~/.config/fish/completions/mimic.fish";

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
    pub fn run(self, mut command: Command, printer: &Printer) -> Outcome {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, "mimic", &mut script);
        let script = String::from_utf8_lossy(&script).into_owned();
        printer.result(&json!({ "text": script }), || script.clone())
    }
}
