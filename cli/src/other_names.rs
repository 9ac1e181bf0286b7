//! Flags by the names that they have elsewhere: who types `--steps` is told of `--samples`.

use crate::verbs::train;
use clap::Command;
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use std::ffi::OsString;

/// Names that other programs have for flags, and what comes nearest here; of several, what the command has. No aliases: most
/// take other values, so whoever types them has to know.
const ELSEWHERE: [(&[&str], &[&str]); 19] = [
    (
        &[
            "steps",
            "timesteps",
            "total-timesteps",
            "iterations",
            "epochs",
        ],
        &["samples"],
    ),
    (
        &["time", "duration", "length", "max-time", "timeout"],
        &["minutes", "seconds", "trim"],
    ),
    (
        &[
            "frames", "range", "start", "end", "from", "to", "crop", "cut",
        ],
        &["trim"],
    ),
    (
        &["output", "outdir", "output-dir", "out-dir", "dest", "name"],
        &["out", "save"],
    ),
    (
        &["jobs", "workers", "cores", "cpus", "num-threads"],
        &["threads"],
    ),
    (&["continue", "load", "checkpoint", "restart"], &["resume"]),
    (&["config", "settings", "plan"], &["preset"]),
    (
        &["character", "model", "robot", "mjcf", "rig"],
        &["skeleton"],
    ),
    (&["clip", "animation", "action"], &["take", "motion"]),
    (
        &["mapping", "joint-map", "retarget-map"],
        &["map", "write-map"],
    ),
    (&["framerate", "frame-rate", "rate", "hz"], &["fps"]),
    (&["scale", "units"], &["unit"]),
    (&["up-axis", "axis"], &["up"]),
    (&["flip"], &["mirror"]),
    (&["disturb", "push", "shove", "noise"], &["perturb"]),
    (&["trials", "rollouts", "num-episodes"], &["episodes"]),
    (&["view", "watch", "open", "show"], &["rerun"]),
    (&["silent"], &["quiet"]),
    (&["overwrite", "replace", "yes"], &["force"]),
];

/// Flags of other programs that are settings here, beside those that have a setting's own name.
const SETTINGS: [(&[&str], &str); 4] = [
    (&["lr", "learning-rate"], "ppo.learning_rate"),
    (&["num-envs", "envs", "n-envs"], "environments"),
    (&["batch-size", "minibatch-size"], "ppo.minibatch"),
    (&["network", "layers", "policy-network"], "hidden"),
];

/// Adds what was probably meant to an error about a flag that doesn't exist. `command` is the whole command line, and `words`
/// what was typed.
pub fn explain(error: &mut Error, command: &Command, words: &[OsString]) {
    let Some(ContextValue::String(flag)) = error.get(ContextKind::InvalidArg) else {
        return;
    };
    if error.kind() != ErrorKind::UnknownArgument {
        return;
    }
    let flag = flag
        .trim_start_matches('-')
        .split('=')
        .next()
        .unwrap_or_default();
    let verbs = words.iter().skip(1);
    let verb = verbs
        .filter_map(|word| command.find_subcommand(word))
        .next();
    let Some(meant) = verb.and_then(|verb| meant(flag, verb)) else {
        return;
    };
    let tip = ContextValue::StyledStrs(vec![StyledStr::from(format!("did you mean `{meant}`?"))]);
    for guess in [
        ContextKind::SuggestedArg,
        ContextKind::SuggestedCommand,
        ContextKind::TrailingArg,
    ] {
        error.remove(guess);
    }
    error.insert(ContextKind::Suggested, tip);
}

/// The flag of `verb`, or the setting, that is called `flag` elsewhere.
fn meant(flag: &str, verb: &Command) -> Option<String> {
    let has = |name: &str| verb.get_arguments().any(|a| a.get_long() == Some(name));
    let here = ELSEWHERE.iter().filter(|(names, _)| names.contains(&flag));
    let mut here = here.flat_map(|(_, here)| here.iter());
    if let Some(name) = here.find(|name| has(name)) {
        return Some(format!("--{name}"));
    }
    let path = match SETTINGS.iter().find(|(names, _)| names.contains(&flag)) {
        Some((_, path)) => (*path).to_owned(),
        None => setting(flag)?,
    };
    has("set").then(|| format!("--set {path}=VALUE"))
}

/// The setting whose own name is that of a flag: `--gamma` is `ppo.gamma`.
fn setting(flag: &str) -> Option<String> {
    let name = flag.replace('-', "_");
    let own = |path: &String| path.rsplit('.').next() == Some(&name);
    train::settings().into_iter().find(own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Cli;
    use clap::CommandFactory;

    /// What the program says about a line, in one piece.
    fn said(line: &str) -> String {
        let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        let command = Cli::command();
        let error = command.clone().try_get_matches_from(&words);
        let mut error = error.expect_err("the line is wrong");
        explain(&mut error, &command, &words);
        error.render().to_string()
    }

    #[test]
    fn flags_of_other_programs_are_understood() {
        for (line, tip) in [
            ("mimic train kick --steps 5M", "`--samples`"),
            ("mimic train kick --time=10", "`--minutes`"),
            ("mimic eval kick --time 10", "`--seconds`"),
            ("mimic import kick.fbx --frames 10", "`--trim`"),
            ("mimic import kick.fbx --output a", "`--out`"),
            ("mimic replay kick --output a", "`--save`"),
            ("mimic train kick --gamma 0.9", "`--set ppo.gamma=VALUE`"),
            (
                "mimic train kick --lr 1e-3",
                "`--set ppo.learning_rate=VALUE`",
            ),
            (
                "mimic --quiet train kick --num-envs 9",
                "`--set environments=VALUE`",
            ),
        ] {
            let said = said(line);
            assert!(
                said.contains(&format!("did you mean {tip}?")),
                "{line}: {said}"
            );
            assert_eq!(said.matches("tip:").count(), 1, "{said}");
        }
    }

    #[test]
    fn what_is_only_misspelt_is_left_to_clap() {
        assert!(said("mimic info kick --jsno").contains("'--json'"));
        assert!(!said("mimic info kick --steps 5").contains("did you mean"));
    }

    #[test]
    fn the_flags_that_are_suggested_exist() {
        let command = Cli::command();
        let has = |name: &&str| {
            let mut verbs = command.get_subcommands();
            verbs.any(|verb| verb.get_arguments().any(|a| a.get_long() == Some(name)))
                || command.get_arguments().any(|a| a.get_long() == Some(name))
        };
        for (names, here) in ELSEWHERE {
            assert!(here.iter().any(has), "{here:?}");
            assert!(!names.iter().any(has), "{names:?}");
        }
        for (_, path) in SETTINGS {
            assert!(
                train::settings().iter().any(|known| known == path),
                "{path}"
            );
        }
    }
}
