//! Flights: while nothing touches the ground, the centre of mass follows a parabola.
//!
//! A character of other proportions, or an animator's sense of time, makes flights that no gravity makes. The centre of
//! mass goes from where it left the ground to where it comes down again along c(t) = c₀ + v t − ½ g t², in the time that
//! the source takes; the body is moved along with it, as it is.

use super::goals::Goals;
use super::model::Model;
use super::solve::carried;
use super::spin;
use super::stance::{Anchor, TOUCHES, carries};
use crate::clip::{Problem, Severity};
use crate::humanoid::Slot;
use crate::motion::Cycle;
use crate::skeleton::GRAVITY;
use nalgebra::{Isometry3, Point3, Vector3};

/// Height of the lowest point from which on a body is in the air, and that it reaches in a flight, leg lengths.
const CLEAR: f64 = 0.015;
const HIGH: f64 = 0.03;
/// Height up to which it still pushes, leg lengths; and how long before and after it is clear it is looked for, s.
const PUSHES: f64 = 0.004;
const LEAVES: f64 = 0.05;
/// By how much more the squared speeds of a longer flight may jump at its ends than those of the smoothest.
const JOLTS: f64 = 1.33;
/// What no one sees of that, (m/s)².
const SMOOTH: f64 = 4e-4;
/// Beginnings, and ends, of a flight that are tried beside the first.
const LENGTHS: usize = 4;
/// Shortest flight, s.
const SHORTEST: f64 = 0.1;
/// A flight falls at least half as fast as it should: slower ones are steps with feet that float, …
const SLOWEST: f64 = 0.5;
/// … and it is no further from its parabola than this in any case, leg lengths …
const FARTHEST: f64 = 0.35;
/// … and always meant if it is as near as this, leg lengths.
const NEAR: f64 = 0.04;
/// Time before and after a flight in which the body gathers and takes up the speed that it changes, s.
const GATHERS: f64 = 0.15;

/// A flight that is moved further than this is told of, metres.
const TOLD: f64 = 0.03;

/// How a body is moved, and whether it flies there; elsewhere it keeps its feet and hands on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lift {
    pub shift: Vector3<f64>,
    pub flies: bool,
}

impl Lift {
    pub fn apply(&self, qpos: &mut [f64]) {
        let root = qpos.iter_mut().zip(&self.shift);
        root.for_each(|(x, by)| *x += by);
    }
}

/// A trajectory of poses and what stands in it.
pub(super) struct Air<'a> {
    pub model: &'a Model<'a>,
    /// Without the last one of a cycle.
    pub frames: &'a [Vec<f64>],
    pub anchors: &'a [Vec<Anchor>],
    pub cycle: Option<&'a Cycle>,
    pub fps: f64,
    /// As in [`super::Options`].
    pub to_perform: bool,
}

/// A flight.
#[derive(Clone, Debug)]
pub(super) struct Flight {
    /// Indices of the last frame on the ground before it and of the first after it.
    pub span: (i64, i64),
    /// Frames on the ground before and after it.
    room: [i64; 2],
    /// How many of these frames may belong to the flight: the body is near the ground there, and may still push on it or not.
    near: [i64; 2],
}

impl Flight {
    /// The same flight in the lengths that it may have, some of them where there are many.
    fn lengths(&self) -> impl Iterator<Item = Flight> {
        let ((a, b), [before, after]) = (self.span, self.room);
        let [earlier, later] = self.near.map(|near| {
            let every = (near as usize / LENGTHS).max(1);
            (0..=near).rev().step_by(every)
        });
        let spans = earlier.flat_map(move |i| later.clone().map(move |j| (i, j)));
        spans.map(move |(i, j)| Flight {
            span: (a - i, b + j),
            room: [before - i, after - j],
            near: [0, 0],
        })
    }
}

