//! Joint rotations from joint coordinates and back, so that other modules can work with rotations whatever the joints.

use super::coordinates::{store, store_quaternion};
use super::{Joint, JointKind, Skeleton};
use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

impl Skeleton {
    /// The rotation that each body's joints make, in its rest frame, `[bodies]`: the orientation of a body in its parent is
    /// `rest.rotation * joint_rotations[body]`. The root and welded bodies have the identity.
    ///
    /// # Panics
    /// If `qpos` is shorter than [`Skeleton::nq`].
    pub fn joint_rotations(&self, qpos: &[f64]) -> Vec<UnitQuaternion<f64>> {
        self.bodies
            .iter()
            .map(|body| {
                let turning = body.joints.iter().filter(|j| j.kind != JointKind::Free);
                turning.fold(UnitQuaternion::identity(), |r, j| r * j.rotation(qpos))
            })
            .collect()
    }

    /// `qpos` from the root's pose in the world and each body's joint rotation (see [`Skeleton::joint_rotations`]).
    ///
    /// A ball joint takes the rotation as it is. One hinge takes the part of the rotation about its axis; two or three
    /// hinges take the angles of the exact decomposition where one exists. Of several solutions the best is the one that
    /// keeps the limits, or comes nearest to keeping them, and among those the one nearest to `near` (a `qpos`, such as that
    /// of the frame before) or else to zero. Slides stay at zero.
    ///
    /// # Panics
    /// If `rotations` is shorter than the number of bodies, or `near` than [`Skeleton::nq`].
    pub fn rotations_to_qpos(
        &self,
        root: &Isometry3<f64>,
        rotations: &[UnitQuaternion<f64>],
        near: Option<&[f64]>,
    ) -> Vec<f64> {
        let mut qpos = vec![0.0; self.nq];
        for (body, rotation) in self.bodies.iter().zip(rotations) {
            let mut rest = *rotation;
            for joint in &body.joints {
                match joint.kind {
                    JointKind::Free => {
                        store(&mut qpos, joint.qpos, root.translation.vector);
                        let same = same_side(&root.rotation, near, joint.qpos + 3);
                        store_quaternion(&mut qpos, joint.qpos + 3, &same);
                    }
                    JointKind::Ball => {
                        let same = same_side(&rest, near, joint.qpos);
                        store_quaternion(&mut qpos, joint.qpos, &same);
                        rest = UnitQuaternion::identity();
                    }
                    JointKind::Hinge(_) | JointKind::Slide(_) => {}
                }
            }
            // Hinges make what is left of the rotation: all of it, unless the body also has a ball.
            let hinges: Vec<&Joint> = body.joints.iter().filter(|j| j.axis().is_some()).collect();
            for (joint, angle) in hinges.iter().zip(hinge_angles(&hinges, &rest, near)) {
                qpos[joint.qpos] = angle;
            }
        }
        qpos
    }
}

impl Joint {
    /// The axis of a hinge.
    fn axis(&self) -> Option<Vector3<f64>> {
        match self.kind {
            JointKind::Hinge(axis) => Some(axis),
            _ => None,
        }
    }
}

/// `rotation` or its negative, which is the same rotation: whichever is nearer to the quaternion in `near`.
fn same_side(
    rotation: &UnitQuaternion<f64>,
    near: Option<&[f64]>,
    at: usize,
) -> UnitQuaternion<f64> {
    let before = near.map(|q| super::kinematics::quaternion(q, at));
    match before {
        Some(before) if before.coords.dot(&rotation.coords) < 0.0 => {
            Unit::new_unchecked(-rotation.into_inner())
        }
        _ => *rotation,
    }
}

