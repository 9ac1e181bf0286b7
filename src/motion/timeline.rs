//! Frames before the first and after the last: derivatives and windows of a motion that repeats go on over its seam.

use super::Cycle;
use crate::clip::LoopMode;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// How many frames there are and what follows the last one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Timeline {
    pub(crate) frames: usize,
    pub(crate) loop_mode: LoopMode,
    pub(crate) cycle: Cycle,
}

impl Timeline {
    /// Cycle number and frame of frame `index`, which may be negative or beyond the end; `None` where a motion
    /// that ends has no such frame. In a motion that repeats, the last frame is frame 0 of the next cycle, so that frame 1
    /// follows it.
    pub(crate) fn locate(&self, index: i64) -> Option<(i64, usize)> {
        let frames = i64::try_from(self.frames).ok()?;
        if (0..frames).contains(&index) {
            return Some((0, usize::try_from(index).ok()?));
        }
        match self.loop_mode {
            LoopMode::Wrap if frames > 1 => {
                let period = frames - 1;
                let frame = usize::try_from(index.rem_euclid(period)).ok()?;
                Some((index.div_euclid(period), frame))
            }
            _ => None,
        }
    }

    /// Indices of up to `2 * reach + 1` frames around `frame`. At the ends of a motion that ends the window is moved
    /// inwards rather than cut, so that a polynomial fitted to it has as many points everywhere.
    pub(crate) fn window(&self, frame: usize, reach: usize) -> std::ops::RangeInclusive<i64> {
        let (frame, reach) = (frame as i64, reach as i64);
        let last = self.frames as i64 - 1;
        match self.loop_mode {
            LoopMode::Wrap if last > 0 => frame - reach..=frame + reach,
            _ => {
                let start = (frame - reach).min(last - 2 * reach).max(0);
                start..=(start + 2 * reach).min(last)
            }
        }
    }
}

impl Cycle {
    /// World transform that carries the first cycle to cycle number `n`.
    ///
    /// The n-th power of a planar rigid motion in closed form: the shifts t + R t + … + Rⁿ⁻¹ t form a geometric
    /// series, sin(nθ/2) / sin(θ/2) · R((n − 1)θ/2) t, for negative n as well.
    pub fn offset(&self, n: i64) -> Isometry3<f64> {
        let n = n as f64;
        let turn = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let half = self.heading / 2.0;
        // The quotient is 0 / 0 where cycles don't turn, and there its limit is n.
        let shift = if half.sin().abs() < 1e-9 {
            self.translation * n
        } else {
            turn((n - 1.0) * half) * self.translation * ((n * half).sin() / half.sin())
        };
        Isometry3::from_parts(shift.into(), turn(n * self.heading))
    }
}
