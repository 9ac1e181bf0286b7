//! Which way a body faces along the ground.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// The place on the ground below a pose, facing where its x axis does.
pub fn anchor(pose: &Isometry3<f32>) -> Isometry3<f32> {
    let at = pose.translation.vector;
    Isometry3::from_parts(Translation3::new(at.x, at.y, 0.0), heading(&pose.rotation))
}

/// The turn about the vertical that carries the world's x axis to where the rotation's x axis points along the ground.
pub fn heading(turn: &UnitQuaternion<f32>) -> UnitQuaternion<f32> {
    let forward = turn * Vector3::x();
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), forward.y.atan2(forward.x))
}
