//! A first frame apart from the motion: many recordings begin with one frame of the pose that their rig was bound in.

use super::seam::{difference, extent, moving_places, rms};
use crate::clip::Problem;
use nalgebra::Isometry3;

/// The step away from such a frame is longer than this many times the longest step between later frames. Chosen: a
/// motion gathers speed over several frames, so its first step isn't the longest by far.
const OF_LONGEST: f64 = 2.5;
/// The step (root mean square over the joints) is also longer than this fraction of the figure's size. Chosen: 3 to 4 cm in a
/// person; what is smaller isn't seen, and a take that hardly moves could begin with it.
const LEAST: f64 = 0.02;
/// Fewest frames that tell how long a motion's steps are. Chosen.
const FEWEST: usize = 10;

/// Whether the first frame of these world transforms is a pose apart from the motion after it.
pub(super) fn is_apart(world: &[Vec<Isometry3<f64>>]) -> bool {
    if world.len() < FEWEST {
        return false;
    }
    let places = moving_places(world);
    // Step lengths, root mean square over the joints that move.
    let mut steps = places.windows(2).map(|w| rms(&difference(&w[0], &w[1])));
    let first = steps.next().unwrap_or(0.0);
    let longest = steps.fold(0.0, f64::max);
    longest > 0.0 && first > OF_LONGEST * longest && first > LEAST * extent(&world[0])
}

pub(super) fn problem() -> Problem {
    Problem::note(
        "first-frame-left-out",
        "the first frame is a pose apart from the motion and was left out; keep it by trimming from 0 s",
    )
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
