//! The cycle of a clip that loops, and its seam: source loops seldom close exactly.

use super::goals::Goals;
use super::model::Model;
use super::rotation::{exp, heading, log};
use crate::clip::{Problem, Severity};
use crate::motion::Cycle;
use nalgebra::{UnitQuaternion, Vector3};

/// A cycle that turns less than this goes straight, radians (1°).
const STRAIGHT: f64 = 0.0175;
/// Gap that is told of, radians (6°).
const NOTICEABLE: f64 = 0.1;
/// Time on either side of the seam over which its gap is spread, s.
const SPREAD: f64 = 0.25;
/// The same as a part of the cycle; the smaller counts.
const SHARE: f64 = 0.15;
/// Metres by which a point that stands is moved and still looks as if it stood.
const HIDES: f64 = 0.01;

/// The turn about Z and shift over the ground that carry the first frame's root to the last frame's. A turn no
/// larger than the gap that the joints leave at the seam is part of that gap: such a cycle goes straight.
pub(super) fn cycle(goals: &Goals, model: &Model) -> Cycle {
    let last = goals.frames().saturating_sub(1);
    let turned = goals.root_rotation(last) * goals.root_rotation(0).inverse();
    let mut angle = heading(&turned);
    if angle.abs() < STRAIGHT.max(joint_gap(goals, model)) {
        angle = 0.0;
    }
    let mut translation = goals.root(last) - exp(&(Vector3::z() * angle)) * goals.root(0);
    translation.z = 0.0;
    Cycle {
        translation,
        heading: angle,
    }
}

/// Greatest angle between a joint in the first frame and the last.
fn joint_gap(goals: &Goals, model: &Model) -> f64 {
    let mut gap = vec![0.0; model.skeleton.nv];
    if let (Some(first), Some(last)) = (goals.guess.first(), goals.guess.last()) {
        model.difference(first, last, &mut gap);
    }
    let joints = model.joints().skip(1);
    let angle = |joint: &crate::skeleton::Joint| {
        gap[joint.dof..joint.dof + joint.kind.nv()]
            .iter()
            .map(|x| x * x)
            .sum::<f64>()
            .sqrt()
    };
    joints.map(angle).fold(0.0, f64::max)
}

/// Tells of a loop that doesn't close.
pub(super) fn gap_problem(goals: &Goals, model: &Model) -> Option<Problem> {
    let gap = joint_gap(goals, model);
    (gap > NOTICEABLE).then(|| Problem {
        id: "loop-gap".to_owned(),
        severity: Severity::Warning,
        message: format!(
            "the loop doesn't close: a joint is {:.0}° off where the last frame meets the first; the gap was spread over \
             the frames around it. Import it with `--loop clamp` if it isn't meant to repeat",
            gap.to_degrees()
        ),
    })
}

/// Frames that were moved to close a loop, and how far each key point was in the worst of them, metres.
pub(super) struct Closed {
    spread: usize,
    last: usize,
    moved: Vec<f64>,
}

impl Closed {
    /// Whether a key point was moved so far around frame `f` that one that stood doesn't look so any more.
    pub fn hides_stance(&self, key: usize, f: usize) -> bool {
        let near = f <= self.spread || f + self.spread >= self.last;
        near && self.moved[key] > HIDES
    }
}

/// Closes the loop of the goals: half of the gap is faded into the frames after the seam, half into those before.
pub(super) fn close(goals: &mut Goals, cycle: &Cycle, model: &Model, fps: f64) -> Closed {
    let last = goals.frames() - 1;
    let turn = exp(&(Vector3::z() * cycle.heading));
    let carry = |p: &Vector3<f64>| turn * p + cycle.translation;
    let gaps: Vec<Vector3<f64>> = (goals.points[0].iter().zip(&goals.points[last]))
        .map(|(first, last)| carry(first) - last)
        .collect();
    let turns: Vec<Vector3<f64>> = (goals.rotations[0].iter().zip(&goals.rotations[last]))
        .map(|(first, last)| log(&(last.inverse() * turn * first)))
        .collect();
    let carried = super::solve::carried(
        &goals.guess[0],
        turn.to_rotation_matrix().matrix(),
        &cycle.translation,
    );
    let mut joints = vec![0.0; model.skeleton.nv];
    model.difference(&goals.guess[last], &carried, &mut joints);
    let spread = ((SPREAD * fps).min(SHARE * last as f64).round() as usize).clamp(1, last / 2);
    for away in 0..=spread {
        let left = 1.0 - away as f64 / (spread + 1) as f64;
        let half = 0.5 * left * left * (3.0 - 2.0 * left);
        bend(
            goals,
            last - away,
            half,
            (&gaps, &turns, &joints),
            &UnitQuaternion::identity(),
            model,
        );
        bend(
            goals,
            away,
            -half,
            (&gaps, &turns, &joints),
            &turn.inverse(),
            model,
        );
    }
    Closed {
        spread,
        last,
        moved: gaps.iter().map(|gap| gap.norm() / 2.0).collect(),
    }
}

type Gap<'a> = (&'a [Vector3<f64>], &'a [Vector3<f64>], &'a [f64]);

/// Moves frame `f` by a part of the gap, whose shifts are first turned by `turn`.
fn bend(
    goals: &mut Goals,
    f: usize,
    part: f64,
    (gaps, turns, joints): Gap,
    turn: &UnitQuaternion<f64>,
    model: &Model,
) {
    for (point, gap) in goals.points[f].iter_mut().zip(gaps) {
        *point += turn * gap * part;
    }
    for (rotation, by) in goals.rotations[f].iter_mut().zip(turns) {
        *rotation *= exp(&(by * part));
    }
    let mut step: Vec<f64> = joints.iter().map(|x| x * part).collect();
    let shift = turn * super::model::vector(joints, 0) * part;
    step[..3].copy_from_slice(shift.as_slice());
    model.step(&mut goals.guess[f], &step);
}
