//! `qvel` from `qpos`: differences on the manifold of coordinates.

use super::timeline::Timeline;
use crate::skeleton::Skeleton;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// MuJoCo velocities of every frame.
///
/// Central differences, as the mean of the velocity from the frame before and to the frame after; both are in the
/// frame's own axes, which a rotation and its rotation vector share. A wrapping motion continues over its
/// seam; at the ends of one that ends the difference is one-sided of second order.
pub(crate) fn qvel(
    skeleton: &Skeleton,
    qpos: &[Vec<f64>],
    fps: f64,
    timeline: &Timeline,
) -> Vec<Vec<f64>> {
    let at = |index: i64| {
        let (cycle, frame) = timeline.locate(index)?;
        Some(moved(&qpos[frame], &timeline.cycle.offset(cycle)))
    };
    let step = |from: i64| {
        let (a, b) = (at(from)?, at(from + 1)?);
        Some(skeleton.differentiate(&a, &b, 1.0 / fps))
    };
    (0..qpos.len() as i64)
        .map(|f| match (step(f - 1), step(f)) {
            (Some(before), Some(after)) => blend(&before, &after, 0.5),
            (None, Some(after)) => match step(f + 1) {
                Some(later) => blend(&after, &later, -0.5),
                None => after,
            },
            (Some(before), None) => match step(f - 2) {
                Some(earlier) => blend(&before, &earlier, -0.5),
                None => before,
            },
            (None, None) => vec![0.0; skeleton.nv],
        })
        .collect()
}

/// `qpos` with its root moved by a world transform.
pub(crate) fn moved(qpos: &[f64], by: &Isometry3<f64>) -> Vec<f64> {
    let mut moved = qpos.to_vec();
    let &[x, y, z, w, i, j, k, ..] = qpos else {
        return moved;
    };
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, i, j, k));
    let root = by * Isometry3::from_parts(Translation3::new(x, y, z), rotation);
    let (t, r) = (root.translation, root.rotation);
    moved[..7].copy_from_slice(&[t.x, t.y, t.z, r.w, r.i, r.j, r.k]);
    moved
}

/// `qvel` seen after a world turn: only the root's linear velocity is in world axes.
pub(crate) fn turned(qvel: &[f64], by: &UnitQuaternion<f64>) -> Vec<f64> {
    let mut turned = qvel.to_vec();
    if let &[x, y, z, ..] = qvel {
        turned[..3].copy_from_slice((by * Vector3::new(x, y, z)).as_slice());
    }
    turned
}

/// `a + (b - a) * t`.
pub(crate) fn blend(a: &[f64], b: &[f64], t: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + (b - a) * t).collect()
}
