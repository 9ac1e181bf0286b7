//! The physics character: bodies, joints, shapes, masses and drives, read from MJCF.
//!
//! Bodies, joints and coordinates keep MuJoCo's order and conventions, so that `qpos` and `qvel` mean the same in both.
//! A free joint has a position (3) and a quaternion w, x, y, z (4); its velocity is linear in world axes (3) and angular in
//! the body's own axes (3). A ball joint has a quaternion, and its velocity is in the child's axes. Several hinges on one
//! body turn it one after the other.
//!
//! ```
//! use mimic::humanoid::Slot;
//! use mimic::skeleton::Skeleton;
//!
//! let skeleton = Skeleton::load("humanoid")?;
//! let poses = skeleton.forward(&skeleton.rest_qpos());
//! let head = poses[skeleton.slots[&Slot::Head]];
//! assert!(head.translation.z > skeleton.leg_length(), "the head is above the legs");
//! # Ok::<(), mimic::skeleton::SkeletonError>(())
//! ```

mod actuators;
mod build;
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
pub(crate) use inertia::point_inertia;
pub(crate) use rotations::twist;

use crate::humanoid::Slot;
use nalgebra::{Isometry3, Matrix3, Vector3};
use std::collections::BTreeMap;

/// Acceleration of gravity, m/s², along −Z: MuJoCo's default (`option/gravity`), so that both engines weigh alike.
///
/// It differs by 0.03 % from the standard gravity of 9.80665 m/s² (3rd CGPM, 1901).
pub const GRAVITY: f64 = 9.81;

/// How a joint lets a body move in its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    /// Moves and turns freely; only the root has one.
    Free,
    /// Turns any way about its anchor.
    Ball,
    /// Turns about a unit axis, in the child body's frame.
    Hinge(Vector3<f64>),
    /// Moves along a unit axis, in the child body's frame.
    Slide(Vector3<f64>),
}

impl JointKind {
    /// Number of coordinates in `qpos`.
    pub fn nq(self) -> usize {
        match self {
            Self::Free => 7,
            Self::Ball => 4,
            Self::Hinge(_) | Self::Slide(_) => 1,
        }
    }

    /// Number of coordinates in `qvel`: the degrees of freedom.
    pub fn nv(self) -> usize {
        match self {
            Self::Free => 6,
            Self::Ball => 3,
            Self::Hinge(_) | Self::Slide(_) => 1,
        }
    }
}

/// A position drive on one degree of freedom, as MuJoCo's `position` actuator:
/// torque = kp (target − coordinate) − kd · rate, clamped to ± `force_limit`.
///
/// The units are those of a hinge or a ball; for a slide they are N/m, N·s/m and N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Stiffness, N·m/rad.
    pub kp: f64,
    /// Damping, N·m·s/rad.
    pub kd: f64,
    /// Largest torque, N·m; infinite where the file sets no limit.
    pub force_limit: f64,
}

/// One joint between a body and its parent.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name in the MJCF; a joint without one is called after its body.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Point about which it turns, in the child body's frame, metres.
    pub anchor: Vector3<f64>,
    /// First index in `qpos`.
    pub qpos: usize,
    /// First index in `qvel`.
    pub dof: usize,
    /// One for each degree of freedom, none for a free joint. The three of a ball joint act on its exponential-map
    /// coordinates along the child's x, y, z.
    pub drives: Vec<Drive>,
    /// Range of each degree of freedom, lowest and highest coordinate, radians (metres for a slide); none for a free joint.
    /// Those of a ball joint are ranges of its exponential-map coordinates.
    pub limits: Vec<[f64; 2]>,
}

/// A shape that can touch the ground, placed in its body's frame, metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Its centre.
        center: Vector3<f64>,
        /// Its radius.
        radius: f64,
    },
    /// All points within `radius` of the segment from `a` to `b`.
    Capsule {
        /// One end of the segment.
        a: Vector3<f64>,
        /// The other end.
        b: Vector3<f64>,
        /// Distance of the surface from the segment.
        radius: f64,
    },
    /// A cuboid.
    Box {
        /// Body from box: the box's centre and axes.
        pose: Isometry3<f64>,
        /// Half of its extents along its axes.
        half: Vector3<f64>,
    },
}

/// One rigid body of the character.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name in the MJCF, which no other body has.
    pub name: String,
    /// Index of the parent, which comes before this body; `None` for the root.
    pub parent: Option<usize>,
    /// Parent from body, at zero joint coordinates.
    pub rest: Isometry3<f64>,
    /// The joints between parent and body, in the order in which they act; none for a body welded to its parent.
    pub joints: Vec<Joint>,
    /// The shapes that can touch the ground.
    pub shapes: Vec<Shape>,
    /// Coulomb friction coefficient of its shapes.
    pub friction: f64,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the body's frame, metres.
    pub com: Vector3<f64>,
    /// Moment of inertia about the centre of mass, along the body's axes, kg·m².
    pub inertia: Matrix3<f64>,
}

/// A character that physics can move.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    /// Name of the built-in character, or of the file without its extension.
    pub name: String,
    /// Lower-case hexadecimal SHA-256 of the MJCF text.
    pub sha256: String,
    /// The MJCF text itself, which runs and policy files carry along.
    pub mjcf: String,
    /// The bodies in MJCF order, parents before children.
    pub bodies: Vec<Body>,
    /// Index of the body that takes each humanoid slot.
    pub slots: BTreeMap<Slot, usize>,
    /// Number of coordinates in `qpos`.
    pub nq: usize,
    /// Number of coordinates in `qvel`: the degrees of freedom.
    pub nv: usize,
}

/// Velocity of one body: linear at the origin of its frame, and angular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// Velocity of the body frame's origin, world axes, m/s.
    pub linear: Vector3<f64>,
    /// Angular velocity, world axes, rad/s.
    pub angular: Vector3<f64>,
}

#[cfg(test)]
mod tests;
