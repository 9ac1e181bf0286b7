//! A cycle of normal walking at 1.2 m/s.
//!
//! Swing and the roll of the feet follow joint-angle curves of normal gait; the standing foot is planted and rolls over
//! heel and ball; pelvis and trunk follow the determinants of gait; the pelvis's horizontal sway is then found so
//! that the zero-moment point travels from foot to foot.

use crate::balance::{Body, GRAVITY, Ground};
use crate::figure::{Figure, Foot, Hand, Turn};
use crate::rig::{
    BALL_AHEAD, BALL_HEIGHT, FOREARM, HEEL_BEHIND, HIPS_ABOVE_LEGS, Pose, Quat, Rig, SHANK, THIGH,
    UPPER_ARM, V3, side_sign,
};
use crate::spline::{Fourier, MinJerk, jet};
use std::f64::consts::TAU;

pub const FPS: f64 = 30.0;
/// Frames from one heel strike to the next of the same foot; the clip has one more, the first of the next cycle.
pub const CYCLE_FRAMES: usize = 33;
/// s.
pub const PERIOD: f64 = CYCLE_FRAMES as f64 / FPS;
/// Travel of one cycle, m.
pub const STRIDE: f64 = 1.2 * PERIOD;

/// Events of a foot, in cycles after its heel strike.
pub const FOOT_FLAT: f64 = 0.09;
pub const HEEL_OFF: f64 = 0.31;
pub const TOE_OFF: f64 = 0.60;

/// Sagittal joint angles in degrees at every tenth of the cycle from heel strike, read from the curves of natural
/// cadence in Winter (2009), ch. 5, and Perry, *Gait Analysis* (1992): thigh against the vertical (forward positive),
/// knee flexion, ankle dorsiflexion.
pub const THIGH_ANGLE: [f64; 10] = [23.0, 19.0, 12.0, 3.0, -7.0, -15.0, -8.0, 9.0, 22.0, 26.0];
pub const KNEE_FLEXION: [f64; 10] = [4.0, 17.0, 16.0, 9.0, 6.0, 12.0, 38.0, 61.0, 48.0, 17.0];
pub const ANKLE_FLEXION: [f64; 10] = [0.0, -4.0, 4.0, 7.0, 10.0, 6.0, -17.0, -9.0, 0.0, 1.0];

/// Ankles to the side of the line of progression, m.
const STEP_HALF_WIDTH: f64 = 0.045;
/// Degrees.
const TOE_OUT: f64 = 7.0;
/// Flat foot's ankle before the hips at heel strike, m.
const ANKLE_LEAD: f64 = 0.303;
/// Mean height of the hip joints, and how far they rise above and fall below it, m.
const HIP_LINE: f64 = 0.870;
const RISE: f64 = 0.0135;
/// Length of the inverted pendulum, m.
const COM_HEIGHT: f64 = 0.95;
/// Where the foot is loaded after heel strike and before toe-off, in front of the ankle, m.
const UNDER_HEEL: f64 = 0.0;
const UNDER_BALL: f64 = 0.160;
/// Velocity with which the heel meets the ground: a leg this straight can't come to rest over it first, m/s.
const LANDING: [f64; 3] = [0.0, -0.25, 0.60];
/// Added to the swinging foot, for the toes that the tables don't know, m.
const CLEARANCE: f64 = 0.016;
/// Each round measures the true body and corrects by the model of `answer`.
const ROUNDS: usize = 15;
/// Part of a round's correction that is taken.
const STEP: f64 = 0.7;
/// Samples per cycle while balancing.
const FINE: usize = 4 * CYCLE_FRAMES;
const SWAY_HARMONICS: usize = 6;
/// Offsets are kept to a thousandth of a millimetre, so that other machines' rounding gives the same file.
const GRAIN: f64 = 1e-6;

/// What repeats in every cycle.
struct Gait {
    /// Pelvis offset from even travel, found by balancing.
    sway: [Fourier; 2],
    /// Pitch of the foot, and of its toes, against the ground; flat before the first point and after the last.
    pitch: MinJerk,
    toes: MinJerk,
    /// Path of the swinging left ankle from its standing place.
    swing: [MinJerk; 3],
}

/// The poses at the given phases.
fn at_phases(rig: &Rig, gait: &Gait, samples: usize, count: usize) -> Vec<Pose> {
    (0..count)
        .map(|k| gait.figure(k as f64 / samples as f64).pose(rig))
        .collect()
}

/// The walk, frame by frame, one more than the cycle has.
pub fn poses(rig: &Rig) -> Vec<Pose> {
    let body = Body::new(rig);
    let mut gait = Gait::new();
    let mut offsets = vec![Ground::zeros(); FINE];
    for _ in 0..ROUNDS {
        let poses = at_phases(rig, &gait, FINE, FINE + 1);
        let zmp = zmp(&body, rig, &poses, PERIOD / FINE as f64);
        let error: Vec<Ground> = (0..FINE)
            .map(|k| wanted(k as f64 / FINE as f64) - zmp[k])
            .collect();
        let change = [0, 1].map(|i| answer(&error, i));
        for (k, offset) in offsets.iter_mut().enumerate() {
            let phase = k as f64 / FINE as f64;
            *offset += Ground::new(change[0].at(phase), change[1].at(phase)) * STEP;
        }
        gait.sway = [0, 1].map(|i| sway(&offsets, i));
    }
    at_phases(rig, &gait, CYCLE_FRAMES, CYCLE_FRAMES + 1)
}

