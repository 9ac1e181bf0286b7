//! The equations of a window of frames: what one Gauss–Newton step over all of them needs.

use super::banded::{Factor, Pentadiagonal};
use super::cost::{LeastSquares, NormalEquations};
use super::smoothness::{DofGroup, SecondDifference, second_difference};
use super::weight;
use super::window::Window;
use crate::retarget::qpos::CycleStep;
use nalgebra::Matrix3;

/// A coupling across the seam of a cycle, between one of the last two frames and one of the first two: a corner of the
/// matrix, far from its band.
struct Corner {
    /// Index of the first unknown of the block's rows.
    row: usize,
    /// Index of the first unknown of its columns.
    column: usize,
    block: Matrix3<f64>,
    /// How many rows and columns of the block count.
    size: usize,
}

/// Gradient and Gauss–Newton matrix of the cost, by the frames of a window.
///
/// An acceleration couples each frame to the next two, so the matrix is a band of blocks, and where the window is a whole
/// cycle, some corners.
pub(super) struct System {
    /// The frames.
    window: Window,
    /// The matrix without its corners.
    band: Pentadiagonal,
    /// `gradient[place * n + dof]`.
    pub gradient: Vec<f64>,
    /// Degrees of freedom.
    n: usize,
    corners: Vec<Corner>,
}

impl System {
    /// Memory for the equations of a window of a skeleton with `n` degrees of freedom.
    pub fn new(n: usize, window: Window) -> System {
        System {
            window,
            band: Pentadiagonal::new(n, window.count),
            gradient: vec![0.0; n * window.count],
            n,
            corners: Vec::new(),
        }
    }

    /// Linearises the cost at `frames`; returns that part of it that depends on the window.
    pub fn assemble(
        &mut self,
        problem: &LeastSquares,
        groups: &[DofGroup],
        cycle: Option<&CycleStep>,
        frames: &[Vec<f64>],
    ) -> f64 {
        let size = self.n * self.n;
        self.band.clear();
        self.gradient.fill(0.0);
        self.corners.clear();
        // What depends on one frame alone goes into its own block …
        let mut pose = problem.model.empty_pose();
        let mut cost = 0.0;
        for (place, f) in self.window.frames().enumerate() {
            let mut normal = NormalEquations {
                gradient: &mut self.gradient[place * self.n..(place + 1) * self.n],
                matrix: &mut self.band.diagonal[place * size..(place + 1) * size],
            };
            cost += problem.frame(f, &frames[f], &mut pose, &mut normal);
        }
        // … and what couples frames into the blocks beside it as well.
        cost + self.smoothness(problem, groups, cycle, frames)
    }

    /// The step of Levenberg and Marquardt: `damping` times the mean of the diagonal is added to the whole diagonal. `None`
    /// where the equations aren't positive definite.
    pub fn solve(&self, factor: &mut Factor, damping: f64, seam_rounds: usize) -> Option<Vec<f64>> {
        // Relative to the mean stiffness, so that the damping means the same for every skeleton and weight.
        if !factor.set(&self.band, self.band.mean_times(damping)) {
            return None;
        }
        let mut x: Vec<f64> = self.gradient.iter().map(|g| -g).collect();
        factor.solve(&mut x);
        if !self.corners.is_empty() {
            self.close_seam(factor, &mut x, seam_rounds);
        }
        Some(x)
    }

    /// Brings the corners C into the solution `x` of the band M by rounds of x ← M⁻¹(b − C x). They converge because M − C
    /// is positive definite as M + C is. Each change of x is −M⁻¹C times the one before it, and begins at the seam's frames
    /// alone.
    fn close_seam(&self, factor: &Factor, x: &mut [f64], rounds: usize) {
        let mut change = x.to_vec();
        for _ in 0..rounds {
            let mut right = vec![0.0; x.len()];
            // The matrix is symmetric: each corner stands for itself and its transpose.
            for corner in &self.corners {
                for i in 0..corner.size {
                    for k in 0..corner.size {
                        let value = corner.block[(i, k)];
                        right[corner.row + i] -= value * change[corner.column + k];
                        right[corner.column + k] -= value * change[corner.row + i];
                    }
                }
            }
            factor.solve_ends(&mut right);
            x.iter_mut().zip(&right).for_each(|(x, by)| *x += by);
            change = right;
        }
    }

