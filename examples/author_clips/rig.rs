//! The rig that both clips move: a humanoid 1.70 m tall in T-pose, Y up, facing +Z, in metres.
//!
//! Lengths are Drillis and Contini's fractions of stature, as printed in Winter, *Biomechanics and Motor Control of
//! Human Movement*, 4th ed. (2009), fig. 4.1.

use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector3};

pub type V3 = Vector3<f64>;
pub type Quat = UnitQuaternion<f64>;

/// m.
pub const STATURE: f64 = 1.70;
/// Ankle above the sole, m.
pub const ANKLE_HEIGHT: f64 = 0.039 * STATURE;
pub const SHANK: f64 = 0.246 * STATURE;
pub const THIGH: f64 = 0.245 * STATURE;
pub const UPPER_ARM: f64 = 0.186 * STATURE;
pub const FOREARM: f64 = 0.146 * STATURE;
pub const HAND: f64 = 0.108 * STATURE;
const HIP_HEIGHT: f64 = ANKLE_HEIGHT + SHANK + THIGH;
const HIP_HALF_WIDTH: f64 = 0.090;
/// Hips joint above the hip joints' line, m.
pub const HIPS_ABOVE_LEGS: f64 = 0.055;
const SHOULDER_HEIGHT: f64 = 0.818 * STATURE;
const SHOULDER_HALF_WIDTH: f64 = 0.175;
/// Ball of the foot in front of the ankle, and its joint above the sole, m.
pub const BALL_AHEAD: f64 = 0.135;
pub const BALL_HEIGHT: f64 = 0.020;
/// Heel behind the ankle, m.
pub const HEEL_BEHIND: f64 = 0.055;
/// Tip of the toes in front of the ball; with ball and heel it makes a foot of 0.152 statures.
pub const TOES: f64 = 0.152 * STATURE - HEEL_BEHIND - BALL_AHEAD;

pub const JOINTS: usize = 22;

pub const NAMES: [&str; JOINTS] = [
    "Hips",
    "Spine",
    "Chest",
    "Neck",
    "Head",
    "LeftShoulder",
    "LeftArm",
    "LeftForeArm",
    "LeftHand",
    "RightShoulder",
    "RightArm",
    "RightForeArm",
    "RightHand",
    "LeftUpLeg",
    "LeftLeg",
    "LeftFoot",
    "LeftToeBase",
    "RightUpLeg",
    "RightLeg",
    "RightFoot",
    "RightToeBase",
    "HeadTop_End",
];

pub const HIPS: usize = 0;
pub const SPINE: usize = 1;
pub const CHEST: usize = 2;
pub const NECK: usize = 3;
pub const HEAD: usize = 4;
pub const HEAD_TOP: usize = 21;
/// Clavicle, left and right; arm, forearm and hand follow.
pub const SHOULDER: [usize; 2] = [5, 9];
/// Hip, left and right; knee, ankle and ball of the foot follow.
pub const UP_LEG: [usize; 2] = [13, 17];

const PARENTS: [usize; JOINTS] = [
    0, 0, 1, 2, 3, 2, 5, 6, 7, 2, 9, 10, 11, 0, 13, 14, 15, 0, 17, 18, 19, 4,
];

/// +1 on the left (+X), −1 on the right.
pub fn side_sign(side: usize) -> f64 {
    if side == 0 { 1.0 } else { -1.0 }
}

/// The rest pose: where every joint is, and how its own axes lie there.
pub struct Rig {
    /// World positions, m.
    pub rest: [V3; JOINTS],
    /// World from joint. Limb joints have their y axis along the bone, as common rigs do.
    pub axes: [Quat; JOINTS],
}

impl Rig {
    pub fn new() -> Self {
        Self {
            rest: rest_positions(),
            axes: std::array::from_fn(rest_axes),
        }
    }

    pub fn parent(joint: usize) -> Option<usize> {
        (joint != HIPS).then(|| PARENTS[joint])
    }

    /// From joint `from` to joint `to` at rest, world axes, m.
    pub fn offset(&self, from: usize, to: usize) -> V3 {
        self.rest[to] - self.rest[from]
    }

    /// World from joint at rest.
    pub fn rest_world(&self, joint: usize) -> Isometry3<f64> {
        Isometry3::from_parts(self.rest[joint].into(), self.axes[joint])
    }

