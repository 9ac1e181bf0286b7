//! Where the ground and the ends of hinges' ranges push, and how hard.
//!
//! All rows are velocities that must not be negative: those of points towards the ground, those of hinges towards
//! their end. They are solved for impulses together, by sweeps of projected Gauss-Seidel over the rows' own matrix
//! A = J M⁻¹ Jᵀ, which holds the drives' stiffness too; friction stays in Coulomb's cone.

use super::dynamics::Dynamics;
use super::matrix::PathMatrix;
use super::pose::Pose;
use super::spatial::Motion;
use super::tree::{Joint, Tree};
use nalgebra::Vector3;

/// Points nearer to the ground than this at the end of a step are looked at, metres; hinges nearer to their end, radians.
const NEAR: f32 = 0.005;
/// Share of a depth that is taken back in one step, and the fastest that it may be, m/s or rad/s.
const RECOVERY: f32 = 0.2;
const FASTEST: f32 = 0.5;
/// Added to the diagonal, as a share of it: of redundant points, each bears its part.
const SOFTNESS: f32 = 1e-3;

/// Passes over all rows, which start from the impulses of the step before.
const SWEEPS: usize = 8;

/// What a row's impulse may be.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// A hinge at the end of its range.
    Stops,
    /// A point on the ground.
    Presses,
    /// This row and the next: no longer together than a share of the impulse in the row before.
    Rubs(f32),
    /// The second row of friction.
    Follows,
}

#[derive(Clone, Copy, Debug)]
struct Row {
    node: usize,
    /// Length of the path that it runs along, which is that of its last coordinate.
    length: usize,
    kind: Kind,
    /// Velocity that it must have, if not more.
    wanted: f32,
    /// Which contact it is, to find its impulse in the next step.
    id: usize,
}

/// Contacts and stops of one step.
#[derive(Clone, Debug, Default)]
pub(super) struct Contacts {
    rows: Vec<Row>,
    /// `[rows, width]`: halved Jacobians, zero beyond their length.
    halves: Vec<f32>,
    width: usize,
    /// `[rows, rows]`.
    matrix: Vec<f32>,
    velocities: Vec<f32>,
    impulses: Vec<f32>,
    /// By id, of the last step.
    last: Vec<f32>,
    sum: Vec<f32>,
}

impl Contacts {
    pub fn new(tree: &Tree) -> Self {
        let points: usize = tree.nodes.iter().map(|node| node.points.len()).sum();
        Contacts {
            width: tree.nodes.iter().map(|n| n.path.len()).max().unwrap_or(0),
            last: vec![0.0; 3 * points + 2 * tree.nodes.len()],
            sum: vec![0.0; tree.dofs()],
            ..Contacts::default()
        }
    }

    /// Forgets the steps before.
    pub fn reset(&mut self) {
        self.last.fill(0.0);
    }

    /// Changes the velocity so that nothing goes on into the ground or beyond its range, and marks in `pressed` the
    /// nodes that push on the ground.
    pub fn resolve(
        &mut self,
        tree: &Tree,
        pose: &mut Pose,
        dynamics: &Dynamics,
        (dt, friction): (f32, f32),
        pressed: &mut [bool],
    ) {
        self.rows.clear();
        self.halves.clear();
        self.velocities.clear();
        self.find(tree, pose, &dynamics.motions, (dt, friction));
        if self.rows.is_empty() {
            self.last.fill(0.0);
            return;
        }
        self.couple(tree, &dynamics.matrix);
        self.solve();
        self.apply(tree, pose, &dynamics.matrix);
        for (row, impulse) in self.rows.iter().zip(&self.impulses) {
            pressed[row.node] |= row.kind == Kind::Presses && *impulse > 0.0;
        }
    }

