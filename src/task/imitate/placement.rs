//! Where on the ground a motion is performed, and which way it faces.

use crate::sim::LinkState;
use nalgebra::{Isometry3, Vector3};

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

/// The state of a link that `offset` has carried to another place.
pub(super) fn moved(state: &LinkState, offset: &Isometry3<f32>) -> LinkState {
    LinkState {
        pose: offset * state.pose,
        linear: offset.rotation * state.linear,
        angular: offset.rotation * state.angular,
    }
}
