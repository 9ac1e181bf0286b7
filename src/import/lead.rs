//! A first frame that is no part of the motion: many a recording begins with the pose that its rig was bound in.

use super::seam::{difference, extent, moving_places, rms};
use crate::clip::{Problem, Severity};
use nalgebra::Isometry3;

/// The step away from such a frame is so many times the longest step of the motion, …
const OF_LONGEST: f64 = 2.5;
/// … and at least this long (root mean square over the joints), relative to the figure's size.
const LEAST: f64 = 0.02;
/// Fewest frames that tell how long a motion's steps are.
const FEWEST: usize = 10;

/// Whether the motion doesn't go on from the first frame of these world transforms.
pub(super) fn is_apart(world: &[Vec<Isometry3<f64>>]) -> bool {
    if world.len() < FEWEST {
        return false;
    }
    let places = moving_places(world);
    let mut steps = places.windows(2).map(|w| rms(&difference(&w[0], &w[1])));
    let first = steps.next().unwrap_or(0.0);
    let longest = steps.fold(0.0, f64::max);
    longest > 0.0 && first > OF_LONGEST * longest && first > LEAST * extent(&world[0])
}

pub(super) fn problem() -> Problem {
    Problem {
        id: "first-frame-left-out".to_owned(),
        severity: Severity::Note,
        message: "the first frame is a pose from which the motion doesn't go on, so it was left out; keep it with `mimic import --trim 0..`"
            .to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A limb that swings, `start` metres from where the motion begins in the first frame, sampled at any rate.
    fn swing(frames: usize, start: f64) -> Vec<Vec<Isometry3<f64>>> {
        let at = |f: usize| 0.5 * (f as f64 / 20.0).sin() + if f == 0 { start } else { 0.0 };
        let frame = |f| {
            vec![
                Isometry3::identity(),
                Isometry3::translation(at(f), 0.0, 1.0),
            ]
        };
        (0..frames).map(frame).collect()
    }

    #[test]
    fn a_pose_before_the_motion_is_told_from_its_beginning() {
        assert!(is_apart(&swing(60, 0.4)));
        assert!(is_apart(&swing(FEWEST, -0.4)));
        assert!(!is_apart(&swing(60, 0.0)));
        // A quick start, and one that is hardly seen.
        assert!(!is_apart(&swing(60, 0.02)));
        assert!(!is_apart(&swing(FEWEST - 1, 0.4)));
        assert!(!is_apart(&[]));
    }
}
