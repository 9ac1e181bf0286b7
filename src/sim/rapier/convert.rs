//! Conversions between nalgebra, which this library uses, and glam, which rapier uses.

use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rapier3d::math::{Mat3, Pose, Rotation, Vector};

pub(super) fn vector(v: Vector3<f32>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(super) fn rotation(q: UnitQuaternion<f32>) -> Rotation {
    Rotation::from_xyzw(q.i, q.j, q.k, q.w)
}

pub(super) fn pose(p: &Isometry3<f32>) -> Pose {
    Pose::from_parts(vector(p.translation.vector), rotation(p.rotation))
}

pub(super) fn matrix(m: &Matrix3<f32>) -> Mat3 {
    Mat3::from_cols(
        vector(m.column(0).into()),
        vector(m.column(1).into()),
        vector(m.column(2).into()),
    )
}

pub(super) fn from_vector(v: Vector) -> Vector3<f32> {
    Vector3::new(v.x, v.y, v.z)
}

pub(super) fn from_pose(p: &Pose) -> Isometry3<f32> {
    let q = Quaternion::new(p.rotation.w, p.rotation.x, p.rotation.y, p.rotation.z);
    let at = from_vector(p.translation);
    // rapier keeps its rotations normalised.
    Isometry3::from_parts(Translation3::from(at), UnitQuaternion::new_unchecked(q))
}
