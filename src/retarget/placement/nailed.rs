//! Clips whose hips never move get the way back that they lost.
//!
//! Some exports keep every joint's rotation but not the way of the hips: the body turns and bends about a point that is
//! nailed in the air, and its feet float up and slide instead. What is lowest carries the body, so the way can be read
//! off it: the body moves down until its lowest point is on the ground, and over the ground so that what is down stands
//! still. A flight can't be read off, and becomes a crouch.

use super::ground::Points;
use crate::clip::{LoopMode, Problem};
use crate::retarget::setting::Setting;
use crate::retarget::way::Way;
use nalgebra::{Vector2, Vector3};

/// Farthest that hips are from their mean while they are nailed, leg lengths. Chosen: rounding in files is below it, and no
/// recorded person stands as still.
const NAILED: f64 = 1e-3;
/// Least that the lowest point rises or slides in such a clip, leg lengths. Chosen; a body that only waves its arms has lost
/// nothing.
const MOVES: f64 = 0.05;
/// Heights over which a point counts less and less as one that carries, leg lengths. Chosen.
const DOWN: f64 = 0.015;
/// Time after which the way forgets where it was, s, so that small slides don't add up. Chosen.
const HELD: f64 = 5.0;
/// Speed from which on a point that is down counts the less the faster it slides, leg lengths per second. Chosen.
const SLOW: f64 = 0.1;
/// Hardest sideways acceleration of the centre of mass that the ground is asked for, m/s². Chosen: that of a brisk
/// step, for a quarter of gravity needs the centre of mass well beside the feet.
const HARDEST: f64 = 1.5;
/// Time that weighs what is beyond it beside slides, s: 2.5 m/s² too much counts like a slide of 1 m/s. Chosen; with half of it,
/// KayKit's two-handed spin survived 91 instead of 94 % of the time.
const YIELDS: f64 = 0.4;
/// How often the accelerations are brought down to it. Chosen.
const GOES: usize = 4;
/// Standard deviation of the window that smooths the way, s: a step from one foot to the other takes about as long. Chosen.
const SMOOTHED: f64 = 0.05;

/// How every frame is shifted, metres; `None` for a clip whose hips move, or whose feet stand. `hips` and `com` are the places of
/// hips and centre of mass.
pub(super) fn way(
    hips: &[Vector3<f64>],
    com: &[Vector3<f64>],
    points: &Points,
    setting: &Setting,
) -> Option<Vec<Vector3<f64>>> {
    let Setting { fps, leg, .. } = *setting;
    let first = hips.first()?;
    let is_nailed = hips.iter().all(|p| (p - first).norm() <= NAILED * leg);
    if !is_nailed || points.all.iter().any(Vec::is_empty) {
        return None;
    }
    let repeats = setting.loop_mode == LoopMode::Wrap;
    let mut way = over_ground(com, points, setting);
    let lowest: Vec<f64> = points.all.iter().map(|frame| bottom(frame)).collect();
    let ground = lowest.iter().copied().fold(f64::INFINITY, f64::min);
    let down: Vec<f64> = lowest.iter().map(|low| ground - low).collect();
    let down = smoothed(&down, SMOOTHED * fps, repeats);
    way.iter_mut().zip(down).for_each(|(place, z)| place.z = z);
    let moves = way.iter().any(|place| place.norm() > MOVES * leg);
    moves.then_some(way)
}

/// The way over the ground on which what is down slides little, and the ground can push the centre of mass as the way asks.
fn over_ground(com: &[Vector3<f64>], points: &Points, setting: &Setting) -> Vec<Vector3<f64>> {
    let fps = setting.fps;
    let repeats = setting.loop_mode == LoopMode::Wrap && com.len() > 1;
    // The last frame of a cycle is its first.
    let own = if repeats { com.len() - 1 } else { com.len() };
    let wraps = |f: usize| if repeats { f % own } else { f.min(own - 1) };
    let pair = |f: usize| [wraps(f), wraps(f + 1)].map(|i| &points.all[i]);
    let speeds: Vec<_> = (0..own).map(|f| -slide(pair(f), setting) * fps).collect();
    let acceleration = |at: &dyn Fn(usize) -> Vector2<f64>, f: usize| {
        let before = if repeats {
            f + own - 1
        } else {
            f.saturating_sub(1)
        };
        let [a, b, c] = [before, f, f + 1].map(|i| at(wraps(i)));
        (a - b * 2.0 + c) * (fps * fps)
    };
    let own_push = |f: usize| acceleration(&|i| com[i].xy(), f);
    let way = |yields: f64, pushes: &[Vector2<f64>]| {
        let way = Way {
            repeats,
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
            let wanted = acceleration(&|i| found[i] + com[i].xy(), f);
            wanted * (HARDEST / wanted.norm().max(HARDEST)) - own_push(f)
        };
        let pushes: Vec<_> = (0..own).map(push).collect();
        found = way(YIELDS, &pushes);
    }
    (0..com.len()).map(|f| found[wraps(f)].push(0.0)).collect()
}

/// The note `hips-restored`.
pub(super) fn problem(way: &[Vector3<f64>]) -> Problem {
    let farthest = |size: &dyn Fn(&Vector3<f64>) -> f64| way.iter().map(size).fold(0.0, f64::max);
    let message = format!(
        "the hips don't move in this clip, so their way was read off what stands on the ground: up to {:.0} cm up and \
         down and {:.0} cm over the ground",
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

/// Height of the lowest of these points, metres.
fn bottom(points: &[Vector3<f64>]) -> f64 {
    points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min)
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