fn sway(offsets: &[Ground], axis: usize) -> Fourier {
    let values: Vec<f64> = offsets
        .iter()
        .map(|o| (o[axis] / GRAIN).round() * GRAIN)
        .collect();
    Fourier::through(&values, SWAY_HARMONICS)
}

/// Pendulum p = x − (h/g) ẍ, solved for every harmonic.
fn answer(error: &[Ground], axis: usize) -> Fourier {
    let values: Vec<f64> = error.iter().map(|e| e[axis]).collect();
    let swing = COM_HEIGHT / GRAVITY * (TAU / PERIOD).powi(2);
    Fourier::through(&values, SWAY_HARMONICS).filtered(|k| {
        if k == 0 {
            0.0
        } else {
            1.0 / (1.0 + swing * (k * k) as f64)
        }
    })
}

/// Zero-moment point of `poses`, the last of which is the first of the next cycle, `dt` seconds apart.
pub fn zmp(body: &Body, rig: &Rig, poses: &[Pose], dt: f64) -> Vec<Ground> {
    let last = poses.len() - 1;
    let moved = |pose: &Pose, cycles: f64| Pose {
        hips: pose.hips + V3::z() * (STRIDE * cycles),
        ..pose.clone()
    };
    body.zmp(
        rig,
        poses,
        &moved(&poses[last - 1], -1.0),
        &moved(&poses[1], 1.0),
        dt,
    )
}

/// Where the zero-moment point ought to be: rolling from heel to ball under one foot, passing to the other foot while
/// both stand.
fn wanted(phase: f64) -> Ground {
    let under = |side: usize, steps: f64, roll: f64| {
        let across = side_sign(side) * (STEP_HALF_WIDTH + TOE_OUT.to_radians().sin() * roll);
        Ground::new(across, STRIDE * steps / 2.0 + ANKLE_LEAD + roll)
    };
    let step = (phase * 2.0).floor();
    let part = phase * 2.0 - step;
    let side = step as usize % 2;
    let both = 2.0 * (TOE_OFF - 0.5);
    if part < both {
        let from = under(1 - side, step - 1.0, UNDER_BALL);
        from.lerp(&under(side, step, UNDER_HEEL), part / both)
    } else {
        let left = (1.0 - part) / (1.0 - both);
        under(
            side,
            step,
            UNDER_BALL + (UNDER_HEEL - UNDER_BALL) * left * left,
        )
    }
}

/// A table's value by Fourier series, radians.
fn angle(table: &[f64], phase: f64) -> f64 {
    Fourier::through(table, 4).at(phase).to_radians()
}

/// Pitch of the foot against the ground that the tables imply; positive lifts the heel.
fn table_pitch(phase: f64) -> f64 {
    angle(&KNEE_FLEXION, phase) - angle(&THIGH_ANGLE, phase) - angle(&ANKLE_FLEXION, phase)
}

/// Ankle from hip, (y, z), that the tables imply.
fn table_ankle(phase: f64) -> [f64; 2] {
    let thigh = angle(&THIGH_ANGLE, phase);
    let shank = thigh - angle(&KNEE_FLEXION, phase);
    [
        -THIGH * thigh.cos() - SHANK * shank.cos(),
        THIGH * thigh.sin() + SHANK * shank.sin(),
    ]
}

impl Gait {
    fn new() -> Self {
        let tabled = |phase: f64| (phase, table_pitch(phase));
        let pitch = MinJerk::through(&[
            (HEEL_OFF, 0.0),
            (0.40, table_pitch(0.40) * 0.6),
            tabled(0.50),
            tabled(TOE_OFF),
            tabled(0.70),
            tabled(0.80),
            tabled(0.90),
            tabled(1.0),
            (1.0 + FOOT_FLAT, 0.0),
        ]);
        let toes = MinJerk::through(&[
            (TOE_OFF, 0.0),
            (0.70, table_pitch(0.70) - 0.7),
            (0.80, table_pitch(0.80) - 0.35),
            (0.90, table_pitch(0.90) - 0.2),
            tabled(1.0),
            (1.0 + FOOT_FLAT, 0.0),
        ]);
        let sway = [0, 1].map(|_| Fourier::through(&[0.0], 0));
        let swing = swing(&pitch);
        Self {
            sway,
            pitch,
            toes,
            swing,
        }
    }

