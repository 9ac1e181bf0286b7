//! Clips whose hips never move get the way back that they lost.
//!
//! Some exports keep every joint's rotation but not the way of the hips: the body turns and bends about a point that is
//! nailed in the air, and its feet float up and slide instead. What is lowest carries the body, so the way can be read
//! off it: the body moves down until its lowest point is on the ground, and over the ground so that what is down stands
//! still. A flight can't be read off, and becomes a crouch.

use super::ground::{Points, bottom};
use crate::clip::Problem;
use crate::humanoid::Slot;
use crate::retarget::limbs::LEGS;
use crate::retarget::setting::Setting;
use crate::retarget::source::Source;
use crate::retarget::way::Way;
use nalgebra::{Vector2, Vector3};

/// Farthest that hips are from where they begin while they are nailed, leg lengths. Chosen: rounding in files is below it, and no
/// recorded person stands as still.
const NAILED: f64 = 1e-3;
/// Farthest that such hips are from the middle of the hip joints, leg lengths: a root on the ground, which rigs without hips have,
/// is farther. Chosen.
const IN_THE_BODY: f64 = 0.5;
/// Shortest way that is worth a warning, leg lengths, and shortest over the ground that is taken at all. Chosen; a body that only
/// waves its arms has lost nothing.
const MOVES: f64 = 0.05;
/// Heights over which a point counts less and less as one that carries, leg lengths. Chosen.
const DOWN: f64 = 0.015;
/// Time after which the way forgets where it was, s: small slides don't add up, and part of a take goes the way that it goes in
/// the whole. Chosen well below the time that a clip keeps around its part.
const HELD: f64 = 0.5;
/// Speed from which on a point that is down counts the less the faster it slides, leg lengths per second. Chosen.
const SLOW: f64 = 0.1;
/// Hardest sideways acceleration of the centre of mass that the ground is asked for, m/s². Chosen.
const HARDEST: f64 = 1.5;
/// Time that weighs what is beyond it beside slides, s: 2.5 m/s² too much counts like a slide of 1 m/s. Chosen
/// (`docs/notebook/nailed-hips.md`).
const YIELDS: f64 = 0.4;
/// How often the accelerations are brought down to it. Chosen.
const GOES: usize = 4;
/// Standard deviation of the window that smooths the way, s: a step from one foot to the other takes about as long. Chosen.
const SMOOTHED: f64 = 0.05;

/// A clip whose hips are nailed.
pub(super) struct Nailed<'a> {
    /// Places of the centre of mass, world, metres.
    pub com: &'a [Vector3<f64>],
    /// Lowest points of all bodies.
    pub points: &'a Points,
    /// Whether the last frame is the first of a cycle that goes on in the same direction.
    pub repeats: bool,
    /// Rate and sizes.
    pub setting: &'a Setting,
}

/// Whether the source's hips never move, and are hips.
pub(super) fn is_nailed(source: &Source, leg: f64) -> bool {
    let Some(hips) = source.points.get(&Slot::Hips).filter(|hips| hips.len() > 1) else {
        return false;
    };
    let joints = |f: usize| LEGS.map(|limb| source.at(limb[0], f));
    let is_hips = |f: usize| match joints(f) {
        [Some(left), Some(right)] => (hips[f] - (left + right) / 2.0).norm() <= IN_THE_BODY * leg,
        _ => false,
    };
    let is_there = |f: usize| (hips[f] - hips[0]).norm() <= NAILED * leg;
    (0..hips.len()).all(|f| is_there(f) && is_hips(f))
}

/// Whether a way leads far enough from where it begins to be told.
pub(super) fn is_seen(way: &[Vector3<f64>], leg: f64) -> bool {
    let leads = |first: &Vector3<f64>| way.iter().any(|place| (place - first).norm() > MOVES * leg);
    way.first().is_some_and(leads)
}

