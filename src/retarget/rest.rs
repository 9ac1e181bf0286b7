//! Where a point that stands is to rest, and how firmly it is held there.

use super::stance::ramp;
use nalgebra::Vector3;

/// Speed at which a standing point has a third of the say of one at rest in where it stands, leg lengths per second.
const SLOW: f64 = 0.08;
/// Distances from its place at which a standing point begins to go with the source, and does so wholly, leg lengths.
const SLIDES: [f64; 2] = [0.08, 0.14];
/// Time at rest from whose mean the place of a stance follows, s.
const LAST: f64 = 0.5;
/// Time in which a stance takes hold of a point, and in which it lets go, s.
const TAKES_HOLD: f64 = 0.08;

/// Frame, place, weight and hold wherever a knob stands; its weight is no number where it doesn't.
pub(super) fn stances(
    path: &[Vector3<f64>],
    weights: &[f64],
    radius: f64,
    fps: f64,
    leg: f64,
) -> Vec<(usize, Vector3<f64>, f64, f64)> {
    let mut found = Vec::new();
    let mut f = 0;
    while f < path.len() {
        let ends = |g: &usize| weights[*g].is_nan();
        let end = (f..path.len()).find(ends).unwrap_or(path.len());
        let stance = Stance {
            path: &path[f..end],
            weights: &weights[f..end],
            begins: f > 0,
            ends: end < path.len(),
            fps,
            leg,
        };
        let rest = stance.rest();
        for (i, weight) in stance.weights.iter().enumerate() {
            let place = stance.place(i, &rest);
            let at = Vector3::new(place.x, place.y, radius);
            if *weight > 0.0 {
                found.push((f + i, at, *weight, weight * stance.hold(i)));
            }
        }
        f = end + 1;
    }
    found
}

/// A knob from where it begins to stand to where it ends.
struct Stance<'a> {
    path: &'a [Vector3<f64>],
    weights: &'a [f64],
    /// Whether the clip shows its beginning and its end.
    begins: bool,
    ends: bool,
    fps: f64,
    leg: f64,
}

impl Stance<'_> {
    /// Leg lengths per second.
    fn speed(&self, i: usize) -> f64 {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(self.path.len() - 1));
        let shift = (self.path[b] - self.path[a]).xy().norm();
        shift * self.fps / ((b - a).max(1) as f64 * self.leg)
    }

    /// Where the knob rests: where it does so last and slowest. What was before has no say, so that a stance is the
    /// same in a clip that begins in its midst.
    fn rest(&self) -> Vector3<f64> {
        let enough = LAST * self.fps;
        let (mut sum, mut total) = (Vector3::zeros(), 0.0);
        for j in (0..self.path.len()).rev() {
            let slow = (-(self.speed(j) / SLOW).powi(2)).exp() + 1e-9;
            let says = slow * self.weights[j].max(1e-3);
            sum += self.path[j] * says;
            total += says;
            if total > enough {
                break;
            }
        }
        sum / total
    }

    /// Rises over the first frames and falls over the last.
    fn hold(&self, i: usize) -> f64 {
        let frames = TAKES_HOLD * self.fps + 1.0;
        let after = if self.begins { (i + 1) as f64 } else { frames };
        let before = if self.ends {
            (self.path.len() - i) as f64
        } else {
            frames
        };
        let t = (after.min(before) / frames).min(1.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// Where the knob should be: at its rest, as long as it is near; where the source has it, once that slides.
    fn place(&self, i: usize, rest: &Vector3<f64>) -> Vector3<f64> {
        let away = (rest - self.path[i]).xy().norm() / self.leg;
        self.path[i].lerp(rest, ramp(SLIDES, away))
    }
}
