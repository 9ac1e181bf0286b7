//! Velocities, momentum, and accelerations without contacts: inertia, gravity, what turns with what, and the drives.

use super::algebra::{Symmetric, Turn, Vec3};
use super::lanes::Lanes;
use super::matrix::PathMatrix;
use super::pose::Pose;
use super::spatial::{Force, Inertia, Motion};
use super::state::State;
use super::tree::{Gains, Joint, Tree};
use crate::skeleton;

const GRAVITY: f32 = skeleton::GRAVITY as f32;
/// Stiffness of a stop, as a share of inertia / dt².
const STOP: f32 = 4.0;

/// What a step computes of eight characters before it looks at the ground.
#[derive(Clone, Debug)]
pub(super) struct Dynamics<L> {
    /// Factor of all masses.
    mass: L,
    /// Where drives aim, by node; of a hinge `w` is its angle.
    targets: Vec<Turn<L>>,
    /// Of every node, in its present pose; and what its own joint adds to that.
    pub motions: Vec<Motion<L>>,
    own: Vec<Motion<L>>,
    inertias: Vec<Inertia<L>>,
    whole: Inertia<L>,
    /// What the whole character has, about the root's origin.
    momentum: Force<L>,
    accelerations: Vec<Motion<L>>,
    forces: Vec<Force<L>>,
    composites: Vec<Inertia<L>>,
    inertia: PathMatrix<L>,
    pub factor: PathMatrix<L>,
    /// Impulse on every coordinate of all but drives and ground.
    impulses: Vec<L>,
    /// Right side, half solution, then change of velocity.
    pub change: Vec<L>,
    /// What drives and stops add to the diagonal.
    stiffening: Vec<L>,
    /// The drives' part of it: by how much their torque yields to a change of velocity.
    yielding: Vec<L>,
    /// Torque of every drive if its coordinate kept its velocity.
    torques: Vec<L>,
    /// Drives that were found beyond their limit: the sign of their torque, else 0.
    saturated: Vec<L>,
    /// Those that were held to it in this pass, likewise.
    held: Vec<L>,
    /// Changes of velocity and drives beyond their limit that stand.
    settled: Vec<[L; 2]>,
}

impl<L: Lanes> Dynamics<L> {
    pub fn new(tree: &Tree) -> Self {
        let (nodes, coordinates) = (tree.nodes.len(), tree.coordinates.len());
        Dynamics {
            mass: L::splat(1.0),
            targets: vec![Turn::identity(); nodes],
            motions: vec![Motion::ZERO; nodes],
            own: vec![Motion::ZERO; nodes],
            inertias: vec![Inertia::ZERO; nodes],
            whole: Inertia::ZERO,
            momentum: Force::ZERO,
            accelerations: vec![Motion::ZERO; nodes],
            forces: vec![Force::ZERO; nodes],
            composites: vec![Inertia::ZERO; nodes],
            inertia: PathMatrix::new(tree),
            factor: PathMatrix::new(tree),
            impulses: vec![L::ZERO; coordinates],
            change: vec![L::ZERO; coordinates],
            stiffening: vec![L::ZERO; coordinates],
            yielding: vec![L::ZERO; coordinates],
            torques: vec![L::ZERO; coordinates],
            saturated: vec![L::ZERO; coordinates],
            held: vec![L::ZERO; coordinates],
            settled: vec![[L::ZERO; 2]; coordinates],
        }
    }

    pub fn take(&mut self, lane: usize, state: &State) {
        self.mass.set(lane, state.mass);
        for (own, target) in self.targets.iter_mut().zip(&state.targets) {
            own.set(lane, target);
        }
        for (own, sign) in self.saturated.iter_mut().zip(&state.saturated) {
            own.set(lane, *sign);
        }
    }

    pub fn give(&self, lane: usize, state: &mut State) {
        for (sign, own) in state.saturated.iter_mut().zip(&self.saturated) {
            *sign = own.of(lane);
        }
    }