impl Air<'_> {
    /// All flights, with how every frame is to be moved so that they follow gravity; `None` where it stays.
    pub fn lifts(&self) -> (Vec<Flight>, Vec<Option<Lift>>) {
        let skeleton = self.model.skeleton;
        let bodies: Vec<_> = self.frames.iter().map(|q| skeleton.forward(q)).collect();
        let com: Vec<_> = bodies.iter().map(|b| skeleton.com(b)).collect();
        let low: Vec<_> = bodies.iter().map(|b| skeleton.lowest_point(b)).collect();
        let flights = self.flights(&low);
        let flights = flights.iter().filter_map(|flight| self.meant(flight, &com));
        let flights: Vec<Flight> = flights.collect();
        let lifts = self.lifts_of(&flights);
        (flights, lifts)
    }

    /// How every frame is to be moved so that these flights follow gravity.
    pub fn lifts_of(&self, flights: &[Flight]) -> Vec<Option<Lift>> {
        let skeleton = self.model.skeleton;
        let com = |f: usize| skeleton.com(&skeleton.forward(&self.frames[f]));
        let mut lifts = vec![None; self.frames.len()];
        for flight in flights {
            let Some(shifts) = self.shifts(flight.span, com) else {
                continue;
            };
            for (index, lift) in self.with_ends(flight, &shifts) {
                if let Some((n, f)) = self.locate(index) {
                    let back = self.offset(n).rotation.inverse();
                    let shift = back * lift.shift;
                    lifts[f] = Some(Lift { shift, ..lift });
                }
            }
        }
        lifts
    }

    /// Cycle number and frame of an index; `None` before the first and after the last frame of what doesn't repeat.
    pub fn locate(&self, index: i64) -> Option<(i64, usize)> {
        let count = self.frames.len() as i64;
        let (n, f) = (index.div_euclid(count), index.rem_euclid(count));
        (n == 0 || self.cycle.is_some()).then_some((n, f as usize))
    }

    /// What carries the first cycle to cycle number `n`.
    pub fn offset(&self, n: i64) -> Isometry3<f64> {
        self.cycle
            .map_or_else(Isometry3::identity, |cycle| cycle.offset(n))
    }

    /// The pose of an index, where its cycle has it.
    pub fn pose(&self, index: i64) -> Option<Vec<f64>> {
        let (n, f) = self.locate(index)?;
        let by = self.offset(n);
        let turn = by.rotation.to_rotation_matrix();
        let at = by.translation.vector;
        Some(carried(&self.frames[f], turn.matrix(), &at))
    }

    /// All flights that begin in the frames.
    fn flights(&self, low: &[f64]) -> Vec<Flight> {
        let leg = self.model.skeleton.leg_length();
        let up: Vec<bool> = (0..low.len())
            .map(|f| low[f] > CLEAR * leg && !self.touches(f))
            .collect();
        let is_up = |index: i64| self.locate(index).map(|(_, f)| up[f]);
        let count = self.frames.len() as i64;
        let run = |from: i64, step: i64, state: bool| {
            let on = |i: &i64| is_up(from + step * i) == Some(state);
            (0..=count).take_while(on).count() as i64
        };
        let begins = |f: &i64| is_up(*f) == Some(false) && is_up(f + 1) == Some(true);
        let starts = (0..count).filter(begins);
        let whole = starts.map(|a| (a, a + 1 + run(a + 1, 1, true)));
        let known = whole.filter(|(a, b)| b - a <= count && is_up(*b) == Some(false));
        let high = |(a, b): &(i64, i64)| {
            let mut heights = (a + 1..*b).filter_map(|i| self.locate(i));
            (b - a) as f64 >= SHORTEST * self.fps && heights.any(|(_, f)| low[f] > HIGH * leg)
        };
        let flights = known.filter(high).map(|(a, b)| {
            let [before, after] = [run(a, -1, false), run(b, 1, false)];
            Flight {
                span: (a, b),
                room: [before, after],
                near: [
                    self.leaves(low, (a, -1), (before - 1) / 2),
                    self.leaves(low, (b, 1), (after - 1) / 2),
                ],
            }
        });
        flights.collect()
    }

    /// The longest flight in which a body that falls and spins freely takes over hardly less of its speed, where it leaves the
    /// ground and where it comes down, than in any other; `None` if there is no flight. The longest of all for a body that is to
    /// perform it: it has to have the flight's spin by the time of its last push, which is before the source's speed changes.
    fn meant(&self, flight: &Flight, com: &[Vector3<f64>]) -> Option<Flight> {
        let widest = flight.lengths().next()?.span;
        let spins = spin::Spins::new(self, widest);
        let leg = self.model.skeleton.leg_length();
        let jolt = |flight: &Flight| {
            let shifts = self.shifts(flight.span, |f| com[f])?;
            let moved = shifts[1].norm_squared() + shifts[shifts.len() - 2].norm_squared();
            let turned = spins.as_ref().and_then(|spins| spins.jolts(flight.span));
            let turned = turned.map_or(0.0, |[a, b]| a * a + b * b);
            Some(moved * self.fps.powi(2) + turned * leg.powi(2))
        };
        let all = flight.lengths().filter_map(|one| Some((jolt(&one)?, one)));
        let all: Vec<(f64, Flight)> = all.collect();
        let least = all.iter().map(|(jolt, _)| *jolt);
        let least = least.fold(f64::INFINITY, f64::min);
        let smooth = all
            .into_iter()
            .filter(|(jolt, _)| self.to_perform || *jolt <= JOLTS * least + SMOOTH);
        let lasts = |flight: &Flight| flight.span.1 - flight.span.0;
        let longest = smooth
            .max_by(|(jolt, a), (other, b)| lasts(a).cmp(&lasts(b)).then(other.total_cmp(jolt)));
        longest.map(|(_, flight)| flight)
    }

    /// Frames that a body takes, in direction `step`, from where it is clear of the ground to where it pushes on it: at
    /// most `most`, which leaves a stance between two flights its midst.
    fn leaves(&self, low: &[f64], (from, step): (i64, i64), most: i64) -> i64 {
        let pushes = PUSHES * self.model.skeleton.leg_length();
        let above = |i: &i64| {
            let at = self.locate(from + step * i);
            at.is_some_and(|(_, f)| low[f] > pushes && !self.touches(f))
        };
        let longest = (LEAVES * self.fps).round() as i64;
        (0..longest.min(most)).take_while(above).count() as i64
    }

    /// What stands in a frame or as near to it as a foot needs to leave the ground or to come down: until it flies it stays
    /// where it stood.
    pub fn stood_on(&self, f: usize) -> Vec<Anchor> {
        let reach = (LEAVES * self.fps).round() as i64;
        let around = (f as i64 - reach..=f as i64 + reach).filter_map(|index| self.locate(index));
        around
            .flat_map(|(_, f)| self.anchors[f].iter().copied())
            .collect()
    }

    fn touches(&self, f: usize) -> bool {
        self.anchors[f].iter().any(|a| a.weight >= TOUCHES)
    }

    /// From the frame before the flight to the one after it: how far the centre of mass is from its parabola; `None` if
    /// so far that it is no flight.
    fn shifts(
        &self,
        (a, b): (i64, i64),
        com: impl Fn(usize) -> Vector3<f64>,
    ) -> Option<Vec<Vector3<f64>>> {
        let place = |index: i64| {
            let (n, f) = self.locate(index)?;
            Some((self.offset(n) * Point3::from(com(f))).coords)
        };
        let (start, end) = (place(a)?, place(b)?);
        let duration = (b - a) as f64 / self.fps;
        let gravity = Vector3::z() * GRAVITY;
        let speed = (end - start) / duration + gravity * (duration / 2.0);
        let off = |index: i64| {
            let t = (index - a) as f64 / self.fps;
            Some(start + speed * t - gravity * (t * t / 2.0) - place(index)?)
        };
        let shifts: Vec<_> = (a..=b).map(off).collect::<Option<_>>()?;
        let leg = self.model.skeleton.leg_length();
        let rise = GRAVITY * duration * duration / 8.0;
        let most = (SLOWEST * rise).min(FARTHEST * leg).max(NEAR * leg);
        let farthest = shifts.iter().map(Vector3::norm).fold(0.0, f64::max);
        (farthest <= most).then_some(shifts)
    }

    /// A flight's moves, and before and after it those that lead to and from their speed.
    fn with_ends(&self, flight: &Flight, shifts: &[Vector3<f64>]) -> Vec<(i64, Lift)> {
        let last = shifts.len() - 1;
        let lift = |shift, flies| Lift { shift, flies };
        let ends = self.ends(flight);
        let ends = ends.into_iter().map(|(index, end, share)| {
            let next = [shifts[1], shifts[last - 1]][end];
            (index, lift(next * share, false))
        });
        let flying = shifts.iter().enumerate().take(last).skip(1);
        let flying = flying.map(|(i, shift)| (flight.span.0 + i as i64, lift(*shift, true)));
        ends.chain(flying).collect()
    }

    /// Frames before (0) and after (1) a flight in which the body takes up its speed and leaves it again: how far it
    /// goes there, as a multiple of the way in the frame next to the ground. That is the cubic that begins at rest and
    /// comes back with that speed. A stance between two flights is shared by them.
    pub fn ends(&self, flight: &Flight) -> Vec<(i64, usize, f64)> {
        let longest = (GATHERS * self.fps).round();
        let (a, b) = flight.span;
        let mut found = Vec::new();
        for (end, (from, step)) in [(a, -1), (b, 1)].into_iter().enumerate() {
            let width = longest.min(flight.room[end] as f64 / 2.0);
            for away in 1..width.ceil() as i64 {
                let u = 1.0 - away as f64 / width;
                // In time away from the ground the body goes one such way a frame.
                found.push((from + step * away, end, -width * u * u * (1.0 - u)));
            }
        }
        found
    }
}

