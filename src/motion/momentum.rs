//! Centre of mass and momenta of the whole body along a motion.

use crate::skeleton::Skeleton;
use nalgebra::{Isometry3, Vector3};

/// The tracks that follow from poses and velocities of one frame at a time; units as in [`Tracks`](super::Tracks).
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct WholeBody {
    pub(crate) com: Vec<Vector3<f64>>,
    pub(crate) com_velocity: Vec<Vector3<f64>>,
    pub(crate) linear_momentum: Vec<Vector3<f64>>,
    pub(crate) angular_momentum: Vec<Vector3<f64>>,
}

/// Computes the tracks by [`Skeleton::com`] and [`Skeleton::momentum`]. The centre of mass moves at linear momentum over
/// mass, which is exact; a difference of positions would only approximate it.
pub(crate) fn whole_body(
    skeleton: &Skeleton,
    qpos: &[Vec<f64>],
    qvel: &[Vec<f64>],
    bodies: &[Vec<Isometry3<f64>>],
) -> WholeBody {
    let mass = skeleton.total_mass();
    let mut tracks = WholeBody::default();
    for (poses, (q, v)) in bodies.iter().zip(qpos.iter().zip(qvel)) {
        let (linear, angular) = skeleton.momentum(poses, &skeleton.twists(q, v));
        tracks.com.push(skeleton.com(poses));
        tracks.com_velocity.push(linear / mass);
        tracks.linear_momentum.push(linear);
        tracks.angular_momentum.push(angular);
    }
    tracks
}