    /// Adds the costs of accelerations and of hinges' speeds; returns their sum.
    fn smoothness(
        &mut self,
        problem: &LeastSquares,
        groups: &[DofGroup],
        cycle: Option<&CycleStep>,
        frames: &[Vec<f64>],
    ) -> f64 {
        let window = self.window;
        let count = window.count as i64;
        // Accelerations of the frames beside the window have frames of the window in them. A ring has no frames beside it.
        let middles = if window.is_ring() {
            0..count
        } else {
            -1..count + 1
        };
        let step = |place: i64| difference(problem, cycle, frames, &window, place);
        // Second differences times the squared rate are accelerations, so weights mean the same at every frame rate.
        let rate = problem.fps * problem.fps;
        let mut cost = 0.0;
        let mut into = step(middles.start - 1);
        for place in middles {
            let out = step(place);
            if let (Some(out), Some(f)) = (&out, window.frame(place)) {
                cost += self.hinge_speeds(problem, out, f, place);
            }
            if let (Some(into), Some(out), Some(f)) = (&into, &out, window.frame(place)) {
                let at = [place - 1, place, place + 1].map(|p| window.solved(p));
                for group in groups {
                    let bend = second_difference(group, into, out);
                    let bend = bend.over_seam(group, cycle, (f, window.total), into, out);
                    cost += self.add(group, (group.weight * rate).powi(2), at, &bend);
                }
            }
            into = out;
        }
        cost
    }

    /// Adds the cost of hinges that turn faster than they may in the step `out` from frame `f`, which is at `place`, to the
    /// next.
    fn hinge_speeds(&mut self, problem: &LeastSquares, out: &[f64], f: usize, place: i64) -> f64 {
        let at = [place, place + 1].map(|p| self.window.solved(p));
        let square = (weight::HINGE_SPEED * problem.fps).powi(2);
        let mut cost = 0.0;
        for (dof, most) in problem.goals.speeds.after(f) {
            // The residual is the excess, whose derivative is −1 by this frame's coordinate and 1 by the next one's.
            let excess = out[dof] - out[dof].clamp(-most, most);
            if excess == 0.0 {
                continue;
            }
            cost += 0.5 * square * excess * excess;
            for (place, sign) in at.into_iter().zip([-1.0, 1.0]) {
                let Some(place) = place else { continue };
                self.gradient[place * self.n + dof] += sign * square * excess;
                self.couple((dof, 1), (place, place, 0), &Matrix3::from_element(square));
            }
            if let [Some(a), Some(b)] = at {
                self.couple((dof, 1), (a, b, 1), &Matrix3::from_element(-square));
            }
        }
        cost
    }

    /// Adds the cost of a second difference between three frames, as far as they are solved for; `square` is the squared
    /// weight.
    fn add(
        &mut self,
        group: &DofGroup,
        square: f64,
        at: [Option<usize>; 3],
        bend: &SecondDifference,
    ) -> f64 {
        for i in 0..3 {
            // Frames beside the window stay, and have no equations.
            let Some(a) = at[i] else { continue };
            // Jᵀ w² r into the gradient, Jᵀ w² J into the matrix; only from earlier to later frames, for it is symmetric.
            let column = bend.by[i].transpose() * square;
            let gradient = column * bend.r;
            for d in 0..group.size {
                self.gradient[a * self.n + group.dof + d] += gradient[d];
            }
            for (k, b) in at.iter().enumerate().skip(i) {
                if let Some(b) = *b {
                    let block = column * bend.by[k];
                    self.couple((group.dof, group.size), (a, b, k - i), &block);
                }
            }
        }
        0.5 * square * bend.r.norm_squared()
    }

    /// Adds a block between the `size` degrees of freedom from `dof` on of the frames at places `a` and `b`, which are
    /// `ahead` apart in time.
    fn couple(
        &mut self,
        (dof, size): (usize, usize),
        (a, b, ahead): (usize, usize, usize),
        block: &Matrix3<f64>,
    ) {
        let n = self.n;
        // Over the seam of a ring the later frame is in an earlier place.
        if ahead > 0 && b != a + ahead {
            self.corners.push(Corner {
                row: a * n + dof,
                column: b * n + dof,
                block: *block,
                size,
            });
            return;
        }
        for (i, k) in (0..size).flat_map(|i| (0..size).map(move |k| (i, k))) {
            let (row, column) = (dof + i, dof + k);
            match ahead {
                0 => self.band.diagonal[a * n * n + row * n + column] += block[(i, k)],
                _ => self.band.couple(a, ahead, (row, column), block[(i, k)]),
            }
        }
    }
}

/// Tangent vector from the frame at a place to the next; the last of a cycle leads to the first, carried on.
fn difference(
    problem: &LeastSquares,
    cycle: Option<&CycleStep>,
    frames: &[Vec<f64>],
    window: &Window,
    place: i64,
) -> Option<Vec<f64>> {
    let (a, b) = (window.frame(place)?, window.frame(place + 1)?);
    let mut step = vec![0.0; problem.model.skeleton.nv];
    match cycle {
        Some(cycle) if b <= a => {
            let next = cycle.carry(&frames[b]);
            problem.model.difference(&frames[a], &next, &mut step);
        }
        _ => problem.model.difference(&frames[a], &frames[b], &mut step),
    }
    Some(step)
}
