//! Equations of motion of eight characters without contacts.
//!
//! One step changes the velocity by Δ, where M is the joint-space inertia matrix, C are the bias forces (gravity, Coriolis,
//! centrifugal and outside forces), and τ(Δ) are the torques of drives and joint limits at the end of the step:
//!
//! M Δ = dt (τ(Δ) − C) + Jᵀ λ
//!
//! τ is linear in Δ, so its part in Δ goes to the left side, on the diagonal of M. The contact impulses λ are for
//! [`super::contact`], which works between the two halves of the solution.

use super::algebra::{Quat, Symmetric, Vec3};
use super::lanes::Lanes;
use super::matrix::PathMatrix;
use super::pose::Pose;
use super::spatial::{ForceVector, MotionVector, SpatialInertia};
use super::state::State;
use super::tree::{Gains, Joint, Tree};
use crate::skeleton;
use nalgebra::Vector3;

/// m/s², along −Z.
const GRAVITY: f32 = skeleton::GRAVITY as f32;
/// Stiffness of a joint limit in units of M_kk / dt², M_kk being the inertia that the hinge carries.
///
/// Chosen, by what it does to a hinge that carries all of its inertia: with stiffness a and damping a · dt, both implicit, a
/// step leaves 1 / (1 + 2a) of the speed at which the hinge arrives at its limit, a ninth, and takes back a / (1 + 2a) of an
/// excess, four ninths.
const LIMIT_STIFFNESS: f32 = 4.0;

/// An impulse from outside at the centre of mass of a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Push {
    /// The lane of the character.
    pub lane: usize,
    pub node: usize,
    /// World axes, N·s.
    pub impulse: Vector3<f32>,
}

/// Quantities of a step of eight characters, by node (`[nodes]`) or by coordinate (`[coordinates]`). Spatial vectors are in
/// world axes about the root's origin.
#[derive(Clone, Debug)]
pub(super) struct Dynamics<L> {
    /// Factor of all masses and inertias.
    mass_scale: L,
    /// `[nodes]`: targets of the drives as joint rotations. For a hinge `w` holds its angle.
    targets: Vec<Quat<L>>,
    /// `[nodes]`.
    pub velocities: Vec<MotionVector<L>>,
    /// `[nodes]`: velocity relative to the parent, S q̇.
    joint_velocities: Vec<MotionVector<L>>,
    /// `[nodes]`.
    inertias: Vec<SpatialInertia<L>>,
    /// Of all nodes together.
    total_inertia: SpatialInertia<L>,
    /// Of all nodes together.
    momentum: ForceVector<L>,
    /// `[nodes]`: accelerations with q̈ = 0.
    accelerations: Vec<MotionVector<L>>,
    /// `[nodes]`: forces that those accelerations take; in the inward pass, those that the joint transmits.
    forces: Vec<ForceVector<L>>,
    /// `[nodes]`: inertia of the subtree as if its joints were locked.
    composites: Vec<SpatialInertia<L>>,
    /// M.
    mass_matrix: PathMatrix<L>,
    /// L, where Lᵀ L is M with the implicit terms on its diagonal.
    pub factor: PathMatrix<L>,
    /// `[coordinates]`: −dt C.
    bias_impulses: Vec<L>,
    /// `[coordinates]`: the right-hand side, then L⁻ᵀ of it, then the change of velocity Δ.
    pub delta: Vec<L>,
    /// `[coordinates]`: what drives and joint limits add to the diagonal of M.
    implicit_diagonal: Vec<L>,
    /// `[coordinates]`: the drives' part of that, dt (kd + dt kp).
    drive_diagonal: Vec<L>,
    /// `[coordinates]`: torque of each drive for Δ = 0.
    torques: Vec<L>,
    /// `[coordinates]`: sign of the torque of a drive that was found beyond its limit, else 0.
    saturated: Vec<L>,
    /// `[coordinates]`: sign of the torque of a drive that this pass holds at its limit, else 0.
    held: Vec<L>,
    /// `[coordinates]`: Δ and `saturated` of the last pass that counted for each lane.
    accepted: Vec<[L; 2]>,
}

