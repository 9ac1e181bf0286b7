//! Clips that walk on the spot get their travel back.
//!
//! A game moves such a character itself, but a simulated one has to push against the ground. While a foot is down it slides
//! backward at the speed of the travel that was taken out, so that speed can be read off the feet.

use crate::clip::{LoopMode, Problem};
use crate::retarget::end_effector::soles;
use crate::retarget::goals::Goals;
use crate::retarget::model::Model;
use crate::retarget::setting::Setting;
use nalgebra::Vector3;

// All chosen, so that the walks and runs on the spot of the clips at hand get their travel, and dances and kicks get none.

/// Farthest that the root of a clip on the spot ends from where it starts, leg lengths.
const ON_THE_SPOT: f64 = 0.1;
/// Farthest that it is from its start on the way, leg lengths.
const STRAYS: f64 = 0.25;
/// Height above the clip's lowest point below which a foot is down, leg lengths.
const DOWN: f64 = 0.04;
/// Slowest travel that is restored, leg lengths per second. A slower slide is a flaw of the clip.
const SLOWEST: f64 = 0.4;
/// The same for a gait whose hips are nailed, which must have lost its travel.
const SLOWEST_NAILED: f64 = 0.15;
/// How near to the median velocity one has to be to agree with it, relative to it …
const AGREES: f64 = 0.5;
/// … and the share of the frames with a foot down that have to agree.
const MAJORITY: f64 = 0.6;
/// Share of the frames in which each foot is the lower one at least, if the clip doesn't repeat: a gait, and not a single
/// slide. One in this many frames.
const ALTERNATES: usize = 5;
/// How often the lower foot changes at least in a gait whose hips are nailed, among frames in which the feet's heights differ by
/// more than this, leg lengths. All gaits of the clips at hand change it twice or more, blows and sitting down at most once.
const CHANGES: usize = 2;
const LEVEL: f64 = 0.02;

/// The velocity that a clip on the spot lacks, m/s, if its feet slide steadily while they are down. Of a clip whose hips are
/// nailed, slower slides are believed as well, if it is a gait.
pub(super) fn missing(
    goals: &Goals,
    model: &Model,
    setting: &Setting,
    is_nailed: bool,
) -> Option<Vector3<f64>> {
    let Setting {
        fps,
        leg,
        loop_mode,
        ..
    } = *setting;
    let last = goals.frames().checked_sub(1)?;
    let away = |f: usize| (goals.root(f) - goals.root(0)).xy().norm();
    // A clip that goes somewhere has its travel, even if it comes back.
    let strays = (0..=last).any(|f| away(f) > STRAYS * leg);
    if strays || away(last) > ON_THE_SPOT * leg {
        return None;
    }
    let soles = soles(model, goals);
    // A cycle on the spot is a gait. A clip that ends may be a single slide, and so may a blow whose hips are nailed: there both
    // feet have to take turns.
    // A step, and sitting down, changes the lower foot once.
    let is_gait = alternate(&soles) && (!is_nailed || changes(&soles, leg, loop_mode) >= CHANGES);
    let may_be_a_slide = loop_mode == LoopMode::Clamp || is_nailed;
    if may_be_a_slide && !is_gait {
        return None;
    }
    let slowest = match is_nailed {
        true => SLOWEST_NAILED,
        false => SLOWEST,
    };
    Some(-sliding(&soles, fps, leg, slowest)?)
}

/// The warning `travel-restored`.
pub(super) fn problem(velocity: &Vector3<f64>) -> Problem {
    let message = format!(
        "the clip moves on the spot and its feet slide; travel of {:.2} m/s was added, with which they stand still",
        velocity.norm()
    );
    Problem::warning("travel-restored", message)
}

/// Whether each foot is the lower one in many frames.
fn alternate(soles: &[Vec<Vector3<f64>>]) -> bool {
    let left = |frame: &&Vec<Vector3<f64>>| left_above_right(frame) < 0.0;
    let count = soles.iter().filter(left).count();
    let least = soles.len() / ALTERNATES;
    (least..=soles.len() - least).contains(&count) && least > 0
}

