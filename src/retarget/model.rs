//! The skeleton as the solver sees it: poses, and how every point moves with every degree of freedom.
//!
//! The solver works in the tangent space of the coordinates, in MuJoCo's order of degrees of freedom: the root's position in
//! world axes, the turn of the root and of ball joints in the turned body's own axes, hinges in radians and slides in
//! metres.

use super::overlap::{self, Pair};
use super::qpos::{put_quaternion, quaternion, vector};
use super::rotation::{exp, log};
use crate::skeleton::{Joint, JointKind, Shape, Skeleton};
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// A point with which a body can touch the ground: a ball of `radius` (0 for a box's corner) about `center`.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactPoint {
    /// Index of the body.
    pub body: usize,
    /// In the body's frame, metres.
    pub center: Vector3<f64>,
    /// Metres.
    pub radius: f64,
    /// Whether a foot stands on it. The upper corners of a box are no part of the sole.
    pub sole: bool,
}

impl ContactPoint {
    /// The centre with all bodies at these places, world, metres.
    pub fn place(&self, bodies: &[Isometry3<f64>]) -> Vector3<f64> {
        (bodies[self.body] * Point3::from(self.center)).coords
    }
}

/// A skeleton with what the solver needs of it.
pub(super) struct Model<'a> {
    /// The skeleton.
    pub skeleton: &'a Skeleton,
    /// For every body the degrees of freedom that move it, ascending.
    pub chains: Vec<Vec<usize>>,
    /// Whether a degree of freedom is a rotation; it is a translation otherwise.
    pub rotates: Vec<bool>,
    /// Spheres' centres, capsules' ends and boxes' corners.
    pub contact_points: Vec<ContactPoint>,
    /// Shapes that must not pass through each other.
    pub pairs: Vec<Pair>,
}

/// A pose with the axes of its degrees of freedom.
#[derive(Clone)]
pub(super) struct Pose {
    /// World from body.
    pub bodies: Vec<Isometry3<f64>>,
    /// World axis of every degree of freedom.
    pub axes: Vec<Vector3<f64>>,
    /// A point on the axis of every degree of freedom that is a rotation, world, metres.
    pub pivots: Vec<Vector3<f64>>,
}

impl<'a> Model<'a> {
    /// Collects what the solver needs.
    pub fn new(skeleton: &'a Skeleton) -> Model<'a> {
        let mut chains: Vec<Vec<usize>> = Vec::with_capacity(skeleton.bodies.len());
        let mut rotates = vec![true; skeleton.nv];
        let mut contact_points = Vec::new();
        let rest = skeleton.forward(&skeleton.rest_qpos());
        for (b, body) in skeleton.bodies.iter().enumerate() {
            // Bodies come after their parents, so the parent's chain is known.
            let mut chain = body.parent.map_or_else(Vec::new, |p| chains[p].clone());
            for joint in &body.joints {
                chain.extend(joint.dof..joint.dof + joint.kind.nv());
                match joint.kind {
                    JointKind::Free => rotates[joint.dof..joint.dof + 3].fill(false),
                    JointKind::Slide(_) => rotates[joint.dof] = false,
                    JointKind::Ball | JointKind::Hinge(_) => {}
                }
            }
            chain.sort_unstable();
            chains.push(chain);
            contact_points.extend(
                body.shapes
                    .iter()
                    .flat_map(|s| shape_points(b, &rest[b], s)),
            );
        }
        Model {
            skeleton,
            chains,
            rotates,
            contact_points,
            pairs: overlap::pairs(skeleton),
        }
    }

    /// All joints, in the order of their coordinates.
    pub fn joints(&self) -> impl Iterator<Item = &'a Joint> {
        self.skeleton.bodies.iter().flat_map(|body| &body.joints)
    }

    /// Memory for a pose.
    pub fn empty_pose(&self) -> Pose {
        Pose {
            bodies: vec![Isometry3::identity(); self.skeleton.bodies.len()],
            axes: vec![Vector3::zeros(); self.skeleton.nv],
            pivots: vec![Vector3::zeros(); self.skeleton.nv],
        }
    }

    /// Forward kinematics with the axes of all degrees of freedom.
    pub fn evaluate(&self, qpos: &[f64], pose: &mut Pose) {
        for b in 0..self.skeleton.bodies.len() {
            self.evaluate_body(b, qpos, pose);
        }
    }

    /// Places one body whose parent is placed already; bodies come after their parents.
    fn evaluate_body(&self, b: usize, qpos: &[f64], pose: &mut Pose) {
        let body = &self.skeleton.bodies[b];
        let parent = body
            .parent
            .map_or_else(Isometry3::identity, |p| pose.bodies[p]);
        let mut at = parent * body.rest;
        for joint in &body.joints {
            at = place(joint, &at, qpos, pose);
        }
        pose.bodies[b] = at;
    }

    /// Moves `qpos` along a tangent vector; rotations are multiplied from the right by exp(v).
    pub fn step(&self, qpos: &mut [f64], tangent: &[f64]) {
        for joint in self.joints() {
            let (q, v) = (joint.qpos, joint.dof);
            match joint.kind {
                JointKind::Free => {
                    for i in 0..3 {
                        qpos[q + i] += tangent[v + i];
                    }
                    let turned = quaternion(qpos, q + 3) * exp(&vector(tangent, v + 3));
                    put_quaternion(qpos, q + 3, &turned);
                }
                JointKind::Ball => {
                    let turned = quaternion(qpos, q) * exp(&vector(tangent, v));
                    put_quaternion(qpos, q, &turned);
                }
                JointKind::Hinge(_) | JointKind::Slide(_) => qpos[q] += tangent[v],
            }
        }
    }

