//! What a motion is for a character that is steered: found from the motion itself, never from its file's name.

use crate::clip::LoopMode;
use crate::humanoid::Slot;
use crate::motion::Motion;
use crate::skeleton::{GRAVITY, Skeleton};
use nalgebra::{Point3, UnitQuaternion, Vector2, Vector3};
use std::f64::consts::{FRAC_PI_3, PI};

// Speeds are in units of √(g l), with l the length of a leg: 2.9 m/s for a leg of 0.86 m. All chosen, over the clips at hand.

/// Slowest gait: 0.3 m/s.
const SLOWEST_GAIT: f64 = 0.1;
/// Fastest mean speed of the bodies of a character that stands, 0.3 m/s. A fight's guard sways at 0.2 m/s.
const CALM: f64 = 0.1;
/// Share of the frames in which each foot of a character that stands is on the ground, at least.
const STANDS: f64 = 0.9;
/// Most turn of a cycle of a gait, radians. What turns more is a turn.
const STRAIGHT: f64 = 0.1;
/// Least turn of a turn, radians.
const TURNS: f64 = 0.5;

/// What a motion is for a steered character.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// It stands.
    Idle,
    /// It travels, cycle after cycle, in the same direction.
    Gait,
    /// It turns on the spot.
    Turn,
    /// Anything else: performed when asked for.
    Extra,
}

impl Role {
    /// What a gait's direction is called, in a frame that faces along X.
    pub fn direction_name(velocity: &Vector2<f64>) -> &'static str {
        let angle = velocity.y.atan2(velocity.x);
        match angle {
            a if a.abs() <= FRAC_PI_3 => "forward",
            a if a.abs() >= PI - FRAC_PI_3 => "backward",
            a if a > 0.0 => "left",
            _ => "right",
        }
    }
}

/// What was found in a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traits {
    /// What it is for.
    pub role: Role,
    /// Mean velocity over the ground in the frame that faces along X, m/s.
    pub velocity: Vector2<f64>,
    /// Turn from its first frame to its last, radians, positive to the left.
    pub turn: f64,
    /// Mean speed of its bodies about the travelling character, m/s.
    pub liveliness: f64,
}

impl Traits {
    /// Looks at a motion of this skeleton.
    pub fn of(motion: &Motion, skeleton: &Skeleton) -> Traits {
        let facing = facing(motion, skeleton);
        let travel = mean_velocity(motion);
        let velocity = facing.inverse() * travel.push(0.0);
        let traits = Traits {
            role: Role::Extra,
            velocity: velocity.xy(),
            turn: turn(motion, skeleton),
            liveliness: liveliness(motion, &travel),
        };
        Traits {
            role: traits.role(motion, skeleton),
            ..traits
        }
    }

    fn role(&self, motion: &Motion, skeleton: &Skeleton) -> Role {
        let unit = (GRAVITY * skeleton.leg_length()).sqrt();
        let speed = self.velocity.norm();
        let feet = feet_down(motion, skeleton);
        let walks = feet.iter().all(|share| (0.05..STANDS).contains(share));
        let stands = feet.iter().all(|share| *share >= STANDS);
        let repeats = motion.loop_mode == LoopMode::Wrap;
        match () {
            () if repeats
                && walks
                && speed >= SLOWEST_GAIT * unit
                && self.turn.abs() < STRAIGHT =>
            {
                Role::Gait
            }
            () if speed >= SLOWEST_GAIT * unit => Role::Extra,
            () if self.turn.abs() >= TURNS => Role::Turn,
            () if stands && self.liveliness < CALM * unit => Role::Idle,
            () => Role::Extra,
        }
    }
}

/// Share of the frames in which each foot is on the ground, left then right.
fn feet_down(motion: &Motion, skeleton: &Skeleton) -> [f64; 2] {
    [Slot::LeftFoot, Slot::RightFoot].map(|slot| {
        let flags = foot_contact(motion, skeleton, slot);
        let down = flags.iter().filter(|down| **down).count();
        down as f64 / flags.len().max(1) as f64
    })
}

