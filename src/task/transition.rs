//! How one motion goes over into another.

use super::blend::Blend;
use super::reference::{Sample, anchor, moved};
use crate::sim::{Character, LinkState};
use nalgebra::{Isometry3, Translation3, Vector3};

/// Seconds in which the speed of the one becomes that of the other.
const EASES: f64 = 1.0;
/// Seconds in which a motion that is to be left slows down.
const SLOWS: f64 = 1.0;
/// Slowest and fastest pace at which a motion begins, of its own: half a run is a quick walk, and more than half as fast
/// again asks for forces that it was never seen with.
const PACES: [f32; 2] = [0.5, 1.5];
/// A motion that goes slower than this stands, and no pace makes it go, m/s.
const STANDS: f32 = 0.5;

/// Where and how a motion is performed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Carries the whole motion: a turn about the vertical and a shift along the ground.
    pub pose: Isometry3<f32>,
    /// What it slides at besides, m/s, world axes.
    pub velocity: Vector3<f32>,
    /// How much faster time goes in it.
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
    /// Where the motion begins, seconds of it.
    begins: f64,
    /// The pace at which it begins, of its own.
    pace: f32,
    /// How much faster the one before was than it is at that pace, m/s, along the ground.
    surplus: Vector3<f32>,
    blend: Option<Blend>,
    /// From when on, seconds passed, and to which pace it slows down before it is left.
    slows: Option<(f64, f64)>,
}

impl Transition {
    /// A motion that nothing leads into, from `time` seconds of it.
    pub fn none(time: f64) -> Self {
        Self {
            place: Isometry3::identity(),
            begins: time,
            pace: 1.0,
            surplus: Vector3::zeros(),
            blend: None,
            slows: None,
        }
    }

    /// From where `present` has brought the character into a motion that is at `begun` at `time` seconds.
    pub fn between(character: &Character, present: &Sample, begun: &Sample, time: f64) -> Self {
        let place = anchor(&present.links[0].pose) * anchor(&begun.links[0].pose).inverse();
        let along = |v: Vector3<f32>| Vector3::new(v.x, v.y, 0.0);
        let speed = along(present.dynamics.com_velocity);
        let own = along(place.rotation * begun.dynamics.com_velocity);
        let pace = pace(&speed, &own);
        let mut transition = Self {
            place,
            begins: time,
            pace,
            surplus: speed - own * pace,
            blend: None,
            slows: None,
        };
        let begins = transition.at(0.0);
        let mut links = begun.links.clone();
        links.iter_mut().for_each(|link| begins.put(link));
        transition.blend = Some(Blend::between(character, &present.links, &links));
        transition
    }

    /// From so many seconds `passed` on, a motion at `speed`, m/s, slows down evenly for one at another speed, but to no less
    /// than half its pace.
    pub fn slow(&mut self, passed: f64, speed: f32, other: f32) {
        if speed > other.max(STANDS) {
            self.slows = Some((passed, f64::from((other / speed).max(PACES[0]))));
        }
    }

    /// Seconds of the motion when so many have `passed`. With p the pace and τ the share of [`EASES`] that has passed, it
    /// runs at 1 + (p − 1) (1 − τ)², and so has gained (p − 1) E/3 (1 − (1 − τ)³); with q the pace to which it slows down
    /// and σ the share of [`SLOWS`] that has passed of that, at (q − 1) σ more, and has gained (q − 1) S (σ²/2, or σ − 1/2
    /// beyond).
    pub fn time(&self, passed: f64) -> f64 {
        let entered = f64::from(self.pace - 1.0) * EASES / 3.0 * (1.0 - left(passed).powi(3));
        let slowed = self.slows.map_or(0.0, |(since, pace)| {
            let share = ((passed - since) / SLOWS).max(0.0);
            let within = share.min(1.0);
            (pace - 1.0) * SLOWS * (within * within / 2.0 + (share - within))
        });
        self.begins + passed + entered + slowed
    }

    /// How fast time goes in the motion when so many seconds have `passed`.
    fn pace_after(&self, passed: f64) -> f32 {
        let entering = (self.pace - 1.0) * left(passed).powi(2) as f32;
        let slowing = self.slows.map_or(0.0, |(since, pace)| {
            (pace - 1.0) * ((passed - since) / SLOWS).clamp(0.0, 1.0)
        });
        1.0 + entering + slowing as f32
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

    /// Whether the speed of the motion before is still felt when so many seconds have `passed`.
    pub fn eases(&self, passed: f64) -> bool {
        self.blend.is_some() && passed < EASES
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
            pace: self.pace_after(passed),
        }
    }
}

/// The share of [`EASES`] that is left.
fn left(passed: f64) -> f64 {
    (1.0 - passed / EASES).clamp(0.0, 1.0)
}

/// The pace at which a motion at its `own` velocity is as fast as the one before it in that direction.
fn pace(speed: &Vector3<f32>, own: &Vector3<f32>) -> f32 {
    let fast = own.norm();
    if fast < STANDS {
        return 1.0;
    }
    (speed.dot(own) / (fast * fast)).clamp(PACES[0], PACES[1])
}
