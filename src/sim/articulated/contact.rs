//! Where the ground pushes on eight characters, and what that does to them.
//!
//! What an impulse on one body does to the twist of another, J M⁻¹ J'ᵀ (the Delassus operator), is computed for whole
//! bodies, six by six: points of a body share it. The drives are in it too, as they are in M. Every body that any of the
//! eight has near the ground is computed for all of them; the points then are each character's own.

use super::algebra::Vec3;
use super::dynamics::Dynamics;
use super::ground::{Ground, NEAR};
use super::lanes::{LANES, Lanes};
use super::pose::Pose;
use super::solve::{Point, Solver, Twist};
use super::spatial::{Force, Motion};
use super::state::State;
use super::tree::{Node, Tree};
use nalgebra::Vector3;
use wide::f32x4;

/// Contacts of one step.
#[derive(Clone, Debug)]
pub(super) struct Contacts<L> {
    /// By lane.
    solvers: Vec<Solver>,
    friction: [f32; LANES],
    near: Vec<Near>,
    /// `[near, width]`: halved Jacobians of their twists, along their paths.
    halves: Vec<[L; 6]>,
    width: usize,
    /// `[near]`: twists without contacts, then the ground's wrenches.
    twists: Vec<[L; 6]>,
    wrenches: Vec<[L; 6]>,
    /// Of every pair, the second no later than the first: twist of the first for each part of the wrench on the second.
    coupling: Vec<[[L; 6]; 6]>,
}

/// A node near the ground, and the lanes in which it is.
#[derive(Clone, Copy, Debug)]
struct Near {
    node: usize,
    lanes: u32,
}

impl<L: Lanes> Contacts<L> {
    pub fn new(tree: &Tree) -> Self {
        Contacts {
            solvers: vec![Solver::default(); LANES],
            friction: [1.0; LANES],
            near: Vec::new(),
            halves: Vec::new(),
            width: tree.nodes.iter().map(|n| n.path.len()).max().unwrap_or(0),
            twists: Vec::new(),
            wrenches: Vec::new(),
            coupling: Vec::new(),
        }
    }

    /// Takes a character's impulses, which [`Contacts::give`] gives back.
    pub fn take(&mut self, lane: usize, state: &mut State) {
        std::mem::swap(&mut self.solvers[lane].last, &mut state.impulses);
        self.friction[lane] = state.friction;
    }

    pub fn give(&mut self, lane: usize, state: &mut State) {
        std::mem::swap(&mut self.solvers[lane].last, &mut state.impulses);
    }

    /// Which points of the first `lanes` characters are near the ground.
    #[inline(always)]
    pub fn find(
        &mut self,
        tree: &Tree,
        pose: &Pose<L>,
        motions: &[Motion<L>],
        (ground, lanes): (&Ground, usize),
    ) {
        self.near.clear();
        self.solvers.iter_mut().for_each(Solver::clear);
        let (mut id, used) = (0, (1 << lanes) - 1);
        for (i, node) in tree.nodes.iter().enumerate() {
            if reaches_ground(node, pose, &motions[i], (i, ground.dt)) & used != 0 {
                self.find_points(tree, pose, &motions[i], (ground, used), (i, id));
            }
            id += node.points.len();
        }
        for solver in &mut self.solvers[..lanes] {
            if solver.points.is_empty() {
                solver.last.fill(Vector3::zeros());
            }
        }
    }

    #[inline(always)]
    fn find_points(
        &mut self,
        tree: &Tree,
        pose: &Pose<L>,
        motion: &Motion<L>,
        (ground, used): (&Ground, u32),
        (i, first): (usize, usize),
    ) {
        let (node, place) = (&tree.nodes[i], &pose.places[i]);
        let (dt, near) = (L::splat(ground.dt), L::splat(NEAR));
        let (mut lanes, next) = (0, self.near.len());
        for (n, (point, radius)) in node.points.iter().enumerate() {
            let mut arm = place.matrix.times(&Vec3::splat(point));
            arm.z -= L::splat(*radius);
            let gap = arm.z + place.origin.z + pose.origin.z;
            let velocity = motion.at(&(place.origin + arm));
            let mut close = gap.min(gap + dt * velocity.z).below(near).bits() & used;
            lanes |= close;
            while close != 0 {
                let lane = close.trailing_zeros() as usize;
                close &= close - 1;
                let wants = ground.wants(gap.of(lane), velocity.of(lane));
                let friction = self.friction[lane] * node.friction;
                let point = Point::new(first + n, arm.of(lane), wants, friction);
                self.solvers[lane].add((i, next), point);
            }
        }
        if lanes != 0 {
            self.near.push(Near { node: i, lanes });
        }
    }

    /// Adds to the half solution what keeps the characters in `open` out of the ground.
    #[inline(always)]
    pub fn resolve(&mut self, tree: &Tree, pose: &Pose<L>, dynamics: &mut Dynamics<L>, open: u32) {
        if self.near.iter().all(|near| near.lanes & open == 0) {
            return;
        }
        self.halve(tree, pose, dynamics);
        self.couple(tree, open);
        self.wrenches.clear();
        self.wrenches.resize(self.near.len(), [L::ZERO; 6]);
        for lane in (0..LANES).filter(|lane| open >> lane & 1 == 1) {
            self.solve(lane);
        }
        self.apply(tree, &mut dynamics.change);
    }

