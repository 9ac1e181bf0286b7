//! The equations of a window of frames: what one Gauss–Newton step over all of them needs.

use super::banded::{Factor, Pentadiagonal};
use super::cost::{Bend, Normal, Part, Problem, bend, weight};
use super::model::vector;
use nalgebra::{Matrix3, Vector3};

/// Turn from a cycle to the next, and its shift.
pub(super) type Step = (Matrix3<f64>, Vector3<f64>);

/// Frames that are solved together: `count` from `start` on, in a trajectory of `total`. One that repeats may pass
/// over its end. The frames around the window stay as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    pub start: usize,
    pub count: usize,
    pub total: usize,
    pub repeats: bool,
}

impl Window {
    /// The frame at a place in the window; places before its start and after its end are the frames around it.
    pub fn frame(&self, place: i64) -> Option<usize> {
        let (at, total) = (self.start as i64 + place, self.total as i64);
        let inside = (0..total).contains(&at) || self.repeats;
        inside.then(|| at.rem_euclid(total.max(1)) as usize)
    }

    pub fn frames(self) -> impl Iterator<Item = usize> {
        (0..self.count as i64).filter_map(move |place| self.frame(place))
    }

    /// Whether every frame of a trajectory that repeats is in it, so that its end is beside its start.
    pub fn is_ring(&self) -> bool {
        self.repeats && self.count == self.total
    }

    /// The place in the window that is solved for; `None` for a frame that stays.
    fn inside(&self, place: i64) -> Option<usize> {
        let count = self.count as i64;
        match self.is_ring() {
            true => Some(place.rem_euclid(count) as usize),
            false => (0..count).contains(&place).then_some(place as usize),
        }
    }
}

/// A coupling across the seam of a cycle: rows of one frame, columns of another.
struct Corner {
    row: usize,
    column: usize,
    block: Matrix3<f64>,
    size: usize,
}

/// Derivatives of the cost by the frames of a window.
pub(super) struct System {
    pub window: Window,
    pub band: Pentadiagonal,
    pub gradient: Vec<f64>,
    n: usize,
    corners: Vec<Corner>,
}

impl System {
    pub fn new(n: usize, window: Window) -> System {
        System {
            window,
            band: Pentadiagonal::new(n, window.count),
            gradient: vec![0.0; n * window.count],
            n,
            corners: Vec::new(),
        }
    }

    /// Fills the system at `frames`; returns the cost that depends on the window.
    pub fn assemble(
        &mut self,
        problem: &Problem,
        parts: &[Part],
        cycle: Option<&Step>,
        frames: &[Vec<f64>],
    ) -> f64 {
        let size = self.n * self.n;
        self.band.clear();
        self.gradient.fill(0.0);
        self.corners.clear();
        let mut pose = problem.model.empty_pose();
        let mut cost = 0.0;
        for (place, f) in self.window.frames().enumerate() {
            let mut normal = Normal {
                gradient: &mut self.gradient[place * self.n..(place + 1) * self.n],
                matrix: &mut self.band.diagonal[place * size..(place + 1) * size],
            };
            cost += problem.frame(f, &frames[f], &mut pose, &mut normal);
        }
        cost + self.smoothness(problem, parts, cycle, frames)
    }

