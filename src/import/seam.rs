//! Whether a clip repeats: whether its end joins its beginning. All thresholds here are chosen.

use crate::clip::{self, carry};
use nalgebra::{Isometry3, Vector3};

/// Largest distance of joints across the seam, relative to the figure's size: root mean square, and of any one joint.
const SEAM_RMS: f64 = 0.02;
const SEAM_MAX: f64 = 0.04;
/// Largest distance across the seam as a fraction of how far the pose changes in the clip: a clip that hardly moves would pass
/// the limits above whatever it does.
const SEAM_OF_RANGE: f64 = 0.2;
/// Change of pose, relative to the figure's size, below which a clip stands still and has nothing to repeat.
const STILL: f64 = 0.002;
/// Velocity across the seam may jump by this many times the median jump between frames within the clip, …
const JUMP_OF_MEDIAN: f64 = 4.0;
/// … or this fraction of the largest one, …
const JUMP_OF_LARGEST: f64 = 0.5;
/// … or this fraction of the clip's root mean square speed.
const JUMP_OF_SPEED: f64 = 0.25;
/// Fewest frames in which a cycle can be seen.
const FEWEST: usize = 5;

/// Positions of joints, metres.
pub(super) type Places = Vec<Vector3<f64>>;

/// Whether the clip with these world transforms repeats: its last frame is its first, moved over the ground.
///
/// The move over the ground, a turn about Z and a horizontal shift, is fitted to all joints. So nobody needs to know which
/// joint is the root: files put the travel on different ones. The remaining distance must be small compared with the figure
/// and with the motion, and velocities must continue across the seam, because a pose that is passed twice in different
/// directions doesn't close a cycle.
pub(crate) fn wraps(world: &[Vec<Isometry3<f64>>]) -> bool {
    let frames = moving_places(world);
    let [first, second, .., before, last] = frames.as_slice() else {
        return false;
    };
    if frames.len() < FEWEST || first.is_empty() {
        return false;
    }
    let height = world.first().map_or(0.0, |frame| extent(frame));
    // The move over the ground that one cycle makes.
    let onto_last = carry(first, last);
    let gaps = gaps(&onto_last, first, last);
    let range = frames
        .iter()
        .map(|frame| rms(&difference(first, frame)))
        .fold(0.0, f64::max);
    // Nothing moves, or the gap is wide for what moves.
    if range < STILL * height || rms(&gaps) > SEAM_OF_RANGE * pose_range(&frames) {
        return false;
    }
    let widest = gaps.iter().map(Vector3::norm).fold(0.0, f64::max);
    // The last pose isn't the first one.
    if rms(&gaps) > SEAM_RMS * height || widest > SEAM_MAX * height {
        return false;
    }
    // The first step of the next cycle, in the heading in which the last one ends.
    let onward: Places = difference(first, second)
        .iter()
        .map(|v| onto_last * v)
        .collect();
    runs_on(&frames, &difference(&difference(before, last), &onward))
}

/// Whether the jump in velocity at the seam (metres per frame) is no more than the clip itself has.
fn runs_on(frames: &[Places], jump: &[Vector3<f64>]) -> bool {
    // Steps are made when they are needed: those of all frames would take as much memory as the frames.
    let step = |pair: &[Places]| difference(&pair[0], &pair[1]);
    // How much velocity changes from frame to frame within the clip is what may happen at the seam, too.
    let change = |three: &[Places]| rms(&difference(&step(&three[..2]), &step(&three[1..])));
    let mut jumps: Vec<f64> = frames.windows(3).map(change).collect();
    jumps.sort_by(f64::total_cmp);
    let median = jumps.get(jumps.len() / 2).copied().unwrap_or(0.0);
    let largest = jumps.last().copied().unwrap_or(0.0);
    let squares = frames.windows(2).map(|pair| rms(&step(pair)).powi(2));
    let speed = (squares.sum::<f64>() / frames.len().saturating_sub(1).max(1) as f64).sqrt();
    // Any one limit is enough: each covers a kind of motion that the others would refuse.
    let limits = [
        JUMP_OF_MEDIAN * median,
        JUMP_OF_LARGEST * largest,
        JUMP_OF_SPEED * speed,
    ];
    limits.iter().any(|limit| rms(jump) <= *limit)
}

