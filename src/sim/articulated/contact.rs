//! Where the ground pushes, and how hard.
//!
//! Every point near the ground has an impulse, which must stop it from going into the ground, can't pull, and rubs
//! within Coulomb's cone. All are solved together, by sweeps of projected Gauss-Seidel. What an impulse on one body
//! does to the twist of another, J M⁻¹ J'ᵀ (the Delassus operator), is computed for whole bodies, six by six: points of a
//! body share it. The drives are in it too, as they are in M.

use super::dynamics::Dynamics;
use super::pose::{Place, Pose, four, three};
use super::spatial::{Force, Motion};
use super::tree::Tree;
use nalgebra::{Matrix3, Vector3};
use wide::f32x4;

/// Points nearer to the ground than this at the end of a step are looked at, metres.
const NEAR: f32 = 0.005;
/// Share of a depth that is taken back in one step (the error reduction parameter), and the fastest that it may be, m/s.
const ERROR_REDUCTION: f32 = 0.2;
const FASTEST: f32 = 0.5;
/// Added to a hard point's own response, as a share of it (constraint force mixing): of redundant points, each bears its
/// part.
const FORCE_MIXING: f32 = 1e-3;
/// Of soft contacts, as MuJoCo's have it: how much of its acceleration a point is given at the surface, and below this
/// depth, metres.
const IMPEDANCE: [f32; 2] = [0.9, 0.95];
const SURFACE: f32 = 0.001;
/// Most passes over all points, which start from the impulses of the step before; and the change, m/s, below which a
/// pass is the last.
const SWEEPS: usize = 12;
const STILL: f32 = 1e-4;

/// What the ground is to one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ground {
    /// Seconds of the step.
    pub dt: f32,
    /// Factor of everyone's friction.
    pub friction: f32,
    /// Seconds in which it yields; 0 where it is hard.
    pub yielding: f32,
}

/// Twist of a body: its angular velocity, and that of its frame's origin.
type Twist = [f32x4; 2];

/// A body with points near the ground.
#[derive(Clone, Copy, Debug)]
struct ContactBody {
    node: usize,
    twist: Twist,
    /// Moment about its origin and force: sum of its points' impulses.
    wrench: [f32; 6],
}

#[derive(Clone, Copy, Debug)]
struct Point {
    body: usize,
    /// From the body's origin.
    arm: Vector3<f32>,
    /// Velocity that it is brought to; upwards it may have more.
    wanted: Vector3<f32>,
    /// Added to its response, as a share of it.
    softness: f32,
    friction: f32,
    impulse: Vector3<f32>,
    /// Its velocity for each impulse on itself.
    response: Matrix3<f32>,
    /// Which point of the tree it is.
    id: usize,
}

/// Contacts of one step.
#[derive(Clone, Debug, Default)]
pub(super) struct Contacts {
    bodies: Vec<ContactBody>,
    points: Vec<Point>,
    /// `[bodies, width]`: halved Jacobians of their twists, along their paths.
    halves: Vec<[f32x4; 6]>,
    width: usize,
    /// `[bodies, bodies]`: twist of the first for each part of the wrench on the second.
    coupling: Vec<[Twist; 6]>,
    /// By id, of the last step.
    last: Vec<Vector3<f32>>,
}

impl Contacts {
    pub fn new(tree: &Tree) -> Self {
        let points: usize = tree.nodes.iter().map(|node| node.points.len()).sum();
        Contacts {
            width: tree.nodes.iter().map(|n| n.path.len()).max().unwrap_or(0),
            last: vec![Vector3::zeros(); points],
            ..Contacts::default()
        }
    }

    /// Forgets the steps before.
    pub fn reset(&mut self) {
        self.last.fill(Vector3::zeros());
    }

    /// Adds to the half solution what keeps the character out of the ground.
    pub fn resolve(&mut self, tree: &Tree, pose: &Pose, dynamics: &mut Dynamics, ground: &Ground) {
        self.find(tree, pose, &dynamics.motions, ground);
        if self.points.is_empty() {
            self.reset();
            return;
        }
        self.halve(tree, pose, dynamics);
        self.couple(tree);
        self.respond();
        self.solve();
        self.apply(tree, &mut dynamics.change);
    }

