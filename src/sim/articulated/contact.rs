//! Contacts of eight characters with the ground.
//!
//! What an impulse on one body does to the twist of another is the Delassus matrix J M⁻¹ Jᵀ. It is computed in 6×6 blocks for
//! whole bodies, because points of one body share them, and from half-solved Jacobians: with M = Lᵀ L and X = L⁻ᵀ Jᵀ it is
//! Xᵀ X. M holds the implicit terms of drives and joint limits, so contacts feel how stiff the character is.
//!
//! A body that any of the eight characters has near the ground is prepared for all eight. Its points, and the sweeps over
//! them, are each character's own ([`super::solve`]).

use super::algebra::Vec3;
use super::dynamics::Dynamics;
use super::ground::{Ground, MARGIN};
use super::lanes::{LANES, Lanes};
use super::pose::Pose;
use super::solve::{ContactPoint, Solver, Twist};
use super::spatial::{ForceVector, MotionVector};
use super::state::State;
use super::tree::{Node, Tree};
use nalgebra::Vector3;
use wide::f32x4;

/// Contacts of one step of eight characters.
#[derive(Clone, Debug)]
pub(super) struct Contacts<L> {
    /// `[LANES]`.
    solvers: Vec<Solver>,
    /// Factor of each character's friction coefficients.
    friction: [f32; LANES],
    /// Bodies that any of the characters has near the ground.
    near: Vec<NearBody>,
    /// `[near, width]`: columns of L⁻ᵀ Jᵀ along each body's path, J being the Jacobian of its twist.
    half_jacobians: Vec<[L; 6]>,
    /// Length of the longest path.
    width: usize,
    /// `[near]`: twists at the end of the step without contacts.
    twists: Vec<[L; 6]>,
    /// `[near]`: the ground's wrenches, moment about the body's origin, then impulse.
    wrenches: Vec<[L; 6]>,
    /// Blocks J_a M⁻¹ J_bᵀ of all pairs b ≤ a: change of the first body's twist for each component of a wrench on the second.
    delassus: Vec<[[L; 6]; 6]>,
}

/// A node near the ground, and the lanes in which it is, as bits.
#[derive(Clone, Copy, Debug)]
struct NearBody {
    node: usize,
    lanes: u32,
}

impl<L: Lanes> Contacts<L> {
    pub fn new(tree: &Tree) -> Self {
        Contacts {
            solvers: vec![Solver::default(); LANES],
            friction: [1.0; LANES],
            near: Vec::new(),
            half_jacobians: Vec::new(),
            width: tree.nodes.iter().map(|n| n.path.len()).max().unwrap_or(0),
            twists: Vec::new(),
            wrenches: Vec::new(),
            delassus: Vec::new(),
        }
    }

    /// Moves a character's impulses of the last step into a lane; [`Contacts::scatter`] moves them back.
    pub fn gather(&mut self, lane: usize, state: &mut State) {
        std::mem::swap(&mut self.solvers[lane].last, &mut state.impulses);
        self.friction[lane] = state.friction;
    }

    /// Moves a lane's impulses back to its character.
    pub fn scatter(&mut self, lane: usize, state: &mut State) {
        std::mem::swap(&mut self.solvers[lane].last, &mut state.impulses);
    }

    /// Finds the points of the first `lanes` characters that are near the ground, or will be at the end of the step.
    #[inline(always)]
    pub fn detect(
        &mut self,
        tree: &Tree,
        pose: &Pose<L>,
        velocities: &[MotionVector<L>],
        (ground, lanes): (&Ground, usize),
    ) {
        self.near.clear();
        self.solvers.iter_mut().for_each(Solver::clear);
        let (mut id, used) = (0, (1 << lanes) - 1);
        // Most bodies are nowhere near the ground in any lane, so a bound for the whole body comes before its points.
        for (i, node) in tree.nodes.iter().enumerate() {
            if reaches_ground(node, pose, &velocities[i], (i, ground.dt)) & used != 0 {
                self.detect_points(tree, pose, &velocities[i], (ground, used), (i, id));
            }
            id += node.points.len();
        }
        // A character in the air has nothing to start the next contact from.
        for solver in &mut self.solvers[..lanes] {
            if solver.points.is_empty() {
                solver.last.fill(Vector3::zeros());
            }
        }
    }