    /// Parent from joint at rest.
    pub fn rest_local(&self, joint: usize) -> Isometry3<f64> {
        let world = self.rest_world(joint);
        Self::parent(joint).map_or(world, |p| self.rest_world(p).inverse() * world)
    }
}

/// A posed rig.
#[derive(Clone)]
pub struct Pose {
    /// Position of the Hips joint, m.
    pub hips: V3,
    /// World rotation of every joint away from its rest orientation.
    pub turn: [Quat; JOINTS],
}

impl Pose {
    pub fn positions(&self, rig: &Rig) -> [V3; JOINTS] {
        let mut at = [self.hips; JOINTS];
        for j in 1..JOINTS {
            let p = PARENTS[j];
            at[j] = at[p] + self.turn[p] * rig.offset(p, j);
        }
        at
    }

    /// World from joint, for every joint.
    pub fn world(&self, rig: &Rig) -> [Isometry3<f64>; JOINTS] {
        let at = self.positions(rig);
        std::array::from_fn(|j| Isometry3::from_parts(at[j].into(), self.turn[j] * rig.axes[j]))
    }

    /// Parent from joint, for every joint.
    pub fn local(&self, rig: &Rig) -> [Isometry3<f64>; JOINTS] {
        let world = self.world(rig);
        std::array::from_fn(|j| Rig::parent(j).map_or(world[j], |p| world[p].inverse() * world[j]))
    }
}

fn rest_positions() -> [V3; JOINTS] {
    let mut at = [V3::zeros(); JOINTS];
    let hips = HIP_HEIGHT + HIPS_ABOVE_LEGS;
    at[HIPS] = V3::new(0.0, hips, 0.0);
    at[SPINE] = V3::new(0.0, hips + 0.090, -0.010);
    at[CHEST] = V3::new(0.0, hips + 0.250, -0.015);
    at[NECK] = V3::new(0.0, SHOULDER_HEIGHT + 0.055, -0.020);
    at[HEAD] = V3::new(0.0, SHOULDER_HEIGHT + 0.145, 0.0);
    at[HEAD_TOP] = V3::new(0.0, STATURE, 0.0);
    for side in 0..2 {
        place_arm(&mut at, side);
        place_leg(&mut at, side);
    }
    at
}

fn place_arm(at: &mut [V3; JOINTS], side: usize) {
    let (s, first) = (side_sign(side), SHOULDER[side]);
    let wrist = SHOULDER_HALF_WIDTH + UPPER_ARM + FOREARM;
    let across = [
        0.030,
        SHOULDER_HALF_WIDTH,
        SHOULDER_HALF_WIDTH + UPPER_ARM,
        wrist,
    ];
    for (k, x) in across.into_iter().enumerate() {
        at[first + k] = V3::new(s * x, SHOULDER_HEIGHT, -0.015);
    }
}

fn place_leg(at: &mut [V3; JOINTS], side: usize) {
    let (s, first) = (side_sign(side), UP_LEG[side]);
    for (k, y) in [HIP_HEIGHT, ANKLE_HEIGHT + SHANK, ANKLE_HEIGHT]
        .into_iter()
        .enumerate()
    {
        at[first + k] = V3::new(s * HIP_HALF_WIDTH, y, 0.0);
    }
    at[first + 3] = V3::new(s * HIP_HALF_WIDTH, BALL_HEIGHT, BALL_AHEAD);
}

/// Columns are the joint's x, y and z axes in the world, at rest.
fn rest_axes(joint: usize) -> Quat {
    let columns = |x: V3, y: V3| {
        let frame = Rotation3::from_basis_unchecked(&[x, y, x.cross(&y)]);
        Quat::from_rotation_matrix(&frame)
    };
    let (left_arm, right_arm) = (SHOULDER[0]..SHOULDER[0] + 4, SHOULDER[1]..SHOULDER[1] + 4);
    let is_leg = UP_LEG.iter().any(|&up| (up..up + 2).contains(&joint));
    if left_arm.contains(&joint) {
        columns(V3::z(), V3::x())
    } else if right_arm.contains(&joint) {
        columns(-V3::z(), -V3::x())
    } else if is_leg {
        columns(-V3::x(), -V3::y())
    } else {
        Quat::identity()
    }
}