/// Whether a foot is on the ground, by frame; empty for a skeleton without it.
pub(super) fn foot_contact(motion: &Motion, skeleton: &Skeleton, slot: Slot) -> Vec<bool> {
    let body = skeleton.slots.get(&slot);
    let mut bodies = motion.contact_bodies.iter();
    let number = bodies.position(|contact| Some(contact) == body);
    number.map_or_else(Vec::new, |c| {
        motion.tracks.contact.iter().map(|row| row[c]).collect()
    })
}

/// Velocity from the first frame to the last, over the ground, m/s.
fn mean_velocity(motion: &Motion) -> Vector2<f64> {
    let at = |f: usize| motion.tracks.com[f].xy();
    let last = motion.tracks.com.len() - 1;
    (at(last) - at(0)) / motion.duration().max(f64::MIN_POSITIVE)
}

/// Mean speed of the bodies relative to the mean velocity, m/s.
fn liveliness(motion: &Motion, travel: &Vector2<f64>) -> f64 {
    let frames = motion.bodies.windows(2);
    let speed = |pair: &[Vec<nalgebra::Isometry3<f64>>]| {
        let moved = pair[0].iter().zip(&pair[1]);
        let speeds = moved.map(|(a, b)| {
            let by = b.translation.vector - a.translation.vector;
            (by * motion.fps - travel.push(0.0)).norm()
        });
        speeds.sum::<f64>() / pair[0].len().max(1) as f64
    };
    let count = frames.len().max(1) as f64;
    frames.map(speed).sum::<f64>() / count
}

/// How a motion's character faces: the mean over the frames, as a turn about the vertical from facing along X.
pub(super) fn facing(motion: &Motion, skeleton: &Skeleton) -> UnitQuaternion<f64> {
    let headings = headings(motion, skeleton);
    let sum: Vector2<f64> = headings.iter().sum();
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), sum.y.atan2(sum.x))
}

/// Turn from the first frame to the last, all the way, radians.
fn turn(motion: &Motion, skeleton: &Skeleton) -> f64 {
    let headings = headings(motion, skeleton);
    let step = |pair: &[Vector2<f64>]| pair[0].perp(&pair[1]).atan2(pair[0].dot(&pair[1]));
    headings.windows(2).map(step).sum()
}

/// The direction along the ground to which the head faces, or the chest without one, or else the root, by frame.
///
/// Pelvis and chest of a strafe are turned toward where it goes; the head looks where it faces.
fn headings(motion: &Motion, skeleton: &Skeleton) -> Vec<Vector2<f64>> {
    let slots = [Slot::Head, Slot::Chest];
    let body = slots
        .iter()
        .find_map(|slot| skeleton.slots.get(slot).copied());
    let body = body.unwrap_or(0);
    let upright = skeleton.forward(&skeleton.rest_qpos())[body].rotation;
    let forward = upright.inverse() * Vector3::x();
    let ahead = |poses: &Vec<nalgebra::Isometry3<f64>>| (poses[body].rotation * forward).xy();
    motion.bodies.iter().map(ahead).collect()
}

/// The point on the ground under the centre of mass in the mean over the frames, seen from a frame that travels along with the
/// motion from the origin at `start`.
pub(super) fn mean_place(motion: &Motion, travel: &Vector2<f64>) -> Point3<f64> {
    let places = motion.tracks.com.iter().enumerate();
    let seen = |(f, com): (usize, &Vector3<f64>)| com.xy() - travel * (f as f64 / motion.fps);
    let count = motion.tracks.com.len().max(1) as f64;
    let mean: Vector2<f64> = places.map(seen).sum::<Vector2<f64>>() / count;
    Point3::new(mean.x, mean.y, 0.0)
}

/// As [`Traits::velocity`], in the motion's own axes.
pub(super) fn travel(motion: &Motion) -> Vector2<f64> {
    mean_velocity(motion)
}
