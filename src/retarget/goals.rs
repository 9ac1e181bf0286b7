//! What the skeleton should look like in every frame: target positions and orientations, and coordinates to start from.

use super::hinge_speed::HingeSpeeds;
use super::limbs;
use super::qpos::{quaternion, vector};
use super::rotation::exp;
use crate::humanoid::Slot;
use nalgebra::{UnitQuaternion, Vector3};

/// A body whose origin follows the source.
#[derive(Clone, Copy, Debug)]
pub(super) struct Keypoint {
    /// The joint that the body's origin is.
    pub slot: Slot,
    /// Index of the body.
    pub body: usize,
    /// Weight of its distance, per metre.
    pub weight: f64,
}

/// A body whose orientation follows the source.
#[derive(Clone, Copy, Debug)]
pub(super) struct Orientation {
    /// The slot that the body is in.
    pub slot: Slot,
    /// Index of the body.
    pub body: usize,
    /// Weight of its angle, per radian; keypoints count 1 per metre.
    pub weight: f64,
}

/// The goals of all frames.
#[derive(Clone)]
pub(super) struct Goals {
    /// Which bodies have positions to reach.
    pub keypoints: Vec<Keypoint>,
    /// Which bodies have orientations to reach.
    pub orientations: Vec<Orientation>,
    /// `points[f][k]`: target of keypoint `k`, world, metres.
    pub points: Vec<Vec<Vector3<f64>>>,
    /// `rotations[f][o]`: target of orientation `o`, world from body.
    pub rotations: Vec<Vec<UnitQuaternion<f64>>>,
    /// `guess[f]`: coordinates that take over the source's orientations; where the solver starts.
    pub guess: Vec<Vec<f64>>,
    /// `ankle_offsets[f]`: from the left and the right ankle's target to where the ankle would be if the skeleton's own leg
    /// had the source's directions, metres.
    pub ankle_offsets: Vec<[Vector3<f64>; 2]>,
    /// How fast hinges may turn.
    pub speeds: HingeSpeeds,
}

/// How the targets of a foot or hand are moved: a shift of its keypoint, metres, and a turn about Z, radians.
#[derive(Clone, Copy, Debug)]
pub(super) struct LimbShift {
    /// Metres, world.
    pub shift: Vector3<f64>,
    /// Radians about +Z.
    pub turn: f64,
}

impl LimbShift {
    /// No move.
    pub const NONE: LimbShift = LimbShift {
        shift: Vector3::new(0.0, 0.0, 0.0),
        turn: 0.0,
    };
}

impl Goals {
    /// How many frames there are.
    pub fn frames(&self) -> usize {
        self.points.len()
    }

    /// The index of a slot's keypoint.
    pub fn keypoint(&self, slot: Slot) -> Option<usize> {
        self.keypoints.iter().position(|key| key.slot == slot)
    }

    /// Moves everything at frame `f`.
    pub fn shift_frame(&mut self, f: usize, by: &Vector3<f64>) {
        self.points[f].iter_mut().for_each(|p| *p += by);
        for i in 0..3 {
            self.guess[f][i] += by[i];
        }
    }

    /// Moves the targets of a limb at frame `f`: the keypoint `key` at its end wholly, the knee or elbow half the way, so
    /// that the limb bends instead of breaking.
    pub fn shift_limb(&mut self, f: usize, key: usize, by: &LimbShift) {
        let Keypoint { slot, body, .. } = self.keypoints[key];
        self.points[f][key] += by.shift;
        // Knee or elbow, if it has a target.
        let middle = limbs::joint_above(slot).and_then(|slot| self.keypoint(slot));
        if let Some(k) = middle {
            self.points[f][k] += by.shift / 2.0;
        }
        if let Some(o) = self.orientations.iter().position(|turn| turn.body == body) {
            self.rotations[f][o] = exp(&(Vector3::z() * by.turn)) * self.rotations[f][o];
        }
    }

    /// Position of the root in the guess, world, metres.
    pub fn root(&self, f: usize) -> Vector3<f64> {
        vector(&self.guess[f], 0)
    }

    /// Orientation of the root in the guess, world from root.
    pub fn root_rotation(&self, f: usize) -> UnitQuaternion<f64> {
        quaternion(&self.guess[f], 3)
    }
}
