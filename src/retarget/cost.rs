//! The cost of a trajectory: half the sum of squared residuals, with its gradient and Gauss–Newton matrix.

use super::goals::Goals;
use super::model::{Model, Pose, quaternion};
use super::rotation::{left_jacobian_inverse, log, right_jacobian_inverse};
use super::stance::Anchor;
use crate::skeleton::{JointKind, limits};
use nalgebra::{Matrix3, Vector3};

/// Weights of the residuals; points count in metres with weight 1.
pub(super) mod weight {
    /// Standing points, per metre.
    pub const STANCE: f64 = 12.0;
    /// Points below the ground, per metre: at first, and where some are left too deep.
    pub const GROUND: f64 = 16.0;
    pub const STIFF_GROUND: [f64; 2] = [60.0, 200.0];
    /// Limbs in each other or in the trunk, per metre.
    pub const OVERLAP: f64 = 3.0;
    /// Coordinates outside of their limits, per radian: at first, and where some are left outside.
    pub const LIMIT: f64 = 3.0;
    pub const STIFF_LIMITS: [f64; 2] = [30.0, 300.0];
    /// Every coordinate's distance from the guess, per radian; decides what nothing else does.
    pub const GUESS: f64 = 0.005;
    /// Root acceleration, per m/s².
    pub const SHIFT_ACCELERATION: f64 = 1e-4;
    /// Joint acceleration, per rad/s².
    pub const TURN_ACCELERATION: f64 = 3e-5;
    /// What a hinge turns faster than it may, per rad/s.
    pub const PACE: f64 = 0.01;
}

/// Limits are kept this far inside, so that they hold to the end, radians.
const LIMIT_MARGIN: f64 = 0.01;

/// What the trajectory is to be fitted to.
pub(super) struct Problem<'a> {
    pub model: &'a Model<'a>,
    pub goals: &'a Goals,
    pub anchors: &'a [Vec<Anchor>],
    pub fps: f64,
    /// Weight of a coordinate's distance outside of its limits, per radian.
    pub limit: f64,
    /// Weight of a point's depth below the ground, per metre.
    pub ground: f64,
}

/// Where one frame's derivatives go: gradient, and the lower triangle of a row-major matrix.
pub(super) struct Normal<'a> {
    pub gradient: &'a mut [f64],
    pub matrix: &'a mut [f64],
}

/// Columns of a Jacobian: the degree of freedom and what it does to a residual of three rows.
pub(super) type Columns = Vec<(usize, Vector3<f64>)>;

impl Normal<'_> {
    /// Adds the residual `r` with derivative `columns` (ascending), both times `weight`.
    fn add(&mut self, columns: &Columns, r: &Vector3<f64>, weight: f64) -> f64 {
        let n = self.gradient.len();
        let square = weight * weight;
        for (i, (row, a)) in columns.iter().enumerate() {
            let a = a * square;
            self.gradient[*row] += a.dot(r);
            for (column, b) in &columns[..=i] {
                self.matrix[row * n + column] += a.dot(b);
            }
        }
        0.5 * square * r.norm_squared()
    }

    fn add_scalar(&mut self, dof: usize, r: f64, weight: f64) -> f64 {
        let n = self.gradient.len();
        self.gradient[dof] += weight * weight * r;
        self.matrix[dof * n + dof] += weight * weight;
        0.5 * weight * weight * r * r
    }
}

impl<'a> Problem<'a> {
    /// With the weights of a first fit.
    pub fn new(
        model: &'a Model<'a>,
        goals: &'a Goals,
        anchors: &'a [Vec<Anchor>],
        fps: f64,
    ) -> Problem<'a> {
        Problem {
            model,
            goals,
            anchors,
            fps,
            limit: weight::LIMIT,
            ground: weight::GROUND,
        }
    }
}

