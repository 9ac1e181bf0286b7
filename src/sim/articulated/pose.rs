//! Joint coordinates of eight characters, and their forward kinematics.

use super::super::state::LinkState;
use super::algebra::{Quat, Rotation, Vec3};
use super::lanes::Lanes;
use super::spatial::MotionVector;
use super::state::State;
use super::tree::{Joint, Node, Tree};

/// The frame of a node: axes of the world, positions from the root's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame<L> {
    /// World from node: the rotation.
    pub rotation: Quat<L>,
    /// The same as a matrix.
    pub matrix: Rotation<L>,
    /// Origin of the frame, metres.
    pub origin: Vec3<L>,
    /// Centre of the joint that connects it to its parent, metres.
    pub pivot: Vec3<L>,
}

impl<L: Lanes> Frame<L> {
    /// A point of the node, given in its own frame, seen from the root's origin.
    #[inline(always)]
    pub fn point(&self, local: &Vec3<L>) -> Vec3<L> {
        self.origin + self.matrix.times(local)
    }
}

/// Coordinates and velocities of a tree, and the frames and joint axes that follow from them.
#[derive(Clone, Debug)]
pub(super) struct Pose<L> {
    /// Position of the root's origin in the world, metres. Everything else is relative to it, so that f32 loses no precision
    /// far from the world's origin.
    pub origin: Vec3<L>,
    /// `[nodes]`: joint rotation, the identity at rest; for the root, its orientation in the world. Unused for hinges.
    pub rotations: Vec<Quat<L>>,
    /// `[nodes]`: angle of a hinge, radians; unused for other joints.
    pub angles: Vec<L>,
    /// `[coordinates]`: m/s for the root's translations, else rad/s.
    pub velocity: Vec<L>,
    /// `[nodes]`.
    pub frames: Vec<Frame<L>>,
    /// `[coordinates]`: the motion that a unit of each coordinate's velocity makes, about the root's origin. These are the
    /// columns of RBDA's motion subspace matrices S.
    pub axes: Vec<MotionVector<L>>,
}

