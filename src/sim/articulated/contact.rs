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
use nalgebra::{Matrix3, Vector3};
use wide::f32x4;

/// Contacts of one step.
#[derive(Clone, Debug)]
pub(super) struct Contacts<L> {
    /// By lane.
    solvers: Vec<Solver>,
    friction: [f32; LANES],
    /// Nodes that any lane has near the ground.
    bodies: Vec<usize>,
    /// `[bodies, width]`: halved Jacobians of their twists, along their paths.
    halves: Vec<[L; 6]>,
    width: usize,
    /// `[bodies]`: twists without contacts, then the ground's wrenches.
    twists: Vec<[L; 6]>,
    wrenches: Vec<[L; 6]>,
    /// `[bodies, bodies]`: twist of the first for each part of the wrench on the second.
    coupling: Vec<[[L; 6]; 6]>,
}

impl<L: Lanes> Contacts<L> {
    pub fn new(tree: &Tree) -> Self {
        Contacts {
            solvers: vec![Solver::default(); LANES],
            friction: [1.0; LANES],
            bodies: Vec::new(),
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
        self.bodies.clear();
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
        let mut touched = false;
        for (n, (point, radius)) in node.points.iter().enumerate() {
            let mut arm = place.matrix.times(&Vec3::splat(point));
            arm.z -= L::splat(*radius);
            let gap = arm.z + place.origin.z + pose.origin.z;
            let velocity = motion.at(&(place.origin + arm));
            let mut close = gap.min(gap + dt * velocity.z).below(near).bits() & used;
            touched |= close != 0;
            while close != 0 {
                let lane = close.trailing_zeros() as usize;
                close &= close - 1;
                let (wanted, softness) = ground.wants(gap.of(lane), velocity.of(lane));
                self.add(
                    lane,
                    first + n,
                    Point {
                        body: 0,
                        arm: arm.of(lane),
                        wanted,
                        softness,
                        friction: self.friction[lane] * node.friction,
                        impulse: Vector3::zeros(),
                        response: Matrix3::zeros(),
                        id: first + n,
                    },
                );
            }
        }
        if touched {
            self.bodies.push(i);
        }
    }

    /// Of the body that comes next in `bodies`.
    fn add(&mut self, lane: usize, id: usize, mut point: Point) {
        let (solver, body) = (&mut self.solvers[lane], self.bodies.len());
        if solver.bodies.last().is_none_or(|last| last.body != body) {
            solver.add_body(body);
        }
        point.body = solver.bodies.len() - 1;
        point.impulse = solver.last[id];
        solver.points.push(point);
    }

    /// Adds to the half solution what keeps the characters in `open` out of the ground.
    #[inline(always)]
    pub fn resolve(&mut self, tree: &Tree, pose: &Pose<L>, dynamics: &mut Dynamics<L>, open: u32) {
        if self.bodies.is_empty() {
            return;
        }
        self.halve(tree, pose, dynamics);
        self.couple(tree);
        self.wrenches.clear();
        self.wrenches.resize(self.bodies.len(), [L::ZERO; 6]);
        for lane in (0..LANES).filter(|lane| open >> lane & 1 == 1) {
            self.solve(lane);
        }
        self.apply(tree, &mut dynamics.change);
    }

    /// Halves the Jacobians of the bodies, and takes their twists from what the step does without contacts.
    #[inline(always)]
    fn halve(&mut self, tree: &Tree, pose: &Pose<L>, dynamics: &Dynamics<L>) {
        self.halves.clear();
        self.halves
            .resize(self.bodies.len() * self.width, [L::ZERO; 6]);
        self.twists.clear();
        let halves = self.halves.chunks_exact_mut(self.width);
        for (&body, half) in self.bodies.iter().zip(halves) {
            let path = &tree.nodes[body].path;
            let origin = &pose.places[body].origin;
            for (half, &k) in half.iter_mut().zip(path) {
                *half = rows(&pose.axes[k], origin);
            }
            dynamics
                .factor
                .halve_rows(tree, path, &mut half[..path.len()]);
            let mut twist = rows(&dynamics.motions[body], origin);
            for (half, &k) in half.iter().zip(path) {
                let change = dynamics.change[k];
                for i in 0..6 {
                    twist[i] += half[i] * change;
                }
            }
            self.twists.push(twist);
        }
    }

    #[inline(always)]
    fn couple(&mut self, tree: &Tree) {
        let count = self.bodies.len();
        self.coupling.clear();
        self.coupling.resize(count * count, [[L::ZERO; 6]; 6]);
        for a in 0..count {
            for b in 0..=a {
                let shared = tree.shared(self.bodies[a], self.bodies[b]);
                let x = &self.halves[a * self.width..a * self.width + shared];
                let y = &self.halves[b * self.width..b * self.width + shared];
                let (mut there, mut back) = ([[L::ZERO; 6]; 6], [[L::ZERO; 6]; 6]);
                for k in 0..6 {
                    let mut sums = [L::ZERO; 6];
                    for (x, y) in x.iter().zip(y) {
                        for i in 0..6 {
                            sums[i] += x[i] * y[k];
                        }
                    }
                    there[k] = sums;
                    for i in 0..6 {
                        back[i][k] = sums[i];
                    }
                }
                self.coupling[b * count + a] = back;
                self.coupling[a * count + b] = there;
            }
        }
    }

    /// One character's impulses, added up by body.
    fn solve(&mut self, lane: usize) {
        let (solver, count) = (&mut self.solvers[lane], self.bodies.len());
        if solver.points.is_empty() {
            return;
        }
        solver.coupling.clear();
        for a in 0..solver.bodies.len() {
            solver.bodies[a].twist = twist(&self.twists[solver.bodies[a].body], lane);
            solver.bodies[a].wrench = [0.0; 6];
            for b in 0..solver.bodies.len() {
                let pair = solver.bodies[a].body * count + solver.bodies[b].body;
                let columns = &self.coupling[pair];
                let columns = std::array::from_fn(|k| twist(&columns[k], lane));
                solver.coupling.push(columns);
            }
        }
        solver.solve();
        for pressed in &solver.bodies {
            let parts = self.wrenches[pressed.body].iter_mut();
            for (part, x) in parts.zip(&pressed.wrench) {
                part.set(lane, *x);
            }
        }
    }

    #[inline(always)]
    fn apply(&self, tree: &Tree, change: &mut [L]) {
        let halves = self.halves.chunks_exact(self.width);
        for ((&body, wrench), half) in self.bodies.iter().zip(&self.wrenches).zip(halves) {
            for (half, &k) in half.iter().zip(&tree.nodes[body].path) {
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
                let node = self.bodies[solver.bodies[point.body].body];
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
            let node = self.bodies[solver.bodies[point.body].body];
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

/// Of a motion: turning, and velocity at `origin`.
#[inline(always)]
fn rows<L: Lanes>(motion: &Motion<L>, origin: &Vec3<L>) -> [L; 6] {
    let (turning, velocity) = (&motion.angular, motion.at(origin));
    [
        turning.x, turning.y, turning.z, velocity.x, velocity.y, velocity.z,
    ]
}

fn twist<L: Lanes>(parts: &[L; 6], lane: usize) -> Twist {
    let [a, b, c, x, y, z] = std::array::from_fn(|i| parts[i].of(lane));
    [f32x4::from([a, b, c, 0.0]), f32x4::from([x, y, z, 0.0])]
}
