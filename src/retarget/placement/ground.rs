//! How high the ground is.
//!
//! The file's z = 0 is believed as long as feet stand near it. A clip in which they don't come down, such as the middle of a
//! cartwheel or a flight, must not be put on its feet. Only where nothing supports z = 0, the ground is where the body as a
//! whole stands.

use crate::motion::contact;
use crate::retarget::setting::Setting;
use nalgebra::Vector3;

/// The ground in the scaled source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ground {
    /// Its height, metres.
    pub floor: f64,
    /// How much higher than the source's soles the skeleton's are when the ankles are where the source has them, metres.
    pub lift: f64,
}

// All chosen over the clips at hand.

/// Farthest from the expected level that feet stand because of a recording's noise, leg lengths.
const NOISE: f64 = 0.025;
/// Distance from the file's z = 0 beyond which a stance says that the ground is elsewhere, leg lengths.
const ELSEWHERE: f64 = 0.12;
/// Height up to which feet at rest are taken to stand on z = 0 though the rig's soles are unknown, leg lengths.
const HIGHER: f64 = 0.07;
/// Height of the lowest point up to which a clip without a stance may be a flight, leg lengths.
const FLIGHT: f64 = 1.5;
/// Heights of the ground above the lowest stance that are tried, leg lengths. When the source stands on its toes, the tip of
/// a foot without toes is below the ball of the foot: a boxer floated by 5 cm.
const TIPTOE: [f64; 3] = [0.0, 0.04, 0.08];
/// How many times as long feet have to stand on a higher level to be believed.
const MUCH_LONGER: f64 = 1.5;
/// An unknown lift is rounded to multiples of this, metres, so that the same rig gets the same lift in a longer or shorter
/// clip.
const STEP: f64 = 0.01;
/// One in this many frames may be below the lowest point: recordings have outliers.
const OUTLIERS: usize = 20;
/// Shortest time that something has to stand to count, s.
const LONG_ENOUGH: f64 = 0.1;
/// The level is this quantile of the heights in stance, a little below the median, for a foot that lies on its side is higher.
const LEVEL: [usize; 2] = [2, 5];

/// Lowest points of the feet and of the whole body, `[f][point]`, world, metres.
pub(super) struct Points {
    /// Of the feet.
    pub soles: Vec<Vec<Vector3<f64>>>,
    /// Of all bodies, the feet's first.
    pub all: Vec<Vec<Vector3<f64>>>,
}

/// Finds the ground. `lift` is known where the source's rest pose stands on z = 0, metres.
pub(super) fn find(points: &Points, lift: Option<f64>, setting: &Setting) -> Ground {
    let leg = setting.leg;
    let expected = lift.unwrap_or(0.0);
    let trusted = Ground {
        floor: 0.0,
        lift: expected,
    };
    let lowest = low(&points.all);
    let feet = most_stood_on(&points.soles, expected, setting).or_else(|| {
        let higher = expected + HIGHER * leg;
        standing(&points.soles, higher, setting).map(|(_, level)| level)
    });
    // Feet near the expected level settle it. Feet far from it, or no stance and a lowest point that no flight explains, say
    // that the file's z = 0 isn't the ground.
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
    // Then the ground is where the body as a whole stands, or its lowest point. The same counts where all of the body stands
    // far above z = 0, even if no foot says so.
    let elsewhere = |floor: f64| Ground { floor, lift: 0.0 };
    let low_stance = most_stood_on(&points.all, lowest, setting);
    match low_stance {
        Some(level) if off || level - expected > ELSEWHERE * leg => elsewhere(level),
        None if off => elsewhere(lowest),
        _ => trusted,
    }
}

/// The level at or a little above `lowest` on which the points stand, metres: a higher one only if they stand there much
/// longer.
fn most_stood_on(points: &[Vec<Vector3<f64>>], lowest: f64, setting: &Setting) -> Option<f64> {
    let levels = TIPTOE.into_iter().filter_map(|higher| {
        let floor = lowest + higher * setting.leg;
        standing(points, floor, setting)
    });
    let longest = levels.reduce(|best, next| {
        let longer = next.0 as f64 > MUCH_LONGER * best.0 as f64;
        if longer { next } else { best }
    });
    longest.map(|(_, level)| level)
}

/// Height of the lowest point of all, but for a few frames, metres.
fn low(points: &[Vec<Vector3<f64>>]) -> f64 {
    let mut heights: Vec<f64> = points.iter().map(|frame| bottom(frame)).collect();
    heights.retain(|h| h.is_finite());
    heights.sort_by(f64::total_cmp);
    heights
        .get(heights.len() / OUTLIERS)
        .copied()
        .unwrap_or(0.0)
}

/// Height of the lowest of these points, metres.
pub(super) fn bottom(points: &[Vector3<f64>]) -> f64 {
    points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min)
}

/// For how many frames something stands at or below `floor`, and at which level; `None` if too short to count.
fn standing(points: &[Vec<Vector3<f64>>], floor: f64, setting: &Setting) -> Option<(usize, f64)> {
    let Setting {
        fps,
        leg,
        loop_mode,
        ..
    } = *setting;
    let stands = contact::detect_above(points, floor, fps, leg, loop_mode);
    let frames = points.iter().zip(stands).filter(|(_, stands)| *stands);
    let mut heights: Vec<f64> = frames.map(|(frame, _)| bottom(frame)).collect();
    heights.sort_by(f64::total_cmp);
    let enough = heights.len() as f64 >= (LONG_ENOUGH * fps).max(2.0);
    let level = heights
        .get(heights.len() * LEVEL[0] / LEVEL[1])
        .filter(|_| enough)?;
    Some((heights.len(), *level))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::LoopMode;

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
        let setting = Setting {
            fps: FPS,
            loop_mode: LoopMode::Clamp,
            leg: LEG,
            ankle: 0.0,
        };
        find(&points, lift, &setting)
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