impl Problem<'_> {
    /// Adds everything that depends on frame `f` alone; returns its cost.
    pub fn frame(&self, f: usize, qpos: &[f64], pose: &mut Pose, to: &mut Normal) -> f64 {
        self.model.evaluate(qpos, pose);
        let mut columns = Columns::with_capacity(self.model.turns.len());
        self.points(f, pose, &mut columns, to)
            + self.turns(f, pose, &mut columns, to)
            + self.stance(f, pose, &mut columns, to)
            + self.ground(pose, &mut columns, to)
            + self.overlaps(pose, &mut columns, to)
            + self.joints(f, qpos, &mut columns, to)
    }

    /// How the world point `p` of `body` moves.
    fn levers(&self, body: usize, pose: &Pose, p: &Vector3<f64>, columns: &mut Columns) {
        columns.clear();
        let lever = |dof: &usize| (*dof, self.model.lever(pose, *dof, p));
        columns.extend(self.model.chains[body].iter().map(lever));
    }

    fn points(&self, f: usize, pose: &Pose, columns: &mut Columns, to: &mut Normal) -> f64 {
        let mut cost = 0.0;
        for (key, goal) in self.goals.keys.iter().zip(&self.goals.points[f]) {
            let at = pose.bodies[key.body].translation.vector;
            self.levers(key.body, pose, &at, columns);
            cost += to.add(columns, &(at - goal), key.weight);
        }
        cost
    }

    fn turns(&self, f: usize, pose: &Pose, columns: &mut Columns, to: &mut Normal) -> f64 {
        let mut cost = 0.0;
        for (turn, goal) in self.goals.turns.iter().zip(&self.goals.rotations[f]) {
            let rotation = pose.bodies[turn.body].rotation;
            let r = log(&(goal.inverse() * rotation));
            let into_body = rotation.inverse().to_rotation_matrix();
            let derivative = right_jacobian_inverse(&r) * into_body.matrix();
            let turning = self.model.chains[turn.body]
                .iter()
                .filter(|dof| self.model.turns[**dof]);
            columns.clear();
            columns.extend(turning.map(|dof| (*dof, derivative * pose.axes[*dof])));
            cost += to.add(columns, &r, turn.weight);
        }
        cost
    }

    fn stance(&self, f: usize, pose: &Pose, columns: &mut Columns, to: &mut Normal) -> f64 {
        let mut cost = 0.0;
        for anchor in &self.anchors[f] {
            let knob = &self.model.knobs[anchor.knob];
            let at = (pose.bodies[knob.body] * nalgebra::Point3::from(knob.center)).coords;
            self.levers(knob.body, pose, &at, columns);
            cost += to.add(columns, &(at - anchor.at), weight::STANCE * anchor.hold);
        }
        cost
    }

    fn ground(&self, pose: &Pose, columns: &mut Columns, to: &mut Normal) -> f64 {
        let mut cost = 0.0;
        for knob in &self.model.knobs {
            let at = (pose.bodies[knob.body] * nalgebra::Point3::from(knob.center)).coords;
            let below = at.z - knob.radius;
            if below < 0.0 {
                self.levers(knob.body, pose, &at, columns);
                columns
                    .iter_mut()
                    .for_each(|(_, lever)| *lever = Vector3::new(0.0, 0.0, lever.z));
                cost += to.add(columns, &Vector3::new(0.0, 0.0, below), self.ground);
            }
        }
        cost
    }

    fn overlaps(&self, pose: &Pose, columns: &mut Columns, to: &mut Normal) -> f64 {
        let overlaps = self
            .model
            .pairs
            .iter()
            .filter_map(|pair| pair.overlap(&pose.bodies));
        let mut cost = 0.0;
        for overlap in overlaps {
            let [one, other] = overlap.bodies;
            let [p, q] = &overlap.points;
            self.levers(one, pose, p, columns);
            for dof in &self.model.chains[other] {
                let lever = -self.model.lever(pose, *dof, q);
                match columns.iter_mut().find(|(own, _)| own == dof) {
                    Some((_, both)) => *both += lever,
                    None => columns.push((*dof, lever)),
                }
            }
            columns.sort_unstable_by_key(|(dof, _)| *dof);
            for (_, lever) in columns.iter_mut() {
                *lever = Vector3::new(lever.dot(&overlap.normal), 0.0, 0.0);
            }
            let r = Vector3::new(-overlap.depth, 0.0, 0.0);
            cost += to.add(columns, &r, weight::OVERLAP);
        }
        cost
    }

    /// Limits, and the pull towards the guess.
    fn joints(&self, f: usize, qpos: &[f64], columns: &mut Columns, to: &mut Normal) -> f64 {
        let guess = &self.goals.guess[f];
        let mut cost = 0.0;
        let mut turned = |to: &mut Normal,
                          v: &Vector3<f64>,
                          r: &Vector3<f64>,
                          dof: usize,
                          weight: f64,
                          rows: [bool; 3]| {
            let mut derivative = right_jacobian_inverse(v);
            for (i, row) in rows.iter().enumerate() {
                if !row {
                    derivative.row_mut(i).fill(0.0);
                }
            }
            columns.clear();
            columns.extend((0..3).map(|i| (dof + i, derivative.column(i).into())));
            to.add(columns, r, weight)
        };
        for joint in self.model.joints() {
            match joint.kind {
                JointKind::Free => {}
                JointKind::Ball => {
                    let off =
                        log(&(quaternion(guess, joint.qpos).inverse()
                            * quaternion(qpos, joint.qpos)));
                    cost += turned(to, &off, &off, joint.dof, weight::GUESS, [true; 3]);
                    let (v, _) = limits::ball(joint, qpos);
                    let r = Vector3::from_fn(|i, _| {
                        joint
                            .limits
                            .get(i)
                            .map_or(0.0, |range| limits::outside(v[i], within(*range)))
                    });
                    if r != Vector3::zeros() {
                        let rows = [r.x != 0.0, r.y != 0.0, r.z != 0.0];
                        cost += turned(to, &v, &r, joint.dof, self.limit, rows);
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

/// A range drawn in by the margin, where it is wide enough.
fn within([low, high]: [f64; 2]) -> [f64; 2] {
    let margin = LIMIT_MARGIN.min((high - low) / 4.0);
    [low + margin, high - margin]
}

/// A part of the tangent space whose second differences are penalised together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub dof: usize,
    pub size: usize,
    pub turns: bool,
    pub weight: f64,
}

/// The parts of a model's tangent space.
pub(super) fn parts(model: &Model) -> Vec<Part> {
    let mut parts = Vec::new();
    for joint in model.joints() {
        let (dof, shift, turn) = (
            joint.dof,
            weight::SHIFT_ACCELERATION,
            weight::TURN_ACCELERATION,
        );
        match joint.kind {
            JointKind::Free => {
                parts.push(Part {
                    dof,
                    size: 3,
                    turns: false,
                    weight: shift,
                });
                parts.push(Part {
                    dof: dof + 3,
                    size: 3,
                    turns: true,
                    weight: turn,
                });
            }
            JointKind::Ball => parts.push(Part {
                dof,
                size: 3,
                turns: true,
                weight: turn,
            }),
            JointKind::Hinge(_) => parts.push(Part {
                dof,
                size: 1,
                turns: false,
                weight: turn,
            }),
            JointKind::Slide(_) => parts.push(Part {
                dof,
                size: 1,
                turns: false,
                weight: shift,
            }),
        }
    }
    parts
}

/// A second difference and its derivatives by the frame before, the frame itself and the frame after.
pub(super) struct Bend {
    pub r: Vector3<f64>,
    pub by: [Matrix3<f64>; 3],
}

/// Second difference of a part from the steps into and out of a frame (tangent vectors).
pub(super) fn bend(part: &Part, into: &[f64], out: &[f64]) -> Bend {
    let pick =
        |v: &[f64]| Vector3::from_fn(|i, _| if i < part.size { v[part.dof + i] } else { 0.0 });
    let (into, out) = (pick(into), pick(out));
    let by = if part.turns {
        [
            left_jacobian_inverse(&into),
            -left_jacobian_inverse(&out) - right_jacobian_inverse(&into),
            right_jacobian_inverse(&out),
        ]
    } else {
        [
            Matrix3::identity(),
            Matrix3::identity() * -2.0,
            Matrix3::identity(),
        ]
    };
    Bend { r: out - into, by }
}
