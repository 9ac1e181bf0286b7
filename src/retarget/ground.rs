//! How high the ground is. The file's z = 0 is believed as long as the feet stand on it; a clip in which they don't
//! come down (a cartwheel's middle, a flight) must not be set on them.

use crate::clip::LoopMode;
use crate::motion::contact;
use nalgebra::Vector3;

/// The ground in the scaled source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ground {
    /// Its height, metres.
    pub floor: f64,
    /// How much higher than the source's soles the skeleton's are when the ankles are where the source has them.
    pub lift: f64,
}

/// Stances this near to where they are expected don't move it, leg lengths: that is the noise of a recording.
const NOISE: f64 = 0.025;
/// Stances further from the file's z = 0 say that the ground is elsewhere, leg lengths.
const ELSEWHERE: f64 = 0.12;
/// Height up to which feet at rest are taken to stand on z = 0, leg lengths.
const HIGHER: f64 = 0.07;
/// Height of the lowest point of a clip without stances that may be a flight, leg lengths.
const FLIGHT: f64 = 1.5;
/// How far below the ball of the foot the tip of one without toes is when the source stands on its toes, leg lengths: what is
/// tried.
const TIPTOE: [f64; 3] = [0.0, 0.04, 0.08];
const MUCH_LONGER: f64 = 1.5;
/// Steps in which an unknown lift is told, so that the same rig gets the same in a longer or shorter clip, metres.
const STEP: f64 = 0.01;
/// Share of the frames in which something may be below the lowest point.
const QUANTILE: usize = 20;
/// Time that something has to stand to count, s.
const LONG_ENOUGH: f64 = 0.1;

/// Lowest points of feet and of the whole body, `[f][point]`, world, metres.
pub(super) struct Points {
    pub soles: Vec<Vec<Vector3<f64>>>,
    pub all: Vec<Vec<Vector3<f64>>>,
}

/// Finds the ground. `lift` is known where the source's rest pose stands on z = 0.
pub(super) fn find(
    points: &Points,
    lift: Option<f64>,
    fps: f64,
    leg: f64,
    loop_mode: LoopMode,
) -> Ground {
    let expected = lift.unwrap_or(0.0);
    let trusted = Ground {
        floor: 0.0,
        lift: expected,
    };
    let lowest = low(&points.all);
    // A rig of unknown soles may stand a little higher.
    let feet = most_stood_on(&points.soles, expected, fps, leg, loop_mode).or_else(|| {
        let higher = expected + HIGHER * leg;
        standing(&points.soles, higher, fps, leg, loop_mode).map(|(_, level)| level)
    });
    let off = match feet {
        Some(level) if (level - expected).abs() <= NOISE * leg => return trusted,
        Some(level) if (level - expected).abs() <= ELSEWHERE * leg => {
            return Ground {
                floor: 0.0,
                lift: (level / STEP).round() * STEP,
            };
        }
        Some(_) => true,
        None => !(-ELSEWHERE * leg..FLIGHT * leg).contains(&(lowest - expected)),
    };
    // Wherever the body as a whole stands, or else its lowest point.
    let elsewhere = |floor: f64| Ground { floor, lift: 0.0 };
    let low_stance = most_stood_on(&points.all, lowest, fps, leg, loop_mode);
    match low_stance {
        Some(level) if off || level - expected > ELSEWHERE * leg => elsewhere(level),
        None if off => elsewhere(lowest),
        _ => trusted,
    }
}

/// The level at or a little above `lowest` on which the points stand: a higher one only if they do so much longer there, for
/// the tip of a foot on its toes is below its ball.
fn most_stood_on(
    points: &[Vec<Vector3<f64>>],
    lowest: f64,
    fps: f64,
    leg: f64,
    loop_mode: LoopMode,
) -> Option<f64> {
    let levels = TIPTOE.into_iter().filter_map(|higher| {
        let floor = lowest + higher * leg;
        standing(points, floor, fps, leg, loop_mode)
    });
    let longest = levels.reduce(|best, next| {
        let longer = next.0 as f64 > MUCH_LONGER * best.0 as f64;
        if longer { next } else { best }
    });
    longest.map(|(_, level)| level)
}

