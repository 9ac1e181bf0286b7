//! The physics character: bodies, joints, shapes, mass and drives, read from MJCF.
//!
//! Bodies, joints and coordinates keep MuJoCo's order and conventions, so that `qpos` and `qvel` mean the same
//! here and there: a free joint is position (3) then quaternion w, x, y, z (4), with velocities linear in the
//! world and angular in the body's own frame; a ball joint is a quaternion, its velocity in the child's frame;
//! several hinges on one body turn it one after the other.

mod coordinates;
mod drive;
mod error;
mod guard;
mod inertia;
mod kinematics;
pub(crate) mod limits;
mod load;
mod measure;
mod rotations;
mod shape;
mod slots;

pub use error::SkeletonError;
pub(crate) use rotations::twist;

use crate::humanoid::Slot;
use nalgebra::{Isometry3, Matrix3, Vector3};
use std::collections::BTreeMap;

/// Acceleration of gravity, m/s², along −Z: MuJoCo's default (`option/gravity`), so that both engines weigh alike.
///
/// It differs by 0.03 % from the standard gravity of 9.80665 m/s² (3rd CGPM, 1901).
pub const GRAVITY: f64 = 9.81;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    Free,
    Ball,
    /// Turns about a unit axis, in the child body's frame.
    Hinge(Vector3<f64>),
    /// Moves along a unit axis, in the child body's frame.
    Slide(Vector3<f64>),
}

/// A position drive on one degree of freedom, as a MuJoCo `position` actuator:
/// torque = kp (target − coordinate) − kd · rate, never beyond ± `force_limit`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// N·m/rad.
    pub kp: f64,
    /// N·m·s/rad.
    pub kd: f64,
    /// N·m; infinite where the file sets none.
    pub force_limit: f64,
}

/// One joint between a body and its parent.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    pub name: String,
    pub kind: JointKind,
    /// Point about which it turns, in the child body's frame, metres.
    pub anchor: Vector3<f64>,
    /// First index in `qpos`.
    pub qpos: usize,
    /// First index in `qvel`.
    pub dof: usize,
    /// One per degree of freedom (none for a free joint). A ball joint's three act on its exponential-map
    /// coordinates along x, y, z.
    pub drives: Vec<Drive>,
    /// Range of every driven coordinate in radians; a ball joint's are those of its exponential map.
    pub limits: Vec<[f64; 2]>,
}

/// Collision and mass shape, placed in its body's frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    Sphere {
        center: Vector3<f64>,
        radius: f64,
    },
    /// Segment from `a` to `b`, swept by `radius`.
    Capsule {
        a: Vector3<f64>,
        b: Vector3<f64>,
        radius: f64,
    },
    Box {
        pose: Isometry3<f64>,
        half: Vector3<f64>,
    },
}

/// One body of the character. Parents stand before their children.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    pub name: String,
    pub parent: Option<usize>,
    /// Parent from body, at zero joint coordinates.
    pub rest: Isometry3<f64>,
    /// In MJCF order; empty for a body welded to its parent.
    pub joints: Vec<Joint>,
    pub shapes: Vec<Shape>,
    /// Coulomb friction coefficient of its shapes.
    pub friction: f64,
    /// kg.
    pub mass: f64,
    /// Centre of mass in the body's frame, metres.
    pub com: Vector3<f64>,
    /// Inertia about the centre of mass, along the body's axes, kg·m².
    pub inertia: Matrix3<f64>,
}

/// A character that physics can move.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    pub name: String,
    /// Lower-case hexadecimal SHA-256 of the MJCF text.
    pub sha256: String,
    /// The MJCF text itself, so that a run is self-contained.
    pub mjcf: String,
    pub bodies: Vec<Body>,
    /// Body that stands for each humanoid slot.
    pub slots: BTreeMap<Slot, usize>,
    pub nq: usize,
    pub nv: usize,
}

/// Velocity of one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// Velocity of the body frame's origin, world axes, m/s.
    pub linear: Vector3<f64>,
    /// Angular velocity, world axes, rad/s.
    pub angular: Vector3<f64>,
}

#[cfg(test)]
mod tests;
