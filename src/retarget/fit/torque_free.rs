//! Rotation with nothing to push on: the turns by which a body keeps its angular momentum in flight.
//!
//! The body is turned as a whole about its centre of mass, by a rotation δ(t) that gives it the same angular momentum L̄ in
//! every step and vanishes at both ends of the flight. For small turns I(t) δ̇ = L̄ − L(t), so L̄ = (∫ I⁻¹)⁻¹ ∫ I⁻¹ L. From
//! there L̄ is found by shooting: what is left of δ at the end tells how far L̄ is off (Newton's method).

use crate::retarget::qpos::{put_quaternion, quaternion, vector};
use crate::skeleton::{Skeleton, Twist};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

/// Most corrections of the momentum of a flight. Chosen: Newton's method takes a few, and what takes more has no solution
/// nearby.
const SHOTS: usize = 12;
/// Most corrections of the turn of a step. Chosen for the same reason.
const CORRECTIONS: usize = 16;
/// What may be left of the turn at the end of a flight, radians. Chosen well below what is seen or felt.
const LEFT_AT_END: f64 = 1e-5;
/// What may be left of the correction of a step, radians. Chosen a tenth of that.
const LEFT_OF_STEP: f64 = 1e-6;
/// A shot that leaves less than this share of the turn shows that the derivative is still good, and it isn't found anew
/// (chord method). Chosen.
const CHORD: f64 = 0.3;
/// Share of the momentum by which it is varied to find the derivative. Chosen: turns are found to 1e-6.
const VARIED: f64 = 1e-3;

/// The turns of a flight's frames, the identity in the first and the last.
pub(super) type Turns = Vec<UnitQuaternion<f64>>;

/// The frames of a flight, from the last on the ground to the first after it.
pub(super) struct TorqueFreeFlight<'a> {
    /// The skeleton.
    pub skeleton: &'a Skeleton,
    /// Coordinates of every frame.
    pub frames: &'a [Vec<f64>],
    /// Frames per second.
    pub fps: f64,
}

impl TorqueFreeFlight<'_> {
    /// The turns with which the body keeps its angular momentum; `None` if none are found.
    pub fn turns(&self) -> Option<Turns> {
        self.shoot_at_rest(mean_momentum(&steps(
            self.skeleton,
            self.frames,
            self.fps,
        )?)?)
    }

    /// The turns that vanish at the end, with a momentum near to this one.
    fn shoot_at_rest(&self, mut momentum: Vector3<f64>) -> Option<Turns> {
        let (mut turns, mut off) = self.shoot(&momentum)?;
        let mut known: Option<Matrix3<f64>> = None;
        for _ in 0..SHOTS {
            if off.norm() < LEFT_AT_END {
                *turns.last_mut()? = UnitQuaternion::identity();
                return Some(turns);
            }
            let derivative = match known {
                Some(derivative) => derivative,
                None => self.derivative(&momentum, &off)?,
            };
            // Newton's step; where it overshoots, half of it.
            let mut step = derivative * off;
            let mut found = self.shoot(&(momentum - step))?;
            if found.1.norm() > off.norm() {
                step /= 2.0;
                found = self.shoot(&(momentum - step))?;
            }
            known = (found.1.norm() < CHORD * off.norm()).then_some(derivative);
            momentum -= step;
            (turns, off) = found;
        }
        None
    }

    /// The turns with which the body has this momentum in every step, and what is left of them at the end.
    fn shoot(&self, momentum: &Vector3<f64>) -> Option<(Turns, Vector3<f64>)> {
        let turns = self.turned(momentum)?;
        let off = turns.last()?.scaled_axis();
        Some((turns, off))
    }

    /// The derivative of the momentum by the turn at the end, by forward differences from where that is `off`.
    fn derivative(&self, momentum: &Vector3<f64>, off: &Vector3<f64>) -> Option<Matrix3<f64>> {
        // At least 1e-3 kg·m²/s, for a body that hardly spins.
        let by = VARIED * momentum.norm().max(1.0);
        let varied = |i| Some((self.shoot(&(momentum + Vector3::ith(i, by)))?.1 - off) / by);
        Matrix3::from_columns(&[varied(0)?, varied(1)?, varied(2)?]).try_inverse()
    }

    /// The turns with which the body has this momentum in every step, starting from none. Each step's is found by iteration,
    /// for the body's inertia turns with it.
    fn turned(&self, momentum: &Vector3<f64>) -> Option<Turns> {
        let (skeleton, fps) = (self.skeleton, self.fps);
        let mut turns = vec![UnitQuaternion::identity()];
        for pair in self.frames.windows(2) {
            // The frame before has its turn already; the next one starts with the same turn.
            let mut by = *turns.last()?;
            let mut pair = pair.to_vec();
            turn(skeleton, &mut pair[0], &by);
            let ease = inertia(skeleton, &skeleton.forward(&pair[0])).try_inverse()?;
            let next = pair[1].clone();
            for _ in 0..CORRECTIONS {
                pair[1].clone_from(&next);
                turn(skeleton, &mut pair[1], &by);
                // The momentum that is missing, divided by the inertia, is the missing rate; times the step's duration, the
                // turn.
                let more = ease * (momentum - mean_of_step(skeleton, &pair, fps)) / fps;
                by = UnitQuaternion::from_scaled_axis(more) * by;
                if more.norm() < LEFT_OF_STEP {
                    break;
                }
            }
            turns.push(by);
        }
        Some(turns)
    }
}

