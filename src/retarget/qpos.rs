//! Parts of MuJoCo's coordinates `qpos`: the root's position is at 0..3, its orientation (w, x, y, z) at 3..7.

use super::rotation::exp;
use crate::motion::Cycle;
use nalgebra::{Matrix3, Quaternion, Rotation3, Unit, UnitQuaternion, Vector3};

/// Three values from index `at` on.
pub(super) fn vector(values: &[f64], at: usize) -> Vector3<f64> {
    Vector3::new(values[at], values[at + 1], values[at + 2])
}

/// The quaternion (w, x, y, z) from index `at` on, normalised; the identity where it has no length.
pub(super) fn quaternion(qpos: &[f64], at: usize) -> UnitQuaternion<f64> {
    let q = Quaternion::new(qpos[at], qpos[at + 1], qpos[at + 2], qpos[at + 3]);
    Unit::try_new(q, 1e-12).unwrap_or_else(UnitQuaternion::identity)
}

/// Writes a quaternion (w, x, y, z) from index `at` on.
pub(super) fn put_quaternion(qpos: &mut [f64], at: usize, q: &UnitQuaternion<f64>) {
    qpos[at..at + 4].copy_from_slice(&[q.w, q.i, q.j, q.k]);
}

/// What carries coordinates from one cycle of a motion to another.
#[derive(Clone, Copy, Debug)]
pub(super) struct CycleStep {
    /// The turn about the world's Z axis.
    pub turn: Matrix3<f64>,
    /// The shift that follows it, metres.
    pub shift: Vector3<f64>,
}

impl CycleStep {
    /// The step of a turn and a shift.
    pub fn new(turn: &UnitQuaternion<f64>, shift: Vector3<f64>) -> CycleStep {
        CycleStep {
            turn: *turn.to_rotation_matrix().matrix(),
            shift,
        }
    }

    /// The step from each cycle to the next.
    pub fn of(cycle: &Cycle) -> CycleStep {
        CycleStep::new(&exp(&(Vector3::z() * cycle.heading)), cycle.translation)
    }

    /// Coordinates carried on by the step: the root moves, the joints stay.
    pub fn carry(&self, qpos: &[f64]) -> Vec<f64> {
        let mut carried = qpos.to_vec();
        let root = self.turn * vector(qpos, 0) + self.shift;
        carried[..3].copy_from_slice(root.as_slice());
        let turn = Rotation3::from_matrix_unchecked(self.turn);
        let turned = UnitQuaternion::from_rotation_matrix(&turn) * quaternion(qpos, 3);
        put_quaternion(&mut carried, 3, &turned);
        carried
    }
}
