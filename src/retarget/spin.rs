//! Flights spin freely: while nothing touches the ground, the angular momentum about the centre of mass stays.
//!
//! The body is turned as it is, as a whole and about its centre of mass, by a rotation δ that gives it the same momentum L̄
//! in every step and is none at both ends of the flight. For small turns I(t) δ̇ = L̄ − L(t), so L̄ = (∫ I⁻¹)⁻¹ ∫ I⁻¹ L; from
//! there L̄ is found by shooting: what δ is at the end tells how far L̄ is off (Newton's method).

use super::flight::{Air, Flight, share};
use super::goals::Goals;
use super::model::{Model, put_quaternion, quaternion, vector};
use super::stance::Anchor;
use crate::clip::{Problem, Severity};
use crate::skeleton::{Skeleton, Twist};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

/// Most corrections of the momentum of a flight, and of the turn of a step.
const SHOTS: usize = 12;
const CORRECTIONS: usize = 16;
/// What may be left of the turn at the end of a flight, and of a step's correction, radians.
const LEFT: [f64; 2] = [1e-5, 1e-6];
/// A step that leaves less than this share of the turn leads on well.
const CHORD: f64 = 0.3;
/// Share of the momentum by which it is varied to see what that gives.
const VARIED: f64 = 1e-3;
/// A flight that would have to be turned further is another motion then, and stays as it is. Radians.
const FARTHEST: f64 = 0.5;
/// By how much such a flight is turned for a body that is to perform it: with more of it DeepMimic's backflip comes down too
/// fast to stand. Radians.
const PART: f64 = 0.3;
/// From here on not even that helps: the spin comes from elsewhere. Radians.
const ELSEWHERE: f64 = 1.0;
/// How much faster than the whole body what doesn't stand turns, before a flight and after it: trunk, arms and head have
/// about half of the body's inertia.
const LEADS: f64 = 2.0;
/// A flight that is turned further than this is told of, radians.
const TOLD: f64 = 0.1;

/// What happens from one frame to the next.
struct Step {
    /// Mean angular momentum, kg·m²/s.
    momentum: Vector3<f64>,
    /// Of the whole body's inertia about its centre of mass, 1/(kg·m²).
    inverse_inertia: Matrix3<f64>,
}

/// How a body is turned about its centre of mass, and whether it flies there; elsewhere it keeps its feet and hands on the
/// ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tilt {
    pub by: UnitQuaternion<f64>,
    pub flies: bool,
}

impl Tilt {
    pub fn apply(&self, skeleton: &Skeleton, qpos: &mut [f64]) {
        turn(skeleton, qpos, &self.by);
    }
}

/// The turns of a flight, none in the first and the last.
type Turns = Vec<UnitQuaternion<f64>>;

/// How flights are turned.
pub(super) struct Tilts {
    /// By frame; `None` where it stays.
    pub frames: Vec<Option<Tilt>>,
    /// The flights that spin freely with that; the others were turned by a part of it, or not at all.
    pub free: Vec<Flight>,
}

/// How every frame is to be turned so that its flight spins freely, and begins and ends with that spin.
pub(super) fn tilts(air: &Air, flights: &[Flight]) -> Tilts {
    let mut tilts = Tilts {
        frames: vec![None; air.frames.len()],
        free: Vec::new(),
    };
    for flight in flights {
        let (a, b) = flight.span;
        let frames: Option<Vec<_>> = (a..=b).map(|index| air.pose(index)).collect();
        let turns = frames.and_then(|f| freely(air.model.skeleton, &f, air.fps));
        let Some((needs, turns)) = turns.map(|turns| (farthest(&turns), turns)) else {
            continue;
        };
        let Some(turns) = within_reason(turns, air.to_perform) else {
            continue;
        };
        if needs <= FARTHEST {
            tilts.free.push(flight.clone());
        }
        for (index, tilt) in with_ends(air, flight, &turns) {
            if let Some((n, f)) = air.locate(index) {
                let heading = air.offset(n).rotation;
                let by = heading.inverse() * tilt.by * heading;
                tilts.frames[f] = Some(Tilt { by, ..tilt });
            }
        }
    }
    tilts
}

/// The turns that a flight gets of those that it needs.
fn within_reason(turns: Turns, to_perform: bool) -> Option<Turns> {
    let needs = farthest(&turns);
    if needs <= FARTHEST {
        return Some(turns);
    }
    let turns = turns.iter().map(|turn| turn.powf(PART / needs));
    (to_perform && needs < ELSEWHERE).then(|| turns.collect())
}

fn farthest(turns: &[UnitQuaternion<f64>]) -> f64 {
    turns.iter().map(UnitQuaternion::angle).fold(0.0, f64::max)
}

