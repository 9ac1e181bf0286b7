//! Files that the first version wrote still open, and mean what they meant. `tests/fixtures/v1` says where they come from.

use mimic::clip::Clip;
use mimic::evaluate::perform;
use mimic::humanoid::Slot;
use mimic::import;
use mimic::motion::Motion;
use mimic::run::{PolicyFile, Run};
use mimic::skeleton::Skeleton;
use mimic::task::{EpisodeStart, StartState};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/v1");
    folder.join(name)
}

/// A copy of the run, for resuming writes into it.
fn run() -> (tempfile::TempDir, Run) {
    let folder = tempfile::tempdir().expect("a folder");
    for entry in std::fs::read_dir(fixture("walk-run")).expect("the run is there") {
        let from = entry.expect("an entry").path();
        let name = from.file_name().expect("a name");
        std::fs::copy(&from, folder.path().join(name)).expect("it is copied");
    }
    let run = Run::open(folder.path()).unwrap_or_else(|e| panic!("{e}"));
    (folder, run)
}

#[test]
fn a_clip_of_the_first_version_is_what_its_source_still_is() {
    let clip = Clip::load(fixture("walk.clip")).unwrap_or_else(|e| panic!("{e}"));
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("clips/walk.glb");
    let imported = import::load(source, &import::Options::default()).expect("our own clip");
    let names = |clip: &Clip| -> Vec<_> {
        let joints = clip.joints.iter();
        joints.map(|j| (j.name.clone(), j.parent)).collect()
    };
    assert_eq!(names(&clip), names(&imported));
    assert_eq!(clip.frames.len(), imported.frames.len());
    let pairs = clip.frames.iter().flatten();
    for (old, new) in pairs.zip(imported.frames.iter().flatten()) {
        // Another processor's sines may differ in their last bit, and so single precision in its.
        let off = (old.to_homogeneous() - new.to_homogeneous()).norm();
        assert!(off < 1e-6, "{off}");
    }
}

#[test]
fn a_motion_of_the_first_version_opens() {
    let path = fixture("walk-run/reference-0.motion");
    let motion = Motion::load(path).unwrap_or_else(|e| panic!("{e}"));
    let skeleton = Skeleton::load(&motion.skeleton_name).expect("a built-in character");
    motion
        .check_skeleton(&skeleton)
        .unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((motion.qpos.len(), motion.fps), (34, 30.0));
    assert!(
        motion.source.is_none(),
        "it was written before there was one"
    );
    let report = motion.report.as_ref().expect("it was retargeted");
    let hips = report.map.iter().find(|joint| joint.slot == Slot::Hips);
    assert_eq!(hips.expect("hips").joint, "Hips");
    // What the old program said of the motion.
    let quality = motion.quality(&skeleton);
    let value = |id: &str| quality.iter().find(|check| check.id == id).map(|c| c.value);
    assert_eq!(value("keypoint-error"), Some(0.008517650678390658));
    assert_eq!(value("contact-disagreement"), Some(0.11029411764705882));
}

#[test]
fn a_run_of_the_first_version_can_be_resumed() {
    let (folder, run) = run();
    assert_eq!(run.plan().hidden, [16]);
    let mut trainer = run.trainer().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((trainer.iteration(), trainer.samples()), (8, 8192));
    // Checkpoint and policy were saved together.
    let policy = folder.path().join("policy.safetensors");
    let policy = PolicyFile::load(policy).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(trainer.state().learner.parameters, policy.parameters);
    let metrics = trainer.iterate().expect("it goes on");
    assert_eq!(metrics.iteration, 9);
    assert_ne!(trainer.state().learner.parameters, policy.parameters);
}

/// It acts as its evaluation by the old program says, up to how other processors round.
#[test]
fn the_policy_of_a_first_run_acts_as_it_did() {
    let (folder, run) = run();
    let text = std::fs::read_to_string(folder.path().join("eval.json")).expect("it is read");
    let evaluation: Value = serde_json::from_str(&text).expect("JSON");
    let first = &evaluation["failures"][0];
    assert_eq!(first["start"], 0.0);
    let survived = first["survived_s"].as_f64().expect("a number");
    let controller = run.controller().unwrap_or_else(|e| panic!("{e}"));
    let start = EpisodeStart::new(0, StartState::Reference(0.0));
    let episodes = perform(&controller, &[start], 10.0).expect("it acts");
    let seconds = episodes[0].survived as f64 / episodes[0].control_hz;
    assert!(
        (seconds - survived).abs() < 0.5,
        "it stood for {seconds} s, then for {survived} s"
    );
}
