//! Flights spin freely: while nothing touches the ground, the angular momentum about the centre of mass stays.

use super::span::Flight;
use super::torque_free::{Step, TorqueFreeFlight, Turns, mean_momentum, steps, turn};
use super::trajectory::{Trajectory, share};
use crate::clip::Problem;
use crate::retarget::anchor::Anchor;
use crate::retarget::goals::Goals;
use crate::retarget::model::Model;
use crate::skeleton::Skeleton;
use nalgebra::UnitQuaternion;

/// Largest turn of a flight; beyond it, the flight would be another motion, and stays as it is. Radians. Chosen: turned by
/// half a radian, DeepMimic's backflip is 3.6 cm from its source in the mean instead of 2.4.
const FARTHEST: f64 = 0.5;
/// By how much such a flight is turned for a body that is to perform it, radians. With half a radian, DeepMimic's backflip
/// comes down too fast to stand (survival 0.97 and 0.94 with two seeds); with 0.3 three seeds gave 0.97, 0.97 and 0.94,
/// nearer to the source.
const PART: f64 = 0.3;
/// Needed turn above which even that doesn't help: the source's spin is no spin of a free body. Radians. Chosen.
const ELSEWHERE: f64 = 1.0;
/// Factor of the turn before and after a flight, where only trunk, arms and head turn, and legs stand. Chosen: the former
/// have about half of the body's inertia.
const LEADS: f64 = 2.0;
/// Turn above which the user gets a note, radians. Chosen.
const NOTED: f64 = 0.1;

/// How a frame's body is turned about its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FlightTurn {
    /// World axes.
    pub by: UnitQuaternion<f64>,
    /// Whether the body flies; on the ground it keeps its feet and hands where they stand.
    pub flies: bool,
}

impl FlightTurn {
    /// Turns a pose.
    pub fn apply(&self, skeleton: &Skeleton, qpos: &mut [f64]) {
        turn(skeleton, qpos, &self.by);
    }
}

/// How flights are turned.
pub(super) struct FlightTurns {
    /// By frame; `None` where it stays.
    pub frames: Vec<Option<FlightTurn>>,
    /// The flights that spin freely with that; the others are turned by a part of what they need, or not at all.
    pub free: Vec<Flight>,
}

/// How every frame is turned so that its flight spins freely, and begins and ends with that spin.
pub(super) fn turns(trajectory: &Trajectory, flights: &[Flight]) -> FlightTurns {
    let mut found = FlightTurns {
        frames: vec![None; trajectory.frames.len()],
        free: Vec::new(),
    };
    for flight in flights {
        let Some(turns) = needed(trajectory, flight) else {
            continue;
        };
        // How far it needs to be turned decides whether it is: wholly, in part or not at all.
        let needs = farthest(&turns);
        let Some(turns) = within_reason(turns, trajectory.to_perform) else {
            continue;
        };
        if needs <= FARTHEST {
            found.free.push(flight.clone());
        }
        for (index, turn) in with_leads(flight, &turns, trajectory.fps) {
            if let Some((n, f)) = trajectory.locate(index) {
                // From the axes of the flight's cycle to those of the frame's.
                let heading = trajectory.offset(n).rotation;
                let by = heading.inverse() * turn.by * heading;
                found.frames[f] = Some(FlightTurn { by, ..turn });
            }
        }
    }
    found
}

/// The turns with which a flight spins freely.
fn needed(trajectory: &Trajectory, flight: &Flight) -> Option<Turns> {
    let (a, b) = flight.span;
    let frames: Option<Vec<_>> = (a..=b).map(|index| trajectory.pose(index)).collect();
    let flight = TorqueFreeFlight {
        skeleton: trajectory.model.skeleton,
        frames: &frames?,
        fps: trajectory.fps,
    };
    flight.turns()
}

/// The turns that a flight gets of those that it needs.
fn within_reason(turns: Turns, to_perform: bool) -> Option<Turns> {
    let needs = farthest(&turns);
    if needs <= FARTHEST {
        return Some(turns);
    }
    // All turns in proportion, so that the largest is `PART`: the spin is then as uneven as before, but less so.
    let turns = turns.iter().map(|turn| turn.powf(PART / needs));
    (to_perform && needs < ELSEWHERE).then(|| turns.collect())
}

