//! The root wrench residual: the part of a motion that its contacts can't explain.
//!
//! By Newton's and Euler's laws about the centre of mass, the ground has to supply the force F = m (c̈ − g) and the moment
//! τ = dL/dt. Contacts supply forces inside friction cones, at the points on which bodies stand. What is left is a force
//! and a moment that no contact can supply (residual forces of Yuan and Kitani, NeurIPS 2020; root residuals of OpenSim's
//! RRA).

use super::nnls;
use super::timeline::Timeline;
use crate::skeleton::{GRAVITY, Skeleton};
use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Vector3, Vector6};
use std::f64::consts::TAU;

/// Half width of the window in which accelerations are fitted, s. Chosen: seven frames at 60 Hz. Second differences of
/// single frames are mostly noise, and a longer window would smooth landings away.
const SMOOTHING: f64 = 0.05;
/// Height above a body's lowest point up to which its points can carry load, leg lengths. Chosen: 2.4 cm with legs of 0.8
/// m.
const SOLE: f64 = 0.03;
/// Edges of the pyramid that stands for a friction cone. Between two edges it has 1 − cos(π/8) = 8 % less friction than the
/// cone; a pyramid of four edges would have 29 % less.
const EDGES: usize = 8;
/// How much the size of loads counts beside what they explain. Its square is a ten-thousandth, and so is its effect on
/// their sum.
const EVENNESS: f64 = 0.01;

/// A force (N) and a moment about the centre of mass (N·m), world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wrench {
    pub(crate) force: Vector3<f64>,
    pub(crate) moment: Vector3<f64>,
}

/// A force with which the ground carries a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Load {
    /// Index of the body.
    pub(crate) body: usize,
    /// Where the force acts, world, metres.
    pub(crate) point: Vector3<f64>,
    /// The force, world axes, N.
    pub(crate) force: Vector3<f64>,
}

/// Which bodies stand on the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing<'a> {
    /// The contact bodies.
    pub(crate) bodies: &'a [usize],
    /// `contact[f][c]`: whether `bodies[c]` stands at frame `f`.
    pub(crate) contact: &'a [Vec<bool>],
}

/// The force and the moment that the world has to supply besides gravity, in every frame.
///
/// Derivatives are those of a quadratic fitted by least squares to the frames within [`SMOOTHING`] (Savitzky and
/// Golay, Analytical Chemistry 36, 1964).
pub(crate) fn required(
    com: &[Vector3<f64>],
    angular_momentum: &[Vector3<f64>],
    mass: f64,
    fps: f64,
    timeline: &Timeline,
) -> Vec<Wrench> {
    let offset = |n| timeline.cycle.offset(n);
    (0..com.len())
        .map(|f| {
            let position = |n, at: usize| (offset(n) * nalgebra::Point3::from(com[at])).coords;
            let spin = |n, at: usize| offset(n).rotation * angular_momentum[at];
            let (_, acceleration) = derivatives(f, fps, timeline, position);
            let (spin_rate, _) = derivatives(f, fps, timeline, spin);
            Wrench {
                force: (acceleration + Vector3::z() * GRAVITY) * mass,
                moment: spin_rate,
            }
        })
        .collect()
}

/// Frames on each side of a frame in the window in which its accelerations are fitted.
pub(crate) fn reach(fps: f64) -> usize {
    (SMOOTHING * fps).round().max(1.0) as usize
}

/// First and second time derivative of `value` at `frame`, by the quadratic fitted to its window; zeros where the window
/// has too few frames for one. `value` takes the number of the cycle and the frame.
pub(crate) fn derivatives(
    frame: usize,
    fps: f64,
    timeline: &Timeline,
    value: impl Fn(i64, usize) -> Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    // The normal equations of the fit, with time in frames: well scaled at any rate.
    let mut normal = Matrix3::zeros();
    let mut moments = Matrix3::zeros();
    for index in timeline.window(frame, reach(fps)) {
        let Some((cycle, at)) = timeline.locate(index) else {
            continue;
        };
        let t = index as f64 - frame as f64;
        let powers = Vector3::new(1.0, t, t * t);
        normal += powers * powers.transpose();
        moments += powers * value(cycle, at).transpose();
    }
    match normal.try_inverse() {
        Some(inverse) => {
            let fit = inverse * moments;
            let row = |i: usize| fit.row(i).transpose();
            (row(1) * fps, row(2) * 2.0 * fps * fps)
        }
        None => (Vector3::zeros(), Vector3::zeros()),
    }
}

