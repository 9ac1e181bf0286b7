//! What a step of one character leaves to the next.

use super::super::state::{LinkState, Target};
use super::tree::{Joint, Tree};
use crate::skeleton::twist;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

#[derive(Clone, Debug)]
pub(super) struct State {
    /// The root's place in the world.
    pub origin: Vector3<f32>,
    /// Of every node, in its parent from how it rests there; the root's in the world. A hinge has its angle instead.
    pub turns: Vec<UnitQuaternion<f32>>,
    pub angles: Vec<f32>,
    /// By coordinate.
    pub velocity: Vec<f32>,
    /// Where drives aim, by node; of a hinge the real part is its angle.
    pub targets: Vec<UnitQuaternion<f32>>,
    /// Drives that were found beyond their limit: the sign of their torque, else 0.
    pub saturated: Vec<f32>,
    /// Of the ground, by point.
    pub impulses: Vec<Vector3<f32>>,
    /// Impulses at the centres of mass of nodes that the next step gives.
    pub pushes: Vec<(usize, Vector3<f32>)>,
    /// Factors of all masses, and of friction.
    pub mass: f32,
    pub friction: f32,
}

impl State {
    pub fn new(tree: &Tree) -> Self {
        let (nodes, coordinates) = (tree.nodes.len(), tree.coordinates.len());
        State {
            origin: Vector3::zeros(),
            turns: vec![UnitQuaternion::identity(); nodes],
            angles: vec![0.0; nodes],
            velocity: vec![0.0; coordinates],
            targets: vec![UnitQuaternion::identity(); nodes],
            saturated: vec![0.0; coordinates],
            impulses: vec![Vector3::zeros(); tree.points()],
            pushes: Vec::new(),
            mass: 1.0,
            friction: 1.0,
        }
    }

    /// Takes the coordinates of `states`, with nothing left of the past; what the joints can't do is left out.
    pub fn reset(&mut self, tree: &Tree, states: &[LinkState]) {
        self.saturated.fill(0.0);
        self.impulses.fill(Vector3::zeros());
        self.pushes.clear();
        (self.mass, self.friction) = (1.0, 1.0);
        for (i, node) in tree.nodes.iter().enumerate() {
            let state = &states[i];
            let velocity = &mut self.velocity[node.first..node.first + node.dof];
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
                    self.angles[i] = twist(&turn.cast(), &axis.cast()) as f32;
                    velocity[0] = rate.dot(&axis);
                }
                _ => {
                    self.turns[i] = turn;
                    velocity.copy_from_slice(rate.as_slice());
                }
            }
        }
    }

    pub fn aim(&mut self, targets: &[Target]) {
        for (own, target) in self.targets.iter_mut().zip(targets) {
            match target {
                Target::Free => {}
                Target::Ball(turn) => *own = *turn,
                Target::Hinge(angle) => {
                    *own = UnitQuaternion::new_unchecked(Quaternion::from_real(*angle))
                }
            }
        }
    }
}
