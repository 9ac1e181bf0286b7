//! A clip is carried onto a physics skeleton: joint map, alignment of the rest poses, goals for every frame, ground
//! and stances, then one least-squares problem over the whole trajectory.
//!
//! The motion keeps the clip's heading; it is moved over the ground so that the root starts above the origin, and in
//! height so that standing feet stand on z = 0.

mod align;
mod banded;
mod cost;
mod fit;
mod flight;
mod footing;
mod goals;
mod ground;
mod model;
mod overlap;
mod pace;
mod rate;
mod reach;
mod reference;
mod report;
mod rest;
mod rotation;
mod seam;
mod solve;
mod source;
mod spin;
mod stance;
mod swing;
mod system;
mod travel;

use crate::clip::{Clip, LoopMode, MOST_FPS};
use crate::humanoid::{self, HumanoidMap, Slot};
use crate::motion::{Cycle, Draft, Motion, RetargetReport};
use crate::skeleton::{JointKind, Skeleton};
use fit::{Fit, Fitted};
use goals::Goals;
use model::Model;
use nalgebra::Vector3;
use source::Source;
use stance::{Anchor, Contacts};
use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Instant;

/// Most times that a slot can count: beyond, the solution is hardly determined by anything else.
const MOST_WEIGHT: f64 = 100.0;

/// How to retarget.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Which joint stands for which slot; found by [`humanoid::map`] if left out.
    pub map: Option<HumanoidMap>,
    /// How much a slot's place and turn count, as a multiple of what they count by default: 0 to 100. Slots that are left
    /// out count once. What stands stands still whatever it counts.
    pub weights: BTreeMap<Slot, f64>,
    /// Whether a body is to perform the motion: a little farther from its source, and nearer to what a body can do. Flights
    /// then begin as early and end as late as they can, so that a body's last push has their spin in it. And a flight whose
    /// spin changes with nothing to push on, which is turned to spin freely but left as it is where that takes more than half
    /// a radian, is turned by 0.3 radians then.
    pub to_perform: bool,
}

/// Why a clip can't be carried onto a skeleton.
#[derive(Debug, thiserror::Error)]
pub enum RetargetError {
    #[error("clip `{clip}` is no humanoid: {reason}")]
    NotHumanoid {
        clip: String,
        reason: humanoid::Error,
    },
    #[error(
        "the joint map puts joint number {joint} in slot `{slot}`, but the clip has only {count}"
    )]
    NoSuchJoint {
        slot: Slot,
        joint: usize,
        count: usize,
    },
    #[error("slot `{slot}` has the weight {weight}; give it 0 to {MOST_WEIGHT}")]
    Weight { slot: Slot, weight: f64 },
    #[error("clip `{clip}` has no frames")]
    Empty { clip: String },
    #[error("clip `{clip}` has a value that is no finite number at frame {frame}, joint `{joint}`")]
    NotFinite {
        clip: String,
        frame: usize,
        joint: String,
    },
    #[error("clip `{clip}` has a frame rate of {fps} Hz; give it a positive one up to 10000")]
    FrameRate { clip: String, fps: f64 },
    #[error("clip `{clip}` has {found} joint transforms at frame {frame} for {expected} joints")]
    Ragged {
        clip: String,
        frame: usize,
        found: usize,
        expected: usize,
    },
    #[error(
        "the source's legs have no length in its rest pose, or a map without both legs was given"
    )]
    NoSourceLegs,
    #[error(
        "the skeleton has no slots for both legs; name its bodies in a JSON file beside the MJCF"
    )]
    NoLegs,
    #[error("skeleton `{skeleton}` doesn't hang on one free joint")]
    NoFreeRoot { skeleton: String },
}

/// A retargeted motion. Its [`Motion::report`] is `report`; the time it took is kept apart, so that equal inputs
/// give equal motions.
#[derive(Clone, Debug)]
pub struct Retargeted {
    pub motion: Motion,
    pub report: RetargetReport,
    /// Wall-clock time spent.
    pub seconds: f64,
    /// Steps of the trajectory solver.
    pub iterations: usize,
}

