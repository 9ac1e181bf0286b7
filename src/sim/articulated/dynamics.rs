//! Velocities, momentum, and accelerations without contacts: inertia, gravity, what turns with what, and the drives.

use super::matrix::PathMatrix;
use super::pose::{Pose, four};
use super::spatial::{Force, Inertia, Motion};
use super::tree::{Joint, Tree};
use nalgebra::{UnitQuaternion, Vector3};
use wide::f32x4;

const GRAVITY: f32 = 9.81;
/// Stiffness of a stop, as a share of inertia / dt².
const STOP: f32 = 4.0;

/// What a step computes of a tree before it looks at the ground.
#[derive(Clone, Debug)]
pub(super) struct Dynamics {
    /// Of every node, in its present pose; and what its own joint adds to that.
    pub motions: Vec<Motion>,
    own: Vec<Motion>,
    inertias: Vec<Inertia>,
    whole: Inertia,
    /// What the whole character has, about the root's origin.
    momentum: Force,
    accelerations: Vec<Motion>,
    forces: Vec<Force>,
    composites: Vec<Inertia>,
    pub matrix: PathMatrix,
    /// Right side, half solution, then change of velocity, by block.
    pub change: Vec<f32x4>,
    /// What drives and stops add to the diagonal.
    stiffening: Vec<f32x4>,
    /// The drives' part of it: by how much their torque yields to a change of velocity.
    yielding: Vec<f32x4>,
    /// Torque of every drive if its coordinate kept its velocity.
    torques: Vec<f32x4>,
    /// Drives that were found beyond their limit: the sign of their torque, else 0.
    saturated: Vec<f32x4>,
    /// Those that were held to it in this step, likewise.
    held: Vec<f32x4>,
    /// Impulses at the centres of mass of nodes that the next step gives.
    pushes: Vec<(usize, Vector3<f32>)>,
}

impl Dynamics {
    pub fn new(tree: &Tree) -> Self {
        let (nodes, blocks) = (tree.nodes.len(), tree.blocks());
        Dynamics {
            motions: vec![Motion::default(); nodes],
            own: vec![Motion::default(); nodes],
            inertias: vec![Inertia::default(); nodes],
            whole: Inertia::default(),
            momentum: Force::default(),
            accelerations: vec![Motion::default(); nodes],
            forces: vec![Force::default(); nodes],
            composites: vec![Inertia::default(); nodes],
            matrix: PathMatrix::new(tree),
            change: vec![f32x4::ZERO; blocks],
            stiffening: vec![f32x4::ZERO; blocks],
            yielding: vec![f32x4::ZERO; blocks],
            torques: vec![f32x4::ZERO; blocks],
            saturated: vec![f32x4::ZERO; blocks],
            held: vec![f32x4::ZERO; blocks],
            pushes: Vec::new(),
        }
    }

    /// Starts from `pose`, with nothing left of the steps before.
    pub fn reset(&mut self, tree: &Tree, pose: &Pose) {
        self.saturated.fill(f32x4::ZERO);
        self.pushes.clear();
        self.survey(tree, pose, 1.0);
    }

    /// Gives a node an impulse at its centre of mass in the next step.
    pub fn push(&mut self, node: usize, impulse: Vector3<f32>) {
        self.pushes.push((node, impulse));
    }

    /// Motions, inertias and momentum of `pose`, masses `mass` times what they are.
    pub fn survey(&mut self, tree: &Tree, pose: &Pose, mass: f32) {
        (self.whole, self.momentum) = (Inertia::default(), Force::default());
        for (i, node) in tree.nodes.iter().enumerate() {
            let own = pose.own_motion(i, node);
            let place = &pose.places[i];
            let central = place.matrix * (node.inertia * mass) * place.matrix.transpose();
            let inertia = Inertia::new(node.mass * mass, place.point(&node.com), central);
            self.motions[i] = node.parent.map_or(own, |p| self.motions[p] + own);
            self.own[i] = own;
            self.momentum += inertia.times(&self.motions[i]);
            self.whole += inertia;
            self.inertias[i] = inertia;
        }
    }

    /// Momentum about the centre of mass after `impulse` from outside, which is about the root's origin.
    pub fn momentum_after(&self, impulse: &Force) -> Force {
        (self.momentum + *impulse).about(&self.whole.com())
    }

    /// Moves the whole character so that it has `momentum` about its centre of mass. A step along velocities that turn
    /// keeps it only to first order; but nothing inside of a body changes its momentum.
    pub fn conserve(&mut self, pose: &mut Pose, momentum: &Force) {
        let momentum = momentum.about(&-self.whole.com());
        let Some(error) = self.whole.motion_of(&(momentum - self.momentum)) else {
            return;
        };
        for motion in &mut self.motions {
            *motion = *motion + error;
        }
        pose.velocity[0] += four(&error.linear);
        pose.velocity[1] += four(&error.angular);
        self.momentum = momentum;
    }

    /// Half solves for what gravity, drives and pushes do in `dt` seconds, and says what momentum comes from outside.
    pub fn accelerate(
        &mut self,
        tree: &Tree,
        pose: &Pose,
        targets: &[UnitQuaternion<f32>],
        dt: f32,
    ) -> Force {
        let weight = Vector3::new(0.0, 0.0, -GRAVITY * self.whole.mass());
        let mut impulse = Force::at(weight * dt, &self.whole.com());
        self.sweep_out(tree);
        for &(node, push) in &self.pushes {
            let push = Force::at(push, &pose.places[node].point(&tree.nodes[node].com));
            impulse += push;
            self.forces[node] = self.forces[node] - push * (1.0 / dt);
        }
        self.sweep_in(tree, pose, dt);
        self.drive(tree, pose, targets, dt);
        self.matrix.factor(&self.stiffening);
        self.matrix.halve(&mut self.change);
        impulse
    }

