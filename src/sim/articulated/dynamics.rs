//! Accelerations without contacts: inertia, gravity, what turns with what, and the drives.

use super::matrix::PathMatrix;
use super::pose::Pose;
use super::spatial::{Force, Inertia, Motion};
use super::tree::{Joint, Tree};
use nalgebra::{UnitQuaternion, Vector3};

const GRAVITY: f32 = 9.81;

/// What a step computes of a tree before it looks at the ground.
#[derive(Clone, Debug)]
pub(super) struct Dynamics {
    /// Of every node, before the step.
    pub motions: Vec<Motion>,
    accelerations: Vec<Motion>,
    forces: Vec<Force>,
    inertias: Vec<Inertia>,
    pub matrix: PathMatrix,
    /// Right side, then change of velocity, of every coordinate.
    change: Vec<f32>,
    /// What the drives add to the diagonal.
    stiffening: Vec<f32>,
    /// Torque of every drive if its coordinate kept its velocity.
    torques: Vec<f32>,
    /// Drives at their limit since the last step: the sign of their torque, else 0.
    saturated: Vec<f32>,
    /// Impulses at the centres of mass of nodes that the next step gives.
    pushes: Vec<(usize, Vector3<f32>)>,
}

impl Dynamics {
    pub fn new(tree: &Tree) -> Self {
        let (nodes, dofs) = (tree.nodes.len(), tree.dofs());
        Dynamics {
            motions: vec![Motion::default(); nodes],
            accelerations: vec![Motion::default(); nodes],
            forces: vec![Force::default(); nodes],
            inertias: vec![Inertia::default(); nodes],
            matrix: PathMatrix::new(tree),
            change: vec![0.0; dofs],
            stiffening: vec![0.0; dofs],
            torques: vec![0.0; dofs],
            saturated: vec![0.0; dofs],
            pushes: Vec::new(),
        }
    }

    /// Forgets the steps before.
    pub fn reset(&mut self) {
        self.saturated.fill(0.0);
        self.pushes.clear();
    }

    /// Gives a node an impulse at its centre of mass in the next step.
    pub fn push(&mut self, node: usize, impulse: Vector3<f32>) {
        self.pushes.push((node, impulse));
    }

    /// Changes the velocity as gravity, drives and pushes do in `dt` seconds.
    pub fn accelerate(
        &mut self,
        tree: &Tree,
        pose: &mut Pose,
        targets: &[UnitQuaternion<f32>],
        (dt, mass): (f32, f32),
    ) {
        self.sweep_out(tree, pose, mass);
        for (node, impulse) in self.pushes.drain(..) {
            let com = pose.nodes[node] * nalgebra::Point3::from(tree.nodes[node].com);
            let force = impulse / dt;
            self.forces[node] = self.forces[node]
                - Force {
                    moment: com.coords.cross(&force),
                    force,
                };
        }
        self.sweep_in(tree, pose, dt);
        self.drive(tree, pose, targets, dt);
        self.matrix.add_diagonal(&self.stiffening);
        self.matrix.factor();
        self.matrix.solve(&mut self.change);
        for (velocity, change) in pose.velocity.iter_mut().zip(&self.change) {
            *velocity += change;
        }
    }

    /// From the root outwards: velocities, accelerations that no coordinate has a part in, and the forces they take
    /// (recursive Newton-Euler, RBDA table 5.1).
    fn sweep_out(&mut self, tree: &Tree, pose: &Pose, mass: f32) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let own = pose.own_motion(node.dofs.clone());
            let (motion, acceleration) = match node.parent {
                // Its axes stay along the world's, but the turning ones travel with it.
                None => (
                    own,
                    Motion {
                        angular: Vector3::zeros(),
                        linear: own.linear.cross(&own.angular) + Vector3::new(0.0, 0.0, GRAVITY),
                    },
                ),
                Some(p) => {
                    let motion = self.motions[p] + own;
                    (motion, self.accelerations[p] + motion.cross(&own))
                }
            };
            let place = &pose.nodes[i];
            let turn = place.rotation.to_rotation_matrix();
            let com = place.translation.vector + turn * node.com;
            let central = turn.matrix() * node.inertia * turn.matrix().transpose();
            let inertia = Inertia::new(node.mass * mass, com, central * mass);
            self.forces[i] =
                inertia.times(&acceleration) + motion.cross_force(&inertia.times(&motion));
            self.motions[i] = motion;
            self.accelerations[i] = acceleration;
            self.inertias[i] = inertia;
        }
    }

    /// From the tips inwards: what each joint has to bear, and the inertia matrix (composite rigid bodies, RBDA
    /// table 6.2).
    fn sweep_in(&mut self, tree: &Tree, pose: &Pose, dt: f32) {
        for (i, node) in tree.nodes.iter().enumerate().rev() {
            let (force, inertia) = (self.forces[i], self.inertias[i]);
            for k in node.dofs.clone() {
                self.change[k] = -dt * pose.axes[k].dot(&force);
                let momentum = inertia.times(&pose.axes[k]);
                for (entry, &j) in self.matrix.row_mut(k).iter_mut().zip(&node.path) {
                    *entry = pose.axes[j].dot(&momentum);
                }
            }
            if let Some(parent) = node.parent {
                self.forces[parent] += force;
                self.inertias[parent] += inertia;
            }
        }
    }

    /// Drives as they will be at the end of the step (stable PD, Tan, Liu and Turk 2011): with Δ the change of
    /// velocity, torque = −kp (e + dt (q̇ + Δ)) − kd (q̇ + Δ), whose part in Δ goes to the left side.
    fn drive(&mut self, tree: &Tree, pose: &Pose, targets: &[UnitQuaternion<f32>], dt: f32) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let errors = match node.joint {
                Joint::Free => continue,
                Joint::Ball => (targets[i].inverse() * pose.turns[i]).scaled_axis(),
                Joint::Hinge(..) => Vector3::new(pose.angles[i] - targets[i].w, 0.0, 0.0),
            };
            for (k, error) in node.dofs.clone().zip(errors.iter()) {
                let gains = tree.gains[k];
                let along = gains.kd + dt * gains.kp;
                let torque = -gains.kp * error - along * pose.velocity[k];
                let sign = self.saturated[k];
                let held = sign != 0.0 && torque * sign > gains.limit;
                self.torques[k] = if held { sign * gains.limit } else { torque };
                self.stiffening[k] = if held { 0.0 } else { dt * along };
                self.change[k] += dt * self.torques[k];
            }
        }
    }

    /// Sees which drives went beyond their limit, given the velocities of before and after the whole step: they get
    /// no more than that in the next.
    pub fn saturate(&mut self, tree: &Tree, change: impl Iterator<Item = f32>, dt: f32) {
        for (k, change) in change.enumerate() {
            let torque = self.torques[k] - self.stiffening[k] * change / dt;
            let limit = tree.gains[k].limit;
            self.saturated[k] = if torque.abs() >= limit && limit > 0.0 {
                torque.signum()
            } else {
                0.0
            };
        }
    }
}