    #[inline(always)]
    fn detect_points(
        &mut self,
        tree: &Tree,
        pose: &Pose<L>,
        velocity: &MotionVector<L>,
        (ground, used): (&Ground, u32),
        (i, first): (usize, usize),
    ) {
        let (node, frame) = (&tree.nodes[i], &pose.frames[i]);
        let (dt, near) = (L::splat(ground.dt), L::splat(MARGIN));
        // The lowest point of each ball, in all lanes at once; then one by one those that are near the ground.
        let (mut lanes, next) = (0, self.near.len());
        for (n, (point, radius)) in node.points.iter().enumerate() {
            // The lowest point of a ball is straight below its centre, whatever the body's orientation.
            let mut arm = frame.matrix.times(&Vec3::splat(point));
            arm.z -= L::splat(*radius);
            let gap = arm.z + frame.origin.z + pose.origin.z;
            let moving = velocity.velocity_at(&(frame.origin + arm));
            // Near now, or so fast that it will be.
            let mut close = gap.min(gap + dt * moving.z).below(near).bits() & used;
            lanes |= close;
            while close != 0 {
                let lane = close.trailing_zeros() as usize;
                close &= close - 1;
                let target = ground.target(gap.get(lane), moving.get(lane));
                let friction = self.friction[lane] * node.friction;
                let point = ContactPoint::new(first + n, arm.get(lane), target, friction);
                self.solvers[lane].add((i, next), point);
            }
        }
        if lanes != 0 {
            self.near.push(NearBody { node: i, lanes });
        }
    }

    /// Adds the contact impulses of the characters in `open` to the half solution: `delta` becomes L⁻ᵀ (… + Jᵀ λ).
    #[inline(always)]
    pub fn solve_contacts(
        &mut self,
        tree: &Tree,
        pose: &Pose<L>,
        dynamics: &mut Dynamics<L>,
        open: u32,
    ) {
        if self.near.iter().all(|near| near.lanes & open == 0) {
            return;
        }
        // For all lanes at once: Jacobians, twists without contacts, and Delassus blocks. Then the sweeps, character by
        // character, and their impulses for all lanes at once again.
        self.prepare(tree, pose, dynamics);
        self.update_delassus(tree, open);
        self.wrenches.clear();
        self.wrenches.resize(self.near.len(), [L::ZERO; 6]);
        for lane in (0..LANES).filter(|lane| open >> lane & 1 == 1) {
            self.solve(lane);
        }
        self.apply(tree, &mut dynamics.delta);
    }

    /// Half-solves the Jacobians of all bodies near the ground, and computes their twists without contacts: J (q̇ + Δ), where
    /// J Δ = J L⁻¹ (L⁻ᵀ b) is the product of the two halves.
    #[inline(always)]
    fn prepare(&mut self, tree: &Tree, pose: &Pose<L>, dynamics: &Dynamics<L>) {
        // Entries beyond a body's path are never read.
        self.half_jacobians
            .resize(self.near.len() * self.width, [L::ZERO; 6]);
        self.twists.clear();
        let half_jacobians = self.half_jacobians.chunks_exact_mut(self.width);
        for (near, half) in self.near.iter().zip(half_jacobians) {
            let path = &tree.nodes[near.node].path;
            let origin = &pose.frames[near.node].origin;
            // Column k of J: the twist that a unit of coordinate k's velocity gives the body.
            for (half, &k) in half.iter_mut().zip(path) {
                *half = rows(&pose.axes[k], origin);
            }
            dynamics
                .factor
                .solve_transposed_rows(tree, path, &mut half[..path.len()]);
            // The twist at the start of the step, and what the half solution adds to it.
            let mut twist = rows(&dynamics.velocities[near.node], origin);
            for (half, &k) in half.iter().zip(path) {
                let change = dynamics.delta[k];
                for i in 0..6 {
                    twist[i] += half[i] * change;
                }
            }
            self.twists.push(twist);
        }
    }

    /// Computes the blocks of all pairs of bodies that some character in `open` has on the ground together. Only coordinates
    /// that move both bodies contribute: those at the beginning of both paths.
    #[inline(always)]
    fn update_delassus(&mut self, tree: &Tree, open: u32) {
        let pairs = pair(self.near.len(), 0);
        if self.delassus.len() < pairs {
            self.delassus.resize(pairs, [[L::ZERO; 6]; 6]);
        }
        for a in 0..self.near.len() {
            for b in 0..=a {
                let (x, y) = (self.near[a], self.near[b]);
                if x.lanes & y.lanes & open == 0 {
                    continue;
                }
                let shared = tree.shared(x.node, y.node);
                let x = &self.half_jacobians[a * self.width..a * self.width + shared];
                let y = &self.half_jacobians[b * self.width..b * self.width + shared];
                for (k, sums) in self.delassus[pair(a, b)].iter_mut().enumerate() {
                    *sums = [L::ZERO; 6];
                    for (x, y) in x.iter().zip(y) {
                        for i in 0..6 {
                            sums[i] += x[i] * y[k];
                        }
                    }
                }
            }
        }
    }