/// The largest angle, radians.
fn farthest(turns: &[UnitQuaternion<f64>]) -> f64 {
    turns.iter().map(UnitQuaternion::angle).fold(0.0, f64::max)
}

/// A flight's turns, and those before and after it that lead to and from their speed. These are faster, for legs that stand
/// have no part in them, but never farther than those of the flight.
fn with_leads(flight: &Flight, turns: &[UnitQuaternion<f64>], fps: f64) -> Vec<(i64, FlightTurn)> {
    let last = turns.len() - 1;
    let most = farthest(turns);
    let turn = |by, flies| FlightTurn { by, flies };
    let leads = flight.leads(fps).into_iter().map(|lead| {
        // The turn of the frame next to the ground is the speed that the flight begins or ends with.
        let next = [turns[1], turns[last - 1]][lead.end].scaled_axis();
        let by = (next * (LEADS * lead.share)).cap_magnitude(most);
        let by = UnitQuaternion::from_scaled_axis(by);
        (lead.index, turn(by, false))
    });
    let flying = turns.iter().enumerate().take(last).skip(1);
    let flying = flying.map(|(i, by)| (flight.span.0 + i as i64, turn(*by, true)));
    leads.chain(flying).collect()
}

/// How a body spins from frame to frame.
pub(super) struct Spins {
    /// Index of the first frame.
    from: i64,
    steps: Vec<Step>,
}

impl Spins {
    /// From frame `from` to frame `to`.
    pub fn new(trajectory: &Trajectory, (from, to): (i64, i64)) -> Option<Spins> {
        let frames: Option<Vec<_>> = (from..=to).map(|index| trajectory.pose(index)).collect();
        let steps = steps(trajectory.model.skeleton, &frames?, trajectory.fps)?;
        Some(Spins { from, steps })
    }

    /// By how much the speed at which the body turns jumps in frame `a` and in frame `b` if it keeps its momentum in
    /// between, rad/s; for small turns.
    pub fn jolts(&self, (a, b): (i64, i64)) -> Option<[f64; 2]> {
        let at = |index: i64| usize::try_from(index - self.from).ok();
        // Step i leads from frame i to the next, so a flight from a to b has the steps a to b − 1.
        let steps = self.steps.get(at(a)?..at(b)?)?;
        let kept = mean_momentum(steps)?;
        let jolt = |step: &Step| (step.inverse_inertia * (kept - step.momentum)).norm();
        Some([jolt(steps.first()?), jolt(steps.last()?)])
    }
}

/// Turns the targets of frame `f` about the centre of mass of its pose `qpos`; limbs that `anchors` hold keep theirs.
pub(super) fn turn_goals(
    model: &Model,
    goals: &mut Goals,
    f: usize,
    anchors: &[Anchor],
    (qpos, turn): (&[f64], &FlightTurn),
) {
    let com = model.skeleton.com(&model.skeleton.forward(qpos));
    for (key, point) in goals.keypoints.iter().zip(&mut goals.points[f]) {
        let moved = com + turn.by * (*point - com);
        *point = point.lerp(&moved, share(model, key.slot, anchors, turn.flies));
    }
    // A share of a rotation is the same axis with a share of the angle.
    for (goal, rotation) in goals.orientations.iter().zip(&mut goals.rotations[f]) {
        let share = share(model, goal.slot, anchors, turn.flies);
        *rotation = turn.by.powf(share) * *rotation;
    }
}

/// The note `spin-corrected` of flights that were turned far, by up to so many radians; `all` tells whether all of them spin
/// freely now.
pub(super) fn problem(farthest: f64, all: bool) -> Option<Problem> {
    let rest = if all {
        ""
    } else {
        "; a flight that would need more keeps some of the change"
    };
    let message = format!(
        "in a flight the body's spin changed with nothing to push on, so it was turned by up to {:.0} degrees in the air\
         {rest}; this adds to its distance from the source",
        farthest.to_degrees()
    );
    (farthest > NOTED).then(|| Problem::note("spin-corrected", message))
}

#[cfg(test)]
mod tests;
