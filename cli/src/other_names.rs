//! Flags by the names that they have elsewhere: who types `--steps` is told of `--samples`.

use crate::failure::Failure;
use crate::shell;
use crate::verbs::train;
use clap::Command;
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use std::ffi::OsString;
use std::path::Path;

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
    let verbs = words.iter().skip(1);
    let at = verbs
        .clone()
        .position(|word| command.find_subcommand(word).is_some());
    let given: Vec<&OsString> = at.map_or(Vec::new(), |at| verbs.clone().skip(at).collect());
    if let Some(advice) = advice(flag, &given) {
        return tell(error, advice);
    }
    let flag = flag
        .trim_start_matches('-')
        .split('=')
        .next()
        .unwrap_or_default();
    let verb = verbs
        .filter_map(|word| command.find_subcommand(word))
        .next();
    let Some(meant) = verb.and_then(|verb| meant(flag, verb)) else {
        return;
    };
    tell(error, format!("did you mean `{meant}`?"));
}

/// Puts advice in the place of clap's own.
fn tell(error: &mut Error, advice: String) {
    let tip = ContextValue::StyledStrs(vec![StyledStr::from(advice)]);
    for guess in [
        ContextKind::SuggestedArg,
        ContextKind::SuggestedCommand,
        ContextKind::TrailingArg,
    ] {
        error.remove(guess);
    }
    error.insert(ContextKind::Suggested, tip);
}

/// What to do with a `word` that the verb doesn't take, where that is more than another flag. `given` is the command line from
/// the verb on.
fn advice(word: &str, given: &[&OsString]) -> Option<String> {
    let (verb, rest) = given.split_first()?;
    let verb = verb.to_str()?;
    let inputs = rest.iter().filter_map(|word| word.to_str());
    let mut inputs = inputs.filter(|word| !word.starts_with('-'));
    if !word.starts_with('-') {
        return match verb {
            "eval" => {
                let first = inputs
                    .next()
                    .filter(|first| *first != word)
                    .unwrap_or("RUN");
                let (first, word) = (shell::word(first), shell::word(word));
                Some(format!(
                    "evaluate one run after the other, and compare them with `mimic plot {first} {word}` or `mimic runs`"
                ))
            }
            "info" | "retarget" | "tracks" | "replay" | "runs" => {
                Some(format!("call `mimic {verb}` once for each"))
            }
            _ => None,
        };
    }
    // What decides how an animation file is read is for the command that reads one.
    let name = word.split(['=', ' ']).next().unwrap_or(word);
    if verb != "edit" || !["--take", "--up", "--unit"].contains(&name) {
        return None;
    }
    let at = rest
        .iter()
        .position(|given| given.to_str().is_some_and(|given| given.starts_with(name)))?;
    let value = match rest[at].to_str()?.split_once('=') {
        Some((_, value)) => value.to_owned(),
        None => rest
            .get(at + 1)
            .map_or("VALUE".into(), |value| value.to_string_lossy().into_owned()),
    };
    let file = inputs.find(|input| *input != value).unwrap_or("FILE");
    let (file, value) = (shell::path(Path::new(file)), shell::word(&value));
    Some(format!(
        "import the file first, and edit the clip: `mimic import {file} {name} {value}`"
    ))
}

/// That a run goes on as it was made, where `--resume` comes with an option that would change it.
pub fn fixed(error: &Error) -> Option<Failure> {
    let context = [ContextKind::InvalidArg, ContextKind::PriorArg];
    let names = context.into_iter().filter_map(|kind| error.get(kind));
    let names: Vec<&str> = names
        .flat_map(|value| match value {
            ContextValue::String(name) => vec![name.as_str()],
            ContextValue::Strings(names) => names.iter().map(String::as_str).collect(),
            _ => Vec::new(),
        })
        .collect();
    let is_resume = |name: &&str| name.starts_with("--resume");
    if error.kind() != ErrorKind::ArgumentConflict || !names.iter().any(is_resume) {
        return None;
    }
    let other = names.iter().find(|name| !is_resume(name))?;
    if !other.starts_with('-') {
        return Some(
            Failure::user("a run keeps its motions, so `--resume` takes no other input")
                .with_remedy("leave the input out, or train a new run with it, without `--resume`"),
        );
    }
    let flag = other.split(' ').next().unwrap_or(other);
    let given = other.replace(['<', '>'], "");
    let what = match flag {
        "--samples" => "a run's number of samples is fixed",
        "--out" => "a run stays in its folder",
        _ => "a run's settings and motions are fixed",
    };
    Some(
        Failure::user(format!("{what}, so `--resume` takes no `{flag}`")).with_remedy(format!(
            "train a new run with `mimic train INPUT {given}`, or leave the option out"
        )),
    )
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
    fn what_another_verb_does_is_shown() {
        for (line, tip) in [
            (
                "mimic edit pack.glb --take Hit_A",
                "`mimic import pack.glb --take Hit_A`",
            ),
            (
                "mimic edit --take=3 my.glb",
                "`mimic import my.glb --take 3`",
            ),
            (
                "mimic edit a.bvh --mirror --unit 0.01",
                "`mimic import a.bvh --unit 0.01`",
            ),
            (
                "mimic eval kick walk",
                "`mimic plot kick walk` or `mimic runs`",
            ),
            (
                "mimic eval kick --episodes 8 it's",
                "`mimic plot kick 'it'\\''s'`",
            ),
            (
                "mimic tracks a.motion b.motion",
                "call `mimic tracks` once for each",
            ),
        ] {
            let said = said(line);
            assert!(said.contains(tip), "{line}: {said}");
        }
    }

    #[test]
    fn a_run_that_goes_on_can_not_be_changed() {
        for (line, cause, remedy) in [
            (
                "mimic train --resume kick --samples 9M",
                "number of samples is fixed",
                "INPUT --samples N`",
            ),
            (
                "mimic train --samples 9M --resume kick",
                "number of samples is fixed",
                "INPUT --samples N`",
            ),
            (
                "mimic train --resume kick --seed 7",
                "are fixed",
                "INPUT --seed N`",
            ),
            (
                "mimic train --resume kick --take 2",
                "are fixed",
                "INPUT --take TAKE`",
            ),
            (
                "mimic train --resume kick --out b",
                "stays in its folder",
                "INPUT --out RUN`",
            ),
            (
                "mimic train walk.fbx --resume kick",
                "keeps its motions",
                "without `--resume`",
            ),
        ] {
            let words = line.split(' ');
            let error = Cli::command()
                .try_get_matches_from(words)
                .expect_err("it is wrong");
            let message = fixed(&error).and_then(|failure| failure.message());
            let message = message.expect(line);
            assert!(
                message.contains(cause) && message.contains(remedy),
                "{line}: {message}"
            );
            assert!(!message.contains("cannot be used with"), "{message}");
        }
        let other = Cli::command().try_get_matches_from(["mimic", "--quiet", "--verbose", "runs"]);
        assert_eq!(fixed(&other.expect_err("they conflict")), None);
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
