//! The whole trajectory in one least-squares problem: Levenberg–Marquardt over all frames at once, or, where these
//! are many, over one window of them after the other.

use super::banded::{Factor, Pentadiagonal};
use super::cost::{Part, Problem, parts};
use super::rotation::exp;
use super::system::{Step, System, Window};
use crate::motion::Cycle;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Most steps over a window.
const ITERATIONS: usize = 15;
/// Relative gain below which the search ends.
const GAIN: f64 = 1e-3;
/// A frame of which no coordinate changes by more in a step stands still, m or radians.
const STILL: f64 = 3e-4;
/// Longest step of a frame, radians or metres: a longer one can carry a limb over into another way of bending.
const FARTHEST: f64 = 0.5;
/// Time around a frame that still moves in which others are solved with it, s, and most frames of it.
const REACH: f64 = 0.2;
const MOST_REACH: usize = 200;
/// Damping at the start, relative to the mean diagonal.
const DAMPING: f64 = 1e-5;
/// Damping at which a step that gains nothing ends the search. Where limbs meet the ground or leave it in a step, less
/// leaves a search far from its end.
const STIFF: f64 = 10.0;
/// Change of the damping after a step that gained, and after one that did not.
const ON_GAIN: f64 = 0.3;
const ON_LOSS: f64 = 30.0;
/// Rounds in which the seam of a cycle is brought into a step.
const SEAM_ROUNDS: usize = 4;
/// Memory for a window's equations, those of a trial and their factor, bytes: about 1,200 frames of a humanoid.
const MEMORY: usize = 64 << 20;
/// Time by which a window reaches back into the one before, so that those frames see what comes after them, s.
const OVERLAP: f64 = 1.0;
/// Fewest frames in a window, whatever the skeleton.
const SHORTEST_WINDOW: usize = 64;

/// What a search did: its steps, and how far each frame went in the last one that gained.
struct Improved {
    steps: usize,
    moved: Vec<f64>,
}

pub(super) struct Solver<'a> {
    problem: &'a Problem<'a>,
    parts: Vec<Part>,
    /// For a trajectory that repeats.
    cycle: Option<Step>,
    n: usize,
    /// Most frames in a window.
    longest: usize,
}