/// A flight's turns, and before and after it those that lead to and from their speed: the faster, as legs that stand have
/// no part in them, but no farther than those of the flight.
fn with_ends(air: &Air, flight: &Flight, turns: &[UnitQuaternion<f64>]) -> Vec<(i64, Tilt)> {
    let last = turns.len() - 1;
    let most = farthest(turns);
    let tilt = |by, flies| Tilt { by, flies };
    let ends = air.ends(flight).into_iter().map(|(index, end, share)| {
        let next = [turns[1], turns[last - 1]][end].scaled_axis();
        let by = (next * (LEADS * share)).cap_magnitude(most);
        let by = UnitQuaternion::from_scaled_axis(by);
        (index, tilt(by, false))
    });
    let flying = turns.iter().enumerate().take(last).skip(1);
    let flying = flying.map(|(i, by)| (flight.span.0 + i as i64, tilt(*by, true)));
    ends.chain(flying).collect()
}

/// How a body spins from frame to frame.
pub(super) struct Spins {
    /// Index of the first frame.
    from: i64,
    steps: Vec<Step>,
}

impl Spins {
    /// From frame `from` to frame `to`.
    pub fn new(air: &Air, (from, to): (i64, i64)) -> Option<Spins> {
        let frames: Option<Vec<_>> = (from..=to).map(|index| air.pose(index)).collect();
        let steps = steps(air.model.skeleton, &frames?, air.fps)?;
        Some(Spins { from, steps })
    }

    /// By how much the speed at which a body turns jumps in frame `a` and in frame `b`, if it keeps its momentum in between;
    /// rad/s, for small turns.
    pub fn jolts(&self, (a, b): (i64, i64)) -> Option<[f64; 2]> {
        let at = |index: i64| usize::try_from(index - self.from).ok();
        let steps = self.steps.get(at(a)?..at(b)?)?;
        let kept = kept(steps)?;
        let jolt = |step: &Step| (step.inverse_inertia * (kept - step.momentum)).norm();
        Some([jolt(steps.first()?), jolt(steps.last()?)])
    }
}

fn steps(skeleton: &Skeleton, frames: &[Vec<f64>], fps: f64) -> Option<Vec<Step>> {
    let pairs = frames.windows(2);
    pairs.map(|pair| step(skeleton, pair, fps)).collect()
}

/// The momentum that a body keeps which turns as far as in these steps.
fn kept(steps: &[Step]) -> Option<Vector3<f64>> {
    let ease: Matrix3<f64> = steps.iter().map(|s| s.inverse_inertia).sum();
    let spun: Vector3<f64> = steps.iter().map(|s| s.inverse_inertia * s.momentum).sum();
    Some(ease.try_inverse()? * spun)
}

/// The turns of a flight, from the last frame on the ground to the first after it.
fn freely(skeleton: &Skeleton, frames: &[Vec<f64>], fps: f64) -> Option<Turns> {
    let toss = Toss {
        skeleton,
        frames,
        fps,
    };
    toss.hit(kept(&steps(skeleton, frames, fps)?)?)
}

/// The frames of a flight, and their rate.
struct Toss<'a> {
    skeleton: &'a Skeleton,
    frames: &'a [Vec<f64>],
    fps: f64,
}

impl Toss<'_> {
    /// The turns that end with none, for a momentum that is near to this one.
    fn hit(&self, mut kept: Vector3<f64>) -> Option<Turns> {
        let (mut turns, mut off) = self.shoot(&kept)?;
        let mut gives: Option<Matrix3<f64>> = None;
        for _ in 0..SHOTS {
            if off.norm() < LEFT[0] {
                *turns.last_mut()? = UnitQuaternion::identity();
                return Some(turns);
            }
            let stiff = match gives {
                Some(stiff) => stiff,
                None => self.stiffness(&kept, &off)?,
            };
            let mut step = stiff * off;
            let mut found = self.shoot(&(kept - step))?;
            if found.1.norm() > off.norm() {
                // A whole step may lead too far.
                step /= 2.0;
                found = self.shoot(&(kept - step))?;
            }
            // As long as it leads on well, what a change gives needn't be asked again.
            gives = (found.1.norm() < CHORD * off.norm()).then_some(stiff);
            kept -= step;
            (turns, off) = found;
        }
        None
    }

    /// The turns that keep a momentum, and what is left of them at the end.
    fn shoot(&self, kept: &Vector3<f64>) -> Option<(Turns, Vector3<f64>)> {
        let turns = spinning(self.skeleton, self.frames, self.fps, kept)?;
        let off = turns.last()?.scaled_axis();
        Some((turns, off))
    }

    /// The change of momentum for a change of the turn at the end, where that is `off`.
    fn stiffness(&self, kept: &Vector3<f64>, off: &Vector3<f64>) -> Option<Matrix3<f64>> {
        let by = VARIED * kept.norm().max(1.0);
        let varied = |i| Some((self.shoot(&(kept + Vector3::ith(i, by)))?.1 - off) / by);
        Matrix3::from_columns(&[varied(0)?, varied(1)?, varied(2)?]).try_inverse()
    }
}