    /// Solves the other half. True where a drive goes beyond its limit that wasn't held to it: the step then has to be
    /// taken again, with that drive at the limit.
    pub fn finish(&mut self, tree: &Tree, dt: f32) -> bool {
        self.matrix.finish(&mut self.change);
        let mut fresh = false;
        for (k, gains) in tree.gains.iter().enumerate() {
            let back = self.yielding[k] * self.change[k] * f32x4::splat(1.0 / dt);
            let torque = self.torques[k] - back;
            let over = torque.abs().simd_ge(gains.limit) & gains.limit.simd_gt(f32x4::ZERO);
            let sign = torque.is_sign_negative().select(-f32x4::ONE, f32x4::ONE);
            let saturated = over.select(sign, f32x4::ZERO);
            fresh |= (over & self.held[k].simd_eq(f32x4::ZERO)).any();
            self.saturated[k] = saturated;
        }
        fresh
    }

    /// Changes the velocity by what was solved for.
    pub fn apply(&mut self, pose: &mut Pose) {
        self.pushes.clear();
        for (velocity, change) in pose.velocity.iter_mut().zip(&self.change) {
            *velocity += *change;
        }
    }

    /// From the root outwards: accelerations that no coordinate has a part in, and the forces they take (recursive
    /// Newton-Euler, RBDA table 5.1).
    fn sweep_out(&mut self, tree: &Tree) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let motion = self.motions[i];
            let acceleration = match node.parent {
                // Its axes stay along the world's, but the turning ones travel with it.
                None => Motion {
                    angular: Vector3::zeros(),
                    linear: motion.linear.cross(&motion.angular) + Vector3::new(0.0, 0.0, GRAVITY),
                },
                Some(p) => self.accelerations[p] + motion.cross(&self.own[i]),
            };
            let momentum = self.inertias[i].times(&motion);
            self.forces[i] = self.inertias[i].times(&acceleration) + motion.cross_force(&momentum);
            self.accelerations[i] = acceleration;
        }
    }

    /// From the tips inwards: what each joint has to bear, and the inertia matrix (composite rigid bodies, RBDA
    /// table 6.2).
    fn sweep_in(&mut self, tree: &Tree, pose: &Pose, dt: f32) {
        self.composites.copy_from_slice(&self.inertias);
        for (i, node) in tree.nodes.iter().enumerate().rev() {
            let (force, inertia) = (self.forces[i], self.composites[i]);
            let first = if node.parent.is_none() { 0 } else { node.block };
            for block in first..=node.block {
                self.change[block] = pose.axes[block].dot(&force) * f32x4::splat(-dt);
                let momenta = inertia.momenta(&pose.axes[block]);
                for (rows, &other) in self.matrix.rows_mut(block).iter_mut().zip(&node.path) {
                    *rows = pose.axes[other].powers(&momenta);
                }
            }
            if let Some(parent) = node.parent {
                self.forces[parent] += force;
                self.composites[parent] += inertia;
            }
        }
    }

    /// Drives as they will be at the end of the step (stable PD, Tan, Liu and Turk 2011): with Δ the change of
    /// velocity, torque = −kp (e + dt (q̇ + Δ)) − kd (q̇ + Δ), whose part in Δ goes to the left side.
    fn drive(&mut self, tree: &Tree, pose: &Pose, targets: &[UnitQuaternion<f32>], dt: f32) {
        let dt = f32x4::splat(dt);
        for (i, node) in tree.nodes.iter().enumerate() {
            let error = match node.joint {
                Joint::Free => continue,
                Joint::Ball => (targets[i].inverse() * pose.turns[i]).scaled_axis(),
                Joint::Hinge(..) => Vector3::new(pose.angles[i] - targets[i].w, 0.0, 0.0),
            };
            let (k, gains) = (node.block, &tree.gains[node.block]);
            let along = gains.kd + dt * gains.kp;
            let torque = -(gains.kp * four(&error)) - along * pose.velocity[k];
            // Zero where it isn't saturated, so never beyond.
            let held = (torque * self.saturated[k]).simd_gt(gains.limit);
            self.held[k] = held.select(self.saturated[k], f32x4::ZERO);
            self.torques[k] = held.select(self.saturated[k] * gains.limit, torque);
            self.yielding[k] = held.select(f32x4::ZERO, dt * along);
            self.change[k] += dt * self.torques[k];
            self.stiffening[k] = self.yielding[k];
            if let Joint::Hinge(_, Some(range)) = node.joint {
                self.stop(pose, i, k, range, dt.as_array()[0]);
            }
        }
    }

    /// The end of a hinge's range: a spring so stiff, and so damped, that it holds within two steps what comes, taken
    /// at the step's end as drives are.
    fn stop(&mut self, pose: &Pose, i: usize, k: usize, range: [f32; 2], dt: f32) {
        let rate = pose.velocity[k].as_array()[0];
        let next = pose.angles[i] + dt * rate;
        let beyond = next - next.clamp(range[0], range[1]);
        if beyond != 0.0 {
            let spring = STOP * self.matrix.diagonal(k, 0) / (dt * dt);
            let damper = spring * dt;
            self.change[k].as_mut_array()[0] -= dt * (spring * beyond + damper * rate);
            self.stiffening[k].as_mut_array()[0] += dt * (damper + spring * dt);
        }
    }
}