impl Nailed<'_> {
    /// The way up and down, metres, that puts the lowest point to where soles of a body that stands are, at this height.
    pub fn down(&self, ground: f64) -> Vec<Vector3<f64>> {
        // A body without shapes stands on nothing.
        let by = |frame: &Vec<Vector3<f64>>| match bottom(frame) {
            low if low.is_finite() => ground - low,
            _ => 0.0,
        };
        let by: Vec<f64> = self.points.all.iter().map(by).collect();
        let by = smoothed(&by, SMOOTHED * self.setting.fps, self.repeats);
        by.into_iter().map(|z| Vector3::z() * z).collect()
    }

    /// The way over the ground beside this travel, m/s, on which what is down slides little, and the ground can push the centre of
    /// mass as the way asks; metres.
    pub fn over_ground(&self, travel: &Vector3<f64>) -> Vec<Vector3<f64>> {
        let fps = self.setting.fps;
        let last = self.com.len() - 1;
        // The last frame of a cycle is its first.
        let own = if self.repeats { last } else { last + 1 };
        let slides = |f: usize| {
            let pair = [f, (f + 1).min(last)].map(|i| &self.points.all[i]);
            -slide(pair, self.setting) * fps - travel.xy()
        };
        let speeds: Vec<_> = (0..own).map(slides).collect();
        let own_push = |f: usize| self.acceleration(f, own, &|i| self.com[i].xy());
        let way = |yields: f64, pushes: &[Vector2<f64>]| {
            let way = Way {
                repeats: self.repeats,
                fps,
                stay: HELD.powi(-2),
                follow: 1.0,
                push: yields * yields,
            };
            way.solve(&speeds, pushes)
        };
        // First nearly as the feet say; then, where the ground can't push like that, as hard as it can.
        let least: Vec<_> = (0..own).map(|f| -own_push(f)).collect();
        let mut found = way(SMOOTHED, &least);
        for _ in 0..GOES {
            let push = |f: usize| {
                let wanted = self.acceleration(f, own, &|i| found[i] + self.com[i].xy());
                wanted * (HARDEST / wanted.norm().max(HARDEST)) - own_push(f)
            };
            let pushes: Vec<_> = (0..own).map(push).collect();
            found = way(YIELDS, &pushes);
        }
        (0..=last).map(|f| found[f % own].push(0.0)).collect()
    }

    /// Second difference of places at frame `f` of `own` different ones, m/s²; an end that doesn't repeat is its own neighbour.
    fn acceleration(
        &self,
        f: usize,
        own: usize,
        at: &dyn Fn(usize) -> Vector2<f64>,
    ) -> Vector2<f64> {
        let [before, after] = match self.repeats {
            true => [(f + own - 1) % own, (f + 1) % own],
            false => [f.saturating_sub(1), (f + 1).min(own - 1)],
        };
        (at(before) - at(f) * 2.0 + at(after)) * self.setting.fps.powi(2)
    }
}

/// The warning `hips-restored`.
pub(super) fn problem(way: &[Vector3<f64>]) -> Problem {
    let from_first = way.iter().map(|place| place - way[0]);
    let farthest =
        |size: &dyn Fn(Vector3<f64>) -> f64| from_first.clone().map(size).fold(0.0, f64::max);
    let message = format!(
        "the hips stay at one point in this clip, so their path was estimated from what touches the ground: up to {:.0} cm \
         up or down and {:.0} cm sideways; jumps can't be seen and become crouches, so export the clip with the motion of its \
         hips if you can",
        farthest(&|p| p.z.abs()) * 100.0,
        farthest(&|p| p.xy().norm()) * 100.0
    );
    Problem::warning("hips-restored", message)
}

/// How far what is down slides from a frame to the next, metres over the ground: the mean of all points, of which one counts the
/// less the higher it is above the lowest in either frame, and the faster it slides: one foot that stands is enough.
fn slide(pair: [&Vec<Vector3<f64>>; 2], setting: &Setting) -> Vector2<f64> {
    let low = pair.map(|points| bottom(points));
    let (mut sum, mut weights) = (Vector2::zeros(), 0.0);
    for (before, after) in pair[0].iter().zip(pair[1]) {
        let height = (before.z - low[0]).max(after.z - low[1]);
        let step = (after - before).xy();
        let speed = step.norm() * setting.fps;
        let weight = (-height / (DOWN * setting.leg)).exp() / (speed / setting.leg + SLOW);
        sum += step * weight;
        weights += weight;
    }
    sum / f64::max(weights, f64::MIN_POSITIVE)
}

/// A path smoothed by a Gaussian window of this standard deviation, frames. Beyond its ends a cycle goes on, and any other path
/// stays.
fn smoothed(path: &[f64], deviation: f64, repeats: bool) -> Vec<f64> {
    let last = path.len() as i64 - 1;
    let at = |index: i64| match repeats && last > 0 {
        true => path[index.rem_euclid(last) as usize],
        false => path[index.clamp(0, last) as usize],
    };
    let reach = (3.0 * deviation).ceil().min(last as f64) as i64;
    let weight = |k: i64| (-0.5 * (k as f64 / deviation.max(1e-9)).powi(2)).exp();
    let whole: f64 = (-reach..=reach).map(weight).sum();
    let smooth = |f: i64| (-reach..=reach).map(|k| at(f + k) * weight(k)).sum::<f64>() / whole;
    (0..=last).map(smooth).collect()
}