/// Carries `clip` onto `skeleton`. Of a clip of fewer than 27 frames a second the motion has a multiple of them, 60 a second
/// or up to eight times as many.
///
/// # Errors
/// [`RetargetError`] when the clip is no humanoid or malformed, or the skeleton lacks legs.
pub fn retarget(
    clip: &Clip,
    skeleton: &Skeleton,
    options: &Options,
) -> Result<Retargeted, RetargetError> {
    let start = Instant::now();
    check(clip, skeleton)?;
    check_weights(&options.weights)?;
    let map = joint_map(clip, options)?;
    let (clip, own) = clip.with_margins();
    let wraps = clip.loop_mode == LoopMode::Wrap && clip.frames.len() > SHORTEST_CYCLE;
    let mut problems = clip.problems.clone();
    let (clip, own, few) = rate::often_enough(clip, own);
    problems.extend(few);
    let clip = clip.as_ref();
    let alignment = align::align(clip, &map, skeleton)?;
    let model = Model::new(skeleton);
    let mut goals = Goals::new(clip, &map, &alignment, &model, &options.weights);
    let leg = skeleton.leg_length();
    let mut source = Source::new(clip, &map, &alignment, skeleton);
    problems.extend(restore_travel(clip, &model, &mut goals, &mut source));
    let mut contacts = put_on_ground(clip, &model, &mut goals, &mut source, own.start);
    swing::hang(&mut goals, ankle_height(skeleton), leg);
    let cycle = wraps.then(|| seam::cycle(&goals, &model));
    let mut closed = None;
    if let Some(cycle) = &cycle {
        problems.extend(seam::gap_problem(&goals, &model));
        closed = Some(seam::close(&mut goals, cycle, &model, clip.fps));
    }
    let seam = cycle.as_ref().zip(closed.as_ref());
    let mut anchors = stance::plant(&model, &mut goals, &contacts, clip.fps, leg, seam);
    let fit = Fit {
        model: &model,
        anchors: &anchors,
        cycle: cycle.as_ref(),
        fps: clip.fps,
        to_perform: options.to_perform,
    };
    let Fitted {
        frames: mut qpos,
        iterations,
        lifted,
        turned,
        spins_freely,
    } = fit.run(&mut goals);
    problems.extend(flight::problem(lifted));
    problems.extend(spin::problem(turned, spins_freely));
    goals.keep(&own);
    source.keep(&own);
    keep(&mut anchors, &own);
    keep(&mut qpos, &own);
    contacts.iter_mut().for_each(|(_, flags)| keep(flags, &own));
    let mut motion = motion(&model, &goals, &anchors, cycle, clip, qpos);
    let measured = stance::measured(&model, &goals, contacts, |end, f| {
        source.is_still(end, f, clip.fps, leg)
    });
    let map = report::mapped(clip, &map);
    let report = report::report(skeleton, &source, &measured, &motion, map, problems);
    motion.report = Some(report.clone());
    Ok(Retargeted {
        motion,
        report,
        seconds: start.elapsed().as_secs_f64(),
        iterations,
    })
}

fn check_weights(weights: &BTreeMap<Slot, f64>) -> Result<(), RetargetError> {
    let wrong = weights
        .iter()
        .find(|(_, weight)| !(0.0..=MOST_WEIGHT).contains(*weight));
    match wrong {
        Some((&slot, &weight)) => Err(RetargetError::Weight { slot, weight }),
        None => Ok(()),
    }
}

/// Leaves the frames `own`.
fn keep<T>(frames: &mut Vec<T>, own: &Range<usize>) {
    frames.truncate(own.end);
    frames.drain(..own.start);
}

/// The motion of these coordinates.
fn motion(
    model: &Model,
    goals: &Goals,
    anchors: &[Vec<Anchor>],
    cycle: Option<Cycle>,
    clip: &Clip,
    qpos: Vec<Vec<f64>>,
) -> Motion {
    let contact_bodies = stance::contact_bodies(model, goals, anchors);
    let draft = Draft {
        name: clip.name.clone(),
        fps: clip.fps,
        loop_mode: match cycle {
            Some(_) => LoopMode::Wrap,
            None => LoopMode::Clamp,
        },
        cycle: cycle.unwrap_or(STILL),
        qpos,
        contact: Some(stance::contact(model, anchors, &contact_bodies)),
        contact_bodies,
    };
    Motion::from_poses(model.skeleton, draft)
}

/// Gives a clip on the spot the travel that its feet tell of; says so.
fn restore_travel(
    clip: &Clip,
    model: &Model,
    goals: &mut Goals,
    source: &mut Source,
) -> Option<crate::clip::Problem> {
    let leg = model.skeleton.leg_length();
    let velocity = travel::missing(goals, model, clip.fps, leg, clip.loop_mode)?;
    for f in 0..goals.frames() {
        let by = velocity * (f as f64 / clip.fps);
        goals.shift_frame(f, &by);
        source.shift_frame(f, &by);
    }
    Some(travel::problem(&velocity))
}

