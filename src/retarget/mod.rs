//! A clip is carried onto a physics skeleton: joint map, alignment of the rest poses, goals for every frame, ground
//! and stances, then one least-squares problem over the whole trajectory.
//!
//! The motion keeps the clip's heading; it is moved over the ground so that the root starts above the origin, and in
//! height so that standing feet stand on z = 0.

mod align;
mod banded;
mod cost;
mod footing;
mod goals;
mod limits;
mod model;
mod report;
mod rotation;
mod seam;
mod solve;
mod stance;
mod travel;

pub use report::{MappedJoint, Report, Spread};

use crate::clip::{Clip, LoopMode};
use crate::humanoid::{self, HumanoidMap, NotHumanoid};
use crate::motion::{Cycle, Draft, Motion};
use crate::skeleton::{JointKind, Skeleton};
use cost::Problem;
use goals::Goals;
use model::Model;
use nalgebra::Vector3;
use solve::Solver;
use std::time::Instant;

/// How to retarget.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Which joint stands for which slot; found by [`humanoid::map`] if left out.
    pub map: Option<HumanoidMap>,
}

/// Why a clip can't be carried onto a skeleton.
#[derive(Debug, thiserror::Error)]
pub enum RetargetError {
    #[error("clip `{clip}` is no humanoid: {reason}")]
    NotHumanoid { clip: String, reason: NotHumanoid },
    #[error(
        "the joint map puts joint number {joint} in slot `{slot}`, but the clip has only {count}"
    )]
    NoSuchJoint {
        slot: humanoid::Slot,
        joint: usize,
        count: usize,
    },
    #[error("clip `{clip}` has no frames")]
    Empty { clip: String },
    #[error("clip `{clip}` has a value that is no finite number at frame {frame}, joint `{joint}`")]
    NotFinite {
        clip: String,
        frame: usize,
        joint: String,
    },
    #[error("clip `{clip}` has a frame rate of {fps} Hz; give it a positive one")]
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
    pub report: Report,
    /// Wall-clock time spent.
    pub seconds: f64,
    /// Steps of the trajectory solver.
    pub iterations: usize,
}

/// Carries `clip` onto `skeleton`.
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
    let map = joint_map(clip, options)?;
    let alignment = align::align(clip, &map, skeleton)?;
    let model = Model::new(skeleton);
    let mut goals = Goals::new(clip, &map, &alignment, &model);
    let leg = skeleton.leg_length();
    let mut problems = clip.problems.clone();
    if clip.loop_mode == LoopMode::Wrap {
        problems.extend(travel::restore(&mut goals, &model, clip.fps, leg));
    }
    let soles = stance::soles(&model, &goals);
    let ground = stance::ground(&soles, clip.fps, leg, clip.loop_mode);
    let root = goals.root(0);
    goals.shift(&Vector3::new(-root.x, -root.y, -ground));
    let wraps = clip.loop_mode == LoopMode::Wrap && goals.frames() > SHORTEST_CYCLE;
    let cycle = wraps.then(|| seam::cycle(&goals, &model));
    let faithful = goals.clone();
    if let Some(cycle) = &cycle {
        problems.extend(seam::gap_problem(&goals, &model));
        seam::close(&mut goals, cycle, &model, clip.fps);
    }
    let anchors = stance::plant(&model, &mut goals, clip.fps, leg, cycle.as_ref());
    let problem = Problem {
        model: &model,
        goals: &goals,
        anchors: &anchors,
        fps: clip.fps,
    };
    let (qpos, iterations) = solve(&problem, cycle.as_ref());
    let contact_bodies = stance::contact_bodies(&model, &goals, &anchors);
    let mut motion = Motion::from_poses(
        skeleton,
        Draft {
            name: clip.name.clone(),
            fps: clip.fps,
            loop_mode: if wraps {
                LoopMode::Wrap
            } else {
                LoopMode::Clamp
            },
            cycle: cycle.unwrap_or(STILL),
            qpos,
            contact: Some(stance::contact(&model, &anchors, &contact_bodies)),
            contact_bodies,
            report: serde_json::Value::Null,
        },
    );
    let report = report::report(
        &model,
        &faithful,
        &motion,
        report::mapped(clip, &map),
        problems,
    );
    motion.report = serde_json::to_value(&report).unwrap_or_default();
    Ok(Retargeted {
        motion,
        report,
        seconds: start.elapsed().as_secs_f64(),
        iterations,
    })
}

/// Fewest steps in a cycle; a clip with fewer ends where it ends.
const SHORTEST_CYCLE: usize = 4;

const STILL: Cycle = Cycle {
    translation: Vector3::new(0.0, 0.0, 0.0),
    heading: 0.0,
};

/// Fits the trajectory and brings it inside the joint limits.
fn solve(problem: &Problem, cycle: Option<&Cycle>) -> (Vec<Vec<f64>>, usize) {
    let mut frames = problem.goals.guess.clone();
    if cycle.is_some() {
        frames.pop();
    }
    let iterations = Solver::new(problem, cycle).run(&mut frames);
    for qpos in &mut frames {
        limits::clamp(problem.model.skeleton, qpos);
    }
    if let (Some(cycle), Some(first)) = (cycle, frames.first()) {
        let turn = rotation::exp(&(Vector3::z() * cycle.heading)).to_rotation_matrix();
        let last = solve::carried(first, turn.matrix(), &cycle.translation);
        frames.push(last);
    }
    (frames, iterations)
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
    if !clip.fps.is_finite() || clip.fps <= 0.0 {
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
