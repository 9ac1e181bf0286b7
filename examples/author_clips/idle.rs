//! Four seconds of standing: a breath, and a little sway over feet that stay where they are.

use crate::balance::{Body, Ground, ground};
use crate::figure::{Figure, Foot, Hand, Turn};
use crate::rig::{ANKLE_HEIGHT, FOREARM, HIPS_ABOVE_LEGS, Pose, Rig, UPPER_ARM, V3, side_sign};
use std::f64::consts::TAU;

pub const FPS: f64 = 30.0;
/// Frames of a breath; the clip has one more, the first of the next.
pub const CYCLE_FRAMES: usize = 120;

/// Ankles to the side of the middle, m.
const HALF_WIDTH: f64 = 0.11;
/// Degrees.
const TOE_OUT: f64 = 10.0;
/// Height of the hip joints, m: knees are a little bent.
const HIP_LINE: f64 = 0.855;
/// Where the weight is, before the ankles, m; and how far it sways forward and to the side.
const WEIGHT: f64 = 0.045;
const SWAY: [f64; 2] = [0.006, 0.004];
/// How far chest and hips rise with a breath: radians, and m.
const BREATH: f64 = 0.02;
const RISE: f64 = 0.002;
/// How often the weight is measured and led to where it should be.
const ROUNDS: usize = 6;

/// The frames, one more than the cycle has.
pub fn poses(rig: &Rig) -> Vec<Pose> {
    let body = Body::new(rig);
    let pose = |frame: usize| {
        let phase = frame as f64 / CYCLE_FRAMES as f64;
        let wanted = wanted(phase);
        let mut hips = wanted;
        let mut pose = figure(phase, hips).pose(rig);
        for _ in 0..ROUNDS {
            hips += wanted - ground(body.com(rig, &pose));
            pose = figure(phase, hips).pose(rig);
        }
        pose
    };
    (0..=CYCLE_FRAMES).map(pose).collect()
}

/// Where the centre of mass is over the ground.
fn wanted(phase: f64) -> Ground {
    let turn = TAU * phase;
    Ground::new(SWAY[0] * turn.sin(), WEIGHT + SWAY[1] * (turn + 1.0).sin())
}

fn figure(phase: f64, hips: Ground) -> Figure {
    let breath = (TAU * phase).cos();
    let tilt = |pitch: f64| Turn {
        pitch,
        ..Turn::default()
    };
    Figure {
        hips: V3::new(hips.x, HIP_LINE + RISE * breath + HIPS_ABOVE_LEGS, hips.y),
        pelvis: tilt(0.03),
        trunk: tilt(0.02 - BREATH * breath),
        head: tilt(-0.03 + BREATH * breath),
        hands: [0, 1].map(hand),
        feet: [0, 1].map(|side| {
            let sign = side_sign(side);
            let ankle = V3::new(sign * HALF_WIDTH, ANKLE_HEIGHT, 0.0);
            Foot::at(ankle, (sign * TOE_OUT).to_radians(), 0.0, 0.0)
        }),
    }
}

/// An arm that hangs, a little bent.
fn hand(side: usize) -> Hand {
    let sign = side_sign(side);
    let out = (9.0 * sign).to_radians();
    let hanging =
        |angle: f64| V3::new(out.sin(), -out.cos() * angle.cos(), out.cos() * angle.sin());
    Hand {
        wrist: hanging(-0.05) * UPPER_ARM + hanging(0.3) * FOREARM,
        elbow: V3::new(0.25 * sign, 0.0, -1.0),
    }
}