impl<L: Lanes> Pose<L> {
    pub fn new(tree: &Tree) -> Self {
        let (nodes, coordinates) = (tree.nodes.len(), tree.coordinates.len());
        let nowhere = Frame {
            rotation: Quat::identity(),
            matrix: Quat::identity().to_matrix(),
            origin: Vec3::ZERO,
            pivot: Vec3::ZERO,
        };
        // The root's axes are the world's and never change.
        let mut axes = vec![MotionVector::ZERO; coordinates];
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
            rotations: vec![Quat::identity(); nodes],
            angles: vec![L::ZERO; nodes],
            velocity: vec![L::ZERO; coordinates],
            frames: vec![nowhere; nodes],
            axes,
        }
    }

    /// Puts a character's coordinates into a lane.
    pub fn gather(&mut self, lane: usize, state: &State) {
        self.origin.set(lane, &state.origin);
        for (own, turn) in self.rotations.iter_mut().zip(&state.rotations) {
            own.set(lane, turn);
        }
        for (own, angle) in self.angles.iter_mut().zip(&state.angles) {
            own.set(lane, *angle);
        }
        for (own, rate) in self.velocity.iter_mut().zip(&state.velocity) {
            own.set(lane, *rate);
        }
    }

    /// Takes a character's coordinates out of a lane.
    pub fn scatter(&self, lane: usize, state: &mut State) {
        state.origin = self.origin.get(lane);
        for (turn, own) in state.rotations.iter_mut().zip(&self.rotations) {
            *turn = own.get(lane);
        }
        for (angle, own) in state.angles.iter_mut().zip(&self.angles) {
            *angle = own.get(lane);
        }
        for (rate, own) in state.velocity.iter_mut().zip(&self.velocity) {
            *rate = own.get(lane);
        }
    }

    /// Writes the states of all nodes in the world, given their velocities about the root's origin.
    pub fn read(&self, velocities: &[MotionVector<L>], lane: usize, states: &mut [LinkState]) {
        let origin = self.origin.get(lane);
        for ((state, frame), motion) in states.iter_mut().zip(&self.frames).zip(velocities) {
            let (at, angular) = (frame.origin.get(lane), motion.angular.get(lane));
            state.pose.rotation = frame.rotation.get(lane);
            state.pose.translation.vector = at + origin;
            state.linear = motion.linear.get(lane) + angular.cross(&at);
            state.angular = angular;
        }
    }

    /// Moves the coordinates on at their velocities for `dt` seconds. Rotations are normalised so that rounding doesn't add up.
    #[inline(always)]
    pub fn integrate(&mut self, tree: &Tree, dt: L) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let k = node.first;
            match node.joint {
                Joint::Free => {
                    // The root's angular velocity is in world axes, so the step multiplies from the left.
                    self.origin += self.rate(k) * dt;
                    let step = Quat::from_rotation_vector(&(self.rate(k + 3) * dt));
                    self.rotations[i] = step.times(&self.rotations[i]).normalized();
                }
                Joint::Ball => {
                    // A ball's is in the node's own axes, so it multiplies from the right.
                    let step = Quat::from_rotation_vector(&(self.rate(k) * dt));
                    self.rotations[i] = self.rotations[i].times(&step).normalized();
                }
                Joint::Hinge(..) => self.angles[i] += self.velocity[k] * dt,
            }
        }
    }

    /// Computes frames and axes from the coordinates, from the root outwards.
    #[inline(always)]
    pub fn forward_kinematics(&mut self, tree: &Tree) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let Some(parent) = node.parent else {
                // Its origin and pivot stay zero: all positions are seen from there.
                self.frames[i].rotation = self.rotations[i];
                self.frames[i].matrix = self.rotations[i].to_matrix();
                continue;
            };
            let parent = self.frames[parent];
            let own = match node.joint {
                Joint::Hinge(axis, _) => Quat::from_axis_angle(&Vec3::splat(&axis), self.angles[i]),
                _ => self.rotations[i],
            };
            let rotation = parent.rotation.times(&Quat::splat(&node.rest)).times(&own);
            let matrix = rotation.to_matrix();
            // The joint's centre is a point of both bodies, which gives the origin of this one.
            let pivot = parent.point(&Vec3::splat(&node.pivot));
            let origin = pivot - matrix.times(&Vec3::splat(&node.anchor));
            self.frames[i] = Frame {
                rotation,
                matrix,
                origin,
                pivot,
            };
            // The joint's axes in the world: they pass through its centre.
            match node.joint {
                Joint::Hinge(axis, _) => {
                    let axis = matrix.times(&Vec3::splat(&axis));
                    self.axes[node.first] = MotionVector::about_axis(axis, &pivot);
                }
                _ => {
                    for k in 0..3 {
                        self.axes[node.first + k] = MotionVector::about_axis(matrix.0[k], &pivot);
                    }
                }
            }
        }
    }

    /// Velocity of a node relative to its parent: S q̇ (RBDA's joint velocity v_J).
    #[inline(always)]
    pub fn joint_velocity(&self, i: usize, node: &Node) -> MotionVector<L> {
        let frame = &self.frames[i];
        match node.joint {
            Joint::Free => MotionVector {
                angular: self.rate(3),
                linear: self.rate(0),
            },
            Joint::Ball => {
                MotionVector::about_axis(frame.matrix.times(&self.rate(node.first)), &frame.pivot)
            }
            Joint::Hinge(..) => {
                let (axis, rate) = (&self.axes[node.first], self.velocity[node.first]);
                MotionVector {
                    angular: axis.angular * rate,
                    linear: axis.linear * rate,
                }
            }
        }
    }

    /// Three velocity coordinates in a row as a vector.
    #[inline(always)]
    fn rate(&self, k: usize) -> Vec3<L> {
        Vec3::new(self.velocity[k], self.velocity[k + 1], self.velocity[k + 2])
    }
}