impl<L: Lanes> Dynamics<L> {
    pub fn new(tree: &Tree) -> Self {
        let (nodes, coordinates) = (tree.nodes.len(), tree.coordinates.len());
        Dynamics {
            mass_scale: L::splat(1.0),
            targets: vec![Quat::identity(); nodes],
            velocities: vec![MotionVector::ZERO; nodes],
            joint_velocities: vec![MotionVector::ZERO; nodes],
            inertias: vec![SpatialInertia::ZERO; nodes],
            total_inertia: SpatialInertia::ZERO,
            momentum: ForceVector::ZERO,
            accelerations: vec![MotionVector::ZERO; nodes],
            forces: vec![ForceVector::ZERO; nodes],
            composites: vec![SpatialInertia::ZERO; nodes],
            mass_matrix: PathMatrix::new(tree),
            factor: PathMatrix::new(tree),
            bias_impulses: vec![L::ZERO; coordinates],
            delta: vec![L::ZERO; coordinates],
            implicit_diagonal: vec![L::ZERO; coordinates],
            drive_diagonal: vec![L::ZERO; coordinates],
            torques: vec![L::ZERO; coordinates],
            saturated: vec![L::ZERO; coordinates],
            held: vec![L::ZERO; coordinates],
            accepted: vec![[L::ZERO; 2]; coordinates],
        }
    }

    /// Puts what a character keeps between steps into a lane.
    pub fn gather(&mut self, lane: usize, state: &State) {
        self.mass_scale.set(lane, state.mass);
        for (own, target) in self.targets.iter_mut().zip(&state.targets) {
            own.set(lane, target);
        }
        for (own, sign) in self.saturated.iter_mut().zip(&state.saturated) {
            own.set(lane, *sign);
        }
    }

    /// Takes what a character keeps between steps out of a lane.
    pub fn scatter(&self, lane: usize, state: &mut State) {
        for (sign, own) in state.saturated.iter_mut().zip(&self.saturated) {
            *sign = own.get(lane);
        }
    }

    /// Computes velocities, inertias and momentum in the present pose, from the root outwards: v_i = v_parent + S q̇ (RBDA
    /// table 5.1), and each body's inertia turned to world axes.
    #[inline(always)]
    pub fn update_bodies(&mut self, tree: &Tree, pose: &Pose<L>) {
        (self.total_inertia, self.momentum) = (SpatialInertia::ZERO, ForceVector::ZERO);
        for (i, node) in tree.nodes.iter().enumerate() {
            let joint_velocity = pose.joint_velocity(i, node);
            let frame = &pose.frames[i];
            // The inertia is constant in the body's frame and turns with it in the world's.
            let central = Symmetric::splat(&node.inertia)
                .rotated(&frame.matrix)
                .scaled(self.mass_scale);
            let com = frame.point(&Vec3::splat(&node.com));
            let inertia = SpatialInertia::new(L::splat(node.mass) * self.mass_scale, &com, central);
            let velocity = match node.parent {
                Some(p) => self.velocities[p] + joint_velocity,
                None => joint_velocity,
            };
            self.velocities[i] = velocity;
            self.joint_velocities[i] = joint_velocity;
            self.momentum += inertia.times(&velocity);
            self.total_inertia += inertia;
            self.inertias[i] = inertia;
        }
    }

    /// Momentum about the centre of mass after an impulse from outside, which is given about the root's origin.
    #[inline(always)]
    pub fn momentum_after(&self, impulse: &ForceVector<L>) -> ForceVector<L> {
        (self.momentum + *impulse).about(&self.total_inertia.com())
    }

    /// Adds a rigid motion of the whole character after which it has `momentum` about its centre of mass.
    ///
    /// Joint torques can't change the momentum of the whole, but moving the coordinates through a finite step does, by an
    /// error of second order in dt: velocities are held while the axes along which they act turn. The correction makes the
    /// momentum change by outside impulses alone, so that in flight it is constant to rounding.
    #[inline(always)]
    pub fn correct_momentum(&mut self, pose: &mut Pose<L>, momentum: &ForceVector<L>) {
        // Back from the centre of mass, where it is after the step, to the root's origin.
        let momentum = momentum.about(&-self.total_inertia.com());
        let error = self.total_inertia.solve(&(momentum - self.momentum));
        // Every body moves with the root, and the root's coordinates are its velocity in world axes.
        for velocity in &mut self.velocities {
            *velocity = *velocity + error;
        }
        for (k, v) in [error.linear, error.angular].into_iter().enumerate() {
            pose.velocity[3 * k] += v.x;
            pose.velocity[3 * k + 1] += v.y;
            pose.velocity[3 * k + 2] += v.z;
        }
        self.momentum = momentum;
    }