    fn find(&mut self, tree: &Tree, pose: &Pose, motions: &[Motion], ground: &Ground) {
        self.bodies.clear();
        self.points.clear();
        let mut id = 0;
        for (i, node) in tree.nodes.iter().enumerate() {
            let (place, motion) = (&pose.places[i], &motions[i]);
            let fastest = motion.angular.norm() * node.reach - motion.at(&place.origin).z;
            let lowest = place.origin.z + pose.origin.z - node.reach;
            if lowest - ground.dt * fastest.max(0.0) > NEAR {
                id += node.points.len();
                continue;
            }
            let friction = ground.friction * node.friction;
            let first = self.points.len();
            for (point, radius) in &node.points {
                let mut arm = place.matrix * point;
                arm.z -= radius;
                let gap = arm.z + place.origin.z + pose.origin.z;
                let velocity = motion.at(&(place.origin + arm));
                if gap < NEAR || gap + ground.dt * velocity.z < NEAR {
                    self.add(arm, ground.wants(gap, velocity), friction, id);
                }
                id += 1;
            }
            if self.points.len() > first {
                self.bodies.push(body(i, place, motion));
            }
        }
    }

    fn add(
        &mut self,
        arm: Vector3<f32>,
        (wanted, softness): (Vector3<f32>, f32),
        friction: f32,
        id: usize,
    ) {
        self.points.push(Point {
            body: self.bodies.len(),
            arm,
            wanted,
            softness,
            friction,
            impulse: self.last[id],
            response: Matrix3::zeros(),
            id,
        });
    }

    /// Halves the Jacobians of the bodies, and adds to their twists what the step does without contacts.
    fn halve(&mut self, tree: &Tree, pose: &Pose, dynamics: &Dynamics) {
        self.halves.clear();
        self.halves
            .resize(self.bodies.len() * self.width, [f32x4::ZERO; 6]);
        let halves = self.halves.chunks_exact_mut(self.width);
        for (body, half) in self.bodies.iter_mut().zip(halves) {
            let path = &tree.nodes[body.node].path;
            let origin = &pose.places[body.node].origin;
            for (half, &block) in half.iter_mut().zip(path) {
                let [a, b, c] = pose.axes[block].angular;
                let [x, y, z] = pose.axes[block].at(origin);
                *half = [a, b, c, x, y, z];
            }
            dynamics.matrix.halve_rows(path, &mut half[..path.len()]);
            let mut sums = [f32x4::ZERO; 6];
            for (half, &block) in half.iter().zip(path) {
                for (sum, row) in sums.iter_mut().zip(half) {
                    *sum += *row * dynamics.change[block];
                }
            }
            let change = twist(sums);
            body.twist[0] += change[0];
            body.twist[1] += change[1];
        }
    }

    fn couple(&mut self, tree: &Tree) {
        let count = self.bodies.len();
        self.coupling.clear();
        for a in 0..count {
            for b in 0..count {
                let shared = tree.shared(self.bodies[a].node, self.bodies[b].node);
                let of = |i: usize| &self.halves[i * self.width..i * self.width + shared];
                self.coupling.push(std::array::from_fn(|k| {
                    let mut sums = [f32x4::ZERO; 6];
                    for (x, y) in of(a).iter().zip(of(b)) {
                        for (sum, row) in sums.iter_mut().zip(x) {
                            *sum += *row * y[k];
                        }
                    }
                    twist(sums)
                }));
            }
        }
    }

    /// What each point does for itself, and where the impulses of the last step lead.
    fn respond(&mut self) {
        let count = self.bodies.len();
        for i in 0..self.points.len() {
            let Point {
                body, arm, impulse, ..
            } = self.points[i];
            let own = &self.coupling[body * (count + 1)];
            for axis in 0..3 {
                let mut unit = Vector3::zeros();
                unit[axis] = 1.0;
                let velocity = at(&answer(own, &wrench(&arm, &unit)), &arm);
                self.points[i].response.set_column(axis, &velocity);
            }
            if impulse != Vector3::zeros() {
                self.spread(body, &arm, &impulse);
            }
        }
    }

    fn solve(&mut self) {
        for _ in 0..SWEEPS {
            let mut largest: f32 = 0.0;
            for i in 0..self.points.len() {
                let Point {
                    body,
                    arm,
                    impulse,
                    response,
                    ..
                } = self.points[i];
                let velocity = at(&self.bodies[body].twist, &arm);
                let next = self.points[i].next(velocity);
                let change = next - impulse;
                if change != Vector3::zeros() {
                    self.points[i].impulse = next;
                    self.spread(body, &arm, &change);
                    largest = largest.max(change.norm() * response[(2, 2)]);
                }
            }
            if largest < STILL {
                break;
            }
        }
        self.last.fill(Vector3::zeros());
        for point in &self.points {
            self.last[point.id] = point.impulse;
        }
    }

    /// Gives an impulse at a point of a body.
    fn spread(&mut self, body: usize, arm: &Vector3<f32>, impulse: &Vector3<f32>) {
        let count = self.bodies.len();
        let wrench = wrench(arm, impulse);
        for (sum, part) in self.bodies[body].wrench.iter_mut().zip(&wrench) {
            *sum += part;
        }
        for (a, other) in self.bodies.iter_mut().enumerate() {
            let change = answer(&self.coupling[a * count + body], &wrench);
            other.twist[0] += change[0];
            other.twist[1] += change[1];
        }
    }

