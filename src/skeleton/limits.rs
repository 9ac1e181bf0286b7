//! Joint limits: how far a coordinate is outside its range, and the nearest coordinate inside.

use super::kinematics::quaternion;
use super::{Joint, JointKind, Skeleton};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};

/// Overshoot up to which a coordinate counts as on its limit, radians (metres for a slide). Chosen: far above the rounding of
/// a clamped quaternion in f64, far below what anyone could see.
const ROUNDING: f64 = 1e-6;

/// Signed distance of `value` from the range `[low, high]`; 0 inside.
pub(crate) fn outside(value: f64, [low, high]: [f64; 2]) -> f64 {
    if value < low {
        value - low
    } else if value > high {
        value - high
    } else {
        0.0
    }
}

/// Exponential-map coordinates of a ball joint, radians, and how far outside its range each of them is.
///
/// A rotation has two rotation vectors shorter than a full turn, the short way and the long way round. Chosen is the short
/// one, unless it is outside the ranges and the long one is less so: a shoulder whose range goes beyond half a turn.
pub(crate) fn ball(joint: &Joint, qpos: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
    let short = rotation_vector(&quaternion(qpos, joint.qpos));
    let outside_of = |v: &Vector3<f64>| {
        Vector3::from_fn(|i, _| {
            joint
                .limits
                .get(i)
                .map_or(0.0, |range| outside(v[i], *range))
        })
    };
    let beyond = outside_of(&short);
    let angle = short.norm();
    // What turns by less than a quarter of a turn would be more than three quarters the long way round; no joint bends that
    // far (chosen).
    if beyond != Vector3::zeros() && angle > PI / 2.0 {
        let long = short * (1.0 - TAU / angle);
        let other = outside_of(&long);
        if other.norm() < beyond.norm() {
            return (long, other);
        }
    }
    (short, beyond)
}

/// The rotation vector of `q` that is no longer than π.
fn rotation_vector(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    let short = if q.w < 0.0 {
        UnitQuaternion::new_unchecked(-q.into_inner())
    } else {
        *q
    };
    short.scaled_axis()
}

/// Signed distance of a hinge's or a slide's coordinate from its range.
fn excess(joint: &Joint, qpos: &[f64]) -> f64 {
    joint
        .limits
        .first()
        .map_or(0.0, |range| outside(qpos[joint.qpos], *range))
}

/// Number of degrees of freedom that are outside their range.
pub(crate) fn violations(skeleton: &Skeleton, qpos: &[f64]) -> usize {
    let joints = skeleton.bodies.iter().flat_map(|body| &body.joints);
    let count = |joint: &Joint| match joint.kind {
        JointKind::Free => 0,
        JointKind::Ball => ball(joint, qpos)
            .1
            .iter()
            .filter(|x| x.abs() > ROUNDING)
            .count(),
        JointKind::Hinge(_) | JointKind::Slide(_) => {
            usize::from(excess(joint, qpos).abs() > ROUNDING)
        }
    };
    joints.map(count).sum()
}

/// Moves every coordinate that is outside its range to the nearer end of it.
pub(crate) fn clamp(skeleton: &Skeleton, qpos: &mut [f64]) {
    clamp_hinges(skeleton, qpos);
    let joints = skeleton.bodies.iter().flat_map(|body| &body.joints);
    for joint in joints.filter(|joint| joint.kind == JointKind::Ball) {
        let (v, beyond) = ball(joint, qpos);
        if beyond != Vector3::zeros() {
            let turn = UnitQuaternion::from_scaled_axis(v - beyond);
            let q = [turn.w, turn.i, turn.j, turn.k];
            qpos[joint.qpos..joint.qpos + 4].copy_from_slice(&q);
        }
    }
}

/// The same as [`clamp`], for hinges and slides only.
pub(crate) fn clamp_hinges(skeleton: &Skeleton, qpos: &mut [f64]) {
    for joint in skeleton.bodies.iter().flat_map(|body| &body.joints) {
        if let JointKind::Hinge(_) | JointKind::Slide(_) = joint.kind {
            qpos[joint.qpos] -= excess(joint, qpos);
        }
    }
}

/// Rewrites `qpos` as the same pose in coordinates near those of the frame before: hinges move by whole turns, as far as
/// their ranges let them, and of a quaternion and its negative the nearer one is taken.
pub(crate) fn unwrap(skeleton: &Skeleton, before: &[f64], qpos: &mut [f64]) {
    for joint in skeleton.bodies.iter().flat_map(|body| &body.joints) {
        let at = joint.qpos;
        match joint.kind {
            JointKind::Hinge(_) => {
                let turned = qpos[at] + TAU * ((before[at] - qpos[at]) / TAU).round();
                let range = joint.limits.first();
                if range.is_none_or(|range| outside(turned, *range) == 0.0) {
                    qpos[at] = turned;
                }
            }
            JointKind::Free => same_side(before, qpos, at + 3),
            JointKind::Ball => same_side(before, qpos, at),
            JointKind::Slide(_) => {}
        }
    }
}

/// Negates the quaternion at `at` if that brings it nearer to the one before: q and −q are the same rotation.
fn same_side(before: &[f64], qpos: &mut [f64], at: usize) {
    let product: f64 = (at..at + 4).map(|i| before[i] * qpos[i]).sum();
    if product < 0.0 {
        qpos[at..at + 4].iter_mut().for_each(|x| *x = -*x);
    }
}
