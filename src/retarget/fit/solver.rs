//! The solver: the whole trajectory in one least-squares problem.
//!
//! Levenberg and Marquardt's method over all frames at once or, where these are many, over one window of them after the
//! other. A rough search over all frames comes first. Then the frames that still move are solved for again, with those
//! around them and without the rest, until they are still.

use super::banded::{Factor, Pentadiagonal};
use super::cost::LeastSquares;
use super::smoothness::{DofGroup, dof_groups};
use super::system::System;
use super::window::Window;
use crate::motion::Cycle;
use crate::retarget::qpos::CycleStep;
use std::ops::Range;

/// Most steps over a window. Chosen, to bound the time.
const ITERATIONS: usize = 15;
/// Relative gain of a step below which the rough search ends. Chosen.
const GAIN: f64 = 1e-3;
/// Change of a coordinate in a step below which its frame is still, metres or radians. Chosen: a third of a millimetre.
const STILL: f64 = 3e-4;
/// Longest change of a coordinate in a step, radians or metres. Chosen: a longer one can carry a limb over into another way
/// of bending.
const FARTHEST: f64 = 0.5;
/// Time around a frame that still moves in which others are solved for with it, s. Chosen: beyond it hardly anything is felt.
const REACH: f64 = 0.2;
/// The same at most, frames.
const MOST_REACH: usize = 200;
/// Damping at the start, relative to the mean diagonal. Chosen small: the guess is near.
const DAMPING: f64 = 1e-5;
/// Damping above which a step that gains nothing ends the search. Where limbs meet the ground or leave it within a step, a
/// search that ended at 0.1 was left far from its end (a knee below the ground in poser's spinning clip).
const STIFF: f64 = 10.0;
/// Factor of the damping after a step that gained …
const ON_GAIN: f64 = 0.3;
/// … and after one that didn't. With 10 instead of 30 that knee jumps by 9.7 cm instead of 5.3.
const ON_LOSS: f64 = 30.0;
/// Rounds in which the seam of a cycle is brought into a step. Chosen: what is left is brought in by the next step.
const SEAM_ROUNDS: usize = 4;
/// Memory for a window's equations, those of a trial, and their factor, bytes: about 1,200 frames of a humanoid. Chosen.
const MEMORY: usize = 64 << 20;
/// Time by which a window reaches back into the one before, so that those frames see what comes after them, s. After a
/// second the solution over windows is within 1e-3 of the one over all frames (a test).
const OVERLAP: f64 = 1.0;
/// Fewest frames in a window, whatever the skeleton.
const SHORTEST_WINDOW: usize = 64;

/// What a search did.
struct Search {
    /// How many steps it tried.
    steps: usize,
    /// The largest change of each frame's coordinates in the last step that gained.
    moved: Vec<f64>,
}

/// Solves a least-squares problem over the frames of a trajectory.
pub(in crate::retarget) struct Solver<'a> {
    problem: &'a LeastSquares<'a>,
    groups: Vec<DofGroup>,
    /// For a trajectory that repeats.
    cycle: Option<CycleStep>,
    /// Degrees of freedom.
    n: usize,
    /// Most frames in a window.
    longest: usize,
}

