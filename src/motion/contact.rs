//! When a foot stands on the ground, from the paths of its points.
//!
//! A point stands while it is slow and low. Lengths are measured in leg lengths and times in seconds, so that a
//! child's walk at 30 Hz and a giant's at 120 Hz get the same labels. Velocities are averaged over 1/30 s before and
//! after a frame, and the slower of the two counts: a foot stands from the frame in which it comes to rest.
//!
//! Two levels of speed and height (hysteresis, alike in both directions of time) keep a stance whole: it has to be clearly
//! slow and low somewhere, and extends as far as it stays fairly so. Short gaps are closed then, and short touches dropped.

use crate::clip::LoopMode;
use nalgebra::Vector3;

/// Speeds below which a point is clearly and fairly at rest, leg lengths per second. Chosen: 0.2 and 0.3 m/s with legs of
/// 0.8 m; the foot of a walk swings at several m/s.
const SPEED: [f64; 2] = [0.25, 0.4];
/// Heights above the floor below which a point is clearly and fairly down, leg lengths. Chosen: 3 and 5 cm with legs of 0.8
/// m.
const HEIGHT: [f64; 2] = [0.04, 0.06];
/// Window in which velocity and height are averaged, s: a frame of the slowest usual rate, so that clips of higher rates
/// are looked at no more closely.
const WINDOW: f64 = 1.0 / 30.0;
/// Shortest stance and shortest gap between stances, s. Chosen: the stances of a sprint, the shortest there are, take some
/// 0.1 s.
const SHORTEST: f64 = 0.08;
/// Share of frames in which a point may be below its floor level. Chosen: a few frames of noise don't lower the floor.
const FLOOR_QUANTILE: f64 = 0.05;

/// Finds in which frames a foot stands, on a floor of unknown height.
///
/// `points[f]` holds positions of the foot's points (joints, corners, …) at frame `f` in the world, metres: the same points
/// in the same order in every frame. Each point has a floor of its own, at the height where it is lowest in the clip. For a
/// foot that never comes down, use [`detect_above`].
pub fn detect(
    points: &[Vec<Vector3<f64>>],
    fps: f64,
    leg_length: f64,
    loop_mode: LoopMode,
) -> Vec<bool> {
    detect_each(points, fps, leg_length, loop_mode, floor_level)
}

/// Finds in which frames a foot stands, on a floor at height `floor`, metres. The rest is as in [`detect`].
pub fn detect_above(
    points: &[Vec<Vector3<f64>>],
    floor: f64,
    fps: f64,
    leg_length: f64,
    loop_mode: LoopMode,
) -> Vec<bool> {
    detect_each(points, fps, leg_length, loop_mode, |_| floor)
}

/// Finds in which frames any of the points stands; `floor` gives a point's floor from its path.
fn detect_each(
    points: &[Vec<Vector3<f64>>],
    fps: f64,
    leg_length: f64,
    loop_mode: LoopMode,
    floor: impl Fn(&[Vector3<f64>]) -> f64,
) -> Vec<bool> {
    let count = points.iter().map(Vec::len).min().unwrap_or(0);
    let mut stands = vec![false; points.len()];
    for point in 0..count {
        let path: Vec<Vector3<f64>> = points.iter().map(|frame| frame[point]).collect();
        let level = floor(&path);
        let states = states(&path, level, fps, leg_length, loop_mode);
        hold_on(&states, &mut stands, loop_mode);
    }
    settle(&mut stands, fps, loop_mode);
    stands
}

/// In which frames something is on the ground that is surely there in some and may be in others.
pub(crate) fn settled(states: &[State], fps: f64, loop_mode: LoopMode) -> Vec<bool> {
    let mut on = vec![false; states.len()];
    hold_on(states, &mut on, loop_mode);
    settle(&mut on, fps, loop_mode);
    on
}

/// The runs of flagged frames that last at least as long as a stance.
pub(crate) fn lasting(flags: &[bool], fps: f64, loop_mode: LoopMode) -> Vec<bool> {
    let shortest = (SHORTEST * fps).round() as usize;
    let mut lasting = vec![false; flags.len()];
    for run in runs(flags, loop_mode, |flag| *flag) {
        if run.len() >= shortest {
            run.iter().for_each(|&f| lasting[f] = true);
        }
    }
    lasting
}

/// Sets the frames of all runs of states that are clear somewhere and fair everywhere. A run that is nowhere clear is a foot
/// that passes the ground.
fn hold_on(states: &[State], on: &mut [bool], loop_mode: LoopMode) {
    for run in runs(states, loop_mode, |s| *s != State::Away) {
        if run.iter().any(|&f| states[f] == State::Clear) {
            run.iter().for_each(|&f| on[f] = true);
        }
    }
}

/// The height below which a path is in only a few frames, metres.
fn floor_level(path: &[Vector3<f64>]) -> f64 {
    let mut heights: Vec<f64> = path.iter().map(|p| p.z).collect();
    heights.sort_by(f64::total_cmp);
    let at = (heights.len().saturating_sub(1) as f64 * FLOOR_QUANTILE).round();
    heights.get(at as usize).copied().unwrap_or(0.0)
}

