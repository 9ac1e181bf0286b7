//! `qvel` from `qpos`: differences on the manifold of coordinates.

use super::timeline::Timeline;
use crate::skeleton::Skeleton;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// Velocities of every frame in MuJoCo's order, `[f][nv]`.
///
/// These are central differences: the mean of the velocity from the frame before and of that to the frame after. Both can
/// be averaged, because each is in the frame's own axes: turning by a rotation vector leaves that vector as it is. A motion
/// that repeats goes on over its seam. At the ends of one that ends, the difference is one-sided of second order: 3/2 of
/// the nearest step minus 1/2 of the next.
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

/// `qpos` with its root, a free joint at its start, moved by a world transform.
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

/// `qvel` after a turn of the world. Only the root's linear velocity is in world axes; MuJoCo has its angular velocity in
/// the body's own.
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