    /// Solves for one character's impulses and writes the sums by body to its lane.
    #[inline(always)]
    fn solve(&mut self, lane: usize) {
        let solver = &mut self.solvers[lane];
        if solver.points.is_empty() {
            return;
        }
        // Take this character's blocks out of the lanes. A pair is stored once; the block of the swapped pair is its transpose.
        solver.delassus.clear();
        for a in 0..solver.bodies.len() {
            let near = solver.bodies[a].near;
            solver.bodies[a].twist = twist(&self.twists[near], lane);
            solver.bodies[a].wrench = [0.0; 6];
            for b in 0..solver.bodies.len() {
                let other = solver.bodies[b].near;
                let answers = &self.delassus[pair(near.max(other), near.min(other))];
                let mut columns = [Twist::default(); 6];
                for (k, column) in columns.iter_mut().enumerate() {
                    *column = if near >= other {
                        twist(&answers[k], lane)
                    } else {
                        twist(&std::array::from_fn(|i| answers[i][k]), lane)
                    };
                }
                solver.delassus.push(columns);
            }
        }
        solver.solve();
        // Lanes of other characters keep the zeros that the caller filled in.
        for pressed in &solver.bodies {
            let parts = self.wrenches[pressed.near].iter_mut();
            for (part, x) in parts.zip(&pressed.wrench) {
                part.set(lane, *x);
            }
        }
    }

    /// Adds L⁻ᵀ Jᵀ times the wrenches.
    #[inline(always)]
    fn apply(&self, tree: &Tree, change: &mut [L]) {
        let half_jacobians = self.half_jacobians.chunks_exact(self.width);
        for ((near, wrench), half) in self.near.iter().zip(&self.wrenches).zip(half_jacobians) {
            for (half, &k) in half.iter().zip(&tree.nodes[near.node].path) {
                for i in 0..6 {
                    change[k] += half[i] * wrench[i];
                }
            }
        }
    }

    /// The ground's impulses on each character together, about the root's origin.
    pub fn impulse(&self, pose: &Pose<L>) -> ForceVector<L> {
        let mut sum = ForceVector::ZERO;
        for (lane, solver) in self.solvers.iter().enumerate() {
            let [mut moment, mut force] = [Vector3::zeros(); 2];
            for point in &solver.points {
                let node = solver.bodies[point.body].node;
                let at = pose.frames[node].origin.get(lane) + point.arm;
                moment += at.cross(&point.impulse);
                force += point.impulse;
            }
            sum.moment.set(lane, &moment);
            sum.force.set(lane, &force);
        }
        sum
    }

    /// Sets the flags of the nodes that press on the ground.
    pub fn mark_pressing(&self, lane: usize, pressed: &mut [bool]) {
        let solver = &self.solvers[lane];
        for point in &solver.points {
            let node = solver.bodies[point.body].node;
            pressed[node] |= point.impulse.z > 0.0;
        }
    }
}

/// The lanes, as bits, in which a node may have points near the ground: a bound by the ball that holds all its points, and by
/// the fastest downward velocity within it.
#[inline(always)]
fn reaches_ground<L: Lanes>(
    node: &Node,
    pose: &Pose<L>,
    velocity: &MotionVector<L>,
    (i, dt): (usize, f32),
) -> u32 {
    let (frame, reach) = (&pose.frames[i], L::splat(node.reach));
    let fastest = velocity.angular.norm() * reach - velocity.velocity_at(&frame.origin).z;
    let lowest = frame.origin.z + pose.origin.z - reach;
    let soon = lowest - L::splat(dt) * fastest.max(L::ZERO);
    L::splat(MARGIN).at_least(soon).bits()
}

/// Index of the pair of bodies `b` ≤ `a`.
fn pair(a: usize, b: usize) -> usize {
    a * (a + 1) / 2 + b
}

/// The six components of a twist: angular velocity, and velocity of the point at `origin`.
#[inline(always)]
fn rows<L: Lanes>(velocity: &MotionVector<L>, origin: &Vec3<L>) -> [L; 6] {
    let (angular, linear) = (&velocity.angular, velocity.velocity_at(origin));
    [
        angular.x, angular.y, angular.z, linear.x, linear.y, linear.z,
    ]
}

/// One lane of a twist.
#[inline(always)]
fn twist<L: Lanes>(parts: &[L; 6], lane: usize) -> Twist {
    let [a, b, c, x, y, z] = parts.each_ref().map(|part| part.get(lane));
    [f32x4::from([a, b, c, 0.0]), f32x4::from([x, y, z, 0.0])]
}
