//! The skeleton as the solver sees it: poses, and how every point moves with every degree of freedom.

use super::overlap::{self, Pair};
use super::rotation::{exp, log};
use crate::skeleton::{Joint, JointKind, Shape, Skeleton};
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

/// A point of a body's surface: a ball of `radius` (perhaps 0) about `center`, in the body's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knob {
    pub body: usize,
    pub center: Vector3<f64>,
    pub radius: f64,
    /// Whether a foot stands on it: not so the upper corners of a box.
    pub sole: bool,
}

pub(super) struct Model<'a> {
    pub skeleton: &'a Skeleton,
    /// For every body the degrees of freedom that move it, ascending.
    pub chains: Vec<Vec<usize>>,
    /// Whether a degree of freedom turns (or else shifts).
    pub turns: Vec<bool>,
    /// Spheres' centres, capsules' ends and boxes' corners.
    pub knobs: Vec<Knob>,
    /// What must not pass through each other.
    pub pairs: Vec<Pair>,
}

/// World transforms of all bodies, and world axis and pivot of every degree of freedom.
#[derive(Clone)]
pub(super) struct Pose {
    pub bodies: Vec<Isometry3<f64>>,
    pub axes: Vec<Vector3<f64>>,
    pub pivots: Vec<Vector3<f64>>,
}

pub(super) fn vector(values: &[f64], at: usize) -> Vector3<f64> {
    Vector3::new(values[at], values[at + 1], values[at + 2])
}

pub(super) fn quaternion(qpos: &[f64], at: usize) -> UnitQuaternion<f64> {
    let q = Quaternion::new(qpos[at], qpos[at + 1], qpos[at + 2], qpos[at + 3]);
    Unit::try_new(q, 1e-12).unwrap_or_else(UnitQuaternion::identity)
}

pub(super) fn put_quaternion(qpos: &mut [f64], at: usize, q: &UnitQuaternion<f64>) {
    qpos[at..at + 4].copy_from_slice(&[q.w, q.i, q.j, q.k]);
}

impl<'a> Model<'a> {
    pub fn new(skeleton: &'a Skeleton) -> Model<'a> {
        let mut chains: Vec<Vec<usize>> = Vec::with_capacity(skeleton.bodies.len());
        let mut turns = vec![true; skeleton.nv];
        let mut knobs = Vec::new();
        let rest = skeleton.forward(&skeleton.rest_qpos());
        for (b, body) in skeleton.bodies.iter().enumerate() {
            let mut chain = body.parent.map_or_else(Vec::new, |p| chains[p].clone());
            for joint in &body.joints {
                chain.extend(joint.dof..joint.dof + joint.kind.nv());
                match joint.kind {
                    JointKind::Free => turns[joint.dof..joint.dof + 3].fill(false),
                    JointKind::Slide(_) => turns[joint.dof] = false,
                    JointKind::Ball | JointKind::Hinge(_) => {}
                }
            }
            chain.sort_unstable();
            chains.push(chain);
            knobs.extend(body.shapes.iter().flat_map(|s| shape_knobs(b, &rest[b], s)));
        }
        Model {
            skeleton,
            chains,
            turns,
            knobs,
            pairs: overlap::pairs(skeleton),
        }
    }

    pub fn joints(&self) -> impl Iterator<Item = &'a Joint> {
        self.skeleton.bodies.iter().flat_map(|body| &body.joints)
    }

    pub fn empty_pose(&self) -> Pose {
        Pose {
            bodies: vec![Isometry3::identity(); self.skeleton.bodies.len()],
            axes: vec![Vector3::zeros(); self.skeleton.nv],
            pivots: vec![Vector3::zeros(); self.skeleton.nv],
        }
    }

    pub fn evaluate(&self, qpos: &[f64], pose: &mut Pose) {
        for b in 0..self.skeleton.bodies.len() {
            self.evaluate_body(b, qpos, pose);
        }
    }

    /// Places one body, whose parent is placed.
    pub fn evaluate_body(&self, b: usize, qpos: &[f64], pose: &mut Pose) {
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

    /// Moves `qpos` along a tangent vector: root position in world axes, turns in the turned body's own axes.
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

    /// The tangent vector that leads from `a` to `b`.
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

    /// Velocity of world point `p` of a body per rate of degree of freedom `dof`, which moves it.
    pub fn lever(&self, pose: &Pose, dof: usize, p: &Vector3<f64>) -> Vector3<f64> {
        if self.turns[dof] {
            pose.axes[dof].cross(&(p - pose.pivots[dof]))
        } else {
            pose.axes[dof]
        }
    }
}

/// World from body after `joint`; notes the joint's axes and pivot.
fn place(joint: &Joint, before: &Isometry3<f64>, qpos: &[f64], pose: &mut Pose) -> Isometry3<f64> {
    let (q, v) = (joint.qpos, joint.dof);
    let (after, axes, count): (Isometry3<f64>, [Vector3<f64>; 3], usize) = match joint.kind {
        JointKind::Free => {
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
            let after = turned(before, joint, quaternion(qpos, q));
            let m = after.rotation.to_rotation_matrix();
            let column = |i: usize| -> Vector3<f64> { m.matrix().column(i).into() };
            (after, [column(0), column(1), column(2)], 3)
        }
    };
    let pivot = before * nalgebra::Point3::from(joint.anchor);
    for (i, axis) in axes.iter().take(count).enumerate() {
        pose.axes[v + i] = *axis;
        pose.pivots[v + i] = pivot.coords;
    }
    after
}

fn turned(before: &Isometry3<f64>, joint: &Joint, turn: UnitQuaternion<f64>) -> Isometry3<f64> {
    let shift = joint.anchor - turn * joint.anchor;
    before * Isometry3::from_parts(shift.into(), turn)
}

fn shape_knobs(body: usize, rest: &Isometry3<f64>, shape: &Shape) -> Vec<Knob> {
    let round = |center: &Vector3<f64>, radius: f64| Knob {
        body,
        center: *center,
        radius,
        sole: true,
    };
    match shape {
        Shape::Sphere { center, radius } => vec![round(center, *radius)],
        Shape::Capsule { a, b, radius } => [a, b].map(|end| round(end, *radius)).into(),
        Shape::Box { pose, half } => (0..8)
            .map(|i: usize| {
                let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
                let corner = half.component_mul(&Vector3::new(sign(0), sign(1), sign(2)));
                Knob {
                    body,
                    center: (pose * nalgebra::Point3::from(corner)).coords,
                    radius: 0.0,
                    sole: (rest.rotation * (pose.rotation * corner)).z <= 0.0,
                }
            })
            .collect(),
    }
}
