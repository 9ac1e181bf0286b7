//! How hard the ground pushes on the points of one character.
//!
//! Every point near the ground has an impulse, which must stop it from going into the ground, can't pull, and rubs
//! within Coulomb's cone. All are solved together, by sweeps of projected Gauss-Seidel.

use nalgebra::{Matrix3, Vector3};
use wide::f32x4;

/// Most passes over all points, which start from the impulses of the step before; and the change, m/s, below which a
/// pass is the last.
const SWEEPS: usize = 12;
const STILL: f32 = 1e-4;

/// Twist of a body: its angular velocity, and that of its frame's origin.
pub(super) type Twist = [f32x4; 2];

/// A body with points near the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pressed {
    pub node: usize,
    /// Which of the nodes that any of the eight characters has near the ground.
    pub near: usize,
    pub twist: Twist,
    /// Moment about its origin and force: sum of its points' impulses.
    pub wrench: [f32; 6],
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Which of this character's [`Pressed`].
    pub body: usize,
    /// From the body's origin.
    pub arm: Vector3<f32>,
    /// Velocity that it is brought to; upwards it may have more.
    pub wanted: Vector3<f32>,
    /// Added to its response, as a share of it.
    pub softness: f32,
    pub friction: f32,
    pub impulse: Vector3<f32>,
    /// Its velocity for each impulse on itself.
    pub response: Matrix3<f32>,
    /// Which point of the tree it is.
    pub id: usize,
}

/// Contacts of one character in one step.
#[derive(Clone, Debug, Default)]
pub(super) struct Solver {
    pub bodies: Vec<Pressed>,
    pub points: Vec<Point>,
    /// `[bodies, bodies]`: twist of the first for each part of the wrench on the second.
    pub coupling: Vec<[Twist; 6]>,
    /// Impulses by point of the tree, of the last step.
    pub last: Vec<Vector3<f32>>,
}

impl Solver {
    pub fn clear(&mut self) {
        self.bodies.clear();
        self.points.clear();
    }

    /// Adds a point of `node`, which is number `near` of those near the ground.
    pub fn add(&mut self, (node, near): (usize, usize), point: Point) {
        if self.bodies.last().is_none_or(|last| last.near != near) {
            self.bodies.push(Pressed {
                node,
                near,
                twist: [f32x4::ZERO; 2],
                wrench: [0.0; 6],
            });
        }
        self.points.push(Point {
            body: self.bodies.len() - 1,
            impulse: self.last[point.id],
            ..point
        });
    }

    #[inline(always)]
    pub fn solve(&mut self) {
        self.respond();
        for _ in 0..SWEEPS {
            if self.sweep() < STILL {
                break;
            }
        }
        self.last.fill(Vector3::zeros());
        for point in &self.points {
            self.last[point.id] = point.impulse;
        }
    }

    /// What each point does for itself, and where the impulses of the last step lead.
    #[inline(always)]
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

    /// Gives every point the impulse that it should have. Gives the largest change of a velocity.
    #[inline(always)]
    fn sweep(&mut self) -> f32 {
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
        largest
    }

    /// Gives an impulse at a point of a body.
    #[inline(always)]
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
}

impl Point {
    /// Number `id` of the tree, with the velocity and softness that the ground wants of it.
    pub fn new(
        id: usize,
        arm: Vector3<f32>,
        (wanted, softness): (Vector3<f32>, f32),
        friction: f32,
    ) -> Self {
        Point {
            body: 0,
            arm,
            wanted,
            softness,
            friction,
            impulse: Vector3::zeros(),
            response: Matrix3::zeros(),
            id,
        }
    }

    /// Impulse that stops the point, as far as it may, given its velocity under the present one.
    #[inline(always)]
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

#[inline(always)]
fn wrench(arm: &Vector3<f32>, impulse: &Vector3<f32>) -> [f32; 6] {
    let moment = arm.cross(impulse);
    [
        moment.x, moment.y, moment.z, impulse.x, impulse.y, impulse.z,
    ]
}

/// Twist that a wrench makes.
#[inline(always)]
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
#[inline(always)]
fn at(twist: &Twist, arm: &Vector3<f32>) -> Vector3<f32> {
    three(twist[1]) + three(twist[0]).cross(arm)
}

#[inline(always)]
fn three(v: f32x4) -> Vector3<f32> {
    let [x, y, z, _] = v.to_array();
    Vector3::new(x, y, z)
}