/// What a body does from one frame to the next.
pub(super) struct Step {
    /// Mean angular momentum about the centre of mass, kg·m²/s.
    pub momentum: Vector3<f64>,
    /// Inverse of the whole body's inertia about its centre of mass, world axes, 1/(kg·m²).
    pub inverse_inertia: Matrix3<f64>,
}

/// The steps between these frames.
pub(super) fn steps(skeleton: &Skeleton, frames: &[Vec<f64>], fps: f64) -> Option<Vec<Step>> {
    let pairs = frames.windows(2);
    pairs.map(|pair| step(skeleton, pair, fps)).collect()
}

/// The step between two frames.
pub(super) fn step(skeleton: &Skeleton, pair: &[Vec<f64>], fps: f64) -> Option<Step> {
    Some(Step {
        momentum: mean_of_step(skeleton, pair, fps),
        inverse_inertia: inertia(skeleton, &skeleton.forward(&pair[0])).try_inverse()?,
    })
}

/// The momentum L̄ = (Σ I⁻¹)⁻¹ Σ I⁻¹ L with which a body turns as far as in these steps, kg·m²/s.
pub(super) fn mean_momentum(steps: &[Step]) -> Option<Vector3<f64>> {
    let ease: Matrix3<f64> = steps.iter().map(|s| s.inverse_inertia).sum();
    let spun: Vector3<f64> = steps.iter().map(|s| s.inverse_inertia * s.momentum).sum();
    Some(ease.try_inverse()? * spun)
}

/// Mean angular momentum from a frame to the next, kg·m²/s.
fn mean_of_step(skeleton: &Skeleton, pair: &[Vec<f64>], fps: f64) -> Vector3<f64> {
    let qvel = skeleton.differentiate(&pair[0], &pair[1], 1.0 / fps);
    let momentum = |qpos: &Vec<f64>| {
        let poses = skeleton.forward(qpos);
        skeleton.momentum(&poses, &skeleton.twists(qpos, &qvel)).1
    };
    // One velocity for the whole step, but the body's shape changes in it.
    (momentum(&pair[0]) + momentum(&pair[1])) / 2.0
}

/// The whole body's inertia about its centre of mass, world axes, kg·m²: each column is the momentum of a turn at 1 rad/s.
fn inertia(skeleton: &Skeleton, poses: &[Isometry3<f64>]) -> Matrix3<f64> {
    let com = skeleton.com(poses);
    let column = |axis: Vector3<f64>| {
        let twist = |pose: &Isometry3<f64>| Twist {
            linear: axis.cross(&(pose.translation.vector - com)),
            angular: axis,
        };
        let twists: Vec<Twist> = poses.iter().map(twist).collect();
        skeleton.momentum(poses, &twists).1
    };
    Matrix3::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z()].map(column))
}

/// Turns a pose about its centre of mass.
pub(super) fn turn(skeleton: &Skeleton, qpos: &mut [f64], by: &UnitQuaternion<f64>) {
    let com = skeleton.com(&skeleton.forward(qpos));
    // The joints stay, so turning the root about the centre of mass turns all of the body.
    let root = com + by * (vector(qpos, 0) - com);
    qpos[..3].copy_from_slice(root.as_slice());
    put_quaternion(qpos, 3, &(by * quaternion(qpos, 3)));
}
