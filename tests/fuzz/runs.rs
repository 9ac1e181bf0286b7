//! Damaged files in the folder of a run, and damaged plans.

use super::targets::Outcome;
use mimic::clip::Clip;
use mimic::evaluate::perform;
use mimic::explain::Explanation;
use mimic::retarget::{self, retarget};
use mimic::run::{Plan, Run, RunError, Session, files};
use mimic::skeleton::Skeleton;
use mimic::task::{EpisodeStart, StartState};
use std::path::{Path, PathBuf};

/// The kinds, each with the file of the run that is damaged.
pub const KINDS: [(&str, &str); 4] = [
    ("run", files::CONFIG),
    ("policy", files::POLICY),
    ("checkpoint", files::CHECKPOINT),
    ("metrics", files::METRICS),
];

/// Makes a run that has learned a little, in `folder`.
pub fn make(folder: &Path, clip: &Clip) {
    let skeleton = Skeleton::load("humanoid").expect("it is built in");
    let motion = retarget(clip, &skeleton, &retarget::Options::default());
    let motion = motion.expect("our own clip is a humanoid's").motion;
    let plan = Plan {
        environments: 2,
        group: 2,
        horizon: 4,
        round: 1,
        samples: 16,
        hidden: vec![4],
        ..Plan::default()
    };
    let run = Run::create(place(folder), plan, skeleton, vec![motion]).expect("it can be trained");
    let mut session = Session::open(run).expect("it can be trained");
    session.train_round().expect("it stays finite");
}

fn place(folder: &Path) -> PathBuf {
    folder.join("run")
}

/// The whole file of a kind in that run.
pub fn whole(folder: &Path, file: &str) -> Vec<u8> {
    std::fs::read(place(folder).join(file)).expect("the run has it")
}

/// Reads the run while the file of this kind is the damaged one.
pub fn read(kind: &str, bytes: &[u8], folder: &Path) -> Outcome {
    let (_, file) = KINDS
        .into_iter()
        .find(|(name, _)| *name == kind)
        .expect("a kind of ours");
    let (run, path) = (place(folder), place(folder).join(file));
    let kept = std::fs::read(&path).expect("the run has it");
    std::fs::write(&path, bytes).expect("it is written");
    let outcome = match kind {
        "policy" => Run::open(&run).and_then(|run| act(&run)),
        "run" => Run::open(&run).and_then(|run| run.controller()).map(drop),
        _ => Run::open(&run).and_then(Session::open).map(drop),
    };
    std::fs::write(&path, kept).expect("it is written");
    outcome.map(|()| None).map_err(|e| e.to_string())
}

/// Acts for a few steps.
fn act(run: &Run) -> Result<(), RunError> {
    let controller = run.controller()?;
    let start = EpisodeStart::new(0, StartState::Reference(0.0));
    match perform(&controller, &[start], 0.1) {
        Ok(_) => Ok(()),
        // Numbers that are finite each can give one that isn't; the command line says in which run.
        Err(error) if error.to_string().contains("not finite") => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// Reads a plan, as of `--preset FILE`.
pub fn plan(bytes: &[u8]) -> Outcome {
    // As the command line does, which knows the file.
    let named = |cause: String| Explanation::input(cause).file("plan.json").to_string();
    let plan: Plan = serde_json::from_slice(bytes).map_err(|e| named(e.to_string()))?;
    plan.check().map_err(|e| named(e.to_string()))?;
    // What is allowed can be written and read again.
    let text = serde_json::to_string(&plan).expect("a plan can be written");
    let again: Plan = serde_json::from_str(&text).expect("and read");
    Ok((again != plan).then_some("it comes back as another plan"))
}

/// The plan of every preset, as text.
pub fn plans() -> Vec<(&'static str, Vec<u8>)> {
    let text = |preset: &mimic::run::Preset| {
        let text = serde_json::to_vec(&(preset.plan)()).expect("a plan can be written");
        (preset.name, text)
    };
    mimic::run::PRESETS.iter().map(text).collect()
}