    fn find(&mut self, tree: &Tree, pose: &Pose, motions: &[Motion], (dt, friction): (f32, f32)) {
        let mut id = 0;
        for (i, node) in tree.nodes.iter().enumerate() {
            let place = &pose.nodes[i];
            for (point, radius) in &node.points {
                let mut at = place.translation.vector + place.rotation * point;
                at.z -= radius;
                let gap = at.z + pose.origin.z;
                if gap < NEAR || gap + dt * motions[i].at(&at).z < NEAR {
                    self.touch(tree, pose, (i, &at), gap / dt, friction * node.friction, id);
                }
                id += 3;
            }
        }
        for (i, node) in tree.nodes.iter().enumerate() {
            if let Joint::Hinge(_, Some(range)) = node.joint {
                let rate = pose.velocity[node.dofs.start];
                for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                    let gap = (pose.angles[i] - range[side]) * sign;
                    if gap + dt * rate * sign < NEAR {
                        self.stop(tree, i, (gap / dt, sign, rate), id + side);
                    }
                }
            }
            id += 2;
        }
    }

    /// Three rows of a point, along z, x and y.
    fn touch(
        &mut self,
        tree: &Tree,
        pose: &Pose,
        (node, at): (usize, &Vector3<f32>),
        room: f32,
        friction: f32,
        id: usize,
    ) {
        let path = &tree.nodes[node].path;
        let kinds = [Kind::Presses, Kind::Rubs(friction), Kind::Follows];
        for (k, (axis, kind)) in [2, 0, 1].into_iter().zip(kinds).enumerate() {
            let start = self.halves.len();
            self.halves
                .extend(path.iter().map(|&j| pose.axes[j].at(at)[axis]));
            let wanted = if k == 0 { wanted(room) } else { 0.0 };
            self.push(
                pose,
                path,
                Row {
                    node,
                    length: path.len(),
                    kind,
                    wanted,
                    id: id + k,
                },
                start,
            );
        }
    }

    /// One row of a hinge.
    fn stop(&mut self, tree: &Tree, node: usize, (room, sign, rate): (f32, f32, f32), id: usize) {
        let path = &tree.nodes[node].path;
        let start = self.halves.len();
        self.halves.resize(start + path.len() - 1, 0.0);
        self.halves.push(sign);
        let wanted = wanted(room);
        self.rows.push(Row {
            node,
            length: path.len(),
            kind: Kind::Stops,
            wanted,
            id,
        });
        self.velocities.push(rate * sign - wanted);
        self.halves.resize(start + self.width, 0.0);
    }

    fn push(&mut self, pose: &Pose, path: &[usize], row: Row, start: usize) {
        let jacobian = self.halves[start..].iter().zip(path);
        let velocity: f32 = jacobian.map(|(j, &k)| j * pose.velocity[k]).sum();
        self.velocities.push(velocity - row.wanted);
        self.rows.push(row);
        self.halves.resize(start + self.width, 0.0);
    }

    /// Halves the Jacobians and multiplies them with each other.
    fn couple(&mut self, tree: &Tree, matrix: &PathMatrix) {
        let (count, width) = (self.rows.len(), self.width);
        for (row, half) in self.rows.iter().zip(self.halves.chunks_exact_mut(width)) {
            matrix.halve(&tree.nodes[row.node].path, &mut half[..row.length]);
        }
        self.matrix.resize(count * count, 0.0);
        for a in 0..count {
            for b in 0..=a {
                let shared = tree.shared(self.rows[a].node, self.rows[b].node);
                let of = |row: usize| &self.halves[row * width..row * width + shared];
                let product: f32 = of(a).iter().zip(of(b)).map(|(x, y)| x * y).sum();
                self.matrix[a * count + b] = product;
                self.matrix[b * count + a] = product;
            }
            self.matrix[a * count + a] *= 1.0 + SOFTNESS;
        }
    }

    fn solve(&mut self) {
        let count = self.rows.len();
        self.impulses.clear();
        self.impulses
            .extend(self.rows.iter().map(|row| self.last[row.id]));
        for i in 0..count {
            let impulse = self.impulses[i];
            self.spread(i, impulse);
        }
        for _ in 0..SWEEPS {
            for i in 0..count {
                match self.rows[i].kind {
                    Kind::Stops | Kind::Presses => self.press(i),
                    Kind::Rubs(friction) => self.rub(i, friction),
                    Kind::Follows => {}
                }
            }
        }
        self.last.fill(0.0);
        for (row, impulse) in self.rows.iter().zip(&self.impulses) {
            self.last[row.id] = *impulse;
        }
    }

    fn spread(&mut self, i: usize, impulse: f32) {
        if impulse != 0.0 {
            let row = &self.matrix[i * self.rows.len()..(i + 1) * self.rows.len()];
            for (velocity, a) in self.velocities.iter_mut().zip(row) {
                *velocity += a * impulse;
            }
        }
    }

    /// The impulse that would stop row `i`.
    fn stopping(&self, i: usize) -> f32 {
        self.impulses[i] - self.velocities[i] / self.matrix[i * (self.rows.len() + 1)]
    }

    fn set(&mut self, i: usize, impulse: f32) {
        let change = impulse - self.impulses[i];
        self.impulses[i] = impulse;
        self.spread(i, change);
    }

    fn press(&mut self, i: usize) {
        self.set(i, self.stopping(i).max(0.0));
    }

    fn rub(&mut self, i: usize, friction: f32) {
        let most = friction * self.impulses[i - 1];
        let [x, y] = [self.stopping(i), self.stopping(i + 1)];
        let length = (x * x + y * y).sqrt();
        let share = if length > most { most / length } else { 1.0 };
        self.set(i, x * share);
        self.set(i + 1, y * share);
    }

    fn apply(&mut self, tree: &Tree, pose: &mut Pose, matrix: &PathMatrix) {
        self.sum.fill(0.0);
        let halves = self.halves.chunks_exact(self.width);
        for ((row, half), impulse) in self.rows.iter().zip(halves).zip(&self.impulses) {
            for (entry, &k) in half.iter().zip(&tree.nodes[row.node].path) {
                self.sum[k] += entry * impulse;
            }
        }
        matrix.unhalve(&mut self.sum);
        for (velocity, change) in pose.velocity.iter_mut().zip(&self.sum) {
            *velocity += change;
        }
    }
}

/// Velocity that leaves no more than `room` metres a second to go, or recovers from a depth.
fn wanted(room: f32) -> f32 {
    if room > 0.0 {
        -room
    } else {
        (-room * RECOVERY).min(FASTEST)
    }
}