/// The lowest point of all, but for a few frames.
fn low(points: &[Vec<Vector3<f64>>]) -> f64 {
    let mut heights: Vec<f64> = points.iter().map(|frame| bottom(frame)).collect();
    heights.retain(|h| h.is_finite());
    heights.sort_by(f64::total_cmp);
    heights
        .get(heights.len() / QUANTILE)
        .copied()
        .unwrap_or(0.0)
}

fn bottom(points: &[Vector3<f64>]) -> f64 {
    points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min)
}

/// For how many frames something stands at or below `floor`, and a little less than the median of the lowest points in them:
/// a foot that lies is higher.
fn standing(
    points: &[Vec<Vector3<f64>>],
    floor: f64,
    fps: f64,
    leg: f64,
    loop_mode: LoopMode,
) -> Option<(usize, f64)> {
    let stands = contact::detect_above(points, floor, fps, leg, loop_mode);
    let frames = points.iter().zip(stands).filter(|(_, stands)| *stands);
    let mut heights: Vec<f64> = frames.map(|(frame, _)| bottom(frame)).collect();
    heights.sort_by(f64::total_cmp);
    let enough = heights.len() as f64 >= (LONG_ENOUGH * fps).max(2.0);
    let level = heights.get(heights.len() * 2 / 5).filter(|_| enough)?;
    Some((heights.len(), *level))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEG: f64 = 0.9;
    const FPS: f64 = 30.0;

    fn ground(soles: impl Fn(f64) -> f64, all: impl Fn(f64) -> f64, lift: Option<f64>) -> Ground {
        let path = |height: &dyn Fn(f64) -> f64| -> Vec<Vec<Vector3<f64>>> {
            let at = |f: i32| vec![Vector3::new(0.0, 0.0, height(f64::from(f) / FPS))];
            (0..30).map(at).collect()
        };
        let points = Points {
            soles: path(&soles),
            all: path(&|t| all(t).min(soles(t))),
        };
        find(&points, lift, FPS, LEG, LoopMode::Clamp)
    }

    #[test]
    fn the_files_ground_is_believed_while_feet_stand_near_it() {
        let here = |lift: f64| Ground { floor: 0.0, lift };
        assert_eq!(ground(|_| 0.012, |_| 0.5, None), here(0.0));
        assert_eq!(ground(|_| 0.06, |_| 0.5, Some(0.05)), here(0.05));
        let told = ground(|_| 0.062, |_| 0.5, None);
        assert!((told.lift - 0.06).abs() < 1e-12 && told.floor == 0.0);
    }

    /// Feet at rest in the air above hands on the ground; nothing at rest at all.
    #[test]
    fn feet_in_the_air_are_no_ground() {
        let here = Ground {
            floor: 0.0,
            lift: 0.0,
        };
        assert_eq!(ground(|_| 0.7, |_| 0.01, None), here);
        let flying = |t: f64| 0.3 + 4.9 * t * (1.0 - t);
        assert_eq!(ground(flying, |_| 2.0, None), here);
    }

    #[test]
    fn a_file_without_a_ground_gets_the_bodys_lowest_stance() {
        for height in [-0.5, 0.4, 3.0] {
            let found = ground(|_| height, |_| height + 0.5, None);
            assert_eq!((found.floor, found.lift), (height, 0.0));
        }
        let on_toes = |t: f64| if t < 0.35 { 2.95 } else { 3.0 };
        assert_eq!(ground(on_toes, |_| 4.0, None).floor, 3.0);
        let lying = ground(|_| 2.0, |_| -1.0, None);
        assert_eq!((lying.floor, lying.lift), (-1.0, 0.0));
    }
}