impl<'a> Solver<'a> {
    pub fn new(problem: &'a Problem<'a>, cycle: Option<&Cycle>) -> Solver<'a> {
        let step = |c: &Cycle| {
            let turn = exp(&(Vector3::z() * c.heading)).to_rotation_matrix();
            (*turn.matrix(), c.translation)
        };
        let n = problem.model.skeleton.nv;
        let frame = 2 * Pentadiagonal::bytes(n) + Factor::bytes(n);
        Solver {
            problem,
            parts: parts(problem.model),
            cycle: cycle.map(step),
            n,
            longest: (MEMORY / frame.max(1)).max(SHORTEST_WINDOW),
        }
    }

    /// Improves `frames` until nothing is gained any more; returns the number of steps taken over a window.
    pub fn run(&self, frames: &mut [Vec<f64>]) -> usize {
        let mut most = 0;
        for window in self.windows(frames.len()) {
            let rough = self.improve(frames, window, |gain, _| gain < GAIN);
            most = most.max(rough.steps);
            self.settle(frames, window, &rough.moved);
        }
        most
    }

    /// Solves again around the frames that are wrong; the others are taken to stand still.
    pub fn mend(&self, frames: &mut [Vec<f64>], is_wrong: impl Fn(usize, &[f64]) -> bool) {
        for window in self.windows(frames.len()) {
            let moved = |f: usize| {
                if is_wrong(f, &frames[f]) {
                    f64::MAX
                } else {
                    0.0
                }
            };
            let moved: Vec<f64> = window.frames().map(moved).collect();
            self.settle(frames, window, &moved);
        }
    }

    /// Goes on where frames still move. The rest of a clip has no say in when a part of it is done, so that a part
    /// becomes the same in a longer or shorter clip.
    fn settle(&self, frames: &mut [Vec<f64>], window: Window, moved: &[f64]) {
        let reach = ((REACH * self.problem.fps).ceil() as usize).clamp(2, MOST_REACH);
        for part in restless(moved, reach) {
            // Both ends of a ring that lacks one frame would be that frame.
            let lacks_one = window.is_ring() && part.len() + 1 == window.count;
            let part = if lacks_one { 0..window.count } else { part };
            let start = (window.start + part.start) % window.total;
            let count = part.len();
            let part = Window {
                start,
                count,
                ..window
            };
            self.improve(frames, part, |_, moved| moved < STILL);
        }
    }

    /// Windows that overlap, in order of time; one that repeats ends with a window over its seam.
    pub fn windows(&self, total: usize) -> impl Iterator<Item = Window> + use<> {
        let repeats = self.cycle.is_some();
        let longest = self.longest;
        let second = (OVERLAP * self.problem.fps).ceil() as usize;
        let overlap = second.clamp(2, longest / 4);
        let window = move |start: usize, count: usize| Window {
            start,
            count,
            total,
            repeats,
        };
        let starts = (0..total.saturating_sub(overlap).max(1)).step_by(longest - overlap);
        let along = starts.map(move |start| window(start, longest.min(total - start)));
        let seam = (repeats && total > longest).then(|| window(total - overlap, 2 * overlap));
        along.chain(seam).filter(|window| window.count > 0)
    }

    /// Levenberg–Marquardt over a window until `done`, told the relative gain of a step and the largest change of a
    /// coordinate.
    fn improve(
        &self,
        frames: &mut [Vec<f64>],
        window: Window,
        done: impl Fn(f64, f64) -> bool,
    ) -> Improved {
        let new = || System::new(self.n, window);
        let (mut system, mut trial) = (new(), new());
        let mut factor = Factor::new(self.n, window.count);
        let mut cost = self.assemble(frames, &mut system);
        let mut damping = DAMPING;
        let mut improved = Improved {
            steps: 0,
            moved: vec![0.0; window.count],
        };
        while improved.steps < ITERATIONS {
            improved.steps += 1;
            let before: Vec<Vec<f64>> = window.frames().map(|f| frames[f].clone()).collect();
            let step = system.solve(&mut factor, damping, SEAM_ROUNDS);
            let moved = step.and_then(|step| self.step(frames, window, &step));
            let tried = moved.map(|moved| (moved, self.assemble(frames, &mut trial)));
            if let Some((moved, trial_cost)) = tried.filter(|(_, trial)| *trial < cost) {
                let gain = (cost - trial_cost) / cost;
                let most = moved.iter().copied().fold(0.0, f64::max);
                cost = trial_cost;
                std::mem::swap(&mut system, &mut trial);
                damping *= ON_GAIN;
                improved.moved = moved;
                if done(gain, most) {
                    break;
                }
                continue;
            }
            for (f, qpos) in window.frames().zip(before) {
                frames[f] = qpos;
            }
            if damping > STIFF {
                break;
            }
            damping *= ON_LOSS;
        }
        improved
    }

    /// Moves the window's frames by a step, and tells how far each went; `None` if it leads to no number.
    fn step(&self, frames: &mut [Vec<f64>], window: Window, step: &[f64]) -> Option<Vec<f64>> {
        let mut moved = Vec::with_capacity(window.count);
        for (f, step) in window.frames().zip(step.chunks_exact(self.n)) {
            let most = step.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            if most > FARTHEST {
                let shorter: Vec<f64> = step.iter().map(|x| x * FARTHEST / most).collect();
                self.problem.model.step(&mut frames[f], &shorter);
            } else {
                self.problem.model.step(&mut frames[f], step);
            }
            moved.push(most);
        }
        let mut coordinates = window.frames().flat_map(|f| &frames[f]);
        coordinates.all(|v| v.is_finite()).then_some(moved)
    }

    fn assemble(&self, frames: &[Vec<f64>], system: &mut System) -> f64 {
        system.assemble(self.problem, &self.parts, self.cycle.as_ref(), frames)
    }

    /// For tests against differences.
    #[cfg(test)]
    pub fn cost_and_gradient(&self, frames: &[Vec<f64>], window: Window) -> (f64, Vec<f64>) {
        let mut system = System::new(self.n, window);
        let cost = self.assemble(frames, &mut system);
        (cost, system.gradient)
    }

    #[cfg(test)]
    pub fn with_windows_of(mut self, longest: usize) -> Self {
        self.longest = longest;
        self
    }
}

/// Runs of frames that moved, and those within `reach` of them.
fn restless(moved: &[f64], reach: usize) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (f, _) in moved.iter().enumerate().filter(|(_, m)| **m > STILL) {
        let (from, to) = (f.saturating_sub(reach), (f + reach + 1).min(moved.len()));
        match runs.last_mut() {
            Some(run) if from <= run.end => run.end = to,
            _ => runs.push(from..to),
        }
    }
    runs
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
