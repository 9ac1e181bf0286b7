//! One animated property of one node over time.

use crate::clip::slerp;
use gltf::json::animation::Interpolation;
use nalgebra::{Quaternion, UnitQuaternion};
use std::rc::Rc;

/// A step happens at a time this near before its key, seconds: key times are rounded to 32 bits, which is half a microsecond
/// at ten seconds.
const STEP_TOLERANCE: f64 = 1e-6;

/// Keys with `N` numbers each: a vector, or a quaternion x, y, z, w.
pub(super) struct Curve<const N: usize> {
    times: Rc<[f64]>,
    values: Rc<[f64]>,
    interpolation: Interpolation,
}

impl<const N: usize> Curve<N> {
    /// A curve, after checking that it has keys, in order and finite, each with its values.
    pub fn new(
        times: Rc<[f64]>,
        values: Rc<[f64]>,
        interpolation: Interpolation,
    ) -> Result<Self, String> {
        // A cubic spline has an in-tangent, a value and an out-tangent per key.
        let per_key = if interpolation == Interpolation::CubicSpline {
            3 * N
        } else {
            N
        };
        if times.is_empty() {
            return Err("no keys".to_owned());
        }
        if let Some(key) = times
            .iter()
            .chain(values.iter())
            .position(|x| !x.is_finite())
        {
            return Err(format!("number {key} of its keys and values is not finite"));
        }
        if let Some(key) = times.windows(2).position(|pair| pair[1] < pair[0]) {
            return Err(format!("key {} is earlier than the one before it", key + 1));
        }
        if values.len() != times.len().saturating_mul(per_key) {
            let (keys, numbers) = (times.len(), values.len());
            return Err(format!(
                "{keys} keys with {numbers} numbers, which should be {per_key} each"
            ));
        }
        Ok(Self {
            times,
            values,
            interpolation,
        })
    }

    /// Times of the keys, seconds.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Value at `time` seconds. Outside the keys the first or the last one holds.
    pub fn at(&self, time: f64) -> [f64; N] {
        let (a, b, t, gap) = self.around(time);
        match self.interpolation {
            Interpolation::Step => self.value(self.step(time)),
            Interpolation::Linear => {
                let (a, b) = (self.value(a), self.value(b));
                std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
            }
            Interpolation::CubicSpline => self.spline(a, b, t, gap),
        }
    }

    /// The key before `time`, the key after it, the fraction of the way between them, and the seconds between them.
    fn around(&self, time: f64) -> (usize, usize, f64, f64) {
        // The first key after this time; outside the keys both neighbours are the same one.
        let after = self.times.partition_point(|&key| key <= time);
        let (a, b) = (after.saturating_sub(1), after.min(self.times.len() - 1));
        let gap = self.times[b] - self.times[a];
        let t = if gap > 0.0 {
            ((time - self.times[a]) / gap).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (a, b, t, gap)
    }

    /// The key whose value holds at `time`.
    fn step(&self, time: f64) -> usize {
        self.times
            .partition_point(|&key| key <= time + STEP_TOLERANCE)
            .saturating_sub(1)
    }

    fn value(&self, key: usize) -> [f64; N] {
        match self.interpolation {
            Interpolation::CubicSpline => self.part(key, 1),
            _ => self.numbers(key * N),
        }
    }

    /// The in-tangent (part 0), value (1) or out-tangent (2) of a cubic spline's key.
    fn part(&self, key: usize, part: usize) -> [f64; N] {
        self.numbers((3 * key + part) * N)
    }

    fn numbers(&self, at: usize) -> [f64; N] {
        std::array::from_fn(|k| self.values[at + k])
    }

    /// Cubic Hermite spline. Tangents are per second, so the gap scales them (glTF 2.0 specification, appendix C).
    fn spline(&self, a: usize, b: usize, t: f64, gap: f64) -> [f64; N] {
        let (from, to) = (self.part(a, 1), self.part(b, 1));
        let (out, into) = (self.part(a, 2), self.part(b, 0));
        // The Hermite basis: 2t³ − 3t² + 1, t³ − 2t² + t, 3t² − 2t³ and t³ − t².
        let (t2, t3) = (t * t, t * t * t);
        std::array::from_fn(|k| {
            (2.0 * t3 - 3.0 * t2 + 1.0) * from[k]
                + gap * (t3 - 2.0 * t2 + t) * out[k]
                + (3.0 * t2 - 2.0 * t3) * to[k]
                + gap * (t3 - t2) * into[k]
        })
    }
}

impl Curve<4> {
    /// The first key whose quaternion is zero.
    pub fn zero_key(&self) -> Option<usize> {
        (0..self.times.len()).find(|&key| unit(self.value(key)).is_none())
    }

    /// Rotation at `time` seconds: spherical interpolation between linear keys, and normalised on a spline.
    pub fn rotation(&self, time: f64) -> UnitQuaternion<f64> {
        let (a, b, t, _) = self.around(time);
        let key = |key: usize| unit(self.value(key)).unwrap_or_default();
        match self.interpolation {
            Interpolation::Step => key(self.step(time)),
            Interpolation::Linear => slerp(&key(a), &key(b), t),
            Interpolation::CubicSpline => unit(self.at(time)).unwrap_or_else(|| key(a)),
        }
    }
}

/// The rotation of a quaternion x, y, z, w of any length but zero.
pub(super) fn unit([x, y, z, w]: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6)
}