/// The turns with which the frames keep a momentum, from none on.
fn spinning(
    skeleton: &Skeleton,
    frames: &[Vec<f64>],
    fps: f64,
    kept: &Vector3<f64>,
) -> Option<Vec<UnitQuaternion<f64>>> {
    let mut turns = vec![UnitQuaternion::identity()];
    for pair in frames.windows(2) {
        let mut by = *turns.last()?;
        let mut pair = pair.to_vec();
        turn(skeleton, &mut pair[0], &by);
        let ease = inertia(skeleton, &skeleton.forward(&pair[0])).try_inverse()?;
        let next = pair[1].clone();
        for _ in 0..CORRECTIONS {
            pair[1].clone_from(&next);
            turn(skeleton, &mut pair[1], &by);
            let more = ease * (kept - momentum(skeleton, &pair, fps)) / fps;
            by = UnitQuaternion::from_scaled_axis(more) * by;
            if more.norm() < LEFT[1] {
                break;
            }
        }
        turns.push(by);
    }
    Some(turns)
}

fn step(skeleton: &Skeleton, pair: &[Vec<f64>], fps: f64) -> Option<Step> {
    Some(Step {
        momentum: momentum(skeleton, pair, fps),
        inverse_inertia: inertia(skeleton, &skeleton.forward(&pair[0])).try_inverse()?,
    })
}

/// Mean angular momentum from a frame to the next.
fn momentum(skeleton: &Skeleton, pair: &[Vec<f64>], fps: f64) -> Vector3<f64> {
    let qvel = skeleton.differentiate(&pair[0], &pair[1], 1.0 / fps);
    let momentum = |qpos: &Vec<f64>| {
        let poses = skeleton.forward(qpos);
        skeleton.momentum(&poses, &skeleton.twists(qpos, &qvel)).1
    };
    (momentum(&pair[0]) + momentum(&pair[1])) / 2.0
}

/// The whole body's inertia about its centre of mass, world axes: a column is the momentum of a turn at 1 rad/s.
fn inertia(skeleton: &Skeleton, poses: &[Isometry3<f64>]) -> Matrix3<f64> {
    let com = skeleton.com(poses);
    let column = |axis: Vector3<f64>| {
        let twist = |pose: &Isometry3<f64>| Twist {
            linear: axis.cross(&(pose.translation.vector - com)),
            angular: axis,
        };
        let twists: Vec<Twist> = poses.iter().map(twist).collect();
        skeleton.momentum(poses, &twists).1
    };
    Matrix3::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z()].map(column))
}

/// Turns a pose about its centre of mass.
fn turn(skeleton: &Skeleton, qpos: &mut [f64], by: &UnitQuaternion<f64>) {
    let com = skeleton.com(&skeleton.forward(qpos));
    let root = com + by * (vector(qpos, 0) - com);
    qpos[..3].copy_from_slice(root.as_slice());
    put_quaternion(qpos, 3, &(by * quaternion(qpos, 3)));
}

/// Turns the goals of a frame about the centre of mass of its pose; what stands keeps its own.
pub(super) fn tilt_goals(
    model: &Model,
    goals: &mut Goals,
    f: usize,
    anchors: &[Anchor],
    (qpos, tilt): (&[f64], &Tilt),
) {
    let com = model.skeleton.com(&model.skeleton.forward(qpos));
    for (key, point) in goals.keys.iter().zip(&mut goals.points[f]) {
        let moved = com + tilt.by * (*point - com);
        *point = point.lerp(&moved, share(model, key.slot, anchors, tilt.flies));
    }
    for (goal, rotation) in goals.turns.iter().zip(&mut goals.rotations[f]) {
        let share = share(model, goal.slot, anchors, tilt.flies);
        *rotation = tilt.by.powf(share) * *rotation;
    }
}

/// Tells of flights that were turned far, and whether `all` of them spin freely now.
pub(super) fn problem(turned: f64, all: bool) -> Option<Problem> {
    let rest = if all {
        ""
    } else {
        "; where it takes more than that, some of the change is left"
    };
    (turned > TOLD).then(|| Problem {
        id: "spin-corrected".to_owned(),
        severity: Severity::Note,
        message: format!(
            "in a flight the body's spin changed with nothing to push on, so it was turned by up to {:.0} degrees in the air{rest}; the distance from the source's joints has that in it",
            turned.to_degrees()
        ),
    })
}

#[cfg(test)]
mod tests;
