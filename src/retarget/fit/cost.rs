//! The cost of a frame: half the sum of squared residuals, with its gradient and Gauss–Newton matrix.
//!
//! Each residual r with weight w adds w²‖r‖²/2 to the cost, w² Jᵀr to the gradient and w² JᵀJ to the matrix, J being its
//! derivative by the frame's degrees of freedom. Second derivatives of r are left out, as Gauss and Newton do: they vanish
//! where goals are met.

use super::weight;
use crate::retarget::anchor::Anchor;
use crate::retarget::goals::Goals;
use crate::retarget::model::{Model, Pose};
use crate::retarget::qpos::quaternion;
use crate::retarget::rotation::{log, right_jacobian_inverse};
use crate::skeleton::{Joint, JointKind, limits};
use nalgebra::Vector3;

/// How far inside of its limits a coordinate is kept, radians or metres. Chosen: what presses against a limit ends a little
/// beyond the margin and still inside of the limit.
const LIMIT_MARGIN: f64 = 0.01;

/// What a trajectory is fitted to, in the sense of least squares.
#[derive(Clone, Copy)]
pub(in crate::retarget) struct LeastSquares<'a> {
    /// The skeleton.
    pub model: &'a Model<'a>,
    /// What it should look like.
    pub goals: &'a Goals,
    /// The points that stand, by frame.
    pub anchors: &'a [Vec<Anchor>],
    /// Frames per second.
    pub fps: f64,
    /// Weight of a coordinate's distance outside of its limits, per radian or metre.
    pub limit: f64,
    /// Weight of a point's depth below the ground, per metre.
    pub ground: f64,
}

/// Where the derivatives of one frame's cost go.
pub(super) struct NormalEquations<'a> {
    /// By degree of freedom.
    pub gradient: &'a mut [f64],
    /// The lower triangle of a square matrix, row by row.
    pub matrix: &'a mut [f64],
}

/// The columns of a residual's Jacobian that aren't zero: the degree of freedom and the derivative by it.
type Columns = Vec<(usize, Vector3<f64>)>;

impl NormalEquations<'_> {
    /// Adds the residual `r` with its derivative, the degrees of freedom ascending, both times `weight`; returns its cost.
    fn add(&mut self, columns: &[(usize, Vector3<f64>)], r: &Vector3<f64>, weight: f64) -> f64 {
        let n = self.gradient.len();
        // Residual and derivative both carry the weight, so gradient and matrix have its square.
        let square = weight * weight;
        for (i, (row, a)) in columns.iter().enumerate() {
            let a = a * square;
            self.gradient[*row] += a.dot(r);
            // Degrees of freedom ascend, so this is the lower triangle.
            for (column, b) in &columns[..=i] {
                self.matrix[row * n + column] += a.dot(b);
            }
        }
        0.5 * square * r.norm_squared()
    }

    /// The same for a residual that is one coordinate.
    fn add_scalar(&mut self, dof: usize, r: f64, weight: f64) -> f64 {
        let n = self.gradient.len();
        self.gradient[dof] += weight * weight * r;
        self.matrix[dof * n + dof] += weight * weight;
        0.5 * weight * weight * r * r
    }

    /// The same for a residual of a ball joint whose first degree of freedom is `dof` and whose rotation vector is `v`: the
    /// residual changes by the `rows` of the inverse right Jacobian at `v`.
    fn add_rotation(
        &mut self,
        dof: usize,
        v: &Vector3<f64>,
        r: &Vector3<f64>,
        weight: f64,
        rows: [bool; 3],
    ) -> f64 {
        let mut derivative = right_jacobian_inverse(v);
        // A component within its limits is no residual.
        for (i, row) in rows.iter().enumerate() {
            if !row {
                derivative.row_mut(i).fill(0.0);
            }
        }
        let column = |i: usize| (dof + i, derivative.column(i).into());
        self.add(&[column(0), column(1), column(2)], r, weight)
    }
}

impl<'a> LeastSquares<'a> {
    /// With the weights of a first fit.
    pub fn new(
        model: &'a Model<'a>,
        goals: &'a Goals,
        anchors: &'a [Vec<Anchor>],
        fps: f64,
    ) -> LeastSquares<'a> {
        LeastSquares {
            model,
            goals,
            anchors,
            fps,
            limit: weight::LIMIT,
            ground: weight::GROUND,
        }
    }
}