/// A motion over the ground that has to carry it.
pub(crate) struct Support<'a> {
    /// The skeleton that moves.
    pub(crate) skeleton: &'a Skeleton,
    /// Its [`Skeleton::leg_length`], metres.
    pub(crate) leg: f64,
    /// `bodies[f][b]`: world pose of each body.
    pub(crate) bodies: &'a [Vec<Isometry3<f64>>],
    /// `com[f]`: centre of mass, world, metres.
    pub(crate) com: &'a [Vector3<f64>],
    /// `required[f]`: what [`required`] gives.
    pub(crate) required: &'a [Wrench],
    /// Which bodies stand in which frames.
    pub(crate) standing: Standing<'a>,
    /// Frames per second.
    pub(crate) fps: f64,
    /// Which frame follows which.
    pub(crate) timeline: &'a Timeline,
}

impl Support<'_> {
    /// Force (N) and moment about the root body's origin (N·m) that the ground can't supply in frame `f`, world axes.
    pub(crate) fn residual(&self, f: usize) -> Vector6<f64> {
        let rays = self.rays(f);
        let (a, b) = self.equations(f, &rays);
        let left = &b - &a * nnls::solve(&a, &b);
        // A wrench at the centre of mass, moved to the root: the same force, and its arm's moment added.
        let force = Vector3::new(left[0], left[1], left[2]);
        let moment = Vector3::new(left[3], left[4], left[5]) * self.length();
        let arm = self.com[f] - self.bodies[f][0].translation.vector;
        let moment = moment + arm.cross(&force);
        Vector6::from_iterator(force.iter().chain(moment.iter()).copied())
    }

    /// What the ground supplies in frame `f`. Many loads explain a motion equally well; these are spread most evenly, so
    /// that feet don't push against each other.
    pub(crate) fn loads(&self, f: usize) -> Vec<Load> {
        let rays = self.rays(f);
        let (a, b) = self.equations(f, &rays);
        let weights = nnls::solve_evenly(&a, &b, EVENNESS);
        let bearing = rays.iter().zip(&weights).filter(|(_, w)| **w > 0.0);
        let load = |(ray, weight): (&Load, &f64)| Load {
            force: ray.force * *weight,
            ..*ray
        };
        bearing.map(load).collect()
    }

    /// The forces along the edges of all friction pyramids, each with 1 N upwards. Contacts supply sums of them with
    /// factors that aren't negative.
    ///
    /// A body counts as standing if it stands anywhere in the window in which `required` was fitted, because the
    /// fitted acceleration is that of the whole window.
    fn rays(&self, f: usize) -> Vec<Load> {
        let leg = self.leg;
        let near = |c: usize| {
            let window = self.timeline.window(f, reach(self.fps));
            let mut frames = window.filter_map(|i| self.timeline.locate(i));
            frames.any(|(_, at)| self.standing.contact[at][c])
        };
        let tracked = self.standing.bodies;
        let feet = tracked.iter().enumerate().filter(|(c, _)| near(*c));
        let feet = feet.map(|(_, body)| *body);
        let loaded = feet.chain(lying(self.skeleton, &self.bodies[f], tracked, leg));
        loaded
            .flat_map(|body| friction_rays(self.skeleton, &self.bodies[f], body, leg))
            .collect()
    }

    /// As in [`wrench_equations`].
    fn equations(&self, f: usize, rays: &[Load]) -> (DMatrix<f64>, DVector<f64>) {
        wrench_equations(rays, &self.required[f], &self.com[f], self.length())
    }

    /// What moments are divided by, metres; a skeleton without legs mustn't make it zero.
    fn length(&self) -> f64 {
        self.leg.max(1e-3)
    }
}

