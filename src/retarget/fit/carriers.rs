//! What carries the body goes down to the ground: a knee, a forearm, a shoulder, or a hand that slides.
//!
//! Feet and hands that stand still were found before the fit. Whatever else gives the force that the motion needs is known only
//! once there is a trajectory. In a source of other proportions such a body floats by some centimetres, or the floor of the
//! whole clip does. The lowest points of a body that carries are led down to the ground, and what leads to it and away from it
//! follows smoothly.

use super::Fit;
use crate::clip::LoopMode;
use crate::humanoid::Slot;
use crate::motion::{self, Path};
use crate::retarget::anchor::Anchor;
use crate::retarget::fade::smoothstep;
use crate::retarget::model::Model;
use nalgebra::Vector3;

/// Height above the ground up to which a body may carry, leg lengths: hands, and all others. Chosen: hands of a fast flair were
/// 12 cm above their floor.
const HAND: f64 = 0.15;
const TRUNK: f64 = 0.1;
/// Time around its stance in which a foot or hand carries nothing else, s: the force of a landing is smeared over as much.
const NEAR_STANCE: f64 = 0.1;
/// Time in which a body goes down before it carries and comes up after it, s. Chosen: about what a limb takes.
const FADE: f64 = 0.25;
/// Height above a body's lowest point up to which its points go down with it, metres. Chosen.
const LEVEL: f64 = 0.02;
/// Force upwards from which on a motion in the air hovers, as a share of the weight, and height of its lowest point up to which
/// it is put down, leg lengths. Chosen: clips of games whose hips keep their height hover by 10 cm with bent knees.
const NEEDS: f64 = 0.75;
const HOVERS: f64 = 0.2;
/// Vertical speed of both feet below which it hovers, m/s.
const PASSES: f64 = 1.0;
/// Heights that are left alone, metres.
const STILL: f64 = 0.002;

/// The anchors of `fit`, and those of the bodies that carry the trajectory `frames` beside them; `None` where that changes
/// nothing.
pub(super) fn anchors(fit: &Fit, frames: &[Vec<f64>]) -> Option<Vec<Vec<Anchor>>> {
    let bodies = fit.model.skeleton.contact_bodies();
    let carries = carries(fit, frames, &bodies);
    let mut anchors = fit.anchors.to_vec();
    let mut is_changed = false;
    let poses: Vec<_> = frames
        .iter()
        .map(|q| fit.model.skeleton.forward(q))
        .collect();
    for (c, &body) in bodies.iter().enumerate() {
        let track: Vec<bool> = carries.iter().map(|row| row[c]).collect();
        let lowest = |f: usize| fit.model.skeleton.lowest_point_of(&poses[f], &[body]);
        let drops = drops(&track, lowest, FADE * fit.fps, fit.cycle.is_some());
        for (f, drop) in drops.into_iter().enumerate() {
            // What stands is on the ground already.
            let drop = drop.filter(|_| !stands(fit.model, &fit.anchors[f], body));
            let Some(Drop { by, hold }) = drop else {
                continue;
            };
            let floor = lowest(f);
            let by = by.max(-floor);
            is_changed |= by.abs() > STILL;
            for (k, point) in fit.model.contact_points.iter().enumerate() {
                let at = point.place(&poses[f]);
                if point.body == body && at.z - point.radius < floor + LEVEL {
                    anchors[f].push(Anchor {
                        point: k,
                        at: at + Vector3::z() * by,
                        weight: f64::from(u8::from(track[f])),
                        hold,
                        is_level: true,
                    });
                }
            }
        }
    }
    // The last frame of a cycle is its first.
    if anchors.len() > frames.len() {
        anchors[frames.len()] = anchors[0].clone();
    }
    is_changed.then_some(anchors)
}

/// `[f][c]`: whether `bodies[c]` carries in frame `f` without standing.
fn carries(fit: &Fit, frames: &[Vec<f64>], bodies: &[usize]) -> Vec<Vec<bool>> {
    let skeleton = fit.model.skeleton;
    let whole = fit.whole_cycle(frames.to_vec());
    let path = Path {
        qpos: &whole,
        fps: fit.fps,
        cycle: fit.cycle,
    };
    let leg = skeleton.leg_length();
    let is_in = |slots: [Slot; 2], body: usize| {
        let mut found = slots.iter().filter_map(|slot| skeleton.slots.get(slot));
        found.any(|b| *b == body)
    };
    let feet = [Slot::LeftFoot, Slot::RightFoot];
    let hands = [Slot::LeftHand, Slot::RightHand];
    let reach = |body: &usize| match is_in(hands, *body) {
        true => HAND * leg,
        false => TRUNK * leg,
    };
    let reach: Vec<f64> = bodies.iter().map(reach).collect();
    let found = motion::carrying(skeleton, &path, bodies, &reach);
    let mut carries = found.by;
    carries.truncate(frames.len());
    let near = (NEAR_STANCE * fit.fps).round() as usize;
    for (c, &body) in bodies.iter().enumerate() {
        let stands: Vec<bool> = (fit.anchors.iter())
            .map(|frame| stands(fit.model, frame, body))
            .collect();
        let [before, after] = nearest(&stands[..frames.len()], fit.cycle.is_some());
        for f in 0..frames.len() {
            let mut around = [before[f], after[f]].into_iter().flatten();
            // Feet carry as well, but aren't led down: those that do stand, or leave the ground and come back to it.
            carries[f][c] &= !is_in(feet, body) && around.all(|(away, _)| away > near);
        }
    }
    put_down(fit, frames, bodies, &found.need, &mut carries);
    carries
}

