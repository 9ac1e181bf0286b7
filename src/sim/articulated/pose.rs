//! Coordinates of a tree, and where they put it.

use super::super::world::LinkState;
use super::spatial::Motion;
use super::tree::{Joint, Tree};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Where a tree is and how it moves.
#[derive(Clone, Debug)]
pub(super) struct Pose {
    /// The root's place in the world. All else is relative to it, so that nothing is lost far from the origin.
    pub origin: Vector3<f32>,
    /// Of every node, in its parent; the root's in the world.
    pub turns: Vec<UnitQuaternion<f32>>,
    /// Of the hinges, radians.
    pub angles: Vec<f32>,
    /// In every velocity coordinate.
    pub velocity: Vec<f32>,
    /// World from node, with the root at zero.
    pub nodes: Vec<Isometry3<f32>>,
    /// What a unit of every velocity coordinate does, about the root's origin.
    pub axes: Vec<Motion>,
}

impl Pose {
    pub fn new(tree: &Tree) -> Self {
        let nodes = tree.nodes.len();
        Pose {
            origin: Vector3::zeros(),
            turns: vec![UnitQuaternion::identity(); nodes],
            angles: vec![0.0; nodes],
            velocity: vec![0.0; tree.dofs()],
            nodes: vec![Isometry3::identity(); nodes],
            axes: vec![Motion::default(); tree.dofs()],
        }
    }

    /// Takes the coordinates of `states`; what their joints can't do is left out.
    pub fn set(&mut self, tree: &Tree, states: &[LinkState]) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let state = &states[i];
            let velocity = &mut self.velocity[node.dofs.clone()];
            let Some(parent) = node.parent.map(|p| &states[p]) else {
                self.origin = state.pose.translation.vector;
                self.turns[i] = state.pose.rotation;
                velocity[..3].copy_from_slice(state.linear.as_slice());
                velocity[3..].copy_from_slice(state.angular.as_slice());
                continue;
            };
            let turn = node.rest.inverse() * parent.pose.rotation.inverse() * state.pose.rotation;
            let apart = state.angular - parent.angular;
            let rate = state.pose.rotation.inverse_transform_vector(&apart);
            match node.joint {
                Joint::Hinge(axis, _) => {
                    self.angles[i] = twist(&turn, &axis);
                    velocity[0] = rate.dot(&axis);
                }
                _ => {
                    self.turns[i] = turn;
                    velocity.copy_from_slice(rate.as_slice());
                }
            }
        }
        self.place(tree);
    }

    /// Node poses and axes from the coordinates.
    pub fn place(&mut self, tree: &Tree) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let Some(parent) = node.parent.map(|p| self.nodes[p]) else {
                self.nodes[i] = Isometry3::from_parts(Translation3::identity(), self.turns[i]);
                self.axes[..6].copy_from_slice(&free_axes());
                continue;
            };
            if let Joint::Hinge(axis, _) = node.joint {
                let half = self.angles[i] * 0.5;
                let part = axis * half.sin();
                let turn = nalgebra::Quaternion::new(half.cos(), part.x, part.y, part.z);
                self.turns[i] = UnitQuaternion::new_unchecked(turn);
            }
            let rotation = parent.rotation * node.rest * self.turns[i];
            let pivot = parent.translation.vector + parent.rotation * node.pivot;
            let place = pivot - rotation * node.anchor;
            self.nodes[i] = Isometry3::from_parts(Translation3::from(place), rotation);
            let axes = &mut self.axes[node.dofs.clone()];
            match node.joint {
                Joint::Hinge(axis, _) => axes[0] = Motion::about(rotation * axis, pivot),
                _ => {
                    let turned = rotation.to_rotation_matrix();
                    for (k, axis) in axes.iter_mut().enumerate() {
                        *axis = Motion::about(turned.matrix().column(k).into(), pivot);
                    }
                }
            }
        }
    }

    /// Moves the coordinates on at their velocity for `dt` seconds.
    pub fn advance(&mut self, tree: &Tree, dt: f32) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let rates = &self.velocity[node.dofs.clone()];
            match node.joint {
                Joint::Free => {
                    self.origin += Vector3::from_column_slice(&rates[..3]) * dt;
                    let turn = turned(&rates[3..], dt) * self.turns[i];
                    self.turns[i] = normalized(turn);
                }
                Joint::Ball => self.turns[i] = normalized(self.turns[i] * turned(rates, dt)),
                Joint::Hinge(..) => self.angles[i] += rates[0] * dt,
            }
        }
        self.place(tree);
    }

    /// States of all nodes in the world.
    pub fn read(&self, tree: &Tree, states: &mut [LinkState]) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let above = node.parent.map_or_else(Motion::default, |p| Motion {
                angular: states[p].angular,
                linear: states[p].linear
                    - states[p].angular.cross(&self.nodes[p].translation.vector),
            });
            let motion = above + self.own_motion(node.dofs.clone());
            let mut pose = self.nodes[i];
            let linear = motion.at(&pose.translation.vector);
            pose.translation.vector += self.origin;
            states[i] = LinkState {
                pose,
                linear,
                angular: motion.angular,
            };
        }
    }

    /// What the velocities of `dofs` do together.
    pub fn own_motion(&self, dofs: std::ops::Range<usize>) -> Motion {
        let parts = self.axes[dofs.clone()].iter().zip(&self.velocity[dofs]);
        parts.fold(Motion::default(), |sum, (axis, rate)| sum + *axis * *rate)
    }
}

fn free_axes() -> [Motion; 6] {
    std::array::from_fn(|k| {
        let along = Vector3::from_fn(|axis, _| if axis == k % 3 { 1.0 } else { 0.0 });
        let (linear, angular) = match k {
            0..3 => (along, Vector3::zeros()),
            _ => (Vector3::zeros(), along),
        };
        Motion { angular, linear }
    })
}

/// Angle of a rotation about an axis, in (-π, π].
fn twist(turn: &UnitQuaternion<f32>, axis: &Vector3<f32>) -> f32 {
    let part = turn.imag().dot(axis);
    let sign = if turn.w < 0.0 { -1.0 } else { 1.0 };
    2.0 * (part * sign).atan2(turn.w * sign)
}

fn turned(rates: &[f32], dt: f32) -> UnitQuaternion<f32> {
    UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(rates) * dt)
}

fn normalized(turn: UnitQuaternion<f32>) -> UnitQuaternion<f32> {
    UnitQuaternion::new_normalize(turn.into_inner())
}
