//! How good a retargeted motion is, from the motion and its goals alone.

use super::goals::Goals;
use super::limits;
use super::model::{Knob, Model};
use crate::clip::{Clip, Problem};
use crate::humanoid::{HumanoidMap, Slot};
use crate::motion::Motion;
use crate::skeleton::Skeleton;
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

/// Points this little above a body's lowest point touch the ground with it, metres.
const TOUCHING: f64 = 0.005;

/// Mean and greatest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub mean: f64,
    pub max: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64>) -> Spread {
        let (mut sum, mut max, mut count) = (0.0, 0.0_f64, 0_usize);
        for value in values {
            sum += value;
            max = max.max(value);
            count += 1;
        }
        Spread {
            mean: sum / count.max(1) as f64,
            max,
        }
    }
}

/// The joint used for a slot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MappedJoint {
    pub slot: Slot,
    pub joint: String,
    pub confidence: f64,
    pub reason: String,
}

/// What the retargeting of a clip achieved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    pub frames: usize,
    /// Distance of hips, shoulders, elbows, wrists, knees and ankles from the scaled source's, metres.
    pub keypoint_error_m: Spread,
    /// Mean horizontal speed of bodies in contact, each at the point on the ground that moves least, m/s.
    pub foot_skate_m_s: f64,
    /// Depth of the lowest point below the ground, per frame, metres.
    pub penetration_m: Spread,
    /// Mean height above the ground of bodies in contact, metres.
    pub float_m: f64,
    /// Coordinates outside of their limits, summed over frames.
    pub joint_limit_violations: usize,
    pub map: Vec<MappedJoint>,
    pub problems: Vec<Problem>,
}

/// Measures a motion against the goals of its frames.
pub(super) fn report(
    model: &Model,
    goals: &Goals,
    motion: &Motion,
    map: Vec<MappedJoint>,
    problems: Vec<Problem>,
) -> Report {
    let skeleton = model.skeleton;
    Report {
        frames: motion.qpos.len(),
        keypoint_error_m: keypoint_error(goals, &motion.bodies),
        foot_skate_m_s: foot_skate(model, motion),
        penetration_m: penetration(skeleton, &motion.bodies),
        float_m: float(skeleton, motion),
        joint_limit_violations: motion
            .qpos
            .iter()
            .map(|q| limits::violations(skeleton, q))
            .sum(),
        map,
        problems,
    }
}

pub(super) fn mapped(clip: &Clip, map: &HumanoidMap) -> Vec<MappedJoint> {
    let named = map.matches.iter().filter_map(|(slot, found)| {
        Some(MappedJoint {
            slot: *slot,
            joint: clip.joints.get(found.joint)?.name.clone(),
            confidence: found.confidence,
            reason: found.reason.clone(),
        })
    });
    named.collect()
}

fn keypoint_error(goals: &Goals, bodies: &[Vec<Isometry3<f64>>]) -> Spread {
    let frames = bodies.iter().zip(&goals.points);
    Spread::of(frames.flat_map(|(bodies, points)| {
        let keys = goals.keys.iter().zip(points);
        keys.map(|(key, goal)| (bodies[key.body].translation.vector - goal).norm())
    }))
}

fn penetration(skeleton: &Skeleton, bodies: &[Vec<Isometry3<f64>>]) -> Spread {
    Spread::of(
        bodies
            .iter()
            .map(|poses| (-skeleton.lowest_point(poses)).max(0.0)),
    )
}

/// Pairs of contact body and frame in contact.
fn contacts(motion: &Motion) -> impl Iterator<Item = (usize, usize)> + '_ {
    let tracks = motion.tracks.contact.iter().enumerate();
    tracks.flat_map(move |(f, contact)| {
        let standing = motion.contact_bodies.iter().zip(contact);
        standing
            .filter(|(_, stands)| **stands)
            .map(move |(body, _)| (f, *body))
    })
}

fn float(skeleton: &Skeleton, motion: &Motion) -> f64 {
    let height = |(f, body): (usize, usize)| {
        skeleton
            .lowest_point_of(&motion.bodies[f], &[body])
            .max(0.0)
    };
    Spread::of(contacts(motion).map(height)).mean
}

/// Over all contacts that last to the next frame: how fast the point on the ground that moves least moves along it.
/// A foot that turns about a point that rests doesn't skate.
fn foot_skate(model: &Model, motion: &Motion) -> f64 {
    let stays = |f: usize, body: usize| {
        let place = motion.contact_bodies.iter().position(|b| *b == body);
        let next = motion.tracks.contact.get(f + 1);
        place.zip(next).is_some_and(|(c, contact)| contact[c])
    };
    let speeds = contacts(motion)
        .filter(|(f, body)| stays(*f, *body))
        .filter_map(|(f, body)| {
            let place = |f: usize, knob: &Knob| motion.bodies[f][body] * Point3::from(knob.center);
            let sole = |knob: &Knob| place(f, knob).z - knob.radius;
            let knobs: Vec<&Knob> = model
                .knobs
                .iter()
                .filter(|knob| knob.body == body)
                .collect();
            let lowest = knobs
                .iter()
                .map(|knob| sole(knob))
                .fold(f64::INFINITY, f64::min);
            let down = knobs.iter().filter(|knob| sole(knob) < lowest + TOUCHING);
            let speed =
                |knob: &&Knob| (place(f + 1, knob) - place(f, knob)).xy().norm() * motion.fps;
            down.map(speed).min_by(f64::total_cmp)
        });
    Spread::of(speeds).mean
}