/// Lets the lowest feet carry where nothing does and the motion needs most of its weight: it hovers, and no flight does. A
/// jump at less than half its speed hovers, too.
fn put_down(
    fit: &Fit,
    frames: &[Vec<f64>],
    bodies: &[usize],
    need: &[f64],
    carries: &mut [Vec<bool>],
) {
    let skeleton = fit.model.skeleton;
    let feet = [Slot::LeftFoot, Slot::RightFoot].map(|slot| skeleton.slots.get(&slot).copied());
    let is_foot = |c: &usize| feet.contains(&Some(bodies[*c]));
    let feet: Vec<usize> = (0..bodies.len()).filter(is_foot).collect();
    let heights = |q: &Vec<f64>| -> Vec<f64> {
        let poses = skeleton.forward(q);
        let height = |c: &usize| skeleton.lowest_point_of(&poses, &[bodies[*c]]);
        feet.iter().map(height).collect()
    };
    let heights: Vec<Vec<f64>> = frames.iter().map(heights).collect();
    let lowest = |f: usize| heights[f].iter().copied().fold(f64::INFINITY, f64::min);
    let stands = |f: usize| fit.anchors[f].iter().any(Anchor::is_contact);
    // A foot that takes off or lands passes these heights, and the force of the push is smeared over the frames beside it.
    let last = frames.len() - 1;
    let rests = |f: usize| {
        let (before, after) = (&heights[f.saturating_sub(1)], &heights[(f + 1).min(last)]);
        let speeds = before.iter().zip(after);
        let mut speeds = speeds.map(|(a, b)| (b - a).abs() * fit.fps / 2.0);
        speeds.all(|speed| speed < PASSES)
    };
    let hovers = |f: usize| {
        let near = lowest(f) < HOVERS * skeleton.leg_length();
        near && rests(f) && need[f] > NEEDS && !carries[f].contains(&true) && !stands(f)
    };
    let hovers: Vec<bool> = (0..frames.len()).map(hovers).collect();
    let loop_mode = match fit.cycle {
        Some(_) => LoopMode::Wrap,
        None => LoopMode::Clamp,
    };
    let hovers = motion::lasting(&hovers, fit.fps, loop_mode);
    for f in (0..frames.len()).filter(|f| hovers[*f]) {
        for (c, height) in feet.iter().zip(&heights[f]) {
            carries[f][*c] |= *height < lowest(f) + LEVEL;
        }
    }
}

/// Whether a body stands on one of these anchors.
pub(super) fn stands(model: &Model, anchors: &[Anchor], body: usize) -> bool {
    let mut on = anchors.iter();
    on.any(|a| a.is_contact() && model.contact_points[a.point].body == body)
}

/// How far a body goes down in a frame, metres upwards, and how firmly it is held there, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Drop {
    by: f64,
    hold: f64,
}

/// The way of a body to the ground, by frame: all of it in frames in which it carries, and the more of it the nearer such
/// frames are, up to `fade` frames away. `lowest` is the height of its lowest point.
fn drops(
    carries: &[bool],
    lowest: impl Fn(usize) -> f64,
    fade: f64,
    repeats: bool,
) -> Vec<Option<Drop>> {
    let [before, after] = nearest(carries, repeats);
    let part = |found: Option<Near>| {
        let hold = |away: usize| smoothstep((1.0 - away as f64 / fade).max(0.0));
        found.map_or((0.0, 0.0), |(away, f)| (hold(away), -lowest(f)))
    };
    let drop = |(before, after): (Option<Near>, Option<Near>)| {
        let ((a, before), (b, after)) = (part(before), part(after));
        // Between two that are near, both count in proportion; beside one alone, the rest is no way.
        let by = (before * a + after * b) / (a + b).max(1.0);
        let hold = a.max(b);
        (hold > 0.0).then_some(Drop { by, hold })
    };
    before.into_iter().zip(after).map(drop).collect()
}

/// A flagged frame: how many frames away it is, and which it is.
type Near = (usize, usize);

/// For every frame, the nearest flagged one before it and after it, itself included.
fn nearest(flags: &[bool], repeats: bool) -> [Vec<Option<Near>>; 2] {
    let count = flags.len();
    let rounds = if repeats { 2 } else { 1 };
    // Going through the frames in one direction, and twice through those of a cycle: what precedes the first are the last.
    let since = |at: &dyn Fn(usize) -> usize| {
        let mut last: Option<Near> = None;
        let mut found = vec![None; count];
        for step in 0..rounds * count {
            let f = at(step % count);
            last = match flags[f] {
                true => Some((0, f)),
                false => last.map(|(away, from)| (away + 1, from)),
            };
            found[f] = last;
        }
        found
    };
    [since(&|i| i), since(&|i| count - 1 - i)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_goes_down_before_it_carries() {
        let carries: Vec<bool> = (0..20).map(|f| (8..10).contains(&f)).collect();
        let found = drops(&carries, |f| 0.05 + 0.001 * f as f64, 4.0, false);
        let by = |f: usize| found[f].map_or(0.0, |drop| drop.by);
        assert!((by(8) + 0.058).abs() < 1e-12 && (by(9) + 0.059).abs() < 1e-12);
        assert!((by(6) + 0.058 * 0.5).abs() < 1e-12 && by(4) == 0.0);
        assert_eq!(found[8].map(|drop| drop.hold), Some(1.0));
        assert_eq!(found[15], None);
    }

    #[test]
    fn the_nearest_frame_may_be_beyond_the_seam() {
        let mut flags = vec![false; 10];
        flags[9] = true;
        let [before, after] = nearest(&flags, true);
        assert_eq!((before[1], after[1]), (Some((2, 9)), Some((8, 9))));
        let [before, after] = nearest(&flags, false);
        assert_eq!((before[1], after[1]), (None, Some((8, 9))));
    }
}
