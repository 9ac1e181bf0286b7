//! Flights: where the body is in the air, and in which frame each flight begins and ends.
//!
//! It is easy to see when a body is clear of the ground, and hard to see when it stops pushing. So a flight may have any of
//! several lengths. The one is chosen with which the body, falling and spinning freely, changes its speed least at take-off
//! and landing.

use super::ballistic::{self, FlightShift};
use super::span::Flight;
use super::spin::Spins;
use super::trajectory::Trajectory;
use nalgebra::Vector3;

// All chosen, over the jumps, runs and flips at hand.

/// Height of the lowest point above which a body is in the air, leg lengths …
const CLEAR: f64 = 0.015;
/// … and that it reaches somewhere in a flight.
const HIGH: f64 = 0.03;
/// Height of the lowest point up to which a body still pushes on the ground, leg lengths.
const PUSHES: f64 = 0.004;
/// Shortest flight, s.
const SHORTEST: f64 = 0.1;
/// A longer flight is preferred whose jumps of speed, squared and added up, are at most this multiple of the smoothest one's …
const JOLTS: f64 = 1.33;
/// … plus this, (m/s)²: jumps of 2 cm/s that nobody sees.
const UNSEEN: f64 = 4e-4;

/// All flights, and how every frame is shifted so that they fall freely; `None` where it stays.
pub(super) fn find(trajectory: &Trajectory) -> (Vec<Flight>, Vec<Option<FlightShift>>) {
    let skeleton = trajectory.model.skeleton;
    let frames = trajectory.frames.iter();
    let bodies: Vec<_> = frames.map(|q| skeleton.forward(q)).collect();
    let com: Vec<_> = bodies.iter().map(|b| skeleton.com(b)).collect();
    let low: Vec<_> = bodies.iter().map(|b| skeleton.lowest_point(b)).collect();
    let flights = in_the_air(trajectory, &low);
    let flights = flights.iter();
    let flights: Vec<Flight> = flights
        .filter_map(|flight| choose(trajectory, flight, &com))
        .collect();
    let shifts = ballistic::shifts(trajectory, &flights);
    (flights, shifts)
}

/// The flights that begin in the frames, at their shortest; `low[f]` is the height of the lowest point, metres.
fn in_the_air(trajectory: &Trajectory, low: &[f64]) -> Vec<Flight> {
    let leg = trajectory.model.skeleton.leg_length();
    let up: Vec<bool> = (0..low.len())
        .map(|f| low[f] > CLEAR * leg && !trajectory.touches(f))
        .collect();
    let is_up = |index: i64| trajectory.locate(index).map(|(_, f)| up[f]);
    let count = trajectory.frames.len() as i64;
    // How many frames on from one, in the direction `step`, are all in the air or all on the ground.
    let run = |from: i64, step: i64, state: bool| {
        let on = |i: &i64| is_up(from + step * i) == Some(state);
        (0..=count).take_while(on).count() as i64
    };
    let begins = |f: &i64| is_up(*f) == Some(false) && is_up(f + 1) == Some(true);
    let starts = (0..count).filter(begins);
    let whole = starts.map(|a| (a, a + 1 + run(a + 1, 1, true)));
    // The speed of a flight that begins or ends outside of the clip is unknown.
    let known = whole.filter(|(a, b)| b - a <= count && is_up(*b) == Some(false));
    let high = |(a, b): &(i64, i64)| {
        let mut heights = (a + 1..*b).filter_map(|i| trajectory.locate(i));
        (b - a) as f64 >= SHORTEST * trajectory.fps && heights.any(|(_, f)| low[f] > HIGH * leg)
    };
    let flights = known.filter(high).map(|(a, b)| {
        let [before, after] = [run(a, -1, false), run(b, 1, false)];
        // At most half of a stance between two flights, less its middle frame, may belong to each.
        Flight {
            span: (a, b),
            room: [before, after],
            near: [
                near_ground(trajectory, low, (a, -1), (before - 1) / 2),
                near_ground(trajectory, low, (b, 1), (after - 1) / 2),
            ],
        }
    });
    flights.collect()
}

/// How many frames a body takes, from index `from` in direction `step`, to where it pushes on the ground: at most `most`.
fn near_ground(trajectory: &Trajectory, low: &[f64], (from, step): (i64, i64), most: i64) -> i64 {
    let pushes = PUSHES * trajectory.model.skeleton.leg_length();
    let above = |i: &i64| {
        let at = trajectory.locate(from + step * i);
        at.is_some_and(|(_, f)| low[f] > pushes && !trajectory.touches(f))
    };
    // The body leaves the ground within a few frames; what takes longer is standing on tiptoe.
    let longest = trajectory.near();
    (0..longest.min(most)).take_while(above).count() as i64
}

/// The length of a flight: the longest whose body changes its speed hardly more at take-off and landing than that of the
/// smoothest. `None` if no length is a free fall.
///
/// A body that is to perform the motion gets the longest of all. It has to have the flight's spin by the time of its last
/// push, which is before the source's speed changes: with the smoothest flight of DeepMimic's jump, survival was 0.97
/// instead of 1.00.
fn choose(trajectory: &Trajectory, flight: &Flight, com: &[Vector3<f64>]) -> Option<Flight> {
    let widest = flight.lengths().next()?.span;
    let spins = Spins::new(trajectory, widest);
    let leg = trajectory.model.skeleton.leg_length();
    // Squared jumps of velocity; those of turning count at the distance of a leg from the centre of mass.
    let jolt = |flight: &Flight| {
        let off = ballistic::off_parabola(trajectory, flight.span, |f| com[f])?;
        let moved = off[1].norm_squared() + off[off.len() - 2].norm_squared();
        let turned = spins.as_ref().and_then(|spins| spins.jolts(flight.span));
        let turned = turned.map_or(0.0, |[a, b]| a * a + b * b);
        Some(moved * trajectory.fps.powi(2) + turned * leg.powi(2))
    };
    let all = flight.lengths().filter_map(|one| Some((jolt(&one)?, one)));
    let all: Vec<(f64, Flight)> = all.collect();
    let least = all.iter().map(|(jolt, _)| *jolt);
    let least = least.fold(f64::INFINITY, f64::min);
    let smooth = all
        .into_iter()
        .filter(|(jolt, _)| trajectory.to_perform || *jolt <= JOLTS * least + UNSEEN);
    let lasts = |flight: &Flight| flight.span.1 - flight.span.0;
    let longest =
        smooth.max_by(|(jolt, a), (other, b)| lasts(a).cmp(&lasts(b)).then(other.total_cmp(jolt)));
    longest.map(|(_, flight)| flight)
}

#[cfg(test)]
mod tests;
