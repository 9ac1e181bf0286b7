//! A clip between its frames, at other rates, and in part.
//!
//! Rotations and translations follow cubic curves through the frames, so that a clip sampled at a higher rate has no
//! kinks in its velocity, which a physics character would have to follow.

use super::{Clip, Error, LoopMode, Margin, Problem};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// A rate within this fraction of the wanted one counts as the wanted one: files write 1/30 s as 0.033332, which is off by
/// 4·10⁻⁵.
const SAME_RATE: f64 = 1e-4;
/// A turn from one frame to the next that is larger than this, in radians, may as well go the other way round, so its
/// neighbours don't shape its path. Chosen below π, where both ways are equally long.
const WILD: f64 = 2.0;
/// Most frames × joints that a clip may have. Chosen: 20 million take 1.1 GB in memory, at seven numbers of eight bytes.
pub(crate) const MOST_TRANSFORMS: usize = 20_000_000;
/// Lowest and highest frame rate that a clip or a motion may have, Hz. Chosen: frames that are ten seconds apart tell nothing of a
/// movement, and the highest is beyond any camera or simulation.
pub(crate) const LEAST_FPS: f64 = 0.1;
pub(crate) const MOST_FPS: f64 = 10_000.0;
/// Longest that a clip or a motion may last, seconds. Chosen: an hour is longer than any take that somebody retargets as a whole,
/// and few frames that last for days would fill tables of many frames a second.
pub(crate) const MOST_SECONDS: f64 = 3600.0;

/// What is wrong with a frame rate, Hz; `None` for one that can be used.
pub(crate) fn rate_flaw(fps: f64) -> Option<String> {
    let usable = (LEAST_FPS..=MOST_FPS).contains(&fps);
    let told = || format!("{fps} is no frame rate from {LEAST_FPS} to {MOST_FPS} Hz");
    (!usable).then(told)
}

/// What is wrong with a duration, seconds; `None` for one that can be used.
pub(crate) fn length_flaw(seconds: f64) -> Option<String> {
    let usable = seconds <= MOST_SECONDS;
    let told = || format!("it lasts {seconds:.0} s, and at most {MOST_SECONDS} s can be used");
    (!usable).then(told)
}

/// The rotation a fraction `t` of the way from `a` to `b`, the short way round at constant speed. Opposite rotations have no
/// short way: `a` stays.
pub(crate) fn slerp(
    a: &UnitQuaternion<f64>,
    b: &UnitQuaternion<f64>,
    t: f64,
) -> UnitQuaternion<f64> {
    a.try_slerp(b, t, 1e-12).unwrap_or(*a)
}

/// Slopes at the start and the end of the step `now`, per frame, given the steps `before` and `after` where there are any.
/// They are those of parabolas through three frames: the mean of two steps between them, as in Catmull and Rom's splines
/// (1974), and 3/2 of a step less 1/2 of the other at a free end.
fn slopes(
    before: Option<Vector3<f64>>,
    now: Vector3<f64>,
    after: Option<Vector3<f64>>,
) -> [Vector3<f64>; 2] {
    match (before, after) {
        (Some(before), Some(after)) => [0.5 * (before + now), 0.5 * (now + after)],
        (None, Some(after)) => [0.5 * (3.0 * now - after), 0.5 * (now + after)],
        (Some(before), None) => [0.5 * (before + now), 0.5 * (3.0 * now - before)],
        (None, None) => [now; 2],
    }
}

/// The distance covered a fraction `t` into the step `now`, along the cubic Hermite curve with these slopes.
fn way(now: Vector3<f64>, [start, end]: [Vector3<f64>; 2], t: f64) -> Vector3<f64> {
    let (t2, t3) = (t * t, t * t * t);
    now * (3.0 * t2 - 2.0 * t3) + start * (t3 - 2.0 * t2 + t) + end * (t3 - t2)
}

/// The rotation made a fraction `t` into the step `now`, with these slopes: the cubic Bézier curve of rotations by cumulative
/// Bernstein polynomials (Kim, Kim and Shin, "A general construction scheme for unit quaternion curves with simple high order
/// derivatives", 1995).
fn turn(now: &UnitQuaternion<f64>, slopes: [Vector3<f64>; 2], t: f64) -> UnitQuaternion<f64> {
    let [start, end] = slopes.map(|slope| UnitQuaternion::from_scaled_axis(slope / 3.0));
    // The three factors make the whole turn at the end of the step: start · middle · end = now.
    let middle = start.inverse() * now * end.inverse();
    let u = 1.0 - t;
    // Cumulative Bernstein polynomials of degree 3.
    let shares = [1.0 - u * u * u, t * t * (3.0 - 2.0 * t), t * t * t];
    start.powf(shares[0]) * middle.powf(shares[1]) * end.powf(shares[2])
}

