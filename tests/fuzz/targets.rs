//! What reads the files of each kind. A new kind gets its seeds in `ours.rs`, its form in `seeds.rs`, and an arm in [`read`].

use super::runs;
use mimic::clip::{Clip, Joint};
use mimic::explain::Explain;
use mimic::humanoid::HumanoidMap;
use mimic::import::{self, Options};
use mimic::motion::Motion;
use mimic::skeleton::Skeleton;
use nalgebra::Isometry3;
use std::path::Path;

/// What came of reading a file: nothing, or what is wrong with the result; or the message of the error.
pub type Outcome = Result<Option<&'static str>, String>;

/// What a file is read with.
pub struct With<'a> {
    /// Where files beside it are, and where it is put if it has to be on a disk.
    pub folder: &'a Path,
    pub options: &'a Options,
    /// The joints that a map names.
    pub joints: &'a [Joint],
}

/// Reads the file `name` of a kind.
pub fn read(kind: &str, name: &str, bytes: &[u8], with: &With) -> Outcome {
    match kind {
        "MJCF" => skeleton(bytes, None, with.folder),
        "slots" => skeleton(
            &std::fs::read(mjcf_of(name)).expect("it is ours"),
            Some(bytes),
            with.folder,
        ),
        "plan" => runs::plan(bytes),
        "run" | "policy" | "checkpoint" | "metrics" => runs::read(kind, bytes, with.folder),
        "joint map" => map(&String::from_utf8_lossy(bytes), with.joints),
        "clip" => told(Clip::load(put(with.folder, "a.clip", bytes)), clip),
        "motion" => told(Motion::load(put(with.folder, "a.motion", bytes)), motion),
        _ => told(
            import::read(bytes, name, Some(with.folder), with.options),
            clip,
        ),
    }
}

fn told<T, E: Explain>(read: Result<T, E>, flaw: fn(&T) -> Option<&'static str>) -> Outcome {
    match read {
        Ok(found) => Ok(flaw(&found)),
        Err(error) => Err(error.to_string()),
    }
}

fn put(folder: &Path, name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("it is written");
    path
}

fn mjcf_of(slots: &str) -> std::path::PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    root.join("skeletons").join(slots).with_extension("xml")
}

fn skeleton(mjcf: &[u8], slots: Option<&[u8]>, folder: &Path) -> Outcome {
    let path = put(folder, "a.xml", mjcf);
    let beside = folder.join("a.json");
    match slots {
        Some(slots) => drop(put(folder, "a.json", slots)),
        None => drop(std::fs::remove_file(beside)),
    }
    told(Skeleton::load(path), |skeleton| {
        let rest = skeleton.rest_qpos();
        let is_whole = skeleton.forward(&rest).iter().all(is_finite)
            && skeleton.total_mass().is_finite()
            && skeleton.leg_length().is_finite();
        (!is_whole).then_some("the skeleton isn't whole")
    })
}

fn map(text: &str, joints: &[Joint]) -> Outcome {
    let map = HumanoidMap::from_json(text, joints);
    // The command line names the file.
    map.map(|_| None).map_err(|e| format!("`map.json`: {e}"))
}

fn clip(clip: &Clip) -> Option<&'static str> {
    let whole = |frame: &Vec<_>| frame.len() == clip.joints.len() && frame.iter().all(is_finite);
    let whole = !clip.frames.is_empty() && clip.frames.iter().all(whole);
    (!whole).then_some("the clip isn't whole")
}

fn motion(motion: &Motion) -> Option<&'static str> {
    let frames = motion.qpos.len();
    let finite = |rows: &[Vec<f64>]| rows.iter().flatten().all(|x| x.is_finite());
    let is_whole = frames > 0
        && motion.qvel.len() == frames
        && motion.bodies.len() == frames
        && motion.tracks.contact.len() == frames
        && finite(&motion.qpos)
        && finite(&motion.qvel)
        && motion.bodies.iter().flatten().all(is_finite);
    (!is_whole).then_some("the motion isn't whole")
}

fn is_finite(at: &Isometry3<f64>) -> bool {
    at.to_homogeneous().iter().all(|x| x.is_finite())
}