    /// Computes the mass matrix M and the bias impulses −dt C. Returns the impulse that comes from outside, of gravity and
    /// `pushes`, about the root's origin.
    #[inline(always)]
    pub fn bias_forces(
        &mut self,
        tree: &Tree,
        pose: &Pose<L>,
        pushes: &[Push],
        dt: f32,
    ) -> ForceVector<L> {
        // Gravity acts on the whole as one force at the centre of mass; within the tree the outward pass takes care of it.
        let fall = self.total_inertia.mass * L::splat(-GRAVITY * dt);
        let weight = Vec3::new(L::ZERO, L::ZERO, fall);
        let mut impulse = ForceVector::at_point(weight, &self.total_inertia.com());
        self.outward_pass(tree);
        // Outside forces are subtracted from those that a body's motion takes (RBDA table 5.1); a push acts as a force that
        // is constant over the step.
        for push in pushes {
            let mut force = Vec3::ZERO;
            force.set(push.lane, &push.impulse);
            let com = Vec3::splat(&tree.nodes[push.node].com);
            let force = ForceVector::at_point(force, &pose.frames[push.node].point(&com));
            impulse += force;
            self.forces[push.node] = self.forces[push.node] - force * L::splat(1.0 / dt);
        }
        self.inward_pass(tree, pose, L::splat(-dt));
        impulse
    }

    /// Adds drives and joint limits, factors the matrix, and takes the first half of the solution: `delta` becomes
    /// L⁻ᵀ (dt (τ − C)).
    #[inline(always)]
    pub fn solve_first_half(&mut self, tree: &Tree, pose: &Pose<L>, dt: f32) {
        self.delta.copy_from_slice(&self.bias_impulses);
        self.implicit_drives(tree, pose, L::splat(dt));
        self.factor
            .factor(tree, &self.mass_matrix, &self.implicit_diagonal);
        self.factor.solve_transposed(tree, &mut self.delta);
    }

    /// Takes the second half of the solution, after the contacts, and accepts it for the lanes in `open`. Returns those lanes
    /// in which a drive exceeds its torque limit and wasn't held to it: they have to be solved again with that drive at its
    /// limit.
    #[inline(always)]
    pub fn solve_second_half(&mut self, tree: &Tree, open: u32, dt: f32) -> u32 {
        self.factor.solve(tree, &mut self.delta);
        let (mask, mut exceeded) = (L::mask(open), 0);
        let per_dt = L::splat(1.0 / dt);
        for (k, c) in tree.coordinates.iter().enumerate() {
            // The torque at the end of the step, now that Δ is known.
            let torque = self.torques[k] - self.drive_diagonal[k] * self.delta[k] * per_dt;
            let sign = torque.below(L::ZERO).select(L::splat(-1.0), L::splat(1.0));
            let mut saturated = L::ZERO;
            if c.gains.limit > 0.0 {
                let over = torque.abs().at_least(L::splat(c.gains.limit));
                saturated = over.select(sign, L::ZERO);
                exceeded |= over.and(self.held[k].is_zero()).bits();
            }
            // Lanes that were accepted before keep what they have.
            let [delta, signs] = &mut self.accepted[k];
            *delta = mask.select(self.delta[k], *delta);
            *signs = mask.select(saturated, *signs);
            self.saturated[k] = *signs;
        }
        exceeded & open
    }

    /// Changes the velocities by the accepted solution.
    #[inline(always)]
    pub fn apply_delta(&mut self, pose: &mut Pose<L>) {
        for (velocity, [delta, _]) in pose.velocity.iter_mut().zip(&self.accepted) {
            *velocity += *delta;
        }
    }