    /// Motions, inertias and momentum of `pose`.
    #[inline(always)]
    pub fn survey(&mut self, tree: &Tree, pose: &Pose<L>) {
        (self.whole, self.momentum) = (Inertia::ZERO, Force::ZERO);
        for (i, node) in tree.nodes.iter().enumerate() {
            let own = pose.own_motion(i, node);
            let place = &pose.places[i];
            let central = Symmetric::splat(&node.inertia)
                .turned(&place.matrix)
                .scaled(self.mass);
            let com = place.point(&Vec3::splat(&node.com));
            let inertia = Inertia::new(L::splat(node.mass) * self.mass, &com, central);
            let motion = match node.parent {
                Some(p) => self.motions[p] + own,
                None => own,
            };
            self.motions[i] = motion;
            self.own[i] = own;
            self.momentum += inertia.times(&motion);
            self.whole += inertia;
            self.inertias[i] = inertia;
        }
    }

    /// Momentum about the centre of mass after `impulse` from outside, which is about the root's origin.
    #[inline(always)]
    pub fn momentum_after(&self, impulse: &Force<L>) -> Force<L> {
        (self.momentum + *impulse).about(&self.whole.com())
    }

    /// Moves the whole character so that it has `momentum` about its centre of mass. A step along velocities that turn
    /// keeps it only to first order; but nothing inside of a body changes its momentum.
    #[inline(always)]
    pub fn conserve(&mut self, pose: &mut Pose<L>, momentum: &Force<L>) {
        let momentum = momentum.about(&-self.whole.com());
        let error = self.whole.motion_of(&(momentum - self.momentum));
        for motion in self.motions.iter_mut() {
            *motion = *motion + error;
        }
        for (k, v) in [error.linear, error.angular].into_iter().enumerate() {
            pose.velocity[3 * k] += v.x;
            pose.velocity[3 * k + 1] += v.y;
            pose.velocity[3 * k + 2] += v.z;
        }
        self.momentum = momentum;
    }

    /// Inertia, and what gravity, motion and `pushes` (lane, node, impulse) do in `dt` seconds; gives the momentum that
    /// comes from outside.
    #[inline(always)]
    pub fn load(
        &mut self,
        tree: &Tree,
        pose: &Pose<L>,
        pushes: &[(usize, usize, nalgebra::Vector3<f32>)],
        dt: f32,
    ) -> Force<L> {
        let fall = self.whole.mass * L::splat(-GRAVITY * dt);
        let weight = Vec3::new(L::ZERO, L::ZERO, fall);
        let mut impulse = Force::at(weight, &self.whole.com());
        self.sweep_out(tree);
        for (lane, node, push) in pushes {
            let mut force = Vec3::ZERO;
            force.set(*lane, push);
            let at = pose.places[*node].point(&Vec3::splat(&tree.nodes[*node].com));
            let push = Force::at(force, &at);
            impulse += push;
            self.forces[*node] = self.forces[*node] - push * L::splat(1.0 / dt);
        }
        self.sweep_in(tree, pose, L::splat(-dt));
        impulse
    }

    /// Half solves for what that load and the drives do.
    #[inline(always)]
    pub fn accelerate(&mut self, tree: &Tree, pose: &Pose<L>, dt: f32) {
        self.change.copy_from_slice(&self.impulses);
        self.drive(tree, pose, L::splat(dt));
        self.factor.factor(tree, &self.inertia, &self.stiffening);
        self.factor.halve(tree, &mut self.change);
    }

    /// Solves the other half, for the lanes in `open`. Gives those of them where a drive goes beyond its limit that
    /// wasn't held to it: the step then has to be taken again, with that drive at the limit.
    #[inline(always)]
    pub fn finish(&mut self, tree: &Tree, open: u32, dt: f32) -> u32 {
        self.factor.finish(tree, &mut self.change);
        let (mask, mut fresh) = (L::mask(open), 0);
        let per_dt = L::splat(1.0 / dt);
        for (k, c) in tree.coordinates.iter().enumerate() {
            let torque = self.torques[k] - self.yielding[k] * self.change[k] * per_dt;
            let sign = torque.below(L::ZERO).choose(L::splat(-1.0), L::splat(1.0));
            let mut saturated = L::ZERO;
            if c.gains.limit > 0.0 {
                let over = torque.abs().at_least(L::splat(c.gains.limit));
                saturated = over.choose(sign, L::ZERO);
                fresh |= over.and(self.held[k].is_zero()).bits();
            }
            let [change, signs] = &mut self.settled[k];
            *change = mask.choose(self.change[k], *change);
            *signs = mask.choose(saturated, *signs);
            self.saturated[k] = *signs;
        }
        fresh & open
    }