/// How often the lower foot changes, among frames in which one is clearly lower.
fn changes(soles: &[Vec<Vector3<f64>>], leg: f64, loop_mode: LoopMode) -> usize {
    let higher = soles.iter().map(|frame| left_above_right(frame));
    let clear = higher.filter(|by| by.abs() > LEVEL * leg);
    let lower: Vec<bool> = clear.map(|by| by < 0.0).collect();
    let changes = lower.windows(2).filter(|pair| pair[0] != pair[1]).count();
    // The cycle goes on with its first frame.
    let over_seam = loop_mode == LoopMode::Wrap && lower.first() != lower.last();
    changes + usize::from(over_seam)
}

/// How much higher the left foot is than the right one, metres. The left foot's points are in the frame's first half.
fn left_above_right(frame: &[Vector3<f64>]) -> f64 {
    let lowest = |points: &[Vector3<f64>]| points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let (left, right) = frame.split_at(frame.len() / 2);
    lowest(left) - lowest(right)
}

/// Velocity at which feet slide while they are down, m/s; `None` if they slide slowly or unsteadily. The median finds what most
/// frames agree on, and those frames' mean is the result.
fn sliding(soles: &[Vec<Vector3<f64>>], fps: f64, leg: f64, slowest: f64) -> Option<Vector3<f64>> {
    let lowest = |points: &[Vector3<f64>]| {
        (0..points.len()).min_by(|a, b| points[*a].z.total_cmp(&points[*b].z))
    };
    let floor = soles
        .iter()
        .flatten()
        .map(|p| p.z)
        .fold(f64::INFINITY, f64::min);
    let mut velocities: Vec<Vector3<f64>> = Vec::new();
    for pair in soles.windows(2) {
        // The foot's lowest point is the one on the ground.
        let point = lowest(&pair[0])?;
        if pair[0][point].z < floor + DOWN * leg {
            let v = (pair[1][point] - pair[0][point]) * fps;
            velocities.push(Vector3::new(v.x, v.y, 0.0));
        }
    }
    let middle = Vector3::new(median(&velocities, 0)?, median(&velocities, 1)?, 0.0);
    let speed = middle.norm();
    if speed < slowest * leg {
        return None;
    }
    // Frames in which a foot comes down or leaves slide otherwise; most have to agree.
    let agreeing: Vec<Vector3<f64>> = velocities
        .iter()
        .filter(|v| (*v - middle).norm() < AGREES * speed)
        .copied()
        .collect();
    let steady = agreeing.len() as f64 >= MAJORITY * velocities.len() as f64;
    steady.then(|| agreeing.iter().sum::<Vector3<f64>>() / agreeing.len() as f64)
}

/// The median of the vectors' coordinates along an axis.
fn median(vectors: &[Vector3<f64>], axis: usize) -> Option<f64> {
    let mut values: Vec<f64> = vectors.iter().map(|v| v[axis]).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames in which the left foot is so much higher than the right one, metres.
    fn soles(left_above: &[f64]) -> Vec<Vec<Vector3<f64>>> {
        let frame = |by: &f64| vec![Vector3::z() * *by, Vector3::zeros()];
        left_above.iter().map(frame).collect()
    }

    #[test]
    fn a_step_changes_the_lower_foot_once_and_a_gait_again_and_again() {
        let changes = |heights: &[f64], mode| changes(&soles(heights), 1.0, mode);
        let step = [0.1, 0.1, 0.01, -0.01, -0.1, -0.1];
        assert_eq!(changes(&step, LoopMode::Clamp), 1);
        // A walk that repeats, cut where the feet change.
        assert_eq!(changes(&step, LoopMode::Wrap), 2);
        // Feet that are nearly level change nothing.
        assert_eq!(changes(&[0.01, -0.01, 0.01, -0.01], LoopMode::Wrap), 0);
    }
}
