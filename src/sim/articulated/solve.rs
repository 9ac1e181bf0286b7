//! Contact impulses of one character, by projected Gauss-Seidel.
//!
//! Each contact point has an impulse that may push but not pull, and whose tangential part stays within Coulomb's friction
//! cone. The sweeps go over all points in turn, give each the impulse that brings it to its target velocity while the others
//! keep theirs, and project that onto the cone. Points of one body share the body's 6×6 blocks of the Delassus matrix
//! J M⁻¹ Jᵀ, so an impulse changes twists of whole bodies, and a point reads its velocity from its body's twist.

use nalgebra::{Matrix3, Vector3};
use wide::f32x4;

/// Most sweeps over all points. Chosen: the sweeps start from the impulses of the last step, so that a character that stands
/// needs few of them, and what one step leaves unsolved the next goes on with.
const SWEEPS: usize = 12;
/// A sweep that changes no point's velocity by more than this is the last, m/s. Chosen: over a 240 Hz step it is less than a
/// thousandth of a millimetre.
const TOLERANCE: f32 = 1e-4;

/// Twist of a body: angular velocity, and velocity of its frame's origin, world axes. The fourth lane of each is 0.
pub(super) type Twist = [f32x4; 2];

/// A body of the character that has contact points.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactBody {
    pub node: usize,
    /// Its index among the bodies that any of the eight characters has near the ground.
    pub near: usize,
    /// Its twist at the end of the step under the present impulses.
    pub twist: Twist,
    /// Sum of its points' impulses: moment about its origin (N·m·s), then impulse (N·s).
    pub wrench: [f32; 6],
}

/// A point of a body that is near the ground. Vectors are in world axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactPoint {
    /// Index of its [`ContactBody`].
    pub body: usize,
    /// From the body's origin, metres.
    pub arm: Vector3<f32>,
    /// Velocity to which it is brought, m/s. Its vertical velocity may be larger, because the ground doesn't pull.
    pub target: Vector3<f32>,
    /// Regularisation, as a share of its own response.
    pub softness: f32,
    /// Coulomb friction coefficient.
    pub friction: f32,
    /// The ground's impulse on it, N·s.
    pub impulse: Vector3<f32>,
    /// Its own 3×3 block of the Delassus matrix: change of its velocity for an impulse on it, 1/kg.
    pub response: Matrix3<f32>,
    /// Its index among all points of the tree.
    pub id: usize,
}

/// Contacts of one character in one step.
#[derive(Clone, Debug, Default)]
pub(super) struct Solver {
    pub bodies: Vec<ContactBody>,
    pub points: Vec<ContactPoint>,
    /// `[bodies, bodies]`: change of the first body's twist for each component of a wrench on the second.
    pub delassus: Vec<[Twist; 6]>,
    /// `[points of the tree]`: impulses of the last step, N·s.
    pub last: Vec<Vector3<f32>>,
}

impl Solver {
    /// Forgets bodies and points, but not the last step's impulses.
    pub fn clear(&mut self) {
        self.bodies.clear();
        self.points.clear();
    }

    /// Adds a point of `node`, which has index `near` among the bodies near the ground. Points of one node come in a row. The
    /// point starts with its impulse of the last step.
    pub fn add(&mut self, (node, near): (usize, usize), point: ContactPoint) {
        if self.bodies.last().is_none_or(|last| last.near != near) {
            self.bodies.push(ContactBody {
                node,
                near,
                twist: [f32x4::ZERO; 2],
                wrench: [0.0; 6],
            });
        }
        self.points.push(ContactPoint {
            body: self.bodies.len() - 1,
            impulse: self.last[point.id],
            ..point
        });
    }

    /// Finds the impulses of all points, and the wrenches on their bodies.
    #[inline(always)]
    pub fn solve(&mut self) {
        self.prepare();
        for _ in 0..SWEEPS {
            if self.sweep() < TOLERANCE {
                break;
            }
        }
        self.last.fill(Vector3::zeros());
        for point in &self.points {
            self.last[point.id] = point.impulse;
        }
    }

    /// Computes the response of each point to its own impulse, and applies the impulses that the sweeps start from.
    #[inline(always)]
    fn prepare(&mut self) {
        let count = self.bodies.len();
        for i in 0..self.points.len() {
            let ContactPoint {
                body, arm, impulse, ..
            } = self.points[i];
            let own = &self.delassus[body * (count + 1)];
            for axis in 0..3 {
                let mut unit = Vector3::zeros();
                unit[axis] = 1.0;
                let velocity = velocity_at(&twist_of(own, &wrench(&arm, &unit)), &arm);
                self.points[i].response.set_column(axis, &velocity);
            }
            if impulse != Vector3::zeros() {
                self.apply_impulse(body, &arm, &impulse);
            }
        }
    }

