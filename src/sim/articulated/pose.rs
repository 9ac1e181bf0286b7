//! Coordinates of eight characters, and where they put them.

use super::super::state::LinkState;
use super::algebra::{Rotation, Turn, Vec3};
use super::lanes::Lanes;
use super::spatial::Motion;
use super::state::State;
use super::tree::{Joint, Node, Tree};

/// Where a node is in the world, seen from the root's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<L> {
    pub turn: Turn<L>,
    pub matrix: Rotation<L>,
    pub origin: Vec3<L>,
    /// Where its joint turns.
    pub pivot: Vec3<L>,
}

impl<L: Lanes> Place<L> {
    #[inline(always)]
    pub fn point(&self, local: &Vec3<L>) -> Vec3<L> {
        self.origin + self.matrix.times(local)
    }
}

/// Where a tree is and how it moves.
#[derive(Clone, Debug)]
pub(super) struct Pose<L> {
    /// The root's place in the world. All else is relative to it, so that nothing is lost far from the world's origin.
    pub origin: Vec3<L>,
    /// Of every node that is no hinge, in its parent from how it rests there; the root's in the world.
    pub turns: Vec<Turn<L>>,
    /// Of the hinges, radians.
    pub angles: Vec<L>,
    /// By coordinate.
    pub velocity: Vec<L>,
    pub places: Vec<Place<L>>,
    /// What a unit of every coordinate's velocity does, about the root's origin.
    pub axes: Vec<Motion<L>>,
}

impl<L: Lanes> Pose<L> {
    pub fn new(tree: &Tree) -> Self {
        let (nodes, coordinates) = (tree.nodes.len(), tree.coordinates.len());
        let nowhere = Place {
            turn: Turn::identity(),
            matrix: Turn::identity().matrix(),
            origin: Vec3::ZERO,
            pivot: Vec3::ZERO,
        };
        let mut axes = vec![Motion::ZERO; coordinates];
        let one = L::splat(1.0);
        let units = [
            Vec3::new(one, L::ZERO, L::ZERO),
            Vec3::new(L::ZERO, one, L::ZERO),
            Vec3::new(L::ZERO, L::ZERO, one),
        ];
        for (k, unit) in units.into_iter().enumerate() {
            axes[k].linear = unit;
            axes[3 + k].angular = unit;
        }
        Pose {
            origin: Vec3::ZERO,
            turns: vec![Turn::identity(); nodes],
            angles: vec![L::ZERO; nodes],
            velocity: vec![L::ZERO; coordinates],
            places: vec![nowhere; nodes],
            axes,
        }
    }

    pub fn take(&mut self, lane: usize, state: &State) {
        self.origin.set(lane, &state.origin);
        for (own, turn) in self.turns.iter_mut().zip(&state.turns) {
            own.set(lane, turn);
        }
        for (own, angle) in self.angles.iter_mut().zip(&state.angles) {
            own.set(lane, *angle);
        }
        for (own, rate) in self.velocity.iter_mut().zip(&state.velocity) {
            own.set(lane, *rate);
        }
    }

    pub fn give(&self, lane: usize, state: &mut State) {
        state.origin = self.origin.of(lane);
        for (turn, own) in state.turns.iter_mut().zip(&self.turns) {
            *turn = own.of(lane);
        }
        for (angle, own) in state.angles.iter_mut().zip(&self.angles) {
            *angle = own.of(lane);
        }
        for (rate, own) in state.velocity.iter_mut().zip(&self.velocity) {
            *rate = own.of(lane);
        }
    }

    /// States of all nodes in the world.
    pub fn read(&self, motions: &[Motion<L>], lane: usize, states: &mut [LinkState]) {
        let origin = self.origin.of(lane);
        for ((state, place), motion) in states.iter_mut().zip(&self.places).zip(motions) {
            let (at, angular) = (place.origin.of(lane), motion.angular.of(lane));
            state.pose.rotation = place.turn.of(lane);
            state.pose.translation.vector = at + origin;
            state.linear = motion.linear.of(lane) + angular.cross(&at);
            state.angular = angular;
        }
    }

    /// Moves the coordinates on at their velocity for `dt` seconds.
    #[inline(always)]
    pub fn advance(&mut self, tree: &Tree, dt: L) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let k = node.first;
            match node.joint {
                Joint::Free => {
                    self.origin += self.rate(k) * dt;
                    let turn = Turn::by(&(self.rate(k + 3) * dt));
                    self.turns[i] = turn.times(&self.turns[i]).normalized();
                }
                Joint::Ball => {
                    let turn = Turn::by(&(self.rate(k) * dt));
                    self.turns[i] = self.turns[i].times(&turn).normalized();
                }
                Joint::Hinge(..) => self.angles[i] += self.velocity[k] * dt,
            }
        }
    }

    /// Places and axes from the coordinates.
    #[inline(always)]
    pub fn place(&mut self, tree: &Tree) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let Some(parent) = node.parent else {
                self.places[i].turn = self.turns[i];
                self.places[i].matrix = self.turns[i].matrix();
                continue;
            };
            let parent = self.places[parent];
            let own = match node.joint {
                Joint::Hinge(axis, _) => Turn::about(&Vec3::splat(&axis), self.angles[i]),
                _ => self.turns[i],
            };
            let turn = parent.turn.times(&Turn::splat(&node.rest)).times(&own);
            let matrix = turn.matrix();
            let pivot = parent.point(&Vec3::splat(&node.pivot));
            let origin = pivot - matrix.times(&Vec3::splat(&node.anchor));
            self.places[i] = Place {
                turn,
                matrix,
                origin,
                pivot,
            };
            match node.joint {
                Joint::Hinge(axis, _) => {
                    let axis = matrix.times(&Vec3::splat(&axis));
                    self.axes[node.first] = Motion::about(axis, &pivot);
                }
                _ => {
                    for k in 0..3 {
                        self.axes[node.first + k] = Motion::about(matrix.0[k], &pivot);
                    }
                }
            }
        }
    }

    /// What a node's joint does by itself.
    #[inline(always)]
    pub fn own_motion(&self, i: usize, node: &Node) -> Motion<L> {
        let place = &self.places[i];
        match node.joint {
            Joint::Free => Motion {
                angular: self.rate(3),
                linear: self.rate(0),
            },
            Joint::Ball => Motion::about(place.matrix.times(&self.rate(node.first)), &place.pivot),
            Joint::Hinge(..) => {
                let (axis, rate) = (&self.axes[node.first], self.velocity[node.first]);
                Motion {
                    angular: axis.angular * rate,
                    linear: axis.linear * rate,
                }
            }
        }
    }

    /// Three velocities in a row.
    #[inline(always)]
    fn rate(&self, k: usize) -> Vec3<L> {
        Vec3::new(self.velocity[k], self.velocity[k + 1], self.velocity[k + 2])
    }
}