/// The wrenches of `loads` about the centre of mass as columns, and the required wrench. Moments are divided by a leg's length,
/// metres, so that forces and moments are in newtons both and errors in them are comparable.
pub(super) fn wrench_equations(
    loads: &[Load],
    required: &Wrench,
    com: &Vector3<f64>,
    leg: f64,
) -> (DMatrix<f64>, DVector<f64>) {
    let column = |force: &Vector3<f64>, moment: Vector3<f64>| {
        let moment = moment / leg;
        Vector6::from_iterator(force.iter().chain(moment.iter()).copied())
    };
    let target = column(&required.force, required.moment);
    let columns: Vec<Vector6<f64>> = loads
        .iter()
        .map(|load| column(&load.force, (load.point - com).cross(&load.force)))
        .collect();
    let a = DMatrix::from_fn(6, columns.len(), |row, j| columns[j][row]);
    (a, DVector::from_column_slice(target.as_slice()))
}

/// Bodies that touch the ground but have no contact track: they carry a character that sits, kneels or lies.
/// A motion without any contact bodies is one without a ground.
fn lying<'a>(
    skeleton: &'a Skeleton,
    poses: &'a [Isometry3<f64>],
    tracked: &'a [usize],
    leg_length: f64,
) -> impl Iterator<Item = usize> + 'a {
    let others = (0..poses.len()).filter(|body| !tracked.contains(body) && !tracked.is_empty());
    let has_shape = |body: &usize| !skeleton.bodies[*body].shapes.is_empty();
    others
        .filter(has_shape)
        .filter(move |body| skeleton.lowest_point_of(poses, &[*body]) <= SOLE * leg_length)
}

/// The edge forces of the friction pyramids under one body, each with 1 N upwards.
pub(super) fn friction_rays(
    skeleton: &Skeleton,
    poses: &[Isometry3<f64>],
    body: usize,
    leg_length: f64,
) -> Vec<Load> {
    let friction = skeleton.bodies[body].friction;
    let lowest = skeleton.lowest_point_of(poses, &[body]);
    let points = skeleton.ground_points(poses, body);
    let sole = points.iter().filter(|p| p.z <= lowest + SOLE * leg_length);
    let edges: [Vector3<f64>; EDGES] = std::array::from_fn(|edge| {
        let (sin, cos) = (TAU * edge as f64 / EDGES as f64).sin_cos();
        Vector3::new(friction * cos, friction * sin, 1.0)
    });
    let load = |point: Vector3<f64>, force| Load { body, point, force };
    sole.flat_map(|point| edges.map(|force| load(*point, force)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point contact supplies friction up to the coefficient times the load, the same along the diagonal.
    #[test]
    fn friction_reaches_as_far_in_every_direction() {
        let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid is valid");
        let head = skeleton.bodies.iter().position(|b| b.name == "head");
        let head = head.expect("it has a head");
        let poses = skeleton.forward(&skeleton.rest_qpos());
        let point = skeleton.ground_points(&poses, head)[0];
        let friction = skeleton.bodies[head].friction;
        let timeline = Timeline {
            frames: 1,
            loop_mode: crate::clip::LoopMode::Clamp,
            cycle: crate::motion::Cycle::NONE,
        };
        for step in 0..16 {
            let (sin, cos) = (TAU * f64::from(step) / 16.0).sin_cos();
            let left = |part: f64| {
                let sideways = friction * part;
                let required = Wrench {
                    force: Vector3::new(sideways * cos, sideways * sin, 1.0) * 100.0,
                    moment: Vector3::zeros(),
                };
                let support = Support {
                    skeleton: &skeleton,
                    leg: skeleton.leg_length(),
                    bodies: std::slice::from_ref(&poses),
                    com: &[point],
                    required: &[required],
                    standing: Standing {
                        bodies: &[head],
                        contact: &[vec![true]],
                    },
                    fps: 30.0,
                    timeline: &timeline,
                };
                support.residual(0).fixed_rows::<3>(0).norm()
            };
            assert!(left(0.92) < 1e-6, "direction {step}");
            assert!(left(1.05) > 1.0, "direction {step}");
        }
    }
}