    fn figure(&self, phase: f64) -> Figure {
        let wave = |lag: f64| (TAU * (phase - lag)).cos();
        let twist = -4.5 * wave(0.0);
        let list = 4.0 * wave(0.17);
        Figure {
            hips: V3::new(
                self.sway[0].at(phase),
                hip_line(phase) + HIPS_ABOVE_LEGS,
                STRIDE * phase + self.sway[1].at(phase),
            ),
            pelvis: degrees(twist, 3.0, list),
            trunk: degrees(-2.0 * twist, 0.5, -list),
            head: degrees(twist, -3.5, 0.0),
            hands: [0, 1].map(|side| hand(side, phase)),
            feet: [0, 1].map(|side| self.foot(side, phase)),
        }
    }

    fn foot(&self, side: usize, phase: f64) -> Foot {
        // Cycles of this foot: the right one strikes half a cycle after the left.
        let own = phase - 0.5 * side as f64;
        let cycle = own.floor();
        let within = own - cycle;
        let strike = cycle + 0.5 * side as f64;
        let sign = side_sign(side);
        let yaw = (sign * TOE_OUT).to_radians();
        let place = V3::new(sign * STEP_HALF_WIDTH, 0.0, STRIDE * strike + ANKLE_LEAD);
        // The flat foot ends at the first phase of `pitch`, and its cycle at the last.
        let late = if within < FOOT_FLAT {
            within + 1.0
        } else {
            within
        };
        let (pitch, toes) = (self.pitch.at(late), self.toes.at(late));
        let mirrored = |at: V3| place + V3::new(sign * at.x, at.y, at.z);
        if within < FOOT_FLAT {
            Foot::at(mirrored(heel_rocker(pitch)), yaw, pitch, pitch)
        } else if within <= TOE_OFF {
            Foot::at(mirrored(ball_rocker(pitch)), yaw, pitch, 0.0)
        } else {
            let path = V3::from_fn(|i, _| self.swing[i].at(within));
            Foot::at(mirrored(path), yaw, pitch, toes)
        }
    }
}

/// The left ankle, from its foot's place, while the foot turns on its ball.
fn ball_rocker(pitch: f64) -> V3 {
    let yaw = TOE_OUT.to_radians();
    let ball = toe_out() * V3::new(0.0, BALL_HEIGHT, BALL_AHEAD);
    Foot::on_ball(ball, yaw, pitch, 0.0).ankle
}

/// The left ankle, from its foot's place, while the foot turns on its heel.
fn heel_rocker(pitch: f64) -> V3 {
    let heel = toe_out() * V3::new(0.0, 0.0, -HEEL_BEHIND);
    Foot::on_heel(heel, TOE_OUT.to_radians(), pitch, 0.0).ankle
}

fn toe_out() -> Quat {
    Quat::from_axis_angle(&V3::y_axis(), TOE_OUT.to_radians())
}

/// Height of the hip joints: lowest while both feet stand, highest over the standing foot.
fn hip_line(phase: f64) -> f64 {
    HIP_LINE - RISE * (2.0 * TAU * (phase - 0.02)).cos()
}

/// The left ankle from its place in the last stance: from the ball rocker's end over the tables' swing to the heel
/// rocker's start.
fn swing(pitch: &MinJerk) -> [MinJerk; 3] {
    [0, 1, 2].map(|i| {
        let travel = if i == 2 { STRIDE } else { 0.0 };
        let start = jet(&|t| ball_rocker(pitch.at(t))[i], TOE_OFF);
        let mut end = jet(&|t| heel_rocker(pitch.at(t))[i] + travel, 1.0);
        end[1] += PERIOD * LANDING[i];
        let via = |phase: f64| {
            let [y, z] = table_ankle(phase);
            let line = V3::new(
                0.0,
                hip_line(phase) + y + CLEARANCE,
                STRIDE * phase - ANKLE_LEAD + z,
            );
            (phase, line[i])
        };
        let mut points = vec![(TOE_OFF, start[0]), (1.0, end[0])];
        if i > 0 {
            points.splice(1..1, [via(0.72), via(0.84)]);
        }
        MinJerk::between(&points, start, end)
    })
}

fn degrees(yaw: f64, pitch: f64, roll: f64) -> Turn {
    Turn {
        yaw: yaw.to_radians(),
        pitch: pitch.to_radians(),
        roll: roll.to_radians(),
    }
}

/// Arms swing against the legs: shoulder and elbow angles, from an arm that hangs.
fn hand(side: usize, phase: f64) -> Hand {
    let sign = side_sign(side);
    let forward = -sign * (TAU * (phase - 0.02)).cos();
    let shoulder = (-4.0 + 18.0 * forward).to_radians();
    let elbow = (24.0 + 9.0 * forward).to_radians();
    let out = (9.0 * sign).to_radians();
    let hanging =
        |angle: f64| V3::new(out.sin(), -out.cos() * angle.cos(), out.cos() * angle.sin());
    let upper = hanging(shoulder) * UPPER_ARM;
    let lower = hanging(shoulder + elbow) * FOREARM;
    let inward = V3::new(-0.10 * sign * FOREARM, 0.0, 0.0);
    Hand {
        wrist: upper + lower + inward,
        elbow: V3::new(0.25 * sign, 0.0, -1.0),
    }
}