    fn apply(&self, tree: &Tree, change: &mut [f32x4]) {
        for (body, half) in self.bodies.iter().zip(self.halves.chunks_exact(self.width)) {
            let wrench = body.wrench.map(f32x4::splat);
            for (half, &block) in half.iter().zip(&tree.nodes[body.node].path) {
                for (row, part) in half.iter().zip(&wrench) {
                    change[block] += *row * *part;
                }
            }
        }
    }

    /// The ground's impulse on the character; marks in `pressed` the nodes that push on it.
    pub fn report(&self, pose: &Pose, pressed: &mut [bool]) -> Force {
        let mut sum = Force::default();
        for point in &self.points {
            let node = self.bodies[point.body].node;
            pressed[node] |= point.impulse.z > 0.0;
            sum += Force::at(point.impulse, &(pose.places[node].origin + point.arm));
        }
        sum
    }
}

impl Point {
    /// Impulse that stops the point, as far as it may, given its velocity under the present one.
    fn next(&self, velocity: Vector3<f32>) -> Vector3<f32> {
        let (now, response) = (self.impulse, &self.response);
        // Softness resists the whole impulse, not only its change.
        let stopping = |k: usize, velocity: f32| {
            let own = response[(k, k)];
            let over = velocity - self.wanted[k] + now[k] * own * self.softness;
            now[k] - over / (own * (1.0 + self.softness))
        };
        let up = stopping(2, velocity.z).max(0.0);
        let along = |k: usize| stopping(k, velocity[k] + response[(k, 2)] * (up - now.z));
        let [x, y] = [along(0), along(1)];
        let (most, length) = (self.friction * up, (x * x + y * y).sqrt());
        let share = if length > most { most / length } else { 1.0 };
        Vector3::new(x * share, y * share, up)
    }
}

fn body(node: usize, place: &Place, motion: &Motion) -> ContactBody {
    ContactBody {
        node,
        twist: [four(&motion.angular), four(&motion.at(&place.origin))],
        wrench: [0.0; 6],
    }
}

/// Sums of the lanes of each.
fn twist([a, b, c, x, y, z]: [f32x4; 6]) -> Twist {
    [[a, b, c, f32x4::ZERO], [x, y, z, f32x4::ZERO]].map(|rows| {
        let [p, q, r, s] = f32x4::transpose(rows);
        p + q + r + s
    })
}

fn wrench(arm: &Vector3<f32>, impulse: &Vector3<f32>) -> [f32; 6] {
    let moment = arm.cross(impulse);
    [
        moment.x, moment.y, moment.z, impulse.x, impulse.y, impulse.z,
    ]
}

/// Twist that a wrench makes.
fn answer(coupling: &[Twist; 6], wrench: &[f32; 6]) -> Twist {
    let mut sum = [f32x4::ZERO; 2];
    for (column, part) in coupling.iter().zip(wrench) {
        let part = f32x4::splat(*part);
        sum[0] += column[0] * part;
        sum[1] += column[1] * part;
    }
    sum
}

/// Velocity at a point of a body.
fn at(twist: &Twist, arm: &Vector3<f32>) -> Vector3<f32> {
    three(twist[1]) + three(twist[0]).cross(arm)
}

impl Ground {
    /// Velocity that a point `gap` above the ground is brought to, and how softly.
    fn wants(&self, gap: f32, velocity: Vector3<f32>) -> (Vector3<f32>, f32) {
        if self.yielding <= 0.0 {
            return (Vector3::new(0.0, 0.0, wanted(gap / self.dt)), FORCE_MIXING);
        }
        // A critically damped spring whose time constant is `yielding` (MuJoCo, "Computation", "Reference"); of less than two
        // steps it would overshoot.
        let yielding = self.yielding.max(2.0 * self.dt);
        let [first, most] = IMPEDANCE;
        let depth = (-gap).max(0.0);
        let impedance = first + (most - first) * (depth / SURFACE).min(1.0);
        let kept = (1.0 - 2.0 * self.dt / (most * yielding)).max(0.0);
        let back = self.dt * impedance / (most * yielding).powi(2) * depth;
        let mut wanted = velocity * kept;
        wanted.z = if gap > 0.0 {
            wanted.z.min(-gap / self.dt)
        } else {
            wanted.z + back
        };
        (wanted, (1.0 - impedance) / impedance)
    }
}

/// Velocity that leaves no more than `room` metres a second to go, or recovers from a depth.
fn wanted(room: f32) -> f32 {
    if room > 0.0 {
        -room
    } else {
        (-room * ERROR_REDUCTION).min(FASTEST)
    }
}