    /// The tangent vector that leads from `a` to `b`: the inverse of [`Model::step`].
    pub fn difference(&self, a: &[f64], b: &[f64], tangent: &mut [f64]) {
        for joint in self.joints() {
            let (q, v) = (joint.qpos, joint.dof);
            let turn = |at: usize| log(&(quaternion(a, at).inverse() * quaternion(b, at)));
            match joint.kind {
                JointKind::Free => {
                    for i in 0..3 {
                        tangent[v + i] = b[q + i] - a[q + i];
                    }
                    tangent[v + 3..v + 6].copy_from_slice(turn(q + 3).as_slice());
                }
                JointKind::Ball => tangent[v..v + 3].copy_from_slice(turn(q).as_slice()),
                JointKind::Hinge(_) | JointKind::Slide(_) => tangent[v] = b[q] - a[q],
            }
        }
    }

    /// A column of the Jacobian of the world point `p` of a body: its velocity for a unit rate of degree of freedom `dof`,
    /// which must be one that moves the body. ω × r for a rotation, the axis itself for a translation.
    pub fn lever(&self, pose: &Pose, dof: usize, p: &Vector3<f64>) -> Vector3<f64> {
        if self.rotates[dof] {
            pose.axes[dof].cross(&(p - pose.pivots[dof]))
        } else {
            pose.axes[dof]
        }
    }
}

/// World from body after `joint`, whose axes and pivot are written to `pose`.
fn place(joint: &Joint, before: &Isometry3<f64>, qpos: &[f64], pose: &mut Pose) -> Isometry3<f64> {
    let (q, v) = (joint.qpos, joint.dof);
    // Where the body is after the joint, and the world axes of the joint's degrees of freedom.
    let (after, axes, count): (Isometry3<f64>, [Vector3<f64>; 3], usize) = match joint.kind {
        JointKind::Free => {
            // MuJoCo's free joint: position in world axes, rotation about the body's own axes through its origin.
            let turn = quaternion(qpos, q + 3);
            let at = vector(qpos, q);
            let m = turn.to_rotation_matrix();
            for i in 0..3 {
                pose.axes[v + i] = Vector3::ith(i, 1.0);
                pose.axes[v + 3 + i] = m.matrix().column(i).into();
                pose.pivots[v + 3 + i] = at;
            }
            return Isometry3::from_parts(at.into(), turn);
        }
        JointKind::Slide(axis) => (
            before * Translation3::from(axis * qpos[q]),
            [before.rotation * axis; 3],
            1,
        ),
        JointKind::Hinge(axis) => {
            let turn = UnitQuaternion::from_axis_angle(&Unit::new_unchecked(axis), qpos[q]);
            (turned(before, joint, turn), [before.rotation * axis; 3], 1)
        }
        JointKind::Ball => {
            // A ball joint's degrees of freedom are the axes of the body after the turn.
            let after = turned(before, joint, quaternion(qpos, q));
            let m = after.rotation.to_rotation_matrix();
            let column = |i: usize| -> Vector3<f64> { m.matrix().column(i).into() };
            (after, [column(0), column(1), column(2)], 3)
        }
    };
    let pivot = before * Point3::from(joint.anchor);
    for (i, axis) in axes.iter().take(count).enumerate() {
        pose.axes[v + i] = *axis;
        pose.pivots[v + i] = pivot.coords;
    }
    after
}

/// World from body after a turn about the joint's anchor.
fn turned(before: &Isometry3<f64>, joint: &Joint, turn: UnitQuaternion<f64>) -> Isometry3<f64> {
    // Rotation about the anchor a: x ↦ R x + (a − R a).
    let shift = joint.anchor - turn * joint.anchor;
    before * Isometry3::from_parts(shift.into(), turn)
}

/// The contact points of a shape: where a convex hull of balls has its centres. `rest` is the body in the rest pose.
fn shape_points(body: usize, rest: &Isometry3<f64>, shape: &Shape) -> Vec<ContactPoint> {
    let round = |center: &Vector3<f64>, radius: f64| ContactPoint {
        body,
        center: *center,
        radius,
        sole: true,
    };
    match shape {
        Shape::Sphere { center, radius } => vec![round(center, *radius)],
        Shape::Capsule { a, b, radius } => [a, b].map(|end| round(end, *radius)).into(),
        // A convex shape touches a plane at these points first, so no others are needed.
        Shape::Box { pose, half } => (0..8)
            .map(|i: usize| {
                let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
                // The eight corners, by the bits of their number.
                let corner = half.component_mul(&Vector3::new(sign(0), sign(1), sign(2)));
                ContactPoint {
                    body,
                    center: (pose * Point3::from(corner)).coords,
                    radius: 0.0,
                    // The lower corners with the body at rest.
                    sole: (rest.rotation * (pose.rotation * corner)).z <= 0.0,
                }
            })
            .collect(),
    }
}
