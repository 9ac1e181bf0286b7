//! Coordinates of a tree, and where they put it.

use super::super::world::LinkState;
use super::spatial::{Axes, Motion};
use super::tree::{Joint, Node, Tree};
use crate::skeleton::twist;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use wide::f32x4;

/// Where a node is in the world, seen from the root's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub rotation: UnitQuaternion<f32>,
    pub matrix: Matrix3<f32>,
    pub origin: Vector3<f32>,
    /// Where its joint turns.
    pub pivot: Vector3<f32>,
}

impl Place {
    pub fn point(&self, local: &Vector3<f32>) -> Vector3<f32> {
        self.origin + self.matrix * local
    }
}

/// Where a tree is and how it moves.
#[derive(Clone, Debug)]
pub(super) struct Pose {
    /// The root's place in the world. All else is relative to it, so that nothing is lost far from the world's origin.
    pub origin: Vector3<f32>,
    /// Of every node, in its parent; the root's in the world.
    pub turns: Vec<UnitQuaternion<f32>>,
    /// Of the hinges, radians.
    pub angles: Vec<f32>,
    /// By block.
    pub velocity: Vec<f32x4>,
    pub places: Vec<Place>,
    /// What a unit of every velocity coordinate does, by block, about the root's origin.
    pub axes: Vec<Axes>,
}

impl Pose {
    pub fn new(tree: &Tree) -> Self {
        let nowhere = Place {
            rotation: UnitQuaternion::identity(),
            matrix: Matrix3::identity(),
            origin: Vector3::zeros(),
            pivot: Vector3::zeros(),
        };
        let mut axes = vec![Axes::default(); tree.blocks()];
        let unit = |k: usize| {
            f32x4::from(std::array::from_fn(
                |lane| if lane == k { 1.0 } else { 0.0 },
            ))
        };
        axes[0].linear = [unit(0), unit(1), unit(2)];
        axes[1].angular = [unit(0), unit(1), unit(2)];
        Pose {
            origin: Vector3::zeros(),
            turns: vec![UnitQuaternion::identity(); tree.nodes.len()],
            angles: vec![0.0; tree.nodes.len()],
            velocity: vec![f32x4::ZERO; tree.blocks()],
            places: vec![nowhere; tree.nodes.len()],
            axes,
        }
    }

    /// Takes the coordinates of `states`; what their joints can't do is left out.
    pub fn set(&mut self, tree: &Tree, states: &[LinkState]) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let state = &states[i];
            let Some(parent) = node.parent.map(|p| &states[p]) else {
                self.origin = state.pose.translation.vector;
                self.turns[i] = state.pose.rotation;
                self.velocity[0] = four(&state.linear);
                self.velocity[1] = four(&state.angular);
                continue;
            };
            let turn = node.rest.inverse() * parent.pose.rotation.inverse() * state.pose.rotation;
            let apart = state.angular - parent.angular;
            let rate = state.pose.rotation.inverse_transform_vector(&apart);
            match node.joint {
                Joint::Hinge(axis, _) => {
                    self.angles[i] = twist(&turn.cast(), &axis.cast()) as f32;
                    self.velocity[node.block] = f32x4::from([rate.dot(&axis), 0.0, 0.0, 0.0]);
                }
                _ => {
                    self.turns[i] = turn;
                    self.velocity[node.block] = four(&rate);
                }
            }
        }
        self.place(tree);
    }

    /// Moves the coordinates on at their velocity for `dt` seconds.
    pub fn advance(&mut self, tree: &Tree, dt: f32) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let rate = three(self.velocity[node.block]) * dt;
            match node.joint {
                Joint::Free => {
                    self.origin += three(self.velocity[0]) * dt;
                    self.turns[i] =
                        normalized(UnitQuaternion::from_scaled_axis(rate) * self.turns[i]);
                }
                Joint::Ball => {
                    self.turns[i] =
                        normalized(self.turns[i] * UnitQuaternion::from_scaled_axis(rate))
                }
                Joint::Hinge(..) => self.angles[i] += rate.x,
            }
        }
        self.place(tree);
    }

    /// Places and axes from the coordinates.
    fn place(&mut self, tree: &Tree) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let Some(parent) = node.parent.map(|p| self.places[p]) else {
                self.places[i].rotation = self.turns[i];
                self.places[i].matrix = self.turns[i].to_rotation_matrix().into_inner();
                continue;
            };
            if let Joint::Hinge(axis, _) = node.joint {
                let (sin, cos) = (self.angles[i] * 0.5).sin_cos();
                let turn = Quaternion::from_parts(cos, axis * sin);
                self.turns[i] = UnitQuaternion::new_unchecked(turn);
            }
            let rotation = parent.rotation * node.rest * self.turns[i];
            let matrix = rotation.to_rotation_matrix().into_inner();
            let pivot = parent.point(&node.pivot);
            let origin = pivot - matrix * node.anchor;
            self.places[i] = Place {
                rotation,
                matrix,
                origin,
                pivot,
            };
            self.axes[node.block] = match node.joint {
                Joint::Hinge(axis, _) => Axes::about(&[matrix * axis], &pivot),
                _ => Axes::about(&[0, 1, 2].map(|k| matrix.column(k).into()), &pivot),
            };
        }
    }

    /// States of all nodes in the world.
    pub fn read(&self, motions: &[Motion], states: &mut [LinkState]) {
        for ((state, place), motion) in states.iter_mut().zip(&self.places).zip(motions) {
            state.pose.rotation = place.rotation;
            state.pose.translation.vector = place.origin + self.origin;
            state.linear = motion.at(&place.origin);
            state.angular = motion.angular;
        }
    }

    /// What a node's joint does by itself.
    pub fn own_motion(&self, i: usize, node: &Node) -> Motion {
        let (place, rate) = (&self.places[i], self.velocity[node.block]);
        match node.joint {
            Joint::Free => Motion {
                angular: three(rate),
                linear: three(self.velocity[0]),
            },
            Joint::Ball => Motion::about(place.matrix * three(rate), &place.pivot),
            Joint::Hinge(axis, _) => {
                Motion::about(place.matrix * (axis * rate.as_array()[0]), &place.pivot)
            }
        }
    }
}

pub(super) fn four(v: &Vector3<f32>) -> f32x4 {
    f32x4::from([v.x, v.y, v.z, 0.0])
}

pub(super) fn three(v: f32x4) -> Vector3<f32> {
    let [x, y, z, _] = v.to_array();
    Vector3::new(x, y, z)
}

fn normalized(turn: UnitQuaternion<f32>) -> UnitQuaternion<f32> {
    UnitQuaternion::new_normalize(turn.into_inner())
}
