//! How one motion goes over into another.

use super::blend::Blend;
use super::clock::{Clock, EASES, left};
use super::reference::{anchor, moved};
use crate::sim::{Character, LinkState};
use crate::task::step::ReferenceState;
use nalgebra::{Isometry3, Translation3, Vector3};

/// A motion that goes slower than this stands, and no pace makes it go, m/s.
const STANDS: f32 = 0.5;

/// Where and how a motion is performed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Carries the whole motion: a turn about the vertical and a shift along the ground.
    pub pose: Isometry3<f32>,
    /// What it slides at besides, m/s, world axes.
    pub velocity: Vector3<f32>,
    /// Seconds of the motion in a second.
    pub pace: f32,
}

impl Placement {
    /// Puts a link of the motion there.
    pub(super) fn put(&self, link: &mut LinkState) {
        *link = moved(link, &self.pose);
        link.linear = link.linear * self.pace + self.velocity;
        link.angular *= self.pace;
    }

    /// Where the motion itself has it.
    pub fn own() -> Self {
        Self {
            pose: Isometry3::identity(),
            velocity: Vector3::zeros(),
            pace: 1.0,
        }
    }
}

/// What leads into a motion: its place, and what is left of the speed and the pose of the one before it.
#[derive(Clone, Debug)]
pub(super) struct Transition {
    place: Isometry3<f32>,
    clock: Clock,
    /// How much faster the one before was than it is at the pace at which it begins, m/s, along the ground.
    surplus: Vector3<f32>,
    blend: Option<Blend>,
}

impl Transition {
    /// A motion that nothing leads into, from `time` seconds of it.
    pub fn none(time: f64) -> Self {
        Self {
            place: Isometry3::identity(),
            clock: Clock::new(time, 1.0),
            surplus: Vector3::zeros(),
            blend: None,
        }
    }

    /// From where `present` has brought the character into a motion that is at `begun` at `time` seconds.
    pub fn between(
        character: &Character,
        present: &ReferenceState,
        begun: &ReferenceState,
        time: f64,
    ) -> Self {
        let place = anchor(&present.links[0].pose) * anchor(&begun.links[0].pose).inverse();
        let along = |v: Vector3<f32>| Vector3::new(v.x, v.y, 0.0);
        let speed = along(present.dynamics.com_velocity);
        let own = along(place.rotation * begun.dynamics.com_velocity);
        let clock = Clock::new(time, f64::from(pace(&speed, &own)));
        let mut transition = Self {
            place,
            clock,
            surplus: speed - own * clock.pace(0.0) as f32,
            blend: None,
        };
        let begins = transition.at(0.0);
        let mut links = begun.links.clone();
        links.iter_mut().for_each(|link| begins.put(link));
        transition.blend = Some(Blend::between(character, &present.links, &links));
        transition
    }

    /// How time goes in the motion.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// From so many seconds `passed` on, a motion at `speed`, m/s, slows down for one at another speed.
    pub fn slow(&mut self, passed: f64, speed: f32, other: f32) {
        // The speed at its own pace, and no pace makes a motion go that stands.
        let own = speed / self.clock.pace(passed) as f32;
        let pace = if own > STANDS { other / own } else { 1.0 };
        self.clock.slow(passed, f64::from(pace));
    }

    /// Adds to the links of the motion as they are when so many seconds have `passed`, where it is performed, what is left
    /// of the pose before it; tells whether anything is.
    pub fn blend(&self, character: &Character, passed: f64, links: &mut [LinkState]) -> bool {
        let blend = self.blend.as_ref().filter(|blend| blend.lasts(passed));
        if let Some(blend) = blend {
            blend.apply(character, passed, links);
        }
        blend.is_some()
    }

    /// Whether another motion led into this one.
    pub fn was_led_into(&self) -> bool {
        self.blend.is_some()
    }

    /// The same motion, moved on along the ground.
    pub fn shift(&mut self, by: Vector3<f32>) {
        let along = Vector3::new(by.x, by.y, 0.0);
        self.place = Translation3::from(along) * self.place;
    }

    /// Where and at which pace the motion is performed when so many seconds have `passed`: it slides at Δv (1 − τ)², and has
    /// so far gone Δv E/3 (1 − (1 − τ)³).
    pub fn at(&self, passed: f64) -> Placement {
        let left = left(passed) as f32;
        let way = self.surplus * (EASES as f32 / 3.0 * (1.0 - left.powi(3)));
        Placement {
            pose: Translation3::from(way) * self.place,
            velocity: self.surplus * (left * left),
            pace: self.clock.pace(passed) as f32,
        }
    }
}

/// The pace at which a motion at its `own` velocity is as fast as the one before it; the slowest if it goes the other way.
fn pace(speed: &Vector3<f32>, own: &Vector3<f32>) -> f32 {
    let fast = own.norm();
    if fast < STANDS {
        return 1.0;
    }
    if speed.dot(own) < 0.0 {
        return 0.0;
    }
    speed.norm() / fast
}
