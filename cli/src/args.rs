//! The command line: what can be typed.

use crate::verbs;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  mimic info kick.fbx               what is in the file, and which joint is which
  mimic retarget kick.fbx           carry the clip onto the physics character
  mimic train kick.fbx              learn to perform it; the result is a run, runs/kick
  mimic replay kick --rerun         watch the agent beside its reference
  mimic eval kick                   how well it does

Every stage takes the file of an earlier stage and does what is missing. Inputs are found by path, or
by name in the library folder; left out, the most recent one is taken. Results go to standard output,
talk to standard error. Exit code: 0 success, 1 the work failed, 2 wrong usage or input.";

/// From an animation clip to a physics character that performs it
#[derive(Parser)]
#[command(name = "mimic", version, after_help = EXAMPLES, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    pub verb: Verb,
    #[command(flatten)]
    pub talk: Talk,
    /// Folder where inputs are found by name
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

/// How much is said, and in what form.
#[derive(Args)]
#[command(next_help_heading = "Global options")]
pub struct Talk {
    /// Print one JSON object instead of text (`train`: one per iteration)
    #[arg(long, global = true)]
    pub json: bool,
    /// Say nothing but results and errors
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more, also when the output is piped
    #[arg(long, short, global = true)]
    pub verbose: bool,
}

#[derive(Subcommand)]
pub enum Verb {
    Doctor(verbs::doctor::Args),
    Completions(verbs::completions::Args),
    Man(verbs::man::Args),
}