/// Moves goals and source to where the ground is z = 0 and the root starts above the origin in frame `first`, and sets hands
/// down. Returns when the source's feet and hands stand.
fn put_on_ground(
    clip: &Clip,
    model: &Model,
    goals: &mut Goals,
    source: &mut Source,
    first: usize,
) -> Vec<Contacts> {
    let (fps, leg, loop_mode) = (clip.fps, model.skeleton.leg_length(), clip.loop_mode);
    let ankle = ankle_height(model.skeleton);
    let lift = source.ankle.map(|height| height - ankle);
    let points = stance::ground_points(model, goals);
    let ground = ground::find(&points, lift, fps, leg, loop_mode);
    drop(points);
    let contact = |end: Slot| source.contact(end, ground.floor, fps, leg, ankle, loop_mode);
    let ends = source::ENDS.iter().map(|(end, _)| *end);
    let contacts: Vec<Contacts> = ends.filter_map(|end| Some((end, contact(end)?))).collect();
    let is_hand = |contacts: &&Contacts| source::HANDS.contains(&contacts.0);
    for hand in contacts.iter().filter(is_hand) {
        reach::set_down(goals, source, hand, &ground, fps);
    }
    let root = goals.root(first);
    let home = Vector3::new(-root.x, -root.y, -ground.floor - ground.lift);
    for f in 0..goals.frames() {
        goals.shift_frame(f, &home);
        source.shift_frame(f, &home);
    }
    contacts
}

/// Fewest steps in a cycle; a clip with fewer ends where it ends.
const SHORTEST_CYCLE: usize = 4;

const STILL: Cycle = Cycle {
    translation: Vector3::new(0.0, 0.0, 0.0),
    heading: 0.0,
};

/// Height of the skeleton's ankles above its soles in its rest pose.
fn ankle_height(skeleton: &Skeleton) -> f64 {
    let rest = skeleton.forward(&skeleton.rest_qpos());
    let heights: Vec<f64> = [Slot::LeftFoot, Slot::RightFoot]
        .iter()
        .filter_map(|slot| Some(rest[*skeleton.slots.get(slot)?].translation.z))
        .collect();
    heights.iter().sum::<f64>() / heights.len().max(1) as f64
}

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

/// Refuses what later stages take for granted.
fn check(clip: &Clip, skeleton: &Skeleton) -> Result<(), RetargetError> {
    let name = || clip.name.clone();
    if clip.frames.is_empty() {
        return Err(RetargetError::Empty { clip: name() });
    }
    if !(clip.fps > 0.0 && clip.fps <= MOST_FPS) {
        return Err(RetargetError::FrameRate {
            clip: name(),
            fps: clip.fps,
        });
    }
    let rest = std::iter::once(clip.joints.iter().map(|j| j.rest).collect::<Vec<_>>());
    for (frame, transforms) in rest.chain(clip.frames.iter().cloned()).enumerate() {
        let (found, expected) = (transforms.len(), clip.joints.len());
        if found != expected {
            return Err(RetargetError::Ragged {
                clip: name(),
                frame: frame.saturating_sub(1),
                found,
                expected,
            });
        }
        let finite = |t: &nalgebra::Isometry3<f64>| {
            t.translation
                .vector
                .iter()
                .chain(t.rotation.coords.iter())
                .all(|x| x.is_finite())
        };
        if let Some(j) = transforms.iter().position(|t| !finite(t)) {
            let joint = clip.joints[j].name.clone();
            return Err(RetargetError::NotFinite {
                clip: name(),
                frame: frame.saturating_sub(1),
                joint,
            });
        }
    }
    let root = skeleton.bodies.first().map(|body| &body.joints[..]);
    let frees = skeleton
        .bodies
        .iter()
        .flat_map(|b| &b.joints)
        .filter(|j| j.kind == JointKind::Free);
    match root {
        Some([joint]) if joint.kind == JointKind::Free && joint.qpos == 0 && frees.count() == 1 => {
            Ok(())
        }
        _ => Err(RetargetError::NoFreeRoot {
            skeleton: skeleton.name.clone(),
        }),
    }
}

#[cfg(test)]
mod tests;
