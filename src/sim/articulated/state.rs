//! What one character keeps from step to step.

use super::super::state::{LinkState, Target};
use super::tree::{Joint, Tree};
use crate::skeleton::twist;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// State of one character.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// Position of the root's origin in the world, metres.
    pub origin: Vector3<f32>,
    /// `[nodes]`: joint rotation, the identity at rest; for the root, its orientation in the world. Unused for hinges.
    pub rotations: Vec<UnitQuaternion<f32>>,
    /// `[nodes]`: angle of a hinge, radians; unused for other joints.
    pub angles: Vec<f32>,
    /// `[coordinates]`: m/s for the root's translations, else rad/s.
    pub velocity: Vec<f32>,
    /// `[nodes]`: targets of the drives as joint rotations. For a hinge the real part holds its angle.
    pub targets: Vec<UnitQuaternion<f32>>,
    /// `[coordinates]`: sign of the torque of a drive that the last step held at its limit, else 0.
    pub saturated: Vec<f32>,
    /// `[points]`: impulses of the ground in the last step, world axes, N·s. The next step starts from them.
    pub impulses: Vec<Vector3<f32>>,
    /// Node, and impulse at its centre of mass, world axes, N·s, that the next step applies.
    pub pushes: Vec<(usize, Vector3<f32>)>,
    /// Factor of all masses and inertias.
    pub mass: f32,
    /// Factor of the friction coefficients.
    pub friction: f32,
}

impl State {
    pub fn new(tree: &Tree) -> Self {
        let (nodes, coordinates) = (tree.nodes.len(), tree.coordinates.len());
        State {
            origin: Vector3::zeros(),
            rotations: vec![UnitQuaternion::identity(); nodes],
            angles: vec![0.0; nodes],
            velocity: vec![0.0; coordinates],
            targets: tree.nodes.iter().map(|node| rest(&node.joint)).collect(),
            saturated: vec![0.0; coordinates],
            impulses: vec![Vector3::zeros(); tree.points()],
            pushes: Vec::new(),
            mass: 1.0,
            friction: 1.0,
        }
    }

    /// Takes the joint coordinates of `states`, one per node, and forgets all of the past. What the joints can't express, such
    /// as a gap at a joint or a hinge turned about another axis, is left out.
    pub fn reset(&mut self, tree: &Tree, states: &[LinkState]) {
        self.saturated.fill(0.0);
        self.impulses.fill(Vector3::zeros());
        self.pushes.clear();
        (self.mass, self.friction) = (1.0, 1.0);
        for (target, node) in self.targets.iter_mut().zip(&tree.nodes) {
            *target = rest(&node.joint);
        }
        for (i, node) in tree.nodes.iter().enumerate() {
            let state = &states[i];
            let velocity = &mut self.velocity[node.first..node.first + node.dof];
            let Some(parent) = node.parent.map(|p| &states[p]) else {
                self.origin = state.pose.translation.vector;
                self.rotations[i] = state.pose.rotation;
                velocity[..3].copy_from_slice(state.linear.as_slice());
                velocity[3..].copy_from_slice(state.angular.as_slice());
                continue;
            };
            let turn = node.rest.inverse() * parent.pose.rotation.inverse() * state.pose.rotation;
            // Velocity of the joint: relative angular velocity in the child's axes.
            let apart = state.angular - parent.angular;
            let rate = state.pose.rotation.inverse_transform_vector(&apart);
            match node.joint {
                Joint::Hinge(axis, _) => {
                    self.angles[i] = twist(&turn.cast(), &axis.cast()) as f32;
                    velocity[0] = rate.dot(&axis);
                }
                _ => {
                    self.rotations[i] = turn;
                    velocity.copy_from_slice(rate.as_slice());
                }
            }
        }
    }

    /// Sets the targets of the drives, one per node.
    pub fn set_targets(&mut self, targets: &[Target]) {
        for (own, target) in self.targets.iter_mut().zip(targets) {
            match target {
                Target::Free => {}
                Target::Ball(turn) => *own = *turn,
                Target::Hinge(angle) => *own = of_angle(*angle),
            }
        }
    }
}

/// What a drive holds before it is given a target: the joint at rest.
fn rest(joint: &Joint) -> UnitQuaternion<f32> {
    match joint {
        Joint::Hinge(..) => of_angle(0.0),
        Joint::Free | Joint::Ball => UnitQuaternion::identity(),
    }
}

/// A hinge's target among those of [`State::targets`], which are rotations.
fn of_angle(angle: f32) -> UnitQuaternion<f32> {
    UnitQuaternion::new_unchecked(Quaternion::from_real(angle))
}