    /// Outward pass of the recursive Newton-Euler algorithm with q̈ = 0 (RBDA table 5.1): a_i = a_parent + v_i × S q̇ and
    /// f_i = I a_i + v_i ×* I v_i. Gravity is an upward acceleration of the world.
    #[inline(always)]
    fn outward_pass(&mut self, tree: &Tree) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let velocity = self.velocities[i];
            let acceleration = match node.parent {
                // The root's axes keep their directions, but those of rotation pass through its moving origin: their rate
                // of change gives v × ω.
                None => {
                    let mut linear = velocity.linear.cross(&velocity.angular);
                    linear.z += L::splat(GRAVITY);
                    MotionVector {
                        angular: Vec3::ZERO,
                        linear,
                    }
                }
                Some(p) => self.accelerations[p] + velocity.cross(&self.joint_velocities[i]),
            };
            let momentum = self.inertias[i].times(&velocity);
            self.forces[i] =
                self.inertias[i].times(&acceleration) + velocity.cross_force(&momentum);
            self.accelerations[i] = acceleration;
        }
    }

    /// Inward pass: bias forces C_k = S_kᵀ f_i of the recursive Newton-Euler algorithm (RBDA table 5.1), and with them the mass
    /// matrix by the composite rigid body algorithm (RBDA table 6.2), M_kj = S_jᵀ Iᶜ_i S_k for the coordinates j on k's path.
    /// Both run from the leaves to the root and add each body to its parent.
    #[inline(always)]
    fn inward_pass(&mut self, tree: &Tree, pose: &Pose<L>, minus_dt: L) {
        self.composites.copy_from_slice(&self.inertias);
        for (i, node) in tree.nodes.iter().enumerate().rev() {
            let (force, inertia) = (self.forces[i], self.composites[i]);
            // A body's own coordinates, and against them all coordinates above: no others have an entry with them.
            for k in node.first..node.first + node.dof {
                self.bias_impulses[k] = pose.axes[k].dot(&force) * minus_dt;
                let momentum = inertia.times(&pose.axes[k]);
                let row = self.mass_matrix.row_mut(tree, k);
                for (entry, &other) in row.iter_mut().zip(&node.path) {
                    *entry = pose.axes[other].dot(&momentum);
                }
            }
            if let Some(parent) = node.parent {
                self.forces[parent] += force;
                self.composites[parent] += inertia;
            }
        }
    }

    /// Drives and joint limits at the end of the step: stable PD control (Tan, Liu and Turk, "Stable Proportional-Derivative
    /// Controllers", IEEE Computer Graphics and Applications 31(4), 2011).
    ///
    /// With the velocity q̇ + Δ and the error that it leads to, τ = −kp (e + dt (q̇ + Δ)) − kd (q̇ + Δ). It is stable at any
    /// stiffness. The error of a ball is the rotation vector from its target, whose rate is the velocity to first order.
    #[inline(always)]
    fn implicit_drives(&mut self, tree: &Tree, pose: &Pose<L>, dt: L) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let k = node.first;
            match node.joint {
                Joint::Free => {}
                Joint::Ball => {
                    // In the node's own frame, which is that of the coordinates.
                    let error = self.targets[i]
                        .inverse()
                        .times(&pose.rotations[i])
                        .rotation_vector();
                    self.drive_coordinate(tree, pose, k, error.x, dt);
                    self.drive_coordinate(tree, pose, k + 1, error.y, dt);
                    self.drive_coordinate(tree, pose, k + 2, error.z, dt);
                }
                Joint::Hinge(_, range) => {
                    let error = pose.angles[i] - self.targets[i].w;
                    self.drive_coordinate(tree, pose, k, error, dt);
                    if let Some(range) = range {
                        self.limit_hinge(tree, pose, (i, k), range, dt);
                    }
                }
            }
        }
    }

    /// The drive of one coordinate: adds its torque for Δ = 0 to the right-hand side, and its share in Δ to the diagonal. A
    /// drive at its torque limit is a constant torque and has no share.
    #[inline(always)]
    fn drive_coordinate(&mut self, tree: &Tree, pose: &Pose<L>, k: usize, error: L, dt: L) {
        let Gains { kp, kd, limit } = tree.coordinates[k].gains;
        let (kp, kd, limit) = (L::splat(kp), L::splat(kd), L::splat(limit));
        let gain = kd + dt * kp;
        let torque = -(kp * error) - gain * pose.velocity[k];
        // A drive stays at its limit while its torque without Δ asks for more in the same direction. Where it wasn't
        // saturated the sign is 0, and 0 is never beyond.
        let sign = self.saturated[k];
        let held = limit.below(torque * sign);
        self.held[k] = held.select(sign, L::ZERO);
        self.torques[k] = held.select(sign * limit, torque);
        self.drive_diagonal[k] = held.select(L::ZERO, dt * gain);
        self.delta[k] += dt * self.torques[k];
        self.implicit_diagonal[k] = self.drive_diagonal[k];
    }

    /// The limit of a hinge: a one-sided spring and damper, implicit like a drive, that act where the hinge would be outside
    /// its range at the end of the step (see [`LIMIT_STIFFNESS`]).
    #[inline(always)]
    fn limit_hinge(
        &mut self,
        tree: &Tree,
        pose: &Pose<L>,
        (i, k): (usize, usize),
        range: [f32; 2],
        dt: L,
    ) {
        let rate = pose.velocity[k];
        let next = pose.angles[i] + dt * rate;
        let (low, high) = (L::splat(range[0]), L::splat(range[1]));
        let beyond = next - next.max(low).min(high);
        let hit = L::ZERO.below(beyond.abs());
        // Most steps reach no limit in any lane.
        if hit.bits() == 0 {
            return;
        }
        // Scaled with the diagonal of M, so that a heavy leg and a light hand stop alike.
        let spring = L::splat(LIMIT_STIFFNESS) * self.mass_matrix.diagonal(tree, k) / (dt * dt);
        let damper = spring * dt;
        let (push, stiff) = (
            dt * (spring * beyond + damper * rate),
            dt * (damper + spring * dt),
        );
        self.delta[k] -= hit.select(push, L::ZERO);
        self.implicit_diagonal[k] += hit.select(stiff, L::ZERO);
    }
}
