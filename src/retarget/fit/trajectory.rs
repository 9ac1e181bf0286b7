//! A trajectory of poses, which may repeat.

use crate::humanoid::Slot;
use crate::motion::Cycle;
use crate::retarget::anchor::Anchor;
use crate::retarget::end_effector::is_anchored;
use crate::retarget::limbs::end_below;
use crate::retarget::model::Model;
use crate::retarget::qpos::CycleStep;
use nalgebra::Isometry3;

/// Time before and after a flight in which a foot is about to leave the ground or has just come down, s. Chosen: at 60 Hz
/// three frames.
pub(super) const NEAR: f64 = 0.05;

/// A trajectory of poses and its contacts. Indices go beyond its frames where it repeats: −1 is the last frame of the
/// cycle before.
pub(super) struct Trajectory<'a> {
    /// The skeleton.
    pub model: &'a Model<'a>,
    /// Coordinates of every frame, without the last one of a cycle.
    pub frames: &'a [Vec<f64>],
    /// The points that stand, by frame.
    pub anchors: &'a [Vec<Anchor>],
    /// What leads from each cycle to the next.
    pub cycle: Option<&'a Cycle>,
    /// Frames per second.
    pub fps: f64,
    /// As in [`crate::retarget::Options`].
    pub to_perform: bool,
}

impl Trajectory<'_> {
    /// Cycle number and frame of an index; `None` before the first and after the last frame of what doesn't repeat.
    pub fn locate(&self, index: i64) -> Option<(i64, usize)> {
        let count = self.frames.len() as i64;
        let (n, f) = (index.div_euclid(count), index.rem_euclid(count));
        (n == 0 || self.cycle.is_some()).then_some((n, f as usize))
    }

    /// What carries the first cycle to cycle number `n`.
    pub fn offset(&self, n: i64) -> Isometry3<f64> {
        self.cycle
            .map_or_else(Isometry3::identity, |cycle| cycle.offset(n))
    }

    /// The coordinates at an index, in its own cycle.
    pub fn pose(&self, index: i64) -> Option<Vec<f64>> {
        let (n, f) = self.locate(index)?;
        let by = self.offset(n);
        let step = CycleStep::new(&by.rotation, by.translation.vector);
        Some(step.carry(&self.frames[f]))
    }

    /// Whether a point is in contact with the ground in frame `f`.
    pub fn touches(&self, f: usize) -> bool {
        self.anchors[f].iter().any(Anchor::is_contact)
    }

    /// The frames of [`NEAR`].
    pub fn near(&self) -> i64 {
        (NEAR * self.fps).round() as i64
    }

    /// The anchors of frame `f` and of those within [`NEAR`] of it: a foot stays in place until the flight begins.
    pub fn stood_on(&self, f: usize) -> Vec<Anchor> {
        let reach = self.near();
        let around = (f as i64 - reach..=f as i64 + reach).filter_map(|index| self.locate(index));
        around
            .flat_map(|(_, f)| self.anchors[f].iter().copied())
            .collect()
    }
}

/// How far the body in `slot` goes along when the whole body is moved, 0 to 1. In flight every body does. On the ground, a
/// foot or hand in contact stays, and the knee or elbow above it goes half the way.
pub(super) fn share(model: &Model, slot: Slot, anchors: &[Anchor], flies: bool) -> f64 {
    let end = end_below(slot).unwrap_or(slot);
    // A shin belongs to its foot, a forearm to its hand; all other bodies to themselves.
    let stands = !flies && is_anchored(model, end, anchors);
    match (stands, end == slot) {
        (false, _) => 1.0,
        (true, false) => 0.5,
        (true, true) => 0.0,
    }
}
