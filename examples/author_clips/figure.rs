//! From what an animator says (trunk angles, where feet and hands are) to a pose of every joint.

use crate::rig::{ANKLE_HEIGHT, BALL_AHEAD, HEEL_BEHIND};
use crate::rig::{
    BALL_HEIGHT, CHEST, FOREARM, HEAD, HEAD_TOP, HIPS, JOINTS, NECK, Pose, Quat, Rig, SHANK,
    SHOULDER, SPINE, THIGH, UP_LEG, UPPER_ARM, V3,
};
use nalgebra::Rotation3;

/// Turns in radians, each about the axes turned by the ones before it: `yaw` to the left about Y, `pitch` forward
/// about X, `roll` to the right about Z.
#[derive(Clone, Copy, Default)]
pub struct Turn {
    pub yaw: f64,
    pub pitch: f64,
    pub roll: f64,
}

impl Turn {
    pub fn quat(self) -> Quat {
        Quat::from_axis_angle(&V3::y_axis(), self.yaw)
            * Quat::from_axis_angle(&V3::x_axis(), self.pitch)
            * Quat::from_axis_angle(&V3::z_axis(), self.roll)
    }

    fn scaled(self, by: f64) -> Self {
        Self {
            yaw: self.yaw * by,
            pitch: self.pitch * by,
            roll: self.roll * by,
        }
    }
}

/// Where a foot is. Positive pitch lifts the heel.
#[derive(Clone, Copy)]
pub struct Foot {
    pub ankle: V3,
    pub turn: Quat,
    pub toes: Quat,
    /// The knee's axis, pointing to the left.
    pub knee_axis: V3,
}

impl Foot {
    /// Placed by the joint in the ball of the foot.
    pub fn on_ball(ball: V3, yaw: f64, pitch: f64, toe_pitch: f64) -> Self {
        let ankle_from_ball = V3::new(0.0, ANKLE_HEIGHT - BALL_HEIGHT, -BALL_AHEAD);
        let turn = foot_turn(yaw, pitch);
        Self::at(ball + turn * ankle_from_ball, yaw, pitch, toe_pitch)
    }

    /// Placed by the lowest point of the heel.
    pub fn on_heel(heel: V3, yaw: f64, pitch: f64, toe_pitch: f64) -> Self {
        let ankle_from_heel = V3::new(0.0, ANKLE_HEIGHT, HEEL_BEHIND);
        Self::at(
            heel + foot_turn(yaw, pitch) * ankle_from_heel,
            yaw,
            pitch,
            toe_pitch,
        )
    }

    /// Placed by the ankle.
    pub fn at(ankle: V3, yaw: f64, pitch: f64, toe_pitch: f64) -> Self {
        Self {
            ankle,
            turn: foot_turn(yaw, pitch),
            toes: foot_turn(yaw, toe_pitch),
            knee_axis: foot_turn(yaw, 0.0) * V3::x(),
        }
    }
}

fn foot_turn(yaw: f64, pitch: f64) -> Quat {
    Turn {
        yaw,
        pitch,
        roll: 0.0,
    }
    .quat()
}

/// Where a hand is, in the chest's frame.
#[derive(Clone, Copy)]
pub struct Hand {
    /// Wrist from the shoulder joint, m.
    pub wrist: V3,
    /// Side to which the elbow points.
    pub elbow: V3,
}

/// All that is said about one instant.
#[derive(Clone)]
pub struct Figure {
    pub hips: V3,
    pub pelvis: Turn,
    /// Chest against pelvis, shared by the two spine joints.
    pub trunk: Turn,
    /// Head against chest, shared by neck and head.
    pub head: Turn,
    /// Left, right.
    pub hands: [Hand; 2],
    pub feet: [Foot; 2],
}

impl Figure {
    pub fn pose(&self, rig: &Rig) -> Pose {
        let mut pose = Pose {
            hips: self.hips,
            turn: [Quat::identity(); JOINTS],
        };
        pose.turn[HIPS] = self.pelvis.quat();
        pose.turn[SPINE] = pose.turn[HIPS] * self.trunk.scaled(0.5).quat();
        pose.turn[CHEST] = pose.turn[SPINE] * self.trunk.scaled(0.5).quat();
        pose.turn[NECK] = pose.turn[CHEST] * self.head.scaled(0.5).quat();
        pose.turn[HEAD] = pose.turn[NECK] * self.head.scaled(0.5).quat();
        pose.turn[HEAD_TOP] = pose.turn[HEAD];
        for side in 0..2 {
            self.arm(&mut pose, rig, side);
            self.leg(&mut pose, rig, side);
        }
        pose
    }

    fn arm(&self, pose: &mut Pose, rig: &Rig, side: usize) {
        let first = SHOULDER[side];
        let chest = pose.turn[CHEST];
        let bones = Bones {
            along: rig.offset(first + 1, first + 2).normalize(),
            bend: -V3::z(),
            lengths: [UPPER_ARM, FOREARM],
        };
        let hand = &self.hands[side];
        let [upper, lower] = bones.reach(chest * hand.wrist, chest * hand.elbow);
        pose.turn[first] = chest;
        pose.turn[first + 1] = upper;
        pose.turn[first + 2] = lower;
        pose.turn[first + 3] = lower;
    }

    fn leg(&self, pose: &mut Pose, rig: &Rig, side: usize) {
        let first = UP_LEG[side];
        let foot = &self.feet[side];
        let hip = pose.hips + pose.turn[HIPS] * rig.offset(HIPS, first);
        let bones = Bones {
            along: -V3::y(),
            bend: V3::z(),
            lengths: [THIGH, SHANK],
        };
        let to_ankle = foot.ankle - hip;
        let [upper, lower] = bones.reach(to_ankle, to_ankle.cross(&foot.knee_axis));
        pose.turn[first] = upper;
        pose.turn[first + 1] = lower;
        pose.turn[first + 2] = foot.turn;
        pose.turn[first + 3] = foot.toes;
    }
}

/// Two bones in line at rest, with a hinge between them.
struct Bones {
    /// Direction at rest.
    along: V3,
    /// Direction into which the hinge leaves the line when it bends, at rest.
    bend: V3,
    lengths: [f64; 2],
}

impl Bones {
    /// World turns of both bones when the far end is at `target` from the near end and the hinge is moved towards
    /// `pole`. The law of cosines; a target out of reach gives the straight limb.
    fn reach(&self, target: V3, pole: V3) -> [Quat; 2] {
        let [a, b] = self.lengths;
        let distance = target.norm().min(a + b);
        let cosine = (a * a + distance * distance - b * b) / (2.0 * a * distance);
        let angle = cosine.clamp(-1.0, 1.0).acos();
        let along = target.normalize();
        let bend = (pole - along * along.dot(&pole)).normalize();
        let upper = along * angle.cos() + bend * angle.sin();
        let lower = (along * distance - upper * a).normalize();
        let normal = along.cross(&bend);
        [self.turn(upper, normal), self.turn(lower, normal)]
    }

    fn turn(&self, along: V3, normal: V3) -> Quat {
        let frame = |x: V3, n: V3| Rotation3::from_basis_unchecked(&[x, n, x.cross(&n)]);
        let rest = frame(self.along, self.along.cross(&self.bend));
        Quat::from_rotation_matrix(&(frame(along, normal) * rest.inverse()))
    }
}
