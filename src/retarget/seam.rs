//! Stage 4, seam: closes the loop of a clip that repeats, for few clips' loops close exactly.
//!
//! First the cycle is found: the turn and the shift that lead from the first frame to the last. What is left between the
//! last frame and the first one carried on by the cycle is a gap. Half of it is faded into the frames after the seam, half
//! into those before.

use super::fade::smoothstep;
use super::goals::Goals;
use super::input::Input;
use super::model::Model;
use super::qpos::{CycleStep, vector};
use super::rotation::{exp, heading, log};
use crate::clip::Problem;
use crate::motion::Cycle;
use crate::skeleton::Joint;
use nalgebra::{UnitQuaternion, Vector3};

/// Turn of a cycle below which it goes straight, radians: 1°. Chosen: a recorded gait that is meant to be straight turns by
/// less.
pub(super) const STRAIGHT: f64 = 0.0175;
/// Gap of a joint above which the user gets a warning, radians: 6°. Chosen.
const NOTICEABLE: f64 = 0.1;
/// Time on either side of the seam over which the gap is faded, s. Chosen.
const SPREAD: f64 = 0.25;
/// The same as a share of the cycle; the smaller counts. With 0.1, DeepMimic's run, whose hand misses 20 cm, stepped by 4.4
/// cm beyond its source, with 0.15 by 2.9.
const SHARE: f64 = 0.15;
/// How far closing a loop may move a point that stands without it looking as if it slid, metres. Chosen: a clip whose loop
/// closes is moved by less. Without this rule DeepMimic's run stood on its left foot alone.
const HIDES: f64 = 0.01;

/// Goals whose loop is closed, if the clip repeats.
pub(super) struct Closed {
    /// What the skeleton should look like.
    pub goals: Goals,
    /// The cycle and what closing it moved; `None` for a clip that ends.
    pub seam: Option<Seam>,
    /// The warning `loop-gap`.
    pub problem: Option<Problem>,
}

/// The seam of a cycle.
pub(super) struct Seam {
    /// What leads from each cycle to the next.
    pub cycle: Cycle,
    /// Frames on either side that were moved.
    spread: usize,
    /// Index of the last frame.
    last: usize,
    /// How far each keypoint was moved at the seam, metres.
    moved: Vec<f64>,
}

impl Seam {
    /// Whether closing the loop moved a keypoint so far around frame `f` that one that stood doesn't look as if it did.
    pub fn hides_stance(&self, keypoint: usize, f: usize) -> bool {
        let near = f <= self.spread || f + self.spread >= self.last;
        near && self.moved[keypoint] > HIDES
    }
}

/// Closes the loop of the goals if the clip repeats.
pub(super) fn close(goals: Goals, input: &Input, model: &Model) -> Closed {
    if !input.repeats {
        return Closed {
            goals,
            seam: None,
            problem: None,
        };
    }
    let joint_gap = joint_gap(&goals, model);
    let cycle = cycle(&goals, joint_gap);
    let gap = Gap::new(&goals, &cycle, model);
    let last = goals.frames() - 1;
    // At least one frame on either side, and at most up to the middle.
    let spread = (SPREAD * input.clip.fps).min(SHARE * last as f64);
    let seam = Seam {
        spread: (spread.round() as usize).clamp(1, last / 2),
        last,
        moved: gap.shifts.iter().map(|gap| gap.norm() / 2.0).collect(),
        cycle,
    };
    Closed {
        goals: fade_out(goals, &gap, &seam, model),
        seam: Some(seam),
        problem: problem(joint_gap),
    }
}

/// The turn about Z and the shift over the ground that carry the first frame's root to the last frame's. A turn no larger
/// than the gap that the joints leave is part of that gap: such a cycle goes straight.
fn cycle(goals: &Goals, joint_gap: f64) -> Cycle {
    let last = goals.frames().saturating_sub(1);
    // Only the heading of the rotation from the first frame to the last belongs to the cycle. Roll and pitch are part of the
    // gap.
    let turned = goals.root_rotation(last) * goals.root_rotation(0).inverse();
    let mut angle = heading(&turned);
    if angle.abs() < STRAIGHT.max(joint_gap) {
        angle = 0.0;
    }
    let mut translation = goals.root(last) - exp(&(Vector3::z() * angle)) * goals.root(0);
    // A cycle goes over the ground. A difference in height is part of the gap.
    translation.z = 0.0;
    Cycle {
        translation,
        heading: angle,
    }
}

