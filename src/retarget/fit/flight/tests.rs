//! Flights of jumps that are built by hand.

use super::super::ballistic::problem;
use super::*;
use crate::motion::Cycle;
use crate::retarget::model::Model;
use crate::retarget::qpos::{put_quaternion, quaternion, vector};
use crate::skeleton::{GRAVITY, Skeleton};
use nalgebra::Point3;

const FPS: f64 = 60.0;
const STANDS: usize = 20;
const FLIES: usize = 24;

/// The humanoid at rest stands, jumps forward under a part of gravity, and stands again.
fn jump(skeleton: &Skeleton, gravity: f64) -> Vec<Vec<f64>> {
    let rest = skeleton.rest_qpos();
    let low = skeleton.lowest_point(&skeleton.forward(&rest));
    let frames = 0..2 * STANDS + FLIES + 1;
    let duration = FLIES as f64 / FPS;
    let frame = |f: usize| {
        let t = (f.saturating_sub(STANDS) as f64 / FPS).min(duration);
        let mut qpos = rest.clone();
        qpos[0] += t;
        qpos[2] += gravity * t * (duration - t) / 2.0 - low;
        qpos
    };
    frames.map(frame).collect()
}

fn shifts(
    skeleton: &Skeleton,
    frames: &[Vec<f64>],
    cycle: Option<&Cycle>,
) -> Vec<Option<FlightShift>> {
    let trajectory = Trajectory {
        model: &Model::new(skeleton),
        frames,
        anchors: &vec![Vec::new(); frames.len()],
        cycle,
        fps: FPS,
        to_perform: false,
    };
    find(&trajectory).1
}

fn moved(frames: &[Vec<f64>], shifts: &[Option<FlightShift>]) -> Vec<Vector3<f64>> {
    let place = |(qpos, shift): (&Vec<f64>, &Option<FlightShift>)| {
        let shift = shift.map_or_else(Vector3::zeros, |shift| shift.by);
        vector(qpos, 0) + shift
    };
    frames.iter().zip(shifts).map(place).collect()
}

#[test]
fn a_jump_falls_freely() {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid is valid");
    for gravity in [0.7 * GRAVITY, 1.3 * GRAVITY] {
        let frames = jump(&skeleton, gravity);
        let path = moved(&frames, &shifts(&skeleton, &frames, None));
        let bend = |f: usize| (path[f - 1] - path[f] * 2.0 + path[f + 1]) * FPS * FPS;
        for f in STANDS + 1..STANDS + FLIES {
            assert!((bend(f) + Vector3::z() * GRAVITY).norm() < 1e-9, "{f}");
        }
        // It gathers, and takes off and lands with the speed of the flight.
        let jumps = |path: &[Vector3<f64>], f: usize| (path[f - 1] - path[f] * 2.0 + path[f + 1]).z;
        let before: Vec<_> = frames.iter().map(|q| vector(q, 0)).collect();
        let change = jumps(&path, STANDS) - jumps(&before, STANDS);
        let speed = (GRAVITY - gravity).abs() * FLIES as f64 / (2.0 * FPS * FPS);
        assert!(change.abs() < 0.5 * speed, "{change} of {speed}");
        assert_eq!(path[STANDS], before[STANDS]);
        assert_eq!(path[0], before[0]);
    }
}

/// The same jump, beginning in its midst and going round a curve.
#[test]
fn a_jump_over_the_seam_of_a_cycle_is_the_same_jump() {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid is valid");
    let mut frames = jump(&skeleton, 0.7 * GRAVITY);
    let straight = shifts(&skeleton, &frames, None);
    let cycle = Cycle {
        translation: Vector3::new(0.0, 1.0, 0.0),
        heading: 0.8,
    };
    let cut = STANDS + 10;
    let mut ring = frames.split_off(cut);
    let onward = cycle.offset(1);
    let turn = onward.rotation;
    for qpos in &mut frames {
        let at = onward * Point3::from(vector(qpos, 0));
        qpos[..3].copy_from_slice(at.coords.as_slice());
        let facing = turn * quaternion(qpos, 3);
        put_quaternion(qpos, 3, &facing);
    }
    let rest = ring.len();
    ring.append(&mut frames);
    let round = shifts(&skeleton, &ring, Some(&cycle));
    for (f, shift) in straight.iter().enumerate() {
        let (at, back) = match f.checked_sub(cut) {
            Some(at) => (at, nalgebra::UnitQuaternion::identity()),
            None => (rest + f, turn.inverse()),
        };
        let by = |shift: Option<FlightShift>| shift.map_or_else(Vector3::zeros, |shift| shift.by);
        let apart = back * by(round[at]) - by(*shift);
        assert!(apart.norm() < 1e-9, "{f}: {apart}");
    }
}

/// It rises by a centimetre in 40 ms before it jumps, where it is near enough to the ground for a flight to begin.
#[test]
fn a_flight_begins_where_its_speed_does() {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid is valid");
    let (fps, rises, lasts) = (240.0, 10, 96);
    let rest = skeleton.rest_qpos();
    let low = skeleton.lowest_point(&skeleton.forward(&rest));
    let (top, takes_off) = (0.01, STANDS + rises);
    let height = |f: usize| {
        let t = f.saturating_sub(takes_off).min(lasts) as f64 / fps;
        let duration = lasts as f64 / fps;
        let rise = f.saturating_sub(STANDS).min(rises) as f64 / rises as f64;
        let sinks = 1.0 - t / duration;
        top * rise * sinks + GRAVITY * t * (duration - t) / 2.0
    };
    let frame = |f: usize| {
        let mut qpos = rest.clone();
        qpos[2] += height(f) - low;
        qpos
    };
    let frames: Vec<Vec<f64>> = (0..takes_off + lasts + STANDS).map(frame).collect();
    let trajectory = Trajectory {
        model: &Model::new(&skeleton),
        frames: &frames,
        anchors: &vec![Vec::new(); frames.len()],
        cycle: None,
        fps,
        to_perform: false,
    };
    let starts = |trajectory: &Trajectory| -> Vec<i64> {
        let (flights, _) = find(trajectory);
        flights.iter().map(|flight| flight.span.0).collect()
    };
    let takes_off = takes_off as i64;
    let found = starts(&trajectory);
    assert!(
        matches!(found[..], [start] if start >= takes_off),
        "{found:?} {takes_off}"
    );
    let low: Vec<f64> = (0..frames.len()).map(height).collect();
    let first = &in_the_air(&trajectory, &low)[0];
    assert!(first.near[0] > 2, "they are near");
    // Who is to perform it has left the ground by then.
    let earliest = first.span.0 - first.near[0];
    assert!(earliest < takes_off, "{earliest} {takes_off}");
    let performed = Trajectory {
        to_perform: true,
        ..trajectory
    };
    assert_eq!(starts(&performed), [earliest]);
}

#[test]
fn feet_that_float_are_no_flight() {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid is valid");
    let frames = jump(&skeleton, 0.3 * GRAVITY);
    let found = shifts(&skeleton, &frames, None);
    assert!(found.iter().all(Option::is_none));
    assert_eq!(problem(0.0), None);
}