impl<'a> Solver<'a> {
    /// A solver for a trajectory that repeats by `cycle`, or ends.
    pub fn new(problem: &'a LeastSquares<'a>, cycle: Option<&Cycle>) -> Solver<'a> {
        let n = problem.model.skeleton.nv;
        // A search holds the equations, those of a trial step, and their factor.
        let frame = 2 * Pentadiagonal::bytes(n) + Factor::bytes(n);
        Solver {
            problem,
            groups: dof_groups(problem.model),
            cycle: cycle.map(CycleStep::of),
            n,
            longest: (MEMORY / frame.max(1)).max(SHORTEST_WINDOW),
        }
    }

    /// Improves `frames` until hardly anything is gained any more; returns the most steps that a window took. `progress` is
    /// told which share of the windows is done.
    pub fn run(&self, frames: &mut [Vec<f64>], progress: impl Fn(f64)) -> usize {
        let mut most = 0;
        let windows: Vec<Window> = self.windows(frames.len()).collect();
        for (done, window) in windows.iter().copied().enumerate() {
            progress(done as f64 / windows.len() as f64);
            // The whole window until it gains little, and then its parts until each is still.
            let rough = self.search(frames, window, |gain, _| gain < GAIN);
            most = most.max(rough.steps);
            self.settle(frames, window, &rough.moved);
        }
        most
    }

    /// Solves again around the frames that are wrong, and leaves the others as they are.
    pub fn repair(&self, frames: &mut [Vec<f64>], is_wrong: impl Fn(usize, &[f64]) -> bool) {
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

    /// Goes on around frames that moved in the last step. When a part of a clip is done doesn't depend on the rest of it, so
    /// that the part becomes the same in a longer or shorter clip.
    fn settle(&self, frames: &mut [Vec<f64>], window: Window, moved: &[f64]) {
        // At least two frames, which accelerations couple to.
        let reach = ((REACH * self.problem.fps).ceil() as usize).clamp(2, MOST_REACH);
        for part in moving(moved, reach) {
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
            self.search(frames, part, |_, moved| moved < STILL);
        }
    }

    /// Windows that overlap, in order of time; the last one of a trajectory that repeats is over its seam.
    pub fn windows(&self, total: usize) -> impl Iterator<Item = Window> + use<> {
        let repeats = self.cycle.is_some();
        let longest = self.longest;
        let second = (OVERLAP * self.problem.fps).ceil() as usize;
        // At most a quarter of a window, or windows of large skeletons would hardly get on.
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

    /// Levenberg and Marquardt's method over a window until `done`, which gets the relative gain of a step and the largest
    /// change of a coordinate in it.
    fn search(
        &self,
        frames: &mut [Vec<f64>],
        window: Window,
        done: impl Fn(f64, f64) -> bool,
    ) -> Search {
        let new = || System::new(self.n, window);
        let (mut system, mut trial) = (new(), new());
        let mut factor = Factor::new(self.n, window.count);
        let mut cost = self.assemble(frames, &mut system);
        // Damping falls after steps that gain, towards Gauss and Newton's step, which is best near the solution; it rises
        // after steps that don't, towards short steps down the gradient. A rejected step keeps its equations.
        let mut damping = DAMPING;
        let mut search = Search {
            steps: 0,
            moved: vec![0.0; window.count],
        };
        while search.steps < ITERATIONS {
            search.steps += 1;
            let before: Vec<Vec<f64>> = window.frames().map(|f| frames[f].clone()).collect();
            // A step that can't be solved for, that isn't finite, or that doesn't lower the cost is taken back.
            let step = system.solve(&mut factor, damping, SEAM_ROUNDS);
            let moved = step.and_then(|step| self.step(frames, window, &step));
            let tried = moved.map(|moved| (moved, self.assemble(frames, &mut trial)));
            if let Some((moved, trial_cost)) = tried.filter(|(_, trial)| *trial < cost) {
                let gain = (cost - trial_cost) / cost;
                let most = moved.iter().copied().fold(0.0, f64::max);
                cost = trial_cost;
                std::mem::swap(&mut system, &mut trial);
                damping *= ON_GAIN;
                search.moved = moved;
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
        search
    }

    /// Moves the window's frames by a step, each no farther than [`FARTHEST`]; returns the largest change that each was to
    /// make, or `None` if a coordinate isn't finite after it.
    fn step(&self, frames: &mut [Vec<f64>], window: Window, step: &[f64]) -> Option<Vec<f64>> {
        let mut moved = Vec::with_capacity(window.count);
        for (f, step) in window.frames().zip(step.chunks_exact(self.n)) {
            let most = step.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            // A long step is shortened frame by frame: its direction counts, and neighbours follow in the next step.
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

    /// Linearises the cost.
    fn assemble(&self, frames: &[Vec<f64>], system: &mut System) -> f64 {
        system.assemble(self.problem, &self.groups, self.cycle.as_ref(), frames)
    }

    /// For tests against differences.
    #[cfg(test)]
    pub fn cost_and_gradient(&self, frames: &[Vec<f64>], window: Window) -> (f64, Vec<f64>) {
        let mut system = System::new(self.n, window);
        let cost = self.assemble(frames, &mut system);
        (cost, system.gradient)
    }

    /// For tests of windows.
    #[cfg(test)]
    pub fn with_windows_of(mut self, longest: usize) -> Self {
        self.longest = longest;
        self
    }
}

/// Runs of frames that moved, with those within `reach` of them.
fn moving(moved: &[f64], reach: usize) -> Vec<Range<usize>> {
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
