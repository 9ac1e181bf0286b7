//! Where a point that stands is held on the ground, and how firmly.

use crate::retarget::fade::{ramp, smoothstep};
use nalgebra::Vector3;

/// Speed at which a frame has 1/e of the weight of one at rest in the mean that gives the place, leg lengths per second.
/// Chosen: 7 cm/s for a leg of 0.9 m, at which a source counts as still.
const SLOW: f64 = 0.08;
/// Distances from its place from which on a point begins to slide with the source, and does so wholly, leg lengths. Chosen:
/// no stance drags a foot further than that. With twice the width, no clip but one gained, and that little.
const SLIDES: [f64; 2] = [0.08, 0.14];
/// Time at rest from whose mean the place follows, s. Chosen: it is the same in a clip that begins in the midst of the stance.
const LAST: f64 = 0.5;
/// Time in which a stance takes hold of a point, and in which it lets go, s. Chosen: a foot that pivots has points that
/// stand one after the other; held at once, it turned by up to a radian between two frames.
const TAKES_HOLD: f64 = 0.08;
/// Least weight of a frame's speed and of its height in the mean, so that a stance that is never slow or low has a place too.
const LEAST: [f64; 2] = [1e-9, 1e-3];

/// A contact point over the whole timeline.
pub(super) struct Track<'a> {
    /// Its centre, world, metres.
    pub path: &'a [Vector3<f64>],
    /// How near the ground it stands: 0 to 1, NaN where it doesn't stand.
    pub weights: &'a [f64],
    /// Metres.
    pub radius: f64,
    /// Frames per second.
    pub fps: f64,
    /// The skeleton's leg length, metres.
    pub leg: f64,
}

/// Where a point stands in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foothold {
    /// Where its centre is to be, world, metres.
    pub at: Vector3<f64>,
    /// How near the ground it stands: 0 to 1.
    pub weight: f64,
    /// How firmly it is held: 0 to the weight.
    pub hold: f64,
}

/// The footholds of a point, with their frames.
pub(super) fn footholds(track: &Track) -> Vec<(usize, Foothold)> {
    let (path, weights) = (track.path, track.weights);
    let mut found = Vec::new();
    let mut f = 0;
    while f < path.len() {
        // A stance goes on to the first frame in which the point doesn't stand.
        let ends = |g: &usize| weights[*g].is_nan();
        let end = (f..path.len()).find(ends).unwrap_or(path.len());
        let stance = Stance {
            path: &path[f..end],
            weights: &weights[f..end],
            begins: f > 0,
            ends: end < path.len(),
            fps: track.fps,
            leg: track.leg,
        };
        let rest = stance.rest();
        for (i, weight) in stance.weights.iter().enumerate() {
            let place = stance.place(i, &rest);
            // A point that is slow but too high to be held stays in the stance without pulling.
            if *weight > 0.0 {
                let foothold = Foothold {
                    // The ball touches the ground when its centre is a radius above it.
                    at: Vector3::new(place.x, place.y, track.radius),
                    weight: *weight,
                    hold: weight * stance.hold(i),
                };
                found.push((f + i, foothold));
            }
        }
        f = end + 1;
    }
    found
}

/// A point from where it begins to stand to where it ends.
struct Stance<'a> {
    path: &'a [Vector3<f64>],
    weights: &'a [f64],
    /// Whether the clip shows its beginning.
    begins: bool,
    /// Whether the clip shows its end.
    ends: bool,
    fps: f64,
    leg: f64,
}

impl Stance<'_> {
    /// Horizontal speed by central differences, leg lengths per second.
    fn speed(&self, i: usize) -> f64 {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(self.path.len() - 1));
        let shift = (self.path[b] - self.path[a]).xy().norm();
        shift * self.fps / ((b - a).max(1) as f64 * self.leg)
    }

    /// Where the point rests: the mean of its path over the last half second in which it is low and slow. Earlier frames
    /// don't count, so that a stance is the same in a clip that begins in the middle of it.
    fn rest(&self) -> Vector3<f64> {
        let enough = LAST * self.fps;
        let (mut sum, mut total) = (Vector3::zeros(), 0.0);
        for j in (0..self.path.len()).rev() {
            // A Gaussian of the speed: frames at rest decide, frames that roll or slide hardly count.
            let slow = (-(self.speed(j) / SLOW).powi(2)).exp() + LEAST[0];
            let weight = slow * self.weights[j].max(LEAST[1]);
            sum += self.path[j] * weight;
            total += weight;
            if total > enough {
                break;
            }
        }
        sum / total
    }

    /// Rises to 1 over the first frames and falls over the last; not where the clip cuts the stance.
    fn hold(&self, i: usize) -> f64 {
        // One frame more than the time, so that even the first and last frame are held a little.
        let frames = TAKES_HOLD * self.fps + 1.0;
        let after = if self.begins { (i + 1) as f64 } else { frames };
        let before = if self.ends {
            (self.path.len() - i) as f64
        } else {
            frames
        };
        smoothstep((after.min(before) / frames).min(1.0))
    }

    /// Where the point should be: at its rest as long as it is near, and where the source has it once that slides away.
    fn place(&self, i: usize, rest: &Vector3<f64>) -> Vector3<f64> {
        let away = (rest - self.path[i]).xy().norm() / self.leg;
        self.path[i].lerp(rest, ramp(SLIDES, away))
    }
}