/// Angles of the first three of `hinges` that make `rotation`: the best of all solutions.
fn hinge_angles(
    hinges: &[&Joint],
    rotation: &UnitQuaternion<f64>,
    near: Option<&[f64]>,
) -> Vec<f64> {
    let axes: Vec<Vector3<f64>> = hinges.iter().filter_map(|j| j.axis()).take(3).collect();
    let wanted: Vec<f64> = hinges
        .iter()
        .map(|j| {
            let [low, high] = j.limits.first().copied().unwrap_or([0.0, 0.0]);
            near.map_or(0.0_f64.max(low).min(high), |q| q[j.qpos])
        })
        .collect();
    let candidates = match *axes.as_slice() {
        [] => return Vec::new(),
        [e] => vec![[twist(rotation, &e), 0.0, 0.0]],
        // Two hinges can't make every rotation. A third one at right angles to both makes it solvable, and its angle, which
        // would be the error, is dropped.
        [e1, e2] => davenport(e1, e2, e1.cross(&e2), rotation, wanted[0]),
        [e1, e2, e3, ..] => davenport(e1, e2, e3, rotation, wanted[0]),
    };
    let mut best = (f64::INFINITY, wanted.clone());
    // Each solution may be shifted by whole turns; the shift nearest to the wanted angles is the one to judge.
    for candidate in candidates {
        let turns = |i: usize| candidate[i] + TAU * ((wanted[i] - candidate[i]) / TAU).round();
        let angles: Vec<f64> = (0..axes.len()).map(turns).collect();
        let cost = cost(hinges, &angles, &wanted);
        if cost < best.0 {
            best = (cost, angles);
        }
    }
    best.1
}

/// How bad a solution is: squared distances from the wanted angles, and a hundred times those from the limits (chosen, so
/// that a solution inside the limits wins unless it is ten times as far from the wanted angles).
fn cost(hinges: &[&Joint], angles: &[f64], wanted: &[f64]) -> f64 {
    let each = hinges.iter().zip(angles.iter().zip(wanted));
    each.map(|(joint, (angle, wanted))| {
        let [low, high] = joint.limits.first().copied().unwrap_or([-TAU, TAU]);
        let outside = (low - angle).max(angle - high).max(0.0);
        100.0 * outside * outside + (angle - wanted).powi(2)
    })
    .sum()
}

/// Angle of the part of `rotation` about the unit vector `axis` (swing-twist decomposition), radians, in [−π, π].
pub(crate) fn twist(rotation: &UnitQuaternion<f64>, axis: &Vector3<f64>) -> f64 {
    let half = rotation.imag().dot(axis).atan2(rotation.w);
    let angle = 2.0 * half;
    angle - TAU * (angle / TAU).round()
}

/// Both solutions of R₁(a) R₂(b) R₃(c) = `rotation` for rotations about the unit axes e1, e2, e3, which need not be
/// orthogonal: generalised Euler angles after Davenport (Wertz, Spacecraft Attitude Determination and Control,
/// 1978, app. E).
///
/// e1·R e3 depends on b alone: it is a constant plus |(cos, sin)| · cos(b − atan2(sin, cos)), which has two solutions for b.
/// Each gives a, then c. Where the axes can't make the rotation, b is the nearest. Where R e3 lies along e1, only the sum
/// of a and c counts, and a is `free`.
fn davenport(
    e1: Vector3<f64>,
    e2: Vector3<f64>,
    e3: Vector3<f64>,
    rotation: &UnitQuaternion<f64>,
    free: f64,
) -> Vec<[f64; 3]> {
    // Two hinges about one axis leave a third axis without direction: they act as one.
    let Some(e3) = e3.try_normalize(1e-9) else {
        return vec![[twist(rotation, &e1), 0.0, 0.0]];
    };
    let constant = e1.dot(&e2) * e2.dot(&e3);
    let (cos, sin) = (e1.dot(&e3) - constant, e1.dot(&e2.cross(&e3)));
    let size = cos.hypot(sin);
    let reach = e1.dot(&(rotation * e3)) - constant;
    // Clamped: rounding, or a rotation out of reach, may ask for a cosine beyond ±1.
    let spread = if size > 1e-12 {
        (reach / size).clamp(-1.0, 1.0).acos()
    } else {
        0.0
    };
    // Given b, a brings R₂ e3 to R e3 about e1, and c is what is left about e3.
    let solve = |b: f64| {
        let second = about(&e2, b);
        let a = angle_about(&e1, &(second * e3), &(rotation * e3)).unwrap_or(free);
        let third = second.inverse() * about(&e1, a).inverse() * rotation;
        [a, b, twist(&third, &e3)]
    };
    let middle = sin.atan2(cos);
    vec![solve(middle + spread), solve(middle - spread)]
}

/// Rotation by `angle` about a unit axis.
fn about(axis: &Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * angle)
}

/// Signed angle about `axis` from `from` to `to`; `None` if either lies along the axis.
fn angle_about(axis: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<f64> {
    let across = |v: &Vector3<f64>| (v - axis * axis.dot(v)).try_normalize(1e-7);
    let (from, to) = (across(from)?, across(to)?);
    Some(axis.dot(&from.cross(&to)).atan2(from.dot(&to)))
}