    /// Changes the velocity by what was solved for.
    #[inline(always)]
    pub fn apply(&mut self, pose: &mut Pose<L>) {
        for (velocity, [change, _]) in pose.velocity.iter_mut().zip(&self.settled) {
            *velocity += *change;
        }
    }

    /// From the root outwards: accelerations that no coordinate has a part in, and the forces they take (recursive
    /// Newton-Euler, RBDA table 5.1).
    #[inline(always)]
    fn sweep_out(&mut self, tree: &Tree) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let motion = self.motions[i];
            let acceleration = match node.parent {
                // Its axes stay along the world's, but the turning ones travel with it.
                None => {
                    let mut linear = motion.linear.cross(&motion.angular);
                    linear.z += L::splat(GRAVITY);
                    Motion {
                        angular: Vec3::ZERO,
                        linear,
                    }
                }
                Some(p) => self.accelerations[p] + motion.cross(&self.own[i]),
            };
            let momentum = self.inertias[i].times(&motion);
            self.forces[i] = self.inertias[i].times(&acceleration) + motion.cross_force(&momentum);
            self.accelerations[i] = acceleration;
        }
    }

    /// From the tips inwards: what each joint has to bear, and the inertia matrix (composite rigid bodies, RBDA
    /// table 6.2).
    #[inline(always)]
    fn sweep_in(&mut self, tree: &Tree, pose: &Pose<L>, minus_dt: L) {
        self.composites.copy_from_slice(&self.inertias);
        for (i, node) in tree.nodes.iter().enumerate().rev() {
            let (force, inertia) = (self.forces[i], self.composites[i]);
            for k in node.first..node.first + node.dof {
                self.impulses[k] = pose.axes[k].dot(&force) * minus_dt;
                let momentum = inertia.times(&pose.axes[k]);
                let row = self.inertia.row_mut(tree, k);
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

    /// Drives as they will be at the end of the step (stable PD, Tan, Liu and Turk 2011): with Δ the change of
    /// velocity, torque = −kp (e + dt (q̇ + Δ)) − kd (q̇ + Δ), whose part in Δ goes to the left side.
    #[inline(always)]
    fn drive(&mut self, tree: &Tree, pose: &Pose<L>, dt: L) {
        for (i, node) in tree.nodes.iter().enumerate() {
            let k = node.first;
            match node.joint {
                Joint::Free => {}
                Joint::Ball => {
                    let error = self.targets[i].inverse().times(&pose.turns[i]).vector();
                    self.pull(tree, pose, k, error.x, dt);
                    self.pull(tree, pose, k + 1, error.y, dt);
                    self.pull(tree, pose, k + 2, error.z, dt);
                }
                Joint::Hinge(_, range) => {
                    let error = pose.angles[i] - self.targets[i].w;
                    self.pull(tree, pose, k, error, dt);
                    if let Some(range) = range {
                        self.stop(tree, pose, (i, k), range, dt);
                    }
                }
            }
        }
    }

    /// One coordinate's drive.
    #[inline(always)]
    fn pull(&mut self, tree: &Tree, pose: &Pose<L>, k: usize, error: L, dt: L) {
        let Gains { kp, kd, limit } = tree.coordinates[k].gains;
        let (kp, kd, limit) = (L::splat(kp), L::splat(kd), L::splat(limit));
        let along = kd + dt * kp;
        let torque = -(kp * error) - along * pose.velocity[k];
        // Zero where it isn't saturated, so never beyond.
        let sign = self.saturated[k];
        let held = limit.below(torque * sign);
        self.held[k] = held.choose(sign, L::ZERO);
        self.torques[k] = held.choose(sign * limit, torque);
        self.yielding[k] = held.choose(L::ZERO, dt * along);
        self.change[k] += dt * self.torques[k];
        self.stiffening[k] = self.yielding[k];
    }

    /// The end of a hinge's range: a spring so stiff, and so damped, that it holds within two steps what comes, taken
    /// at the step's end as drives are.
    #[inline(always)]
    fn stop(
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
        if hit.bits() == 0 {
            return;
        }
        let spring = L::splat(STOP) * self.inertia.diagonal(tree, k) / (dt * dt);
        let damper = spring * dt;
        let (push, stiff) = (
            dt * (spring * beyond + damper * rate),
            dt * (damper + spring * dt),
        );
        self.change[k] -= hit.choose(push, L::ZERO);
        self.stiffening[k] += hit.choose(stiff, L::ZERO);
    }
}
