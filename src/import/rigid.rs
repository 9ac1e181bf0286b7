//! World matrices with scale, shear and mirroring become rigid transforms at the same places.

use crate::clip::slerp;
use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};

/// From a file's axes and units to canonical space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Rotation or reflection: canonical from file.
    pub axes: Matrix3<f64>,
    /// Metres per unit of the file.
    pub unit_m: f64,
    /// The caller said which way is up, so the figure doesn't decide it.
    pub is_sure: bool,
}

/// Positions beyond this are damage, not motion, metres. Chosen: clip files have single precision, and this is far enough from
/// its limit that later arithmetic stays finite.
const FARTHEST_M: f64 = 1e12;

impl Frame {
    /// The rigid transform, in canonical space, at the position of the file's `world`, with the rotation nearest to its own.
    /// A matrix that has none, because it is scaled to nothing, gets `otherwise`. `None` if the position can't be used.
    ///
    /// Rotations are conjugated (A R Aᵀ) and not only multiplied by the axes A: so joints aligned with the file's axes become
    /// aligned with the canonical ones, and axes that reflect still make rotations.
    pub fn rigid(
        &self,
        world: &Matrix4<f64>,
        otherwise: &UnitQuaternion<f64>,
    ) -> Option<Isometry3<f64>> {
        let place = self.axes * world.fixed_view::<3, 1>(0, 3).into_owned() * self.unit_m;
        if !place.iter().all(|x| x.abs() < FARTHEST_M) {
            return None;
        }
        let rotation = match rotation_of(&world.fixed_view::<3, 3>(0, 0).into_owned()) {
            Some(turn) => self.conjugate(&turn),
            None => *otherwise,
        };
        Some(Isometry3::from_parts(Translation3::from(place), rotation))
    }

    fn conjugate(&self, turn: &Rotation3<f64>) -> UnitQuaternion<f64> {
        // Conjugation: into the file's axes, turn, and back.
        let matrix = self.axes * turn.matrix() * self.axes.transpose();
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
    }
}

/// The rotation nearest to a linear map, or `None` where the map flattens space (to a billionth, chosen: beyond that the axis is
/// noise).
///
/// A map that mirrors is reflected through the origin first. Any reflection would make it a rotation, but this one needs no
/// choice of an axis, so the result can't jump from one frame to the next.
pub(crate) fn rotation_of(linear: &Matrix3<f64>) -> Option<Rotation3<f64>> {
    // The scale along each axis of the joint.
    let lengths: Vector3<f64> = Vector3::from_fn(|c, _| linear.column(c).norm());
    if !(lengths.min() > 1e-9 * lengths.max() && lengths.max().is_finite()) {
        return None;
    }
    // With columns of unit length, a scale along the joint's own axes is gone and the matrix is a rotation already.
    let mut unit = Matrix3::from_fn(|r, c| linear[(r, c)] / lengths[c]);
    let volume = unit.determinant();
    if volume.abs() < 1e-9 {
        return None;
    }
    // A mirroring map: the point reflection leaves a rotation.
    if volume < 0.0 {
        unit = -unit;
    }
    Some(Rotation3::from_matrix_unchecked(nearest_orthogonal(unit)?))
}

/// Orthogonal polar factor by Newton's iteration, X ← (X + X⁻ᵀ) / 2 (Higham, "Computing the polar decomposition with
/// applications", 1986). It converges quadratically; sixty steps are chosen far above what nearly flat matrices need.
fn nearest_orthogonal(mut x: Matrix3<f64>) -> Option<Matrix3<f64>> {
    for _ in 0..60 {
        let next = (x + x.try_inverse()?.transpose()) * 0.5;
        let step = (next - x).norm();
        x = next;
        if step < 1e-14 {
            break;
        }
    }
    Some(x)
}

/// The transform a fraction `t` of the way from `a` to `b`: positions in a straight line, rotations along the shortest arc.
pub(crate) fn between(a: &Isometry3<f64>, b: &Isometry3<f64>, t: f64) -> Isometry3<f64> {
    let place = a.translation.vector.lerp(&b.translation.vector, t);
    Isometry3::from_parts(place.into(), slerp(&a.rotation, &b.rotation, t))
}

/// Local transforms, parent from joint, of joints with these world transforms, parents first.
pub(crate) fn locals(parents: &[Option<usize>], world: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    let local = |(parent, world_from_joint): (&Option<usize>, &Isometry3<f64>)| match parent {
        Some(p) => world[*p].inv_mul(world_from_joint),
        None => *world_from_joint,
    };
    parents.iter().zip(world).map(local).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn turn() -> Rotation3<f64> {
        Rotation3::from_euler_angles(0.3, -1.1, 2.4)
    }

    #[test]
    fn scale_leaves_the_rotation() {
        let scaled = turn().matrix() * Matrix3::from_diagonal(&Vector3::new(0.01, 3.0, 100.0));
        let found = rotation_of(&scaled).expect("a rotation");
        assert_relative_eq!(found.matrix(), turn().matrix(), epsilon = 1e-12);
    }

    #[test]
    fn shear_leaves_the_nearest_rotation() {
        // A symmetric positive stretch is the other factor of the polar decomposition.
        let stretch = Matrix3::new(1.0, 0.2, 0.1, 0.2, 1.3, 0.0, 0.1, 0.0, 0.8);
        let unit = turn().matrix() * stretch;
        let found = nearest_orthogonal(unit).expect("an orthogonal factor");
        assert_relative_eq!(found, *turn().matrix(), epsilon = 1e-12);
    }

    #[test]
    fn mirrored_maps_turn_smoothly() {
        let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
        let at = |angle: f64| {
            let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), angle);
            rotation_of(&(turn.matrix() * mirror)).expect("a rotation")
        };
        for k in 0..100 {
            let angle = 0.0628 * f64::from(k);
            assert_relative_eq!(at(angle).angle_to(&at(angle + 0.01)), 0.01, epsilon = 1e-9);
        }
    }

    #[test]
    fn flat_maps_have_none() {
        assert!(rotation_of(&Matrix3::zeros()).is_none());
        assert!(rotation_of(&Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0))).is_none());
        assert!(rotation_of(&Matrix3::new(1., 1., 0., 0., 0., 0., 0., 0., 1.)).is_none());
        assert!(rotation_of(&Matrix3::repeat(f64::NAN)).is_none());
    }

    #[test]
    fn locals_compose_to_the_world() {
        let world: Vec<_> = (0..4)
            .map(|k| {
                Isometry3::new(
                    Vector3::new(1.0, f64::from(k), 3.0),
                    Vector3::repeat(f64::from(k)),
                )
            })
            .collect();
        let parents = [None, Some(0), Some(1), Some(0)];
        let local = locals(&parents, &world);
        assert_relative_eq!(world[1] * local[2], world[2], epsilon = 1e-12);
        assert_relative_eq!(world[0] * local[3], world[3], epsilon = 1e-12);
    }
}