    /// One sweep: updates the impulse of every point. Returns the largest change of a velocity, m/s.
    #[inline(always)]
    fn sweep(&mut self) -> f32 {
        let mut largest: f32 = 0.0;
        for i in 0..self.points.len() {
            let ContactPoint {
                body,
                arm,
                impulse,
                response,
                ..
            } = self.points[i];
            let velocity = velocity_at(&self.bodies[body].twist, &arm);
            let next = self.points[i].projected(velocity);
            let change = next - impulse;
            if change != Vector3::zeros() {
                self.points[i].impulse = next;
                self.apply_impulse(body, &arm, &change);
                largest = largest.max(change.norm() * response[(2, 2)]);
            }
        }
        largest
    }

    /// Applies an impulse at a point of a body: changes the twists of all bodies in contact.
    #[inline(always)]
    fn apply_impulse(&mut self, body: usize, arm: &Vector3<f32>, impulse: &Vector3<f32>) {
        let count = self.bodies.len();
        let wrench = wrench(arm, impulse);
        for (sum, part) in self.bodies[body].wrench.iter_mut().zip(&wrench) {
            *sum += part;
        }
        for (a, other) in self.bodies.iter_mut().enumerate() {
            let change = twist_of(&self.delassus[a * count + body], &wrench);
            other.twist[0] += change[0];
            other.twist[1] += change[1];
        }
    }
}

impl ContactPoint {
    /// Point `id` of the tree, with the velocity and softness that the ground demands of it.
    pub fn new(
        id: usize,
        arm: Vector3<f32>,
        (target, softness): (Vector3<f32>, f32),
        friction: f32,
    ) -> Self {
        ContactPoint {
            body: 0,
            arm,
            target,
            softness,
            friction,
            impulse: Vector3::zeros(),
            response: Matrix3::zeros(),
            id,
        }
    }

    /// The impulse that brings the point to its target velocity, projected onto the friction cone, given its velocity under
    /// the present impulse.
    #[inline(always)]
    fn projected(&self, velocity: Vector3<f32>) -> Vector3<f32> {
        let (now, response) = (self.impulse, &self.response);
        // With its response a and the regularisation a s, one coordinate of the impulse λ has to satisfy
        // v + a (λ' − λ) + a s λ' = target: the softness resists the whole impulse, not only its change.
        let stopping = |k: usize, velocity: f32| {
            let own = response[(k, k)];
            let over = velocity - self.target[k] + now[k] * own * self.softness;
            now[k] - over / (own * (1.0 + self.softness))
        };
        // The normal comes first. The tangential velocities are those after its change, with which the friction is solved.
        let up = stopping(2, velocity.z).max(0.0);
        let along = |k: usize| stopping(k, velocity[k] + response[(k, 2)] * (up - now.z));
        let [x, y] = [along(0), along(1)];
        // Friction is isotropic: a tangential impulse beyond the cone is shortened, not clamped by axis.
        let (most, length) = (self.friction * up, (x * x + y * y).sqrt());
        let share = if length > most { most / length } else { 1.0 };
        Vector3::new(x * share, y * share, up)
    }
}

/// Moment about the body's origin, and the impulse itself.
#[inline(always)]
fn wrench(arm: &Vector3<f32>, impulse: &Vector3<f32>) -> [f32; 6] {
    let moment = arm.cross(impulse);
    [
        moment.x, moment.y, moment.z, impulse.x, impulse.y, impulse.z,
    ]
}

/// Change of twist by a wrench, of which `delassus` has a column for each component.
#[inline(always)]
fn twist_of(delassus: &[Twist; 6], wrench: &[f32; 6]) -> Twist {
    let mut sum = [f32x4::ZERO; 2];
    for (column, part) in delassus.iter().zip(wrench) {
        let part = f32x4::splat(*part);
        sum[0] += column[0] * part;
        sum[1] += column[1] * part;
    }
    sum
}

/// Velocity at a point of a body.
#[inline(always)]
fn velocity_at(twist: &Twist, arm: &Vector3<f32>) -> Vector3<f32> {
    xyz(twist[1]) + xyz(twist[0]).cross(arm)
}

#[inline(always)]
fn xyz(v: f32x4) -> Vector3<f32> {
    let [x, y, z, _] = v.to_array();
    Vector3::new(x, y, z)
}