/// The rotation from `a` to `b` in the axes of `a`, the short way round, as a rotation vector.
fn turned(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> Vector3<f64> {
    (a.inverse() * b).scaled_axis()
}

/// Evenly spaced frames over a span of time, the first at its start and the last at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    /// Seconds covered.
    duration: f64,
    /// Number of frames, at least 1.
    pub frames: usize,
    /// Rate of the frames, Hz: the one asked for, or the nearest at which a frame falls on the end.
    pub fps: f64,
}

impl Grid {
    /// Frames over `duration` seconds at about `fps` Hz. `None` if `fps` isn't a rate that can be sampled, or there would be
    /// more than `most` frames. A span too short for two frames at any rate is an instant, of one frame.
    pub fn new(duration: f64, fps: f64, most: usize) -> Option<Self> {
        if rate_flaw(fps).is_some() || duration.is_nan() || duration < 0.0 {
            return None;
        }
        // Intervals as the rate asks, at least one, but none longer than the lowest rate has, or shorter than the highest.
        let (least, fit) = (duration * LEAST_FPS, duration * MOST_FPS);
        let intervals = (duration * fps).round().max(1.0).max(least.ceil());
        let intervals = intervals.min(fit.floor());
        if intervals >= most as f64 {
            return None;
        }
        let (duration, even) = if intervals > 0.0 {
            (duration, (intervals / duration).min(MOST_FPS))
        } else {
            (0.0, fps)
        };
        // The exact rate asked for, where the difference is only rounding.
        let fps = if (even - fps).abs() <= SAME_RATE * fps {
            fps
        } else {
            even
        };
        Some(Self {
            duration,
            frames: intervals as usize + 1,
            fps,
        })
    }

    /// Seconds from the start of the span to frame `frame`.
    pub fn time(&self, frame: usize) -> f64 {
        let intervals = self.frames.saturating_sub(1).max(1);
        self.duration * (frame as f64 / intervals as f64)
    }
}

impl Clip {
    /// Transform of every joint in its parent at `time` seconds from the first frame, metres. Before the first and after the
    /// last frame the clip stands still, even if it loops: later cycles are up to the motion. Between frames, rotations and
    /// translations follow cubic curves.
    pub fn sample(&self, time: f64) -> Vec<Isometry3<f64>> {
        let last = self.frames.len().saturating_sub(1);
        let at = (time * self.fps).clamp(0.0, last as f64);
        let frame = (at as usize).min(last);
        let t = at - frame as f64;
        let Some(a) = self.frames.get(frame) else {
            return Vec::new();
        };
        // A time that is a frame's returns that frame bit for bit, although `frame / fps * fps` may miss it by rounding.
        if t < 1e-9 {
            return a.clone();
        }
        if t > 1.0 - 1e-9 || frame == last {
            return self.frames[(frame + 1).min(last)].clone();
        }
        let around = &self.frames[frame.saturating_sub(1)..(frame + 3).min(last + 1)];
        let joints = around.iter().map(Vec::len).min().unwrap_or(0);
        (0..joints).map(|j| self.between(frame, t, j)).collect()
    }