/// How surely something is on the ground in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum State {
    /// Beyond doubt.
    Clear,
    /// Enough to go on being there.
    Fair,
    /// Not there.
    Away,
}

/// The state of a point in every frame.
fn states(
    path: &[Vector3<f64>],
    floor: f64,
    fps: f64,
    leg_length: f64,
    loop_mode: LoopMode,
) -> Vec<State> {
    let steps: Vec<Vector3<f64>> = path.windows(2).map(|w| (w[1] - w[0]) * fps).collect();
    let heights: Vec<f64> = path.iter().map(|p| p.z - floor).collect();
    let reach = (fps * WINDOW).round().max(1.0) as i64;
    let half = (fps * WINDOW / 2.0).floor() as i64;
    (0..path.len() as i64)
        .map(|f| {
            let before = mean_speed(&steps, f - reach, f, loop_mode);
            let after = mean_speed(&steps, f, f + reach, loop_mode);
            let speed = before.min(after);
            let around = window_of_frames(&heights, f - half, f + half, loop_mode);
            let height = around.iter().sum::<f64>() / around.len().max(1) as f64;
            let within = |level: usize| {
                speed < SPEED[level] * leg_length && height < HEIGHT[level] * leg_length
            };
            match (within(0), within(1)) {
                (true, _) => State::Clear,
                (false, true) => State::Fair,
                _ => State::Away,
            }
        })
        .collect()
}

/// Size of the mean of velocities `from..to`; infinite where there are none. The mean is of vectors, so that shaking about
/// a place is slow.
fn mean_speed(steps: &[Vector3<f64>], from: i64, to: i64, loop_mode: LoopMode) -> f64 {
    let around = window(steps, from, to, loop_mode);
    match around.len() {
        0 => f64::INFINITY,
        count => around.iter().sum::<Vector3<f64>>().norm() / count as f64,
    }
}

/// Items `from..to` of a sequence that repeats, or that is cut at its ends.
fn window<T: Copy>(items: &[T], from: i64, to: i64, loop_mode: LoopMode) -> Vec<T> {
    let count = items.len() as i64;
    let at = |i: i64| match loop_mode {
        LoopMode::Wrap if count > 0 => usize::try_from(i.rem_euclid(count)).ok(),
        _ => usize::try_from(i).ok(),
    };
    (from..to)
        .filter_map(at)
        .filter_map(|i| items.get(i).copied())
        .collect()
}

/// Frames `from..=to`, where the last frame of a wrapping motion is the first.
fn window_of_frames(frames: &[f64], from: i64, to: i64, loop_mode: LoopMode) -> Vec<f64> {
    let distinct = match loop_mode {
        LoopMode::Wrap => &frames[..frames.len().saturating_sub(1).max(1)],
        LoopMode::Clamp => frames,
    };
    window(distinct, from, to + 1, loop_mode)
}

/// Maximal runs of frames that satisfy `is`; in a wrapping motion a run may pass over the seam.
fn runs<T>(items: &[T], loop_mode: LoopMode, is: impl Fn(&T) -> bool) -> Vec<Vec<usize>> {
    let mut runs: Vec<Vec<usize>> = Vec::new();
    let mut open = false;
    for (index, item) in items.iter().enumerate() {
        let now = is(item);
        match (open, now, runs.last_mut()) {
            (true, true, Some(run)) => run.push(index),
            (_, true, _) => runs.push(vec![index]),
            _ => {}
        }
        open = now;
    }
    // What runs into the end of a cycle goes on at its start.
    let seam = loop_mode == LoopMode::Wrap && runs.len() > 1;
    let starts = runs.first().is_some_and(|r| r[0] == 0);
    let ends = runs
        .last()
        .is_some_and(|r| r.last() == Some(&(items.len() - 1)));
    if seam && starts && ends {
        let mut tail = runs.pop().unwrap_or_default();
        tail.append(&mut runs[0]);
        runs[0] = tail;
    }
    runs
}

/// Closes gaps and then drops stances that are too short. Those cut off by an end of the motion stay.
fn settle(stands: &mut [bool], fps: f64, loop_mode: LoopMode) {
    let shortest = (SHORTEST * fps).round() as usize;
    let last = stands.len().saturating_sub(1);
    // Gaps first: two touches with a short gap between them may be long enough together.
    for state in [false, true] {
        for run in runs(stands, loop_mode, |s| *s == state) {
            // The first and last frame of a wrapping motion are one moment.
            let passes_seam = run.contains(&0) && run.contains(&last);
            let whole_motion = run.len() == stands.len();
            let moments = run.len() - usize::from(passes_seam && !whole_motion);
            let cut = loop_mode == LoopMode::Clamp && (run.contains(&0) || run.contains(&last));
            if moments < shortest && !cut && !whole_motion {
                run.iter().for_each(|&f| stands[f] = !state);
            }
        }
    }
}
