//! The whole trajectory in one least-squares problem: Levenberg–Marquardt over all frames at once.

use super::banded::Pentadiagonal;
use super::cost::{Normal, Part, Problem, bend, parts};
use super::model::Pose;
use super::rotation::exp;
use crate::motion::Cycle;
use nalgebra::{Matrix3, Vector3};

/// Most steps.
const ITERATIONS: usize = 15;
/// Relative gain below which the search ends.
const GAIN: f64 = 1e-3;
/// Damping at the start, relative to the mean diagonal.
const DAMPING: f64 = 1e-5;
/// Damping at which a step that gains nothing ends the search.
const STIFF: f64 = 0.1;
/// Change of the damping after a step that gained, and after one that did not.
const ON_GAIN: f64 = 0.3;
const ON_LOSS: f64 = 30.0;
/// Rounds in which the seam of a cycle is brought into a step.
const SEAM_ROUNDS: usize = 4;

/// A coupling across the seam of a cycle: rows of one frame, columns of another.
struct Corner {
    row: usize,
    column: usize,
    block: Matrix3<f64>,
    size: usize,
}

/// Derivatives of the whole cost.
struct System {
    band: Pentadiagonal,
    gradient: Vec<f64>,
    corners: Vec<Corner>,
}

pub(super) struct Solver<'a> {
    problem: &'a Problem<'a>,
    parts: Vec<Part>,
    /// Turn from a cycle to the next, and its shift, for a trajectory that repeats.
    cycle: Option<(Matrix3<f64>, Vector3<f64>)>,
    n: usize,
}