/// The greatest angle between a joint in the first frame and in the last, radians.
fn joint_gap(goals: &Goals, model: &Model) -> f64 {
    let mut gap = vec![0.0; model.skeleton.nv];
    if let (Some(first), Some(last)) = (goals.guess.first(), goals.guess.last()) {
        model.difference(first, last, &mut gap);
    }
    // The root's own difference is the cycle's step.
    let joints = model.joints().skip(1);
    let angle = |joint: &Joint| {
        gap[joint.dof..joint.dof + joint.kind.nv()]
            .iter()
            .map(|x| x * x)
            .sum::<f64>()
            .sqrt()
    };
    joints.map(angle).fold(0.0, f64::max)
}

/// The warning `loop-gap` of a loop whose joints don't close.
fn problem(joint_gap: f64) -> Option<Problem> {
    let message = format!(
        "the loop doesn't close: a joint is {:.0}° off where the last frame meets the first; the gap was spread over the \
         frames around it; import the clip as one that ends if it isn't meant to repeat",
        joint_gap.to_degrees()
    );
    (joint_gap > NOTICEABLE).then(|| Problem::warning("loop-gap", message))
}

/// From the last frame to the first one carried on by the cycle.
struct Gap {
    /// Of every keypoint's target, metres.
    shifts: Vec<Vector3<f64>>,
    /// Of every orientation's target, as a rotation vector in the body's frame, radians.
    turns: Vec<Vector3<f64>>,
    /// Of the guess, as a tangent vector.
    joints: Vec<f64>,
    /// The turn of the cycle.
    turn: UnitQuaternion<f64>,
}

impl Gap {
    /// Measures the gap.
    fn new(goals: &Goals, cycle: &Cycle, model: &Model) -> Gap {
        let last = goals.frames() - 1;
        let turn = exp(&(Vector3::z() * cycle.heading));
        let carry = |p: &Vector3<f64>| turn * p + cycle.translation;
        let points = goals.points[0].iter().zip(&goals.points[last]);
        let rotations = goals.rotations[0].iter().zip(&goals.rotations[last]);
        let mut joints = vec![0.0; model.skeleton.nv];
        let carried = CycleStep::of(cycle).carry(&goals.guess[0]);
        model.difference(&goals.guess[last], &carried, &mut joints);
        Gap {
            shifts: points.map(|(first, last)| carry(first) - last).collect(),
            turns: rotations
                .map(|(first, last)| log(&(last.inverse() * turn * first)))
                .collect(),
            joints,
            turn,
        }
    }

    /// Moves frame `f` by a part of the gap, which is turned by `turn` into the cycle that the frame is in.
    fn apply(
        &self,
        goals: &mut Goals,
        f: usize,
        part: f64,
        turn: &UnitQuaternion<f64>,
        model: &Model,
    ) {
        for (point, shift) in goals.points[f].iter_mut().zip(&self.shifts) {
            *point += turn * shift * part;
        }
        for (rotation, by) in goals.rotations[f].iter_mut().zip(&self.turns) {
            *rotation *= exp(&(by * part));
        }
        // The root's position is in world axes; all other coordinates are relative and need no turning.
        let mut step: Vec<f64> = self.joints.iter().map(|x| x * part).collect();
        let shift = turn * vector(&self.joints, 0) * part;
        step[..3].copy_from_slice(shift.as_slice());
        model.step(&mut goals.guess[f], &step);
    }
}

/// Adds half of the gap to the last frame and takes half of it from the first, and less the further frames are from the seam.
fn fade_out(mut goals: Goals, gap: &Gap, seam: &Seam, model: &Model) -> Goals {
    let here = UnitQuaternion::identity();
    // The gap is seen from the last frame; in the first, the cycle's turn hasn't happened yet.
    let before_the_turn = gap.turn.inverse();
    for away in 0..=seam.spread {
        // Both halves meet at the seam, and are gone just beyond the spread.
        let left = 1.0 - away as f64 / (seam.spread + 1) as f64;
        let half = 0.5 * smoothstep(left);
        gap.apply(&mut goals, seam.last - away, half, &here, model);
        gap.apply(&mut goals, away, -half, &before_the_turn, model);
    }
    goals
}