    /// Transform of joint `j` a fraction `t` of the way from frame `frame` to the next.
    fn between(&self, frame: usize, t: f64, j: usize) -> Isometry3<f64> {
        let (a, b) = (&self.frames[frame][j], &self.frames[frame + 1][j]);
        let step = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
            let moved = b.translation.vector - a.translation.vector;
            (moved, turned(&a.rotation, &b.rotation))
        };
        let beside = |[a, b]: [usize; 2]| {
            let (a, b) = (self.frames[a].get(j)?, self.frames[b].get(j)?);
            Some(step(a, b))
        };
        let [into, out] = self.beside(frame).map(|pair| pair.and_then(beside));
        let now = step(a, b);
        // Beyond the seam of a cycle the root may have another heading and place, so its translation doesn't go on there.
        let in_place = |step: Option<(Vector3<f64>, Vector3<f64>)>, within: bool| {
            step.filter(|_| within || self.joints[j].parent.is_some())
        };
        let last = self.frames.len() - 1;
        let moving = slopes(
            in_place(into, frame > 0).map(|s| s.0),
            now.0,
            in_place(out, frame + 2 <= last).map(|s| s.0),
        );
        // A turn near half a revolution has no clear direction, and nor has its slope.
        let wild = [into, Some(now), out].into_iter().flatten();
        let turning = if wild.map(|s| s.1.norm()).any(|angle| angle > WILD) {
            [now.1; 2]
        } else {
            slopes(into.map(|s| s.1), now.1, out.map(|s| s.1))
        };
        let by = UnitQuaternion::from_scaled_axis(now.1);
        Isometry3::from_parts(
            Translation3::from(a.translation.vector + way(now.0, moving, t)),
            a.rotation * turn(&by, turning, t),
        )
    }

    /// The steps before and after the one from frame `frame`, as pairs of frames. Those of a cycle continue across its seam.
    fn beside(&self, frame: usize) -> [Option<[usize; 2]>; 2] {
        let last = self.frames.len() - 1;
        let goes_on = self.loop_mode == LoopMode::Wrap && last > 1;
        let before = frame.checked_sub(1).map(|f| [f, frame]);
        let after = (frame + 2 <= last).then_some([frame + 1, frame + 2]);
        [
            before.or_else(|| goes_on.then_some([last - 1, last])),
            after.or_else(|| goes_on.then_some([0, 1])),
        ]
    }

    /// The same clip at another rate, Hz. The first and last frames stay, so the rate is the nearest to `fps` with a whole
    /// number of frames between them.
    ///
    /// # Errors
    /// An [`Error`] for a rate that can't be sampled, more frames than a clip may have, and a clip that contradicts itself.
    pub fn resample(&self, fps: f64) -> Result<Clip, Error> {
        self.check()?;
        let grid = self.grid(self.duration(), fps)?;
        let mut clip = self.sampled(0.0, grid, self.loop_mode);
        clip.margin = self.margin_of(0.0, self.duration(), grid.fps);
        Ok(clip)
    }

    /// The part from `from` to `to` seconds, with up to two seconds around it as margins. It plays once: only the whole clip
    /// still loops. Where `to` is beyond the clip's end, it ends there, with a warning.
    ///
    /// # Errors
    /// An [`Error`] for a part that is empty, and for a clip that contradicts itself.
    pub fn trim(&self, from: f64, to: f64) -> Result<Clip, Error> {
        self.check()?;
        let duration = self.duration();
        let end = to.min(duration);
        let start = from.max(0.0);
        // Written so that it also refuses numbers that are not a number.
        if !(from <= to && start <= end) {
            return Err(Error::EmptyTrim {
                from,
                to: end,
                duration,
            });
        }
        let mut part = match start <= 0.0 && end >= duration {
            true => self.clone(),
            false => {
                let grid = self.grid(end - start, self.fps)?;
                let part = self.sampled(start, grid, LoopMode::Clamp);
                let margin = self.margin_of(start, end, grid.fps);
                Clip { margin, ..part }
            }
        };
        let shortened = Problem::shortened(to, duration, self.fps);
        let is_new = |problem: &Problem| !self.problems.contains(problem);
        part.problems.extend(shortened.filter(is_new));
        Ok(part)
    }

    /// What is around the part from `start` to `end` seconds, at `fps` Hz; the clip's own margins count too.
    fn margin_of(&self, start: f64, end: f64, fps: f64) -> Margin {
        let Margin { before, after } = &self.margin;
        let parts = [before.as_slice(), &self.frames, after];
        let long = self.with_frames(parts.concat(), self.fps, LoopMode::Clamp);
        let start = start + before.len() as f64 / self.fps;
        let end = end + before.len() as f64 / self.fps;
        let (led, left) = (
            Margin::frames(start, fps),
            Margin::frames(long.duration() - end, fps),
        );
        let at = |time: f64| long.sample(time);
        Margin {
            before: (1..=led)
                .rev()
                .map(|k| at(start - k as f64 / fps))
                .collect(),
            after: (1..=left).map(|k| at(end + k as f64 / fps)).collect(),
        }
    }

    pub(super) fn grid(&self, duration: f64, fps: f64) -> Result<Grid, Error> {
        let most = MOST_TRANSFORMS / self.joints.len().max(1);
        if Grid::new(0.0, fps, most).is_none() {
            return Err(Error::Rate { fps });
        }
        if length_flaw(duration).is_some() {
            return Err(Error::TooSlow { duration });
        }
        Grid::new(duration, fps, most).ok_or(Error::TooLong { duration, fps })
    }

    fn sampled(&self, start: f64, grid: Grid, loop_mode: LoopMode) -> Clip {
        let frames = (0..grid.frames)
            .map(|f| self.sample(start + grid.time(f)))
            .collect();
        self.with_frames(frames, grid.fps, loop_mode)
    }
}
