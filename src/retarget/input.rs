//! Stage 1, input: checks the clip, makes sure that it has enough frames, and maps its joints to the humanoid's slots.

mod rate;

use super::error::RetargetError;
use super::options::{self, Options};
use crate::clip::{Clip, LoopMode, Problem, length_flaw, rate_flaw};
use crate::humanoid::{self, HumanoidMap};
use crate::skeleton::{JointKind, Skeleton};
use nalgebra::Isometry3;
use std::borrow::Cow;
use std::ops::Range;

/// Fewest steps from frame to frame in a cycle; a shorter clip ends where it ends. Chosen: a seam needs two frames on either
/// side.
const SHORTEST_CYCLE: usize = 4;

/// A clip that can be retargeted.
pub(super) struct Input<'a> {
    /// The clip with the frames around it that it remembers, at a rate that is high enough.
    pub clip: Cow<'a, Clip>,
    /// The frames that the motion keeps; those around them only help to solve for them.
    pub own: Range<usize>,
    /// Which joint is which slot.
    pub map: HumanoidMap,
    /// Whether the clip repeats, and is long enough to.
    pub repeats: bool,
    /// What was found in the clip so far.
    pub problems: Vec<Problem>,
}

/// Checks all that later stages take for granted, and chooses frames and joint map.
///
/// # Errors
/// [`RetargetError`] for a malformed clip, a skeleton without a free root, a weight out of range, a figure that is no humanoid,
/// or a joint map for another clip.
pub(super) fn prepare<'a>(
    clip: &'a Clip,
    skeleton: &Skeleton,
    options: &Options,
) -> Result<Input<'a>, RetargetError> {
    check_clip(clip)?;
    check_root(skeleton)?;
    options::check_weights(&options.weights)?;
    let map = joint_map(clip, options)?;
    let mut problems = clip.problems.clone();
    // A part of a take remembers what was around it: solved with that, it moves as it does in the whole.
    let (clip, own) = clip.with_margins();
    let repeats = clip.loop_mode == LoopMode::Wrap && clip.frames.len() > SHORTEST_CYCLE;
    // The cycle has to be long enough in the clip's own frames, so this comes before more are added.
    let (clip, own, few_frames) = rate::raise(clip, own);
    problems.extend(few_frames);
    Ok(Input {
        clip,
        own,
        map,
        repeats,
        problems,
    })
}

/// The map that was given, or the one that can be found.
fn joint_map(clip: &Clip, options: &Options) -> Result<HumanoidMap, RetargetError> {
    let map = match &options.map {
        Some(map) => map.clone(),
        None => humanoid::map(&clip.joints).map_err(|reason| RetargetError::NotHumanoid {
            clip: clip.name.clone(),
            reason,
        })?,
    };
    let count = clip.joints.len();
    match map.matches.iter().find(|(_, found)| found.joint >= count) {
        Some((&slot, found)) => Err(RetargetError::NoSuchJoint {
            slot,
            joint: found.joint,
            count,
        }),
        None => Ok(map),
    }
}

/// Refuses a clip that is empty, has a rate out of range, or lacks or breaks a transform.
fn check_clip(clip: &Clip) -> Result<(), RetargetError> {
    let name = || clip.name.clone();
    if clip.frames.is_empty() {
        return Err(RetargetError::Empty { clip: name() });
    }
    if rate_flaw(clip.fps).is_some() || length_flaw(clip.duration()).is_some() {
        return Err(RetargetError::FrameRate {
            clip: name(),
            fps: clip.fps,
            seconds: clip.duration(),
        });
    }
    let rest: Vec<_> = clip.joints.iter().map(|joint| joint.rest).collect();
    check_finite(clip, None, &rest)?;
    for (frame, transforms) in clip.frames.iter().enumerate() {
        let (found, expected) = (transforms.len(), clip.joints.len());
        if found != expected {
            return Err(RetargetError::Ragged {
                clip: name(),
                frame,
                found,
                expected,
            });
        }
        check_finite(clip, Some(frame), transforms)?;
    }
    Ok(())
}

/// Refuses values that are infinite or NaN, in a frame or (`None`) in the rest pose.
fn check_finite(
    clip: &Clip,
    frame: Option<usize>,
    transforms: &[Isometry3<f64>],
) -> Result<(), RetargetError> {
    let is_finite = |t: &Isometry3<f64>| {
        let values = t.translation.vector.iter().chain(t.rotation.coords.iter());
        values.copied().all(f64::is_finite)
    };
    match transforms.iter().position(|t| !is_finite(t)) {
        Some(joint) => Err(RetargetError::NotFinite {
            clip: clip.name.clone(),
            frame,
            joint: clip.joints[joint].name.clone(),
        }),
        None => Ok(()),
    }
}

/// Refuses a skeleton whose root doesn't move by one free joint alone, or whose other bodies have such joints: coordinates 0
/// to 6 are taken to be the root's position and orientation.
fn check_root(skeleton: &Skeleton) -> Result<(), RetargetError> {
    let root = skeleton.bodies.first().map(|body| &body.joints[..]);
    let joints = skeleton.bodies.iter().flat_map(|body| &body.joints);
    let free = joints.filter(|joint| joint.kind == JointKind::Free).count();
    match root {
        Some([joint]) if joint.kind == JointKind::Free && joint.qpos == 0 && free == 1 => Ok(()),
        _ => Err(RetargetError::NoFreeRoot {
            skeleton: skeleton.name.clone(),
        }),
    }
}
