//! Differences and sums on the space of `qpos`, as MuJoCo's `mj_differentiatePos` and `mj_integratePos`.

use super::kinematics::{quaternion, vector};
use super::{JointKind, Skeleton};
use nalgebra::{UnitQuaternion, Vector3};

impl Skeleton {
    /// Constant velocity `[nv]` that leads from `q0` to `q1` (both `[nq]`) in `dt` seconds, rotations taking the shorter way.
    ///
    /// # Panics
    /// If `q0` or `q1` is shorter than [`Skeleton::nq`].
    pub fn differentiate(&self, q0: &[f64], q1: &[f64], dt: f64) -> Vec<f64> {
        let mut qvel = vec![0.0; self.nv];
        for joint in self.bodies.iter().flat_map(|b| &b.joints) {
            let (q, v) = (joint.qpos, joint.dof);
            match joint.kind {
                JointKind::Free => {
                    store(&mut qvel, v, (vector(q1, q) - vector(q0, q)) / dt);
                    store(&mut qvel, v + 3, turn(q0, q1, q + 3) / dt);
                }
                JointKind::Ball => store(&mut qvel, v, turn(q0, q1, q) / dt),
                JointKind::Hinge(_) | JointKind::Slide(_) => qvel[v] = (q1[q] - q0[q]) / dt,
            }
        }
        qvel
    }

    /// Coordinates `[nq]` that are reached from `qpos` (`[nq]`) after `dt` seconds at constant `qvel` (`[nv]`).
    ///
    /// # Panics
    /// If `qpos` is shorter than [`Skeleton::nq`] or `qvel` than [`Skeleton::nv`].
    pub fn integrate(&self, qpos: &[f64], qvel: &[f64], dt: f64) -> Vec<f64> {
        let mut moved = qpos[..self.nq].to_vec();
        for joint in self.bodies.iter().flat_map(|b| &b.joints) {
            let (q, v) = (joint.qpos, joint.dof);
            match joint.kind {
                JointKind::Free => {
                    let position = vector(qpos, q) + vector(qvel, v) * dt;
                    store(&mut moved, q, position);
                    turned(&mut moved, q + 3, vector(qvel, v + 3) * dt);
                }
                JointKind::Ball => turned(&mut moved, q, vector(qvel, v) * dt),
                JointKind::Hinge(_) | JointKind::Slide(_) => moved[q] += qvel[v] * dt,
            }
        }
        moved
    }

    /// Coordinates `[nq]` at the fraction `t` of the way from `q0` to `q1`, rotations along the shorter arc at constant rate.
    ///
    /// # Panics
    /// If `q0` or `q1` is shorter than [`Skeleton::nq`].
    pub fn interpolate(&self, q0: &[f64], q1: &[f64], t: f64) -> Vec<f64> {
        self.integrate(q0, &self.differentiate(q0, q1, 1.0), t)
    }
}

/// Writes a unit quaternion scalar first.
pub(super) fn store_quaternion(values: &mut [f64], at: usize, q: &UnitQuaternion<f64>) {
    values[at..at + 4].copy_from_slice(&[q.w, q.i, q.j, q.k]);
}

/// Writes a vector.
pub(super) fn store(values: &mut [f64], at: usize, v: Vector3<f64>) {
    values[at..at + 3].copy_from_slice(v.as_slice());
}

/// Rotation vector from the quaternion in `q0` to that in `q1`, radians. Its components are the same in both frames, because
/// the axis of a rotation stays where it is.
fn turn(q0: &[f64], q1: &[f64], at: usize) -> Vector3<f64> {
    (quaternion(q0, at).inverse() * quaternion(q1, at)).scaled_axis()
}

/// Rotates the quaternion at `at` by a rotation vector in the body's own frame, as MuJoCo's `mju_quatIntegrate` does.
fn turned(qpos: &mut [f64], at: usize, rotation: Vector3<f64>) {
    let q = quaternion(qpos, at) * UnitQuaternion::from_scaled_axis(rotation);
    store_quaternion(qpos, at, &q);
}
