//! A motion between its frames and beyond its ends.

use super::Motion;
use super::velocity::{blend, moved, turned};
use crate::clip::LoopMode;
use crate::skeleton::{GRAVITY, Skeleton};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};

/// How near the acceleration of the centre of mass must be to gravity for the body to be in free fall, m/s². Chosen: a
/// tenth of gravity.
const FREE_FALL: f64 = 1.0;
/// Share of a frame by which two times may differ and count as the same, for rounding.
const SAME: f64 = 1e-6;

/// Where a time falls: between two frames of one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Cycle number: 0 for the first, negative before it.
    pub cycle: i64,
    /// The frame at or before the time.
    pub frame: usize,
    /// The frame after `frame`, at most the last.
    pub next: usize,
    /// How far the time is from `frame` to `next`, from 0 to 1.
    pub blend: f64,
}

impl Motion {
    /// The frames around `time`, seconds. A motion that repeats goes on for ever in both directions; one that ends holds
    /// its first and its last frame. A time that isn't finite counts as 0.
    pub fn moment(&self, time: f64) -> Moment {
        let last = self.qpos.len().saturating_sub(1);
        let position = if time.is_finite() {
            time * self.fps
        } else {
            0.0
        };
        let (cycle, within) = match self.loop_mode {
            LoopMode::Wrap if last > 0 => {
                let period = last as f64;
                let cycle = (position / period).floor();
                (cycle as i64, position - cycle * period)
            }
            _ => (0, position),
        };
        let within = within.clamp(0.0, last as f64);
        let frame = (within as usize).min(last);
        Moment {
            cycle,
            frame,
            next: (frame + 1).min(last),
            blend: within - frame as f64,
        }
    }

    /// Phase at `time`, seconds: 0 to 1 over the motion or its cycle.
    pub fn sample_phase(&self, time: f64) -> f64 {
        let m = self.moment(time);
        let at = |f: usize| self.tracks.phase.get(f).copied().unwrap_or(0.0);
        at(m.frame) + (at(m.next) - at(m.frame)) * m.blend
    }

    /// `qpos` at `time`, seconds. Later cycles go on from where the ones before have travelled.
    ///
    /// # Panics
    /// If the motion has no frames or was made for another skeleton (see [`Motion::check_skeleton`]).
    pub fn sample_qpos(&self, skeleton: &Skeleton, time: f64) -> Vec<f64> {
        let m = self.moment(time);
        let qpos = skeleton.interpolate(&self.qpos[m.frame], &self.qpos[m.next], m.blend);
        match m.cycle {
            0 => qpos,
            n => moved(&qpos, &self.cycle_offset(n)),
        }
    }

    /// `qvel` at `time`, seconds: linear between frames, and zero where a motion that ends holds a frame.
    ///
    /// # Panics
    /// If the motion has no frames.
    pub fn sample_qvel(&self, time: f64) -> Vec<f64> {
        let held = self.loop_mode == LoopMode::Clamp && !(0.0..=self.duration()).contains(&time);
        if held {
            return vec![0.0; self.qvel[0].len()];
        }
        let m = self.moment(time);
        let qvel = blend(&self.qvel[m.frame], &self.qvel[m.next], m.blend);
        match m.cycle {
            0 => qvel,
            n => turned(&qvel, &self.cycle_offset(n).rotation),
        }
    }

    /// `qvel` at `time`, averaged over the steps from frame to frame within `half` seconds on either side, which takes
    /// noise out of it.
    ///
    /// Near a takeoff or a landing fewer steps count, because the velocity changes there at once. At least one step on
    /// either side does, and then this is [`Motion::sample_qvel`].
    ///
    /// # Panics
    /// If the motion has no frames.
    pub fn mean_qvel(&self, time: f64, half: f64) -> Vec<f64> {
        let most = (half * self.fps).round().max(1.0) as usize;
        let count = (2..=most).rev().find(|n| self.all_alike(time, *n));
        // A frame's velocity is the mean of the steps to it and from it, so the velocities of every other frame hold every
        // step once.
        let count = count.unwrap_or(1);
        let at = |i: usize| {
            let time = time + (2.0 * i as f64 + 1.0 - count as f64) / self.fps;
            match self.loop_mode {
                LoopMode::Wrap => time,
                LoopMode::Clamp => time.clamp(0.0, self.duration()),
            }
        };
        let first = self.sample_qvel(at(0));
        let rest = (1..count).map(|i| (i, self.sample_qvel(at(i))));
        rest.fold(first, |mean, (i, next)| {
            blend(&mean, &next, 1.0 / (i + 1) as f64)
        })
    }

    /// Whether the body is in free fall in all of the `count` frames on either side of `time`, or in none of them.
    fn all_alike(&self, time: f64, count: usize) -> bool {
        let (at, count) = (time * self.fps, count as f64);
        let (first, last) = ((at - count + SAME).floor(), (at + count - SAME).ceil());
        let mut frames = (first as i64..=last as i64).map(|frame| self.is_free_fall(frame));
        let alike = frames.next();
        frames.all(|falls| Some(falls) == alike)
    }

    /// Whether the centre of mass falls freely from the frame before `frame` to the one after, by its second difference.
    fn is_free_fall(&self, frame: i64) -> bool {
        let com = [-1, 0, 1].map(|by| self.com(frame + by));
        let [Some(before), Some(now), Some(after)] = com else {
            return false;
        };
        let acceleration = (before - now * 2.0 + after) * self.fps.powi(2);
        (acceleration + Vector3::z() * GRAVITY).norm() < FREE_FALL
    }

    /// The centre of mass in a frame of any cycle, metres; `None` beyond the ends of a motion that ends.
    fn com(&self, frame: i64) -> Option<Vector3<f64>> {
        let period = self.tracks.com.len().checked_sub(1)? as i64;
        if self.loop_mode == LoopMode::Clamp || period == 0 {
            return self.tracks.com.get(usize::try_from(frame).ok()?).copied();
        }
        let com = self.tracks.com[frame.rem_euclid(period) as usize];
        Some((self.cycle_offset(frame.div_euclid(period)) * Point3::from(com)).coords)
    }

    /// World poses of all bodies at `time`, seconds, in the skeleton's order.
    ///
    /// Each body is interpolated on its own, which costs less than kinematics; between frames, joints come apart a little.
    ///
    /// # Panics
    /// If the motion has no frames.
    pub fn sample_bodies(&self, time: f64) -> Vec<Isometry3<f64>> {
        let m = self.moment(time);
        let offset = self.cycle_offset(m.cycle);
        let pairs = self.bodies[m.frame].iter().zip(&self.bodies[m.next]);
        pairs
            .map(|(a, b)| {
                let shift = a.translation.vector.lerp(&b.translation.vector, m.blend);
                let turn = (a.rotation.inverse() * b.rotation).powf(m.blend);
                offset * Isometry3::from_parts(Translation3::from(shift), a.rotation * turn)
            })
            .collect()
    }

    /// Whether contact body number `c` stands at `time`, seconds: as in the nearer frame.
    pub fn sample_contact(&self, c: usize, time: f64) -> bool {
        let m = self.moment(time);
        let frame = if m.blend < 0.5 { m.frame } else { m.next };
        let row = self.tracks.contact.get(frame);
        row.and_then(|r| r.get(c)).copied().unwrap_or(false)
    }
}