/// Positions of the joints that move at all, by more than a ten-thousandth of the figure's size: a file's armature nodes stand
/// still and don't travel with the character.
pub(super) fn moving_places(world: &[Vec<Isometry3<f64>>]) -> Vec<Places> {
    let Some(first) = world.first() else {
        return Vec::new();
    };
    let least = 1e-4 * extent(first);
    let moves = |j: usize| {
        let distance = |frame: &Vec<Isometry3<f64>>| {
            (frame[j].translation.vector - first[j].translation.vector).norm()
        };
        world.iter().any(|frame| distance(frame) > least)
    };
    let moving: Vec<usize> = (0..first.len()).filter(|&j| moves(j)).collect();
    let places = |frame: &Vec<Isometry3<f64>>| {
        moving
            .iter()
            .map(|&j| frame[j].translation.vector)
            .collect()
    };
    world.iter().map(places).collect()
}

/// Longest side of the box around the joints, metres.
pub(super) fn extent(frame: &[Isometry3<f64>]) -> f64 {
    clip::extent(frame.iter().map(|joint| joint.translation.vector))
}

/// The largest distance of a pose from the first one, without the travel.
fn pose_range(frames: &[Places]) -> f64 {
    let Some(first) = frames.first() else {
        return 0.0;
    };
    let away = |frame: &Places| rms(&gaps(&carry(first, frame), first, frame));
    frames.iter().map(away).fold(0.0, f64::max)
}

/// From `b` to `a` moved over the ground, joint by joint.
fn gaps(carry: &Isometry3<f64>, a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Places {
    let place = |p: &Vector3<f64>| carry.rotation * p + carry.translation.vector;
    a.iter().zip(b).map(|(a, b)| place(a) - b).collect()
}

/// From `a` to `b`, joint by joint.
pub(super) fn difference(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Places {
    a.iter().zip(b).map(|(a, b)| b - a).collect()
}

/// Root mean square length.
pub(super) fn rms(vectors: &[Vector3<f64>]) -> f64 {
    let square: f64 = vectors.iter().map(Vector3::norm_squared).sum();
    (square / vectors.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use std::f64::consts::TAU;

    /// A walker of two swinging legs under a root, `turns` of whose cycle take `frames` frames, on a circle of
    /// radius 3 m, with a joint that stays behind at the origin.
    fn walker(frames: usize, turns: f64, lean: f64) -> Vec<Vec<Isometry3<f64>>> {
        let frame = |f: usize| {
            let done = f as f64 / (frames - 1) as f64;
            let swing = (TAU * turns * done).sin();
            let root = Isometry3::from_parts(
                Vector3::new(3.0 * done.sin(), 3.0 - 3.0 * done.cos(), 1.0).into(),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), done),
            );
            let at = |x: f64, y: f64, z: f64| root * Isometry3::translation(x + lean * done, y, z);
            let legs = [at(0.5 * swing, 0.1, -0.9), at(-0.5 * swing, -0.1, -0.9)];
            vec![
                Isometry3::identity(),
                root,
                legs[0],
                legs[1],
                at(0.0, 0.0, 0.7),
            ]
        };
        (0..frames).map(frame).collect()
    }

    #[test]
    fn whole_cycles_wrap_even_along_a_curve() {
        assert!(wraps(&walker(31, 1.0, 0.0)));
        assert!(wraps(&walker(61, 2.0, 0.0)));
    }

    #[test]
    fn parts_of_a_cycle_do_not() {
        for turns in [0.25, 0.8, 0.9, 1.1, 1.5] {
            assert!(!wraps(&walker(31, turns, 0.0)), "{turns}");
        }
    }

    #[test]
    fn a_pose_passed_the_other_way_does_not_close_a_cycle() {
        // After half a swing the legs are where they were, but go back.
        let half = walker(31, 0.5, 0.0);
        assert!(!wraps(&half));
    }

    #[test]
    fn a_changed_pose_does_not_wrap() {
        assert!(wraps(&walker(31, 1.0, 0.02)));
        assert!(!wraps(&walker(31, 1.0, 0.2)));
    }

    #[test]
    fn stills_and_stubs_do_not() {
        let still = walker(31, 1.0, 0.0)[0].clone();
        assert!(!wraps(&vec![still.clone(); 31]));
        assert!(!wraps(&[still.clone(), still]));
        assert!(!wraps(&[]));
        assert!(!wraps(&vec![Vec::new(); 9]));
    }
}