    /// Halves the Jacobians of the bodies, and takes their twists from what the step does without contacts.
    #[inline(always)]
    fn halve(&mut self, tree: &Tree, pose: &Pose<L>, dynamics: &Dynamics<L>) {
        // What is beyond a path is never read.
        self.halves
            .resize(self.near.len() * self.width, [L::ZERO; 6]);
        self.twists.clear();
        let halves = self.halves.chunks_exact_mut(self.width);
        for (near, half) in self.near.iter().zip(halves) {
            let path = &tree.nodes[near.node].path;
            let origin = &pose.places[near.node].origin;
            for (half, &k) in half.iter_mut().zip(path) {
                *half = rows(&pose.axes[k], origin);
            }
            dynamics
                .factor
                .halve_rows(tree, path, &mut half[..path.len()]);
            let mut twist = rows(&dynamics.motions[near.node], origin);
            for (half, &k) in half.iter().zip(path) {
                let change = dynamics.change[k];
                for i in 0..6 {
                    twist[i] += half[i] * change;
                }
            }
            self.twists.push(twist);
        }
    }

    /// Of the pairs that a lane in `open` has on the ground together.
    #[inline(always)]
    fn couple(&mut self, tree: &Tree, open: u32) {
        let pairs = pair(self.near.len(), 0);
        if self.coupling.len() < pairs {
            self.coupling.resize(pairs, [[L::ZERO; 6]; 6]);
        }
        for a in 0..self.near.len() {
            for b in 0..=a {
                let (x, y) = (self.near[a], self.near[b]);
                if x.lanes & y.lanes & open == 0 {
                    continue;
                }
                let shared = tree.shared(x.node, y.node);
                let x = &self.halves[a * self.width..a * self.width + shared];
                let y = &self.halves[b * self.width..b * self.width + shared];
                for (k, sums) in self.coupling[pair(a, b)].iter_mut().enumerate() {
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

    /// One character's impulses, added up by body.
    #[inline(always)]
    fn solve(&mut self, lane: usize) {
        let solver = &mut self.solvers[lane];
        if solver.points.is_empty() {
            return;
        }
        solver.coupling.clear();
        for a in 0..solver.bodies.len() {
            let near = solver.bodies[a].near;
            solver.bodies[a].twist = twist(&self.twists[near], lane);
            solver.bodies[a].wrench = [0.0; 6];
            for b in 0..solver.bodies.len() {
                let other = solver.bodies[b].near;
                let answers = &self.coupling[pair(near.max(other), near.min(other))];
                let mut columns = [Twist::default(); 6];
                for (k, column) in columns.iter_mut().enumerate() {
                    *column = if near >= other {
                        twist(&answers[k], lane)
                    } else {
                        twist(&std::array::from_fn(|i| answers[i][k]), lane)
                    };
                }
                solver.coupling.push(columns);
            }
        }
        solver.solve();
        for pressed in &solver.bodies {
            let parts = self.wrenches[pressed.near].iter_mut();
            for (part, x) in parts.zip(&pressed.wrench) {
                part.set(lane, *x);
            }
        }
    }

    #[inline(always)]
    fn apply(&self, tree: &Tree, change: &mut [L]) {
        let halves = self.halves.chunks_exact(self.width);
        for ((near, wrench), half) in self.near.iter().zip(&self.wrenches).zip(halves) {
            for (half, &k) in half.iter().zip(&tree.nodes[near.node].path) {
                for i in 0..6 {
                    change[k] += half[i] * wrench[i];
                }
            }
        }
    }

    /// The ground's impulses on the characters.
    pub fn impulse(&self, pose: &Pose<L>) -> Force<L> {
        let mut sum = Force::ZERO;
        for (lane, solver) in self.solvers.iter().enumerate() {
            let [mut moment, mut force] = [Vector3::zeros(); 2];
            for point in &solver.points {
                let node = solver.bodies[point.body].node;
                let at = pose.places[node].origin.of(lane) + point.arm;
                moment += at.cross(&point.impulse);
                force += point.impulse;
            }
            sum.moment.set(lane, &moment);
            sum.force.set(lane, &force);
        }
        sum
    }

    /// Marks the nodes that push on the ground.
    pub fn mark(&self, lane: usize, pressed: &mut [bool]) {
        let solver = &self.solvers[lane];
        for point in &solver.points {
            let node = solver.bodies[point.body].node;
            pressed[node] |= point.impulse.z > 0.0;
        }
    }
}

/// Lanes in which a node may have points near the ground.
#[inline(always)]
fn reaches_ground<L: Lanes>(
    node: &Node,
    pose: &Pose<L>,
    motion: &Motion<L>,
    (i, dt): (usize, f32),
) -> u32 {
    let (place, reach) = (&pose.places[i], L::splat(node.reach));
    let fastest = motion.angular.norm() * reach - motion.at(&place.origin).z;
    let lowest = place.origin.z + pose.origin.z - reach;
    let soon = lowest - L::splat(dt) * fastest.max(L::ZERO);
    L::splat(NEAR).at_least(soon).bits()
}

/// Where a pair of bodies is kept, `b` no later than `a`.
fn pair(a: usize, b: usize) -> usize {
    a * (a + 1) / 2 + b
}

/// Of a motion: turning, and velocity at `origin`.
#[inline(always)]
fn rows<L: Lanes>(motion: &Motion<L>, origin: &Vec3<L>) -> [L; 6] {
    let (turning, velocity) = (&motion.angular, motion.at(origin));
    [
        turning.x, turning.y, turning.z, velocity.x, velocity.y, velocity.z,
    ]
}

#[inline(always)]
fn twist<L: Lanes>(parts: &[L; 6], lane: usize) -> Twist {
    let [a, b, c, x, y, z] = parts.each_ref().map(|part| part.of(lane));
    [f32x4::from([a, b, c, 0.0]), f32x4::from([x, y, z, 0.0])]
}
