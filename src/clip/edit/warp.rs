//! The same motion in another time: playback speed and time-warps.

use crate::clip::{Clip, Error};

/// Longest time that a point may have, seconds. Chosen: far more than can be sampled.
const LONGEST: f64 = 1e9;

/// Least time between two points, seconds. Chosen: shorter than the frames of any rate; quotients stay far from what numbers hold.
const SHORTEST: f64 = 1e-6;

/// Smallest factor of speed; a smaller one would stretch the shortest clip over days.
const SLOWEST: f64 = 1e-6;

impl Clip {
    /// The clip played `factor` times as fast (0.000001 or more), sampled at `fps` Hz.
    ///
    /// # Errors
    /// An [`Error`] for a factor out of range, a rate that can't be sampled, and more frames than a clip may have.
    pub fn speed(&self, factor: f64, fps: f64) -> Result<Clip, Error> {
        self.check()?;
        if !(factor.is_finite() && factor >= SLOWEST) {
            return Err(Error::Speed { factor });
        }
        let duration = self.duration();
        if duration == 0.0 {
            return self.resample(fps);
        }
        self.warp(&[(duration, duration / factor)], fps)
    }

    /// The clip in another time, sampled at `fps` Hz: for each of `points` (a, b), what is at `a` seconds moves to `b` seconds.
    /// The start stays at 0. Between the points time runs along a monotone cubic curve without jumps in speed (Fritsch and
    /// Butland, "A method for constructing local monotone piecewise cubic interpolants", 1984); after the last one it runs
    /// at the clip's own speed.
    ///
    /// # Errors
    /// An [`Error`] for points that don't rise or lie beyond the clip's end, a rate that can't be sampled, and more frames
    /// than a clip may have.
    pub fn warp(&self, points: &[(f64, f64)], fps: f64) -> Result<Clip, Error> {
        self.check()?;
        let knots = knots(points, self.duration())?;
        let end = knots.last().map_or(0.0, |knot| knot.0);
        let grid = self.grid(end, fps)?;
        let slopes = slopes(&knots);
        let frames = (0..grid.frames).map(|f| self.sample(source(&knots, &slopes, grid.time(f))));
        Ok(self.with_frames(frames.collect(), grid.fps, self.loop_mode))
    }
}

/// Pairs of new time and source time, both rising from 0 to the end.
fn knots(points: &[(f64, f64)], duration: f64) -> Result<Vec<(f64, f64)>, Error> {
    let mut knots = vec![(0.0, 0.0)];
    let points = points.iter().skip_while(|point| **point == (0.0, 0.0));
    for &(from, to) in points {
        let before = knots[knots.len() - 1];
        // People type the end of a clip with fewer digits than it has: up to a millisecond beyond is meant as the end.
        let from = if from > duration && from <= duration + 1e-3 {
            duration
        } else {
            from
        };
        if !(to >= before.0 + SHORTEST && from > before.1 && from <= duration && to <= LONGEST) {
            return Err(Error::Warp { from, to, duration });
        }
        knots.push((to, from));
    }
    let (to, from) = knots[knots.len() - 1];
    // After the last point time runs as before: at slope 1.
    if from < duration {
        knots.push((to + duration - from, duration));
    }
    Ok(knots)
}

/// Slope of the curve at each knot: the harmonic mean of the secants on both sides, weighted by their lengths (Fritsch and
/// Butland). It never exceeds what keeps the curve rising.
fn slopes(knots: &[(f64, f64)]) -> Vec<f64> {
    let secant = |k: usize| (knots[k + 1].1 - knots[k].1) / (knots[k + 1].0 - knots[k].0);
    let last = knots.len() - 1;
    let slope = |k: usize| match k {
        _ if last == 0 => 1.0,
        0 => secant(0),
        _ if k == last => secant(last - 1),
        _ => {
            let (a, b) = (secant(k - 1), secant(k));
            // Fritsch and Butland's weights: (1 + share of the following interval) / 3.
            let part = (knots[k + 1].0 - knots[k].0) / (knots[k + 1].0 - knots[k - 1].0);
            let share = (1.0 + part) / 3.0;
            a * b / (share * b + (1.0 - share) * a)
        }
    };
    (0..=last).map(slope).collect()
}

/// The time in the source, seconds, of a new time: the cubic Hermite curve between the two knots around it.
fn source(knots: &[(f64, f64)], slopes: &[f64], time: f64) -> f64 {
    let above = knots.partition_point(|knot| knot.0 <= time);
    let (Some(&(t1, s1)), Some(k)) = (knots.get(above), above.checked_sub(1)) else {
        return knots.last().map_or(0.0, |knot| knot.1);
    };
    let (t0, s0) = knots[k];
    let (long, x) = (t1 - t0, (time - t0) / (t1 - t0));
    // Slopes per interval.
    let (rise, start, end) = (s1 - s0, slopes[k] * long, slopes[above] * long);
    let (x2, x3) = (x * x, x * x * x);
    s0 + rise * (3.0 * x2 - 2.0 * x3) + start * (x3 - 2.0 * x2 + x) + end * (x3 - x2)
}
