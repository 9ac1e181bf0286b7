//! How one motion goes over into another.

use super::reference::{Sample, anchor};
use nalgebra::{Isometry3, Translation3, Vector3};

/// Seconds in which the speed of the one becomes that of the other.
const EASES: f64 = 1.0;

/// Where and how a motion is performed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Carries the whole motion: a turn about the vertical and a shift along the ground.
    pub pose: Isometry3<f32>,
    /// What it slides at besides, m/s, world axes.
    pub velocity: Vector3<f32>,
}

impl Placement {
    /// Where the motion itself has it.
    pub fn own() -> Self {
        Self {
            pose: Isometry3::identity(),
            velocity: Vector3::zeros(),
        }
    }
}

/// What leads into a motion: its place, and what is left of the speed of the one before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transition {
    place: Isometry3<f32>,
    /// When it began, seconds of the motion.
    since: f64,
    /// How much faster the one before was, m/s, along the ground.
    surplus: Vector3<f32>,
}

impl Transition {
    /// A motion that nothing leads into.
    pub fn none() -> Self {
        Self {
            place: Isometry3::identity(),
            since: 0.0,
            surplus: Vector3::zeros(),
        }
    }

    /// From where `present` has brought the character into a motion that is at `begun` at `time` seconds.
    pub fn between(present: &Sample, begun: &Sample, time: f64) -> Self {
        let place = anchor(&present.links[0].pose) * anchor(&begun.links[0].pose).inverse();
        let surplus = present.dynamics.com_velocity - place.rotation * begun.dynamics.com_velocity;
        Self {
            place,
            since: time,
            surplus: Vector3::new(surplus.x, surplus.y, 0.0),
        }
    }

    /// The same motion, moved on along the ground.
    pub fn shift(&mut self, by: Vector3<f32>) {
        let along = Vector3::new(by.x, by.y, 0.0);
        self.place = Translation3::from(along) * self.place;
    }

    /// Where the motion is performed at `time` seconds of it. With τ the share of [`EASES`] that has passed it slides at
    /// Δv (1 − τ)², and has so far gone Δv E/3 (1 − (1 − τ)³).
    pub fn at(&self, time: f64) -> Placement {
        let left = (1.0 - (time - self.since) / EASES).clamp(0.0, 1.0) as f32;
        let way = self.surplus * (EASES as f32 / 3.0 * (1.0 - left * left * left));
        Placement {
            pose: Translation3::from(way) * self.place,
            velocity: self.surplus * (left * left),
        }
    }
}
