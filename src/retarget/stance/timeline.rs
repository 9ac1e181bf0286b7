//! The frames of the goals, and of a motion that repeats a cycle before and after them as well, so that a stance may pass
//! over the seam.

use crate::motion::Cycle;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// Frames in time: `margin` frames before the goals' own, those, and as many after them.
pub(super) struct Timeline {
    frames: usize,
    /// Frames before and after the goals' own; 0 for a motion that ends.
    pub margin: usize,
    cycle: Option<Isometry3<f64>>,
}

impl Timeline {
    /// The timeline of this many frames; the last frame of a cycle is the first of the next.
    pub fn new(frames: usize, cycle: Option<&Cycle>) -> Timeline {
        // A whole cycle on either side is longer than any stance that passes over the seam.
        let margin = frames.saturating_sub(1);
        let step = cycle.map(|c| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), c.heading);
            Isometry3::from_parts(c.translation.into(), turn)
        });
        Timeline {
            frames,
            margin: if step.is_some() { margin } else { 0 },
            cycle: step,
        }
    }

    /// A path over the whole timeline, from its own frames: before and after them it is carried on by the cycle.
    pub fn extend(&self, path: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let Some(step) = self.cycle else {
            return path.to_vec();
        };
        // The last frame is the next cycle's first, so a cycle has one frame less.
        let cycle = self.frames - 1;
        let moved = |by: &Isometry3<f64>, p: &Vector3<f64>| (by * Point3::from(*p)).coords;
        let back = step.inverse();
        let before = path[cycle - self.margin..cycle]
            .iter()
            .map(|p| moved(&back, p));
        let after = path[1..=self.margin].iter().map(|p| moved(&step, p));
        before.chain(path.iter().copied()).chain(after).collect()
    }

    /// Flags over the whole timeline, which are alike in every cycle.
    pub fn repeat(&self, flags: &[bool]) -> Vec<bool> {
        if self.cycle.is_none() {
            return flags.to_vec();
        }
        let cycle = self.frames - 1;
        let parts = [
            &flags[cycle - self.margin..cycle],
            flags,
            &flags[1..=self.margin],
        ];
        parts.concat()
    }
}
