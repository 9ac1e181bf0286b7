//! The transition from one motion into another: where the new one is placed, how its speed adapts, and how its pose blends in.

use super::blend::Blend;
use super::clock::{Clock, EASE_IN_S, left};
use super::placement::Placement;
use crate::sim::{Character, LinkState};
use crate::task::follow::anchor;
use crate::task::step::ReferenceState;
use nalgebra::{Isometry3, Translation3, Vector3};

/// A motion slower than this stands, m/s, and no pace makes it walk. Chosen.
const STANDING_M_S: f32 = 0.5;

/// How a motion was entered: its place, and what is left of the speed and the pose of the motion before it.
#[derive(Clone, Debug)]
pub(super) struct Transition {
    place: Isometry3<f32>,
    clock: Clock,
    /// Velocity of the motion before, minus that of this one at the pace at which it begins, m/s along the ground, world axes.
    excess: Vector3<f32>,
    blend: Option<Blend>,
    /// What the motion before let touch the ground where it was left, one per contact body of the character.
    touched: Vec<bool>,
}

impl Transition {
    /// A motion that begins at its time `time`, seconds, without a transition.
    pub fn none(time: f64) -> Self {
        Self {
            place: Isometry3::identity(),
            clock: Clock::new(time, 1.0),
            excess: Vector3::zeros(),
            blend: None,
            touched: Vec::new(),
        }
    }

    /// Lets touch the ground, beside what the new motion lets, what was there when the one before was left: while poses blend, a
    /// knee is still on its way up.
    pub fn allow(&self, may_touch: &mut [bool]) {
        let both = may_touch.iter_mut().zip(&self.touched);
        both.for_each(|(may, touched)| *may |= touched);
    }

    /// The transition of a character from `present` into another motion, which has the state `begun` at its `time`, seconds.
    pub fn between(
        character: &Character,
        present: &ReferenceState,
        begun: &ReferenceState,
        time: f64,
    ) -> Self {
        let place = anchor(&present.links[0].pose) * anchor(&begun.links[0].pose).inverse();
        // Place and heading of the root carry on. Speeds along the ground are those of the centre of mass, which momentum keeps;
        // the root sways about it. Pace takes up as much of the difference as it may, sliding what is left.
        let along = |v: Vector3<f32>| Vector3::new(v.x, v.y, 0.0);
        let speed = along(present.dynamics.com_velocity);
        let own = along(place.rotation * begun.dynamics.com_velocity);
        let clock = Clock::new(time, f64::from(pace(&speed, &own)));
        let mut transition = Self {
            place,
            clock,
            excess: speed - own * clock.pace(0.0) as f32,
            blend: None,
            touched: present.may_touch.clone(),
        };
        let begins = transition.at(0.0);
        let mut links = begun.links.clone();
        links.iter_mut().for_each(|link| begins.put(link));
        transition.blend = Some(Blend::between(character, &present.links, &links));
        transition
    }

    /// How fast the motion is played.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// When so many seconds have `passed`, slows a motion at `speed`, m/s, down for another motion at the speed `other`, m/s.
    pub fn slow(&mut self, passed: f64, speed: f32, other: f32) {
        // The ratio of speeds, each at its motion's own pace; of a motion that stands there is none.
        let own = speed / self.clock.pace(passed) as f32;
        let pace = if own > STANDING_M_S { other / own } else { 1.0 };
        self.clock.slow(passed, f64::from(pace));
    }

    /// Adds what is left of the pose before the transition to the `links` of the motion when so many seconds have `passed`.
    /// Returns whether anything was left.
    pub fn blend(&self, character: &Character, passed: f64, links: &mut [LinkState]) -> bool {
        let blend = self.blend.as_ref().filter(|blend| blend.lasts(passed));
        if let Some(blend) = blend {
            blend.apply(character, passed, links);
        }
        blend.is_some()
    }

    /// Whether the motion was entered from another one.
    pub fn was_led_into(&self) -> bool {
        self.blend.is_some()
    }

    /// Moves the motion along the ground, metres; a vertical part of `by` is left out.
    pub fn shift(&mut self, by: Vector3<f32>) {
        let along = Vector3::new(by.x, by.y, 0.0);
        self.place = Translation3::from(along) * self.place;
    }

    /// Where and at which pace the motion is performed when so many seconds have `passed`. With Δv the excess velocity, E the
    /// time in which it fades and τ the share of E that has passed, the motion slides at Δv (1 − τ)² and has slid Δv E/3
    /// (1 − (1 − τ)³) so far.
    pub fn at(&self, passed: f64) -> Placement {
        let left = left(passed) as f32;
        let way = self.excess * (EASE_IN_S as f32 / 3.0 * (1.0 - left.powi(3)));
        Placement {
            pose: Translation3::from(way) * self.place,
            velocity: self.excess * (left * left),
            pace: self.clock.pace(passed) as f32,
        }
    }
}

/// The pace that makes a motion with its `own` velocity as fast as `speed`, m/s along the ground: 1 for a motion that stands,
/// and 0, which the clock raises to the slowest, for one that goes the other way.
fn pace(speed: &Vector3<f32>, own: &Vector3<f32>) -> f32 {
    let fast = own.norm();
    if fast < STANDING_M_S {
        return 1.0;
    }
    if speed.dot(own) < 0.0 {
        return 0.0;
    }
    speed.norm() / fast
}