impl LeastSquares<'_> {
    /// Adds everything that depends on frame `f` alone; returns its cost. `pose` is memory to work in.
    pub(super) fn frame(
        &self,
        f: usize,
        qpos: &[f64],
        pose: &mut Pose,
        to: &mut NormalEquations,
    ) -> f64 {
        self.model.evaluate(qpos, pose);
        let mut columns = Columns::with_capacity(self.model.rotates.len());
        self.points(f, pose, &mut columns, to)
            + self.orientations(f, pose, &mut columns, to)
            + self.stance(f, pose, &mut columns, to)
            + self.ground(pose, &mut columns, to)
            + self.overlaps(pose, &mut columns, to)
            + self.joints(f, qpos, to)
    }

    /// The Jacobian of the world point `p` of `body`.
    fn levers(&self, body: usize, pose: &Pose, p: &Vector3<f64>, columns: &mut Columns) {
        // Only what is between the root and the body moves the point: a chain has a third of all degrees of freedom.
        columns.clear();
        let lever = |dof: &usize| (*dof, self.model.lever(pose, *dof, p));
        columns.extend(self.model.chains[body].iter().map(lever));
    }

    /// Distances of keypoints from their targets.
    fn points(
        &self,
        f: usize,
        pose: &Pose,
        columns: &mut Columns,
        to: &mut NormalEquations,
    ) -> f64 {
        let mut cost = 0.0;
        for (key, goal) in self.goals.keypoints.iter().zip(&self.goals.points[f]) {
            let at = pose.bodies[key.body].translation.vector;
            self.levers(key.body, pose, &at, columns);
            cost += to.add(columns, &(at - goal), key.weight);
        }
        cost
    }

    /// Angles of orientations from their targets: r = log(goal⁻¹ R), seen from the body. A rate of a degree of freedom about
    /// the world axis a turns the body by Rᵀa in its own frame, which the inverse right Jacobian takes to the change of r.
    fn orientations(
        &self,
        f: usize,
        pose: &Pose,
        columns: &mut Columns,
        to: &mut NormalEquations,
    ) -> f64 {
        let mut cost = 0.0;
        let goals = self.goals.orientations.iter().zip(&self.goals.rotations[f]);
        for (turn, goal) in goals {
            let rotation = pose.bodies[turn.body].rotation;
            let r = log(&(goal.inverse() * rotation));
            // ∂r = Jr⁻¹(r) · Rᵀa for each axis a that turns the body. Translations don't.
            let into_body = rotation.inverse().to_rotation_matrix();
            let derivative = right_jacobian_inverse(&r) * into_body.matrix();
            let turning = self.model.chains[turn.body]
                .iter()
                .filter(|dof| self.model.rotates[**dof]);
            columns.clear();
            columns.extend(turning.map(|dof| (*dof, derivative * pose.axes[*dof])));
            cost += to.add(columns, &r, turn.weight);
        }
        cost
    }

    /// Distances of standing points from where they stand.
    fn stance(
        &self,
        f: usize,
        pose: &Pose,
        columns: &mut Columns,
        to: &mut NormalEquations,
    ) -> f64 {
        let mut cost = 0.0;
        for anchor in &self.anchors[f] {
            let point = &self.model.contact_points[anchor.point];
            let at = point.place(&pose.bodies);
            self.levers(point.body, pose, &at, columns);
            let mut off = at - anchor.at;
            if anchor.is_level {
                off = upright(&off);
                columns
                    .iter_mut()
                    .for_each(|(_, lever)| *lever = upright(lever));
            }
            // The hold fades in and out, so that a stance begins and ends without a jerk.
            cost += to.add(columns, &off, weight::STANCE * anchor.hold);
        }
        cost
    }

    /// Depths of points below the ground. Only the height counts: the ground doesn't hold what slides over it.
    fn ground(&self, pose: &Pose, columns: &mut Columns, to: &mut NormalEquations) -> f64 {
        let mut cost = 0.0;
        for point in &self.model.contact_points {
            let at = point.place(&pose.bodies);
            let below = at.z - point.radius;
            // One-sided: half a parabola, whose slope is continuous at the ground.
            if below < 0.0 {
                self.levers(point.body, pose, &at, columns);
                columns
                    .iter_mut()
                    .for_each(|(_, lever)| *lever = upright(lever));
                cost += to.add(columns, &(Vector3::z() * below), self.ground);
            }
        }
        cost
    }

    /// Depths of shapes in each other, along the line between their nearest points. What moves both shapes changes it by the
    /// difference.
    fn overlaps(&self, pose: &Pose, columns: &mut Columns, to: &mut NormalEquations) -> f64 {
        let pairs = self.model.pairs.iter();
        let overlaps = pairs.filter_map(|pair| pair.overlap(&pose.bodies));
        let mut cost = 0.0;
        for overlap in overlaps {
            let [one, other] = overlap.bodies;
            let [p, q] = &overlap.points;
            self.levers(one, pose, p, columns);
            // The depth changes by how one point moves against the other. What moves both alike (the root) cancels.
            for dof in &self.model.chains[other] {
                let lever = -self.model.lever(pose, *dof, q);
                match columns.iter_mut().find(|(own, _)| own == dof) {
                    Some((_, both)) => *both += lever,
                    None => columns.push((*dof, lever)),
                }
            }
            // The lower triangle needs ascending degrees of freedom.
            columns.sort_unstable_by_key(|(dof, _)| *dof);
            // Only motion along the normal parts the two; sliding past each other is free.
            for (_, lever) in columns.iter_mut() {
                *lever = Vector3::new(lever.dot(&overlap.normal), 0.0, 0.0);
            }
            let r = Vector3::new(-overlap.depth, 0.0, 0.0);
            cost += to.add(columns, &r, weight::OVERLAP);
        }
        cost
    }

    /// Distances of coordinates from the guess, and outside of their limits. The root has neither.
    fn joints(&self, f: usize, qpos: &[f64], to: &mut NormalEquations) -> f64 {
        let guess = &self.goals.guess[f];
        let mut cost = 0.0;
        for joint in self.model.joints() {
            match joint.kind {
                JointKind::Free => {}
                JointKind::Ball => {
                    let turn =
                        quaternion(guess, joint.qpos).inverse() * quaternion(qpos, joint.qpos);
                    let off = log(&turn);
                    cost += to.add_rotation(joint.dof, &off, &off, weight::GUESS, [true; 3]);
                    // Each component of the rotation vector has a range of its own, as its drives have.
                    let (v, r) = outside_of_ranges(joint, qpos);
                    if r != Vector3::zeros() {
                        let rows = [r.x != 0.0, r.y != 0.0, r.z != 0.0];
                        cost += to.add_rotation(joint.dof, &v, &r, self.limit, rows);
                    }
                }
                JointKind::Hinge(_) | JointKind::Slide(_) => {
                    let (value, wanted) = (qpos[joint.qpos], guess[joint.qpos]);
                    cost += to.add_scalar(joint.dof, value - wanted, weight::GUESS);
                    let range = joint.limits.first().map(|range| within(*range));
                    let r = range.map_or(0.0, |range| limits::outside(value, range));
                    if r != 0.0 {
                        cost += to.add_scalar(joint.dof, r, self.limit);
                    }
                }
            }
        }
        cost
    }
}

/// The vertical part of a vector.
fn upright(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::z() * v.z
}

/// A ball joint's rotation vector, and how far each of its components is outside of its limits, radians.
fn outside_of_ranges(joint: &Joint, qpos: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
    let (v, _) = limits::ball(joint, qpos);
    let outside = |i: usize| {
        let range = joint.limits.get(i);
        range.map_or(0.0, |range| limits::outside(v[i], within(*range)))
    };
    (v, Vector3::from_fn(|i, _| outside(i)))
}

/// A range drawn in by the margin; a narrow one by at most a quarter of its width.
fn within([low, high]: [f64; 2]) -> [f64; 2] {
    let margin = LIMIT_MARGIN.min((high - low) / 4.0);
    [low + margin, high - margin]
}
