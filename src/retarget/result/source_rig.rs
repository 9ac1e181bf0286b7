//! What carrying a motion back onto its source's rig will need: the rig, and the motion of joints that no body follows.

use crate::clip::stored::rounded;
use crate::humanoid::Slot;
use crate::motion::SourceRig;
use crate::retarget::input::Input;
use crate::skeleton::Skeleton;
use nalgebra::Isometry3;
use std::collections::{BTreeMap, BTreeSet};

/// Turn (radians) and shift (metres) from the first frame below which a joint stands still. Chosen: files hold single
/// precision, and importers' arithmetic leaves some 1e-7; an error of 1e-5 moves nothing visibly, at a metre from the joint
/// by 0.01 mm.
const STILL: f64 = 1e-5;

/// The rig of the clip, and the tracks of its joints over the motion's frames.
pub(super) fn source_rig(input: &Input, skeleton: &Skeleton) -> SourceRig {
    let Input { clip, own, map, .. } = input;
    let slots = map.matches.iter().map(|(slot, found)| (*slot, found.joint));
    // A body that is welded to its parent can't turn as its joint does.
    let follows = |slot: &Slot| {
        let body = skeleton.slots.get(slot);
        body.is_some_and(|&body| !skeleton.bodies[body].joints.is_empty())
    };
    let followed = slots.clone().filter(|(slot, _)| follows(slot));
    let followed: BTreeSet<usize> = followed.map(|(_, joint)| joint).collect();
    let mut source = SourceRig {
        joints: clip.joints.clone(),
        map: slots.collect(),
        first: clip.frames[own.start].iter().map(rounded).collect(),
        rotations: BTreeMap::new(),
        translations: BTreeMap::new(),
    };
    for joint in (0..clip.joints.len()).filter(|joint| !followed.contains(joint)) {
        let frames = clip.frames[own.clone()].iter();
        let track: Vec<Isometry3<f64>> = frames.map(|locals| rounded(&locals[joint])).collect();
        let moved = |at: &Isometry3<f64>| track[0].inv_mul(at);
        if track.iter().any(|at| moved(at).rotation.angle() > STILL) {
            let rotations = track.iter().map(|at| at.rotation).collect();
            source.rotations.insert(joint, rotations);
        }
        if track.iter().any(|at| shift(&track[0], at) > STILL) {
            let translations = track.iter().map(|at| at.translation.vector).collect();
            source.translations.insert(joint, translations);
        }
    }
    source
}

fn shift(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    (b.translation.vector - a.translation.vector).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::{Clip, Joint};
    use crate::import;
    use crate::motion::Motion;
    use crate::retarget::{Options, retarget};
    use crate::skeleton::Skeleton;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    /// Our walk, by a figure with a finger of two joints that bend, a thumb that is held bent, and a pen that slides.
    fn walk() -> Clip {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/clips/walk.glb");
        let mut clip = import::load(path, &import::Options::default()).expect("our own clip");
        let hand = clip
            .joints
            .iter()
            .position(|joint| joint.name == "LeftHand");
        let hand = hand.expect("it has a left hand");
        let finger = clip.joints.len();
        let rest = Isometry3::translation(0.08, 0.01, 0.0);
        for (name, parent) in [
            ("LeftHandIndex1", hand),
            ("LeftHandIndex2", finger),
            ("LeftHandThumb1", hand),
            ("Pen", hand),
        ] {
            clip.joints.push(Joint {
                name: name.to_owned(),
                parent: Some(parent),
                rest,
                bone: None,
            });
        }
        let at = |shift: f64, turn: Vector3<f64>| {
            let turn = UnitQuaternion::from_scaled_axis(turn);
            rest * Isometry3::from_parts(Translation3::new(shift, 0.0, 0.0), turn)
        };
        for (f, locals) in clip.frames.iter_mut().enumerate() {
            let bend = 0.3 * (f as f64 / 4.0).sin();
            locals.push(at(0.0, Vector3::new(bend, 0.1, 0.0)));
            locals.push(at(0.0, Vector3::new(2.0 * bend, 0.0, 0.2)));
            locals.push(at(0.0, Vector3::new(0.0, 0.0, 0.7)));
            locals.push(at(0.01 * bend, Vector3::zeros()));
        }
        clip.round_to_file();
        clip
    }

    /// The source in the file of the motion that `clip` becomes.
    fn stored(clip: &Clip) -> SourceRig {
        let skeleton = Skeleton::load("humanoid").expect("a built-in character");
        let done = retarget(clip, &skeleton, &Options::default()).expect("a humanoid");
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("walk.motion");
        done.motion.save(&path).expect("it is written");
        let motion = Motion::load(&path).expect("it is read");
        assert_eq!(motion, done.motion);
        motion.source.expect("it has its source")
    }

    fn joint(clip: &Clip, name: &str) -> usize {
        let at = clip.joints.iter().position(|joint| joint.name == name);
        at.unwrap_or_else(|| panic!("no joint {name}"))
    }

    #[test]
    fn fingers_come_out_of_the_motion_file_as_they_went_in() {
        let clip = walk();
        let source = stored(&clip);
        assert_eq!(source.joints, clip.joints);
        assert_eq!(source.map[&Slot::LeftHand], joint(&clip, "LeftHand"));
        let fingers = ["LeftHandIndex1", "LeftHandIndex2", "LeftHandThumb1", "Pen"];
        let fingers = fingers.map(|name| joint(&clip, name));
        for (f, locals) in clip.frames.iter().enumerate() {
            for finger in fingers {
                assert_eq!(source.local(finger, f), locals[finger], "frame {f}");
            }
        }
        // Nothing is kept of what stands still, or of what a body follows.
        let [index, tip, thumb, pen] = fingers;
        for (tracks, expected) in [
            (
                source.rotations.keys().collect::<Vec<_>>(),
                [&index, &tip].as_slice(),
            ),
            (source.translations.keys().collect(), &[&pen]),
        ] {
            let of_fingers = tracks.iter().filter(|joint| fingers.contains(joint));
            assert_eq!(of_fingers.copied().collect::<Vec<_>>(), expected);
            assert!(!tracks.contains(&&joint(&clip, "LeftHand")));
        }
        assert_eq!(source.first[thumb], clip.frames[0][thumb]);
    }

    /// A part of a take is retargeted with what is around it, and a slow one with frames in between.
    #[test]
    fn tracks_have_the_frames_of_the_motion() {
        let slow = walk().resample(15.0).expect("a rate");
        let part = slow.trim(0.2, 0.6).expect("a part");
        let source = stored(&part);
        let finger = joint(&part, "LeftHandIndex1");
        let track = &source.rotations[&finger];
        let times = (track.len() - 1) / (part.frames.len() - 1);
        assert_eq!(track.len(), times * (part.frames.len() - 1) + 1);
        assert!(times > 1, "{times}");
        for (f, locals) in part.frames.iter().enumerate() {
            let off = track[f * times].angle_to(&locals[finger].rotation);
            assert!(off < 1e-6, "frame {f}: {off} rad");
        }
    }
}