/// Moves the goals of a frame.
pub(super) fn lift(model: &Model, goals: &mut Goals, f: usize, anchors: &[Anchor], lift: &Lift) {
    for (key, point) in goals.keys.iter().zip(&mut goals.points[f]) {
        *point += lift.shift * share(model, key.slot, anchors, lift.flies);
    }
}

/// How far a body goes along when the whole is moved: where it doesn't fly, what stands stays and its knee or elbow goes
/// half the way.
pub(super) fn share(model: &Model, slot: Slot, anchors: &[Anchor], flies: bool) -> f64 {
    let end = match slot {
        Slot::LeftLowerLeg => Slot::LeftFoot,
        Slot::RightLowerLeg => Slot::RightFoot,
        Slot::LeftLowerArm => Slot::LeftHand,
        Slot::RightLowerArm => Slot::RightHand,
        slot => slot,
    };
    let stands = !flies && carries(model, end, anchors);
    match (stands, end == slot) {
        (false, _) => 1.0,
        (true, false) => 0.5,
        (true, true) => 0.0,
    }
}

/// Tells of flights that were moved far.
pub(super) fn problem(lifted: f64) -> Option<Problem> {
    (lifted > TOLD).then(|| Problem {
        id: "flight-corrected".to_owned(),
        severity: Severity::Note,
        message: format!(
            "a flight was no free fall, so the body was moved by up to {:.0} cm in the air; the distance from the source's joints has that in it",
            lifted * 100.0
        ),
    })
}

#[cfg(test)]
mod tests;