impl<'a> Solver<'a> {
    pub fn new(problem: &'a Problem<'a>, cycle: Option<&Cycle>) -> Solver<'a> {
        let step = |c: &Cycle| {
            let turn = exp(&(Vector3::z() * c.heading)).to_rotation_matrix();
            (*turn.matrix(), c.translation)
        };
        Solver {
            problem,
            parts: parts(problem.model),
            cycle: cycle.map(step),
            n: problem.model.skeleton.nv,
        }
    }

    /// Improves `frames` until nothing is gained any more; returns the number of steps taken.
    pub fn run(&self, frames: &mut Vec<Vec<f64>>) -> usize {
        let count = frames.len();
        let mut system = self.empty(count);
        let mut cost = self.assemble(frames, &mut system);
        let mut damping = DAMPING;
        for step in 0..ITERATIONS {
            let Some(trial) = self.trial(frames, &mut system, damping) else {
                damping *= ON_LOSS;
                self.assemble(frames, &mut system);
                continue;
            };
            let trial_cost = self.assemble(&trial, &mut system);
            if trial_cost < cost {
                let gain = (cost - trial_cost) / cost;
                (*frames, cost) = (trial, trial_cost);
                damping *= ON_GAIN;
                if gain < GAIN {
                    return step + 1;
                }
            } else {
                if damping > STIFF {
                    return step + 1;
                }
                damping *= ON_LOSS;
                self.assemble(frames, &mut system);
            }
        }
        ITERATIONS
    }

    /// The frames after a damped Gauss–Newton step. Uses the system up.
    fn trial(
        &self,
        frames: &[Vec<f64>],
        system: &mut System,
        damping: f64,
    ) -> Option<Vec<Vec<f64>>> {
        let (n, count) = (self.n, frames.len());
        let size = n * n;
        let diagonal = |f: usize, i: usize| f * size + i * n + i;
        let total: f64 = (0..count)
            .map(|f| {
                (0..n)
                    .map(|i| system.band.diagonal[diagonal(f, i)])
                    .sum::<f64>()
            })
            .sum();
        let added = damping * total / (n * count) as f64;
        for f in 0..count {
            for i in 0..n {
                system.band.diagonal[diagonal(f, i)] += added;
            }
        }
        if !system.band.factor() {
            return None;
        }
        let mut x: Vec<f64> = system.gradient.iter().map(|g| -g).collect();
        system.band.solve(&mut x);
        if !system.corners.is_empty() {
            self.close_seam(system, &mut x);
        }
        let mut trial = frames.to_vec();
        for (qpos, step) in trial.iter_mut().zip(x.chunks_exact(n)) {
            self.problem.model.step(qpos, step);
        }
        trial
            .iter()
            .flatten()
            .all(|v| v.is_finite())
            .then_some(trial)
    }

    /// Brings the couplings across the seam into the solution `x` of the band M: with the couplings C, x ← M⁻¹(b − C x)
    /// converges, because M − C is positive definite as M + C is.
    fn close_seam(&self, system: &System, x: &mut Vec<f64>) {
        for _ in 0..SEAM_ROUNDS {
            let mut right: Vec<f64> = system.gradient.iter().map(|g| -g).collect();
            for corner in &system.corners {
                for i in 0..corner.size {
                    for k in 0..corner.size {
                        let value = corner.block[(i, k)];
                        right[corner.row + i] -= value * x[corner.column + k];
                        right[corner.column + k] -= value * x[corner.row + i];
                    }
                }
            }
            system.band.solve(&mut right);
            *x = right;
        }
    }

    /// Fills the system at `frames`; returns the cost.
    fn assemble(&self, frames: &[Vec<f64>], system: &mut System) -> f64 {
        let size = self.n * self.n;
        system.band.clear();
        system.gradient.fill(0.0);
        system.corners.clear();
        let mut pose: Pose = self.problem.model.empty_pose();
        let mut cost = 0.0;
        for (f, qpos) in frames.iter().enumerate() {
            let mut normal = Normal {
                gradient: &mut system.gradient[f * self.n..(f + 1) * self.n],
                matrix: &mut system.band.diagonal[f * size..(f + 1) * size],
            };
            cost += self.problem.frame(f, qpos, &mut pose, &mut normal);
        }
        cost + self.smoothness(frames, system)
    }

    /// For tests against differences.
    #[cfg(test)]
    pub fn cost_and_gradient(&self, frames: &[Vec<f64>]) -> (f64, Vec<f64>) {
        let mut system = self.empty(frames.len());
        let cost = self.assemble(frames, &mut system);
        (cost, system.gradient)
    }

    fn empty(&self, count: usize) -> System {
        System {
            band: Pentadiagonal::new(self.n, count),
            gradient: vec![0.0; self.n * count],
            corners: Vec::new(),
        }
    }

    /// Tangent vectors from every frame to the next; a cycle's last leads to the first, carried on.
    fn steps(&self, frames: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut steps = Vec::with_capacity(frames.len());
        let mut add = |a: &[f64], b: &[f64]| {
            let mut step = vec![0.0; self.n];
            self.problem.model.difference(a, b, &mut step);
            steps.push(step);
        };
        for pair in frames.windows(2) {
            add(&pair[0], &pair[1]);
        }
        if let (Some((turn, shift)), Some(first), Some(last)) =
            (self.cycle, frames.first(), frames.last())
        {
            add(last, &carried(first, &turn, &shift));
        }
        steps
    }

    /// Penalty on accelerations: couples each frame to its two neighbours.
    fn smoothness(&self, frames: &[Vec<f64>], system: &mut System) -> f64 {
        let count = frames.len();
        let steps = self.steps(frames);
        let mut cost = 0.0;
        let rate = self.problem.fps * self.problem.fps;
        let range = if self.cycle.is_some() {
            0..count
        } else {
            1..count.saturating_sub(1)
        };
        for f in range {
            let at = [(f + count - 1) % count, f, (f + 1) % count];
            for part in &self.parts {
                let mut bend = bend(part, &steps[at[0]], &steps[f]);
                self.carry(part, f, count, &steps, &mut bend);
                let square = (part.weight * rate).powi(2);
                cost += 0.5 * square * bend.r.norm_squared();
                for i in 0..3 {
                    let column = bend.by[i].transpose() * square;
                    let gradient = column * bend.r;
                    for d in 0..part.size {
                        system.gradient[at[i] * self.n + part.dof + d] += gradient[d];
                    }
                    for k in i..3 {
                        self.couple(system, part, (at[i], at[k], k - i), &(column * bend.by[k]));
                    }
                }
            }
        }
        cost
    }

    /// At the seam the root's shift is seen from the cycle that frame `f` is in.
    fn carry(
        &self,
        part: &Part,
        f: usize,
        count: usize,
        steps: &[Vec<f64>],
        bend: &mut super::cost::Bend,
    ) {
        let Some((turn, _)) = self.cycle.filter(|_| !part.turns && part.size == 3) else {
            return;
        };
        if f == 0 {
            let last = super::model::vector(&steps[count - 1], part.dof);
            let out = super::model::vector(&steps[0], part.dof);
            bend.r = out - turn.transpose() * last;
            bend.by[0] = turn.transpose();
        }
        if f + 1 == count {
            bend.by[2] = turn;
        }
    }

    /// Adds a block between two frames, `ahead` apart in time.
    fn couple(
        &self,
        system: &mut System,
        part: &Part,
        (a, b, ahead): (usize, usize, usize),
        block: &Matrix3<f64>,
    ) {
        let (n, size) = (self.n, self.n * self.n);
        let blocks = match ahead {
            0 => &mut system.band.diagonal,
            1 if b == a + 1 => &mut system.band.next,
            2 if b == a + 2 => &mut system.band.second,
            _ => {
                let (row, column) = (a * n + part.dof, b * n + part.dof);
                system.corners.push(Corner {
                    row,
                    column,
                    block: *block,
                    size: part.size,
                });
                return;
            }
        };
        for i in 0..part.size {
            for k in 0..part.size {
                blocks[a * size + (part.dof + i) * n + part.dof + k] += block[(i, k)];
            }
        }
    }
}

/// Coordinates moved on by a cycle.
pub(super) fn carried(qpos: &[f64], turn: &Matrix3<f64>, shift: &Vector3<f64>) -> Vec<f64> {
    let mut moved = qpos.to_vec();
    let at = turn * super::model::vector(qpos, 0) + shift;
    moved[..3].copy_from_slice(at.as_slice());
    let turn = nalgebra::Rotation3::from_matrix_unchecked(*turn);
    let turned =
        nalgebra::UnitQuaternion::from_rotation_matrix(&turn) * super::model::quaternion(qpos, 3);
    super::model::put_quaternion(&mut moved, 3, &turned);
    moved
}
