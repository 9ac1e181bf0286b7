//! How one motion goes over into another.

use super::blend::Blend;
use super::reference::{Sample, anchor, moved};
use crate::sim::{Character, LinkState};
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
    /// Puts a link of the motion there.
    pub(super) fn put(&self, link: &mut LinkState) {
        *link = moved(link, &self.pose);
        link.linear += self.velocity;
    }

    /// Where the motion itself has it.
    pub fn own() -> Self {
        Self {
            pose: Isometry3::identity(),
            velocity: Vector3::zeros(),
        }
    }
}

/// What leads into a motion: its place, and what is left of the speed and the pose of the one before it.
#[derive(Clone, Debug)]
pub(super) struct Transition {
    place: Isometry3<f32>,
    /// When it began, seconds of the motion.
    since: f64,
    /// How much faster the one before was, m/s, along the ground.
    surplus: Vector3<f32>,
    blend: Option<Blend>,
}

impl Transition {
    /// A motion that nothing leads into.
    pub fn none() -> Self {
        Self {
            place: Isometry3::identity(),
            since: 0.0,
            surplus: Vector3::zeros(),
            blend: None,
        }
    }

    /// From where `present` has brought the character into a motion that is at `begun` at `time` seconds.
    pub fn between(character: &Character, present: &Sample, begun: &Sample, time: f64) -> Self {
        let place = anchor(&present.links[0].pose) * anchor(&begun.links[0].pose).inverse();
        let surplus = present.dynamics.com_velocity - place.rotation * begun.dynamics.com_velocity;
        let mut transition = Self {
            place,
            since: time,
            surplus: Vector3::new(surplus.x, surplus.y, 0.0),
            blend: None,
        };
        let begins = transition.at(time);
        let mut links = begun.links.clone();
        links.iter_mut().for_each(|link| begins.put(link));
        transition.blend = Some(Blend::between(character, &present.links, &links));
        transition
    }

    /// Adds to the links of the motion at `time` seconds, where it is performed, what is left of the pose before it; tells
    /// whether anything is.
    pub fn blend(&self, character: &Character, time: f64, links: &mut [LinkState]) -> bool {
        let passed = time - self.since;
        let blend = self.blend.as_ref().filter(|blend| blend.lasts(passed));
        if let Some(blend) = blend {
            blend.apply(character, passed, links);
        }
        blend.is_some()
    }

    /// Whether the speed of the motion before is still felt at `time` seconds.
    pub fn eases(&self, time: f64) -> bool {
        self.blend.is_some() && time < self.since + EASES
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
