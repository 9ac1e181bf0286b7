//! Where on the ground a motion is performed, and which way it faces.

use crate::sim::LinkState;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Where and how a motion is performed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Carries the whole motion: a turn about the vertical and a shift along the ground.
    pub pose: Isometry3<f32>,
    /// Velocity at which the whole motion slides on top of its own, m/s, world axes.
    pub velocity: Vector3<f32>,
    /// Playback speed factor: seconds of the motion per second.
    pub pace: f32,
}

impl Placement {
    /// Moves a link of the motion to its place. At another pace its own velocities grow by that factor.
    pub(super) fn put(&self, link: &mut LinkState) {
        *link = moved(link, &self.pose);
        link.linear = link.linear * self.pace + self.velocity;
        link.angular *= self.pace;
    }

    /// The motion's own place, at its own pace.
    pub fn own() -> Self {
        Self {
            pose: Isometry3::identity(),
            velocity: Vector3::zeros(),
            pace: 1.0,
        }
    }
}

/// The place on the ground below a pose, facing where its x axis does.
pub(in crate::task) fn anchor(pose: &Isometry3<f32>) -> Isometry3<f32> {
    let at = pose.translation.vector;
    Isometry3::from_parts(Translation3::new(at.x, at.y, 0.0), heading(&pose.rotation))
}

/// The turn about the vertical that carries the world's x axis to where the rotation's x axis points along the ground.
pub(in crate::task) fn heading(turn: &UnitQuaternion<f32>) -> UnitQuaternion<f32> {
    let forward = turn * Vector3::x();
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), forward.y.atan2(forward.x))
}

/// The state of a link that `offset` has carried to another place.
pub(super) fn moved(state: &LinkState, offset: &Isometry3<f32>) -> LinkState {
    LinkState {
        pose: offset * state.pose,
        linear: offset.rotation * state.linear,
        angular: offset.rotation * state.angular,
    }
}
