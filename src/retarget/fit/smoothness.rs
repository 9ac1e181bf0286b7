//! Accelerations: second differences over three frames, and their derivatives.

use super::weight;
use crate::retarget::model::Model;
use crate::retarget::qpos::{CycleStep, vector};
use crate::retarget::rotation::{left_jacobian_inverse, right_jacobian_inverse};
use crate::skeleton::JointKind;
use nalgebra::{Matrix3, Vector3};

/// Degrees of freedom whose second difference is one residual: the position or the orientation of the root, a ball joint, a
/// hinge or a slide.
#[derive(Clone, Copy, Debug)]
pub(super) struct DofGroup {
    /// The first.
    pub dof: usize,
    /// How many: 1 or 3.
    pub size: usize,
    /// Whether they are a rotation in three dimensions, whose differences don't simply subtract.
    pub is_rotation: bool,
    /// Weight of the acceleration, per m/s² or rad/s².
    pub weight: f64,
}

/// All groups of a model.
pub(super) fn dof_groups(model: &Model) -> Vec<DofGroup> {
    let group = |dof, size, is_rotation, weight| DofGroup {
        dof,
        size,
        is_rotation,
        weight,
    };
    // A hinge's angle is a coordinate, and weighs like a rotation although its differences subtract.
    let (linear, angular) = (weight::LINEAR_ACCELERATION, weight::ANGULAR_ACCELERATION);
    let mut groups = Vec::new();
    for joint in model.joints() {
        let dof = joint.dof;
        match joint.kind {
            JointKind::Free => {
                groups.push(group(dof, 3, false, linear));
                groups.push(group(dof + 3, 3, true, angular));
            }
            JointKind::Ball => groups.push(group(dof, 3, true, angular)),
            JointKind::Hinge(_) => groups.push(group(dof, 1, false, angular)),
            JointKind::Slide(_) => groups.push(group(dof, 1, false, linear)),
        }
    }
    groups
}

/// A second difference and its derivatives by the frame before, the frame itself and the frame after.
pub(super) struct SecondDifference {
    /// Metres or radians per frame².
    pub r: Vector3<f64>,
    /// The derivatives, in the tangent space of each frame.
    pub by: [Matrix3<f64>; 3],
}

/// The second difference of a group from the steps into and out of a frame (tangent vectors).
///
/// With rotations, log(R₀⁻¹ R₁) changes with R₀ by minus the inverse left Jacobian and with R₁ by the inverse right one
/// (Solà, Deray, Atchuthan, "A micro Lie theory", 2018).
pub(super) fn second_difference(group: &DofGroup, into: &[f64], out: &[f64]) -> SecondDifference {
    let pick = |v: &[f64]| {
        Vector3::from_fn(|i, _| {
            if i < group.size {
                v[group.dof + i]
            } else {
                0.0
            }
        })
    };
    let (into, out) = (pick(into), pick(out));
    // r = log(R₁⁻¹R₂) − log(R₀⁻¹R₁), or x₀ − 2x₁ + x₂.
    let by = if group.is_rotation {
        [
            left_jacobian_inverse(&into),
            -left_jacobian_inverse(&out) - right_jacobian_inverse(&into),
            right_jacobian_inverse(&out),
        ]
    } else {
        [
            Matrix3::identity(),
            Matrix3::identity() * -2.0,
            Matrix3::identity(),
        ]
    };
    SecondDifference { r: out - into, by }
}

impl SecondDifference {
    /// Over the seam of a cycle, positions of the root in one cycle are compared with those in the next, which is turned:
    /// the root's shift is seen from the cycle that frame `f` of `total` is in.
    pub fn over_seam(
        mut self,
        group: &DofGroup,
        cycle: Option<&CycleStep>,
        (f, total): (usize, usize),
        into: &[f64],
        out: &[f64],
    ) -> SecondDifference {
        // Only the root's position: rotations are relative to the body, and joints to their parents.
        let Some(CycleStep { turn, .. }) = cycle.filter(|_| !group.is_rotation && group.size == 3)
        else {
            return self;
        };
        // Into the first frame: the step before is in the cycle before, turned back here.
        if f == 0 {
            self.r = vector(out, group.dof) - turn.transpose() * vector(into, group.dof);
            self.by[0] = turn.transpose();
        }
        // Out of the last frame: the next one is the first, carried on by the cycle's turn.
        if f + 1 == total {
            self.by[2] = *turn;
        }
        self
    }
}
