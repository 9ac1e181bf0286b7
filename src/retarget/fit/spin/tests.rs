//! Spins of bodies that are moved by hand.

use super::super::flight::find;
use super::super::torque_free::step;
use super::*;
use crate::retarget::model::Model;
use crate::retarget::qpos::put_quaternion;
use nalgebra::Vector3;

const FPS: f64 = 60.0;
const FLIES: i64 = 30;
/// Frames on the ground before and after.
const GATHERS: i64 = 20;

/// The humanoid at rest on the ground, then in the air, where it rocks, swings an arm and turns aside, then at rest
/// on the ground again.
fn leap(skeleton: &Skeleton) -> Vec<Vec<f64>> {
    let arm = skeleton.bodies.iter().find(|b| b.name == "right_upper_arm");
    let at = arm.expect("an arm").joints[0].qpos;
    let frame = |f: i64| {
        let u = (f as f64 / FLIES as f64).clamp(0.0, 1.0);
        let mut qpos = skeleton.rest_qpos();
        let low = skeleton.lowest_point(&skeleton.forward(&qpos));
        let duration = FLIES as f64 / FPS;
        qpos[2] += crate::skeleton::GRAVITY * duration * duration * u * (1.0 - u) / 2.0 - low;
        let wave = (std::f64::consts::PI * u).sin();
        let root = UnitQuaternion::from_euler_angles(0.1 * wave, 0.2 * wave * wave, 0.6 * u);
        put_quaternion(&mut qpos, 3, &root);
        let swing = UnitQuaternion::from_euler_angles(0.0, -1.5 * wave, 0.0);
        put_quaternion(&mut qpos, at, &swing);
        qpos
    };
    (-GATHERS..FLIES + GATHERS + 1).map(frame).collect()
}

/// A somersault of 16 frames a second that turns in its midst and hardly at its ends, with an arm to one side.
#[test]
fn a_somersault_is_turned_far_and_spins_evenly() {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid is valid");
    let arm = skeleton.bodies.iter().find(|b| b.name == "right_upper_arm");
    let at = arm.expect("an arm").joints[0].qpos;
    let frame = |f: i64| {
        let u = f as f64 / 9.0;
        let mut qpos = skeleton.rest_qpos();
        let angle = 0.4 * (std::f64::consts::TAU * u).sin() - 3.5 * u;
        let root = UnitQuaternion::from_euler_angles(0.0, angle, 0.0);
        put_quaternion(&mut qpos, 3, &root);
        let aside = UnitQuaternion::from_euler_angles(-0.5, -u, 0.0);
        put_quaternion(&mut qpos, at, &aside);
        qpos
    };
    let mut frames: Vec<Vec<f64>> = (0..10).map(frame).collect();
    let flight = TorqueFreeFlight {
        skeleton: &skeleton,
        frames: &frames,
        fps: 16.0,
    };
    let turns = flight.turns().expect("turns");
    let farthest = turns.iter().map(UnitQuaternion::angle).fold(0.0, f64::max);
    assert!((0.3..0.5).contains(&farthest), "{farthest} rad");
    assert!(turns[9].angle() < 1e-9 && turns[0].angle() < 1e-9);
    let pairs = frames.iter_mut().zip(&turns);
    pairs.for_each(|(qpos, by)| turn(&skeleton, qpos, by));
    let steps = frames.windows(2).map(|pair| step(&skeleton, pair, 16.0));
    let momenta: Vec<_> = steps.map(|s| s.expect("a step").momentum).collect();
    for momentum in &momenta {
        let off = (momentum - momenta[0]).norm() / momenta[0].norm();
        assert!(off < 1e-4, "{off}");
    }
}

#[test]
fn a_flight_is_turned_within_reason() {
    let turns = |angle: f64| -> Turns {
        let turn = |share: f64| UnitQuaternion::from_scaled_axis(Vector3::y() * angle * share);
        [0.0, 0.5, 1.0, 0.0].map(turn).to_vec()
    };
    let angles = |turns: Turns| -> Vec<f64> { turns.iter().map(|t| t.angle()).collect() };
    let part = angles(within_reason(turns(0.9), true).expect("turns"));
    assert!((part[1] - PART / 2.0).abs() < 1e-9 && (part[2] - PART).abs() < 1e-9);
    for to_perform in [false, true] {
        let near = turns(0.9 * FARTHEST);
        assert_eq!(within_reason(near.clone(), to_perform), Some(near));
        assert_eq!(within_reason(turns(1.2), to_perform), None);
    }
    assert_eq!(within_reason(turns(0.9), false), None);
    let told = |turned, all| problem(turned, all).map(|p| p.message.contains("would need more"));
    assert_eq!(
        [told(0.05, true), told(0.3, true), told(0.3, false)],
        [None, Some(false), Some(true)]
    );
}

#[test]
fn the_momentum_of_a_flight_stays() {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid is valid");
    let still = leap(&skeleton);
    let trajectory = Trajectory {
        model: &Model::new(&skeleton),
        frames: &still,
        anchors: &vec![Vec::new(); still.len()],
        cycle: None,
        fps: FPS,
        to_perform: false,
    };
    let (flights, _) = find(&trajectory);
    let spans: Vec<_> = flights.iter().map(|flight| flight.span).collect();
    assert_eq!(spans, [(GATHERS, GATHERS + FLIES)]);
    let found = turns(&trajectory, &flights).frames;
    let mut frames = still.clone();
    for (qpos, turned) in frames.iter_mut().zip(&found) {
        let Some(FlightTurn { by, flies }) = turned else {
            continue;
        };
        // Half of the body leads with all of the turn.
        let share = if *flies { 1.0 } else { 1.0 / LEADS };
        turn(&skeleton, qpos, &by.powf(share));
    }
    let momenta = |frames: &[Vec<f64>]| -> Vec<Vector3<f64>> {
        let steps = frames.windows(2).map(|pair| step(&skeleton, pair, FPS));
        steps.map(|step| step.expect("a step").momentum).collect()
    };
    let flying = GATHERS as usize..(GATHERS + FLIES) as usize;
    let spread = |momenta: &[Vector3<f64>]| {
        let momenta = &momenta[flying.clone()];
        let mean = momenta.iter().sum::<Vector3<f64>>() / momenta.len() as f64;
        momenta
            .iter()
            .map(|l| (l - mean).norm())
            .fold(0.0, f64::max)
    };
    let (before, after) = (momenta(&still), momenta(&frames));
    assert!(spread(&before) > 1.0 && spread(&after) < 1e-3 * spread(&before));
    // What changes its spin in the air has led to it on the ground.
    let leaves = |momenta: &[Vector3<f64>]| momenta[flying.start] - momenta[flying.start - 1];
    let change = (leaves(&after) - leaves(&before)).norm();
    let in_the_air = (after[flying.start] - before[flying.start]).norm();
    assert!(change < 0.5 * in_the_air, "{change} of {in_the_air}");
    let com = |frames: &[Vec<f64>], f: usize| skeleton.com(&skeleton.forward(&frames[f]));
    for f in 0..frames.len() {
        assert!((com(&frames, f) - com(&still, f)).norm() < 1e-9, "{f}");
    }
    for f in [0, flying.start, flying.end, frames.len() - 1] {
        let apart = frames[f].iter().zip(&still[f]).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-9, "{f}");
    }
}
