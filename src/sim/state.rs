//! Where links are, and where their drives should bring them.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// Pose and velocity of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkState {
    /// World from link.
    pub pose: Isometry3<f32>,
    /// Velocity of the origin of the link's frame, world axes, m/s.
    pub linear: Vector3<f32>,
    /// Angular velocity, world axes, rad/s.
    pub angular: Vector3<f32>,
}

impl LinkState {
    /// At the world's origin, at rest.
    pub(super) fn at_rest() -> Self {
        LinkState {
            pose: Isometry3::identity(),
            linear: Vector3::zeros(),
            angular: Vector3::zeros(),
        }
    }
}

/// The joint position that a link's drive holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// None: the root has no drive.
    Free,
    /// Rotation of a ball joint, or of several hinges together; the identity at rest.
    Ball(UnitQuaternion<f32>),
    /// Angle of a hinge, radians; 0 at rest.
    Hinge(f32),
}
