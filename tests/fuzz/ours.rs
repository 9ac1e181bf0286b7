//! Seeds of our own formats, made from the characters and clips of the repository.

use mimic::clip::Clip;
use mimic::humanoid;
use mimic::import::{self, Options};
use mimic::retarget::{self, retarget};
use mimic::skeleton::Skeleton;
use std::path::Path;

/// Kind, name and bytes.
type Made = (&'static str, &'static str, Vec<u8>);

/// One file of each kind, and the characters that are built in.
pub fn all() -> Vec<Made> {
    let clip = clip();
    let map = humanoid::map(&clip.joints).expect("our own clip is a humanoid's");
    let mut made = vec![
        (
            "joint map",
            "map.json",
            map.to_json(&clip.joints).into_bytes(),
        ),
        ("clip", "kick.clip", saved(|path| clip.save(path).is_ok())),
        ("motion", "kick.motion", motion(&clip)),
    ];
    for (mjcf, slots) in [
        ("humanoid.xml", "humanoid.json"),
        ("marathon.xml", "marathon.json"),
        ("robot.xml", "robot.json"),
    ] {
        made.push(("MJCF", mjcf, character(mjcf)));
        made.push(("slots", slots, character(slots)));
    }
    made
}

/// Half a second of our own kick.
pub fn clip() -> Clip {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("clips/kick.fbx");
    let options = Options {
        trim: Some((0.0, 0.5)),
        ..Options::default()
    };
    import::load(path, &options).expect("our own clip")
}

fn motion(clip: &Clip) -> Vec<u8> {
    let skeleton = Skeleton::load("humanoid").expect("it is built in");
    let motion = retarget(clip, &skeleton, &retarget::Options::default());
    let motion = motion.expect("our own clip is a humanoid's");
    saved(|path| motion.motion.save(path).is_ok())
}

fn character(file: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("skeletons")
        .join(file);
    std::fs::read(path).expect("our own character")
}

fn saved(save: impl FnOnce(&Path) -> bool) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    assert!(save(&path), "it is written");
    std::fs::read(path).expect("it was written")
}
