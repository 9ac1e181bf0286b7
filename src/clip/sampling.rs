//! A clip between its frames, at other rates, and in part.

use super::{Clip, Error, LoopMode};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};

/// A rate this close to the wanted one, relative to it, counts as the wanted one: files write 1/30 s as 0.033332.
const SAME_RATE: f64 = 1e-4;
/// Most frames × joints that a clip may grow to.
pub(crate) const MOST_TRANSFORMS: usize = 20_000_000;
/// Highest frame rate that is sampled, in Hz.
pub(crate) const MOST_FPS: f64 = 10_000.0;

/// Rotation a fraction `t` of the way from `a` to `b`, the short way round at constant speed.
pub(crate) fn slerp(
    a: &UnitQuaternion<f64>,
    b: &UnitQuaternion<f64>,
    t: f64,
) -> UnitQuaternion<f64> {
    a.try_slerp(b, t, 1e-12).unwrap_or(*a)
}

/// Transform a fraction `t` of the way from `a` to `b`.
fn blend(a: &Isometry3<f64>, b: &Isometry3<f64>, t: f64) -> Isometry3<f64> {
    let translation = a.translation.vector.lerp(&b.translation.vector, t);
    Isometry3::from_parts(
        Translation3::from(translation),
        slerp(&a.rotation, &b.rotation, t),
    )
}

/// Evenly spaced frames over a span of time, the first at its start and the last at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    /// Seconds covered.
    duration: f64,
    pub frames: usize,
    /// Rate of the frames in Hz: the one asked for, or the nearest at which a frame falls on the end.
    pub fps: f64,
}

impl Grid {
    /// `None` where `fps` isn't a rate that can be sampled, or the frames would be more than `most`. A span too short
    /// for two frames at any rate is an instant, of one frame.
    pub fn new(duration: f64, fps: f64, most: usize) -> Option<Self> {
        if !(fps > 0.0 && fps <= MOST_FPS && duration >= 0.0) {
            return None;
        }
        let fit = (duration * MOST_FPS).floor();
        let intervals = (duration * fps).round().max(1.0).min(fit);
        if intervals >= most as f64 {
            return None;
        }
        let (duration, even) = if intervals > 0.0 {
            (duration, (intervals / duration).min(MOST_FPS))
        } else {
            (0.0, fps)
        };
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
    /// Transform of every joint in its parent at `time` seconds from the first frame. Before the first and after
    /// the last frame, the clip stands still; a wrapping clip's later cycles are the motion's affair.
    pub fn sample(&self, time: f64) -> Vec<Isometry3<f64>> {
        let last = self.frames.len().saturating_sub(1);
        let at = (time * self.fps).clamp(0.0, last as f64);
        let frame = (at as usize).min(last);
        let t = at - frame as f64;
        let Some(a) = self.frames.get(frame) else {
            return Vec::new();
        };
        // Frames that were sampled come back bit for bit, despite `frame / fps * fps`.
        if t < 1e-9 {
            return a.clone();
        }
        let b = &self.frames[(frame + 1).min(last)];
        if t > 1.0 - 1e-9 {
            return b.clone();
        }
        a.iter().zip(b).map(|(a, b)| blend(a, b, t)).collect()
    }

    /// The same clip at another rate: the first and last frames stay, so the rate is the nearest to `fps` that
    /// fits a whole number of frames between them.
    pub fn resample(&self, fps: f64) -> Result<Clip, Error> {
        let grid = self.grid(self.duration(), fps)?;
        Ok(self.sampled(0.0, grid, self.loop_mode))
    }

    /// The part from `from` to `to` seconds. It ends where it is cut; only the whole keeps its loop.
    pub fn trim(&self, from: f64, to: f64) -> Result<Clip, Error> {
        let duration = self.duration();
        let end = to.min(duration);
        let start = from.max(0.0);
        if !(from <= to && start <= end) {
            return Err(Error::EmptyTrim { from, to, duration });
        }
        let whole = start <= 0.0 && end >= duration;
        let loop_mode = if whole {
            self.loop_mode
        } else {
            LoopMode::Clamp
        };
        Ok(self.sampled(start, self.grid(end - start, self.fps)?, loop_mode))
    }

    fn grid(&self, duration: f64, fps: f64) -> Result<Grid, Error> {
        let most = MOST_TRANSFORMS / self.joints.len().max(1);
        Grid::new(duration, fps, most).ok_or(Error::Rate { fps })
    }

    fn sampled(&self, start: f64, grid: Grid, loop_mode: LoopMode) -> Clip {
        let frames = (0..grid.frames)
            .map(|f| self.sample(start + grid.time(f)))
            .collect();
        Clip {
            fps: grid.fps,
            loop_mode,
            frames,
            ..self.clone()
        }
    }
}