    /// The Gauss–Newton step, where every coordinate is held by `damping` times the mean stiffness besides; `None` where
    /// the equations are not positive definite.
    pub fn solve(&self, factor: &mut Factor, damping: f64, seam_rounds: usize) -> Option<Vec<f64>> {
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

    /// Brings the couplings across the seam into the solution `x` of the band M: with the couplings C, x ← M⁻¹(b − C x)
    /// converges, because M − C is positive definite as M + C is. Each change of x is −M⁻¹C times the one before it.
    fn close_seam(&self, factor: &Factor, x: &mut [f64], rounds: usize) {
        let mut change = x.to_vec();
        for _ in 0..rounds {
            let mut right = vec![0.0; x.len()];
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

    /// Penalty on accelerations: couples each frame to its two neighbours.
    fn smoothness(
        &mut self,
        problem: &Problem,
        parts: &[Part],
        cycle: Option<&Step>,
        frames: &[Vec<f64>],
    ) -> f64 {
        let window = self.window;
        let count = window.count as i64;
        let middles = if window.is_ring() {
            0..count
        } else {
            -1..count + 1
        };
        let step = |place: i64| difference(problem, cycle, frames, &window, place);
        let rate = problem.fps * problem.fps;
        let mut cost = 0.0;
        let mut into = step(middles.start - 1);
        for place in middles {
            let out = step(place);
            if let (Some(out), Some(f)) = (&out, window.frame(place)) {
                cost += self.paces(problem, out, f, place);
            }
            if let (Some(into), Some(out), Some(f)) = (&into, &out, window.frame(place)) {
                let at = [place - 1, place, place + 1].map(|p| window.inside(p));
                for part in parts {
                    let mut bend = bend(part, into, out);
                    carry(&mut bend, part, cycle, (f, window.total), into, out);
                    cost += self.add(part, (part.weight * rate).powi(2), at, &bend);
                }
            }
            into = out;
        }
        cost
    }

    /// Penalty on hinges that turn faster than they may in the step `out` of frame `f`, which stands at `place`.
    fn paces(&mut self, problem: &Problem, out: &[f64], f: usize, place: i64) -> f64 {
        let at = [place, place + 1].map(|p| self.window.inside(p));
        let square = (weight::PACE * problem.fps).powi(2);
        let mut cost = 0.0;
        for (dof, most) in problem.goals.paces.of(f) {
            let excess = out[dof] - out[dof].clamp(-most, most);
            if excess == 0.0 {
                continue;
            }
            cost += 0.5 * square * excess * excess;
            for (place, sign) in at.into_iter().zip([-1.0, 1.0]) {
                let Some(place) = place else { continue };
                self.gradient[place * self.n + dof] += sign * square * excess;
                self.couple(
                    &hinge(dof),
                    (place, place, 0),
                    &Matrix3::from_element(square),
                );
            }
            if let [Some(a), Some(b)] = at {
                self.couple(&hinge(dof), (a, b, 1), &Matrix3::from_element(-square));
            }
        }
        cost
    }

    /// Adds a second difference between three frames, as far as they are solved for.
    fn add(&mut self, part: &Part, square: f64, at: [Option<usize>; 3], bend: &Bend) -> f64 {
        for i in 0..3 {
            let Some(a) = at[i] else { continue };
            let column = bend.by[i].transpose() * square;
            let gradient = column * bend.r;
            for d in 0..part.size {
                self.gradient[a * self.n + part.dof + d] += gradient[d];
            }
            for (k, b) in at.iter().enumerate().skip(i) {
                if let Some(b) = *b {
                    self.couple(part, (a, b, k - i), &(column * bend.by[k]));
                }
            }
        }
        0.5 * square * bend.r.norm_squared()
    }

    /// Adds a block between two frames, `ahead` apart in time.
    fn couple(&mut self, part: &Part, (a, b, ahead): (usize, usize, usize), block: &Matrix3<f64>) {
        let (n, size) = (self.n, self.n * self.n);
        if ahead > 0 && b != a + ahead {
            self.corners.push(Corner {
                row: a * n + part.dof,
                column: b * n + part.dof,
                block: *block,
                size: part.size,
            });
            return;
        }
        for (i, k) in (0..part.size).flat_map(|i| (0..part.size).map(move |k| (i, k))) {
            let (row, column) = (part.dof + i, part.dof + k);
            match ahead {
                0 => self.band.diagonal[a * size + row * n + column] += block[(i, k)],
                _ => self.band.couple(a, ahead, (row, column), block[(i, k)]),
            }
        }
    }
}

/// The part that a hinge is.
fn hinge(dof: usize) -> Part {
    Part {
        dof,
        size: 1,
        turns: false,
        weight: 0.0,
    }
}

/// Tangent vector from the frame at a place to the next; the last of a cycle leads to the first, carried on.
fn difference(
    problem: &Problem,
    cycle: Option<&Step>,
    frames: &[Vec<f64>],
    window: &Window,
    place: i64,
) -> Option<Vec<f64>> {
    let (a, b) = (window.frame(place)?, window.frame(place + 1)?);
    let mut step = vec![0.0; problem.model.skeleton.nv];
    match cycle {
        Some((turn, shift)) if b <= a => {
            let next = super::solve::carried(&frames[b], turn, shift);
            problem.model.difference(&frames[a], &next, &mut step);
        }
        _ => problem.model.difference(&frames[a], &frames[b], &mut step),
    }
    Some(step)
}

/// At the seam the root's shift is seen from the cycle that frame `f` is in.
fn carry(
    bend: &mut Bend,
    part: &Part,
    cycle: Option<&Step>,
    (f, total): (usize, usize),
    into: &[f64],
    out: &[f64],
) {
    let Some((turn, _)) = cycle.filter(|_| !part.turns && part.size == 3) else {
        return;
    };
    if f == 0 {
        bend.r = vector(out, part.dof) - turn.transpose() * vector(into, part.dof);
        bend.by[0] = turn.transpose();
    }
    if f + 1 == total {
        bend.by[2] = *turn;
    }
}
