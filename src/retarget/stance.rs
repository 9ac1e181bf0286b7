//! Which points of feet and hands rest on the ground when, and where.

use super::footing;
use super::goals::Goals;
use super::ground::Points;
use super::model::{Model, Pose};
use super::report::Contact;
use super::rest::stances;
use super::seam::Closed;
use super::source::HANDS;
use crate::clip::LoopMode;
use crate::humanoid::Slot;
use crate::motion::{Cycle, contact};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// A point that should stay where it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor {
    /// Index in [`Model::knobs`].
    pub knob: usize,
    /// Where the knob's centre should be, world, metres.
    pub at: Vector3<f64>,
    /// How near the ground it stands, from 0 to 1.
    pub weight: f64,
    /// How firmly it is held there, from 0 to 1: a stance takes hold and lets go in some frames.
    pub hold: f64,
}

/// A foot or hand: its key among the goals, and the knobs that it carries.
struct Limb {
    key: usize,
    is_foot: bool,
    knobs: Vec<usize>,
}

const FEET: [Slot; 2] = [Slot::LeftFoot, Slot::RightFoot];

/// Heights, in leg lengths, up to which a standing point is held fully, and from which on not at all.
const HELD: [f64; 2] = [0.015, 0.05];

/// The same for hands, whose source's wrists stay above the ground.
const HAND_HELD: [f64; 2] = [0.12, 0.2];
/// A hand stands on what is this near to its lowest point, metres.
const PALM: f64 = 0.02;

fn limbs(model: &Model, goals: &Goals) -> Vec<Limb> {
    let slots = FEET
        .into_iter()
        .map(|s| (s, true))
        .chain(HANDS.into_iter().map(|s| (s, false)));
    slots
        .filter_map(|(slot, is_foot)| {
            let key = goals.keys.iter().position(|key| key.slot == slot)?;
            let body = goals.keys[key].body;
            let carried = |k: &usize| {
                let knob = &model.knobs[*k];
                under(model, body, knob.body) && (knob.sole || !is_foot)
            };
            let knobs = (0..model.knobs.len()).filter(carried).collect();
            Some(Limb {
                key,
                is_foot,
                knobs,
            })
        })
        .collect()
}

fn under(model: &Model, top: usize, body: usize) -> bool {
    std::iter::successors(Some(body), |b| model.skeleton.bodies[*b].parent).any(|b| b == top)
}

/// Whether the body in `slot` or one that hangs on it stands.
pub(super) fn carries(model: &Model, slot: Slot, anchors: &[Anchor]) -> bool {
    let body = model.skeleton.slots.get(&slot);
    let stands = |body: &usize| {
        let mut knobs = anchors.iter().map(|a| model.knobs[a.knob].body);
        knobs.any(|knob| under(model, *body, knob))
    };
    body.is_some_and(stands)
}

/// Bodies that may touch the ground: feet with what hangs on them, and hands if the clip sets them down.
pub(super) fn contact_bodies(model: &Model, goals: &Goals, anchors: &[Vec<Anchor>]) -> Vec<usize> {
    let used = |body: usize| {
        anchors
            .iter()
            .flatten()
            .any(|a| model.knobs[a.knob].body == body)
    };
    let mut bodies: Vec<usize> = Vec::new();
    for limb in limbs(model, goals) {
        for knob in limb.knobs {
            let body = model.knobs[knob].body;
            if !bodies.contains(&body) && (limb.is_foot || used(body)) {
                bodies.push(body);
            }
        }
    }
    bodies.sort_unstable();
    bodies
}

/// The source's contacts on the skeleton's bodies, as far as the source stands still in them.
pub(super) fn measured(
    model: &Model,
    goals: &Goals,
    contacts: Vec<Contacts>,
    is_still: impl Fn(Slot, usize) -> bool,
) -> Vec<Contact> {
    let limbs = limbs(model, goals);
    let on_bodies = |(slot, touches): Contacts| {
        let limb = limbs.iter().find(|l| goals.keys[l.key].slot == slot)?;
        let mut bodies: Vec<usize> = limb.knobs.iter().map(|k| model.knobs[*k].body).collect();
        bodies.dedup();
        let stands = touches.iter().enumerate();
        let stands = stands
            .map(|(f, touches)| *touches && is_still(slot, f))
            .collect();
        Some(Contact {
            bodies,
            touches,
            stands,
        })
    };
    contacts.into_iter().filter_map(on_bodies).collect()
}

/// Weight from which on an anchor means contact.
pub(super) const TOUCHES: f64 = 0.5;

/// `contact[f][c]`: whether contact body `c` stands at frame `f`.
pub(super) fn contact(model: &Model, anchors: &[Vec<Anchor>], bodies: &[usize]) -> Vec<Vec<bool>> {
    let stands = |frame: &Vec<Anchor>, body: usize| {
        frame
            .iter()
            .any(|a| a.weight >= TOUCHES && model.knobs[a.knob].body == body)
    };
    let row = |frame: &Vec<Anchor>| bodies.iter().map(|b| stands(frame, *b)).collect();
    anchors.iter().map(row).collect()
}

/// `paths[limb][knob][f]`: centre of a limb's knob when the limb is where and turned as its goals say.
fn paths(model: &Model, goals: &Goals, limbs: &[Limb]) -> Vec<Vec<Vec<Vector3<f64>>>> {
    let mut pose: Pose = model.empty_pose();
    let mut paths: Vec<Vec<Vec<Vector3<f64>>>> = limbs
        .iter()
        .map(|limb| vec![Vec::new(); limb.knobs.len()])
        .collect();
    for f in 0..goals.frames() {
        model.evaluate(&goals.guess[f], &mut pose);
        for (limb, paths) in limbs.iter().zip(&mut paths) {
            let key = goals.keys[limb.key].body;
            let guessed = pose.bodies[key];
            // A chain of hinges can't be guessed well; where the limb is to turn is known all the same.
            let wanted = goals.turns.iter().position(|turn| turn.body == key);
            let wanted = wanted.map_or(guessed.rotation, |t| goals.rotations[f][t]);
            let goal = Isometry3::from_parts(goals.points[f][limb.key].into(), wanted);
            let moved = goal * guessed.inverse();
            for (knob, path) in limb.knobs.iter().zip(paths) {
                let knob = &model.knobs[*knob];
                let at = pose.bodies[knob.body] * nalgebra::Point3::from(knob.center);
                path.push((moved * at).coords);
            }
        }
    }
    paths
}

/// `soles[f][k]`: every foot knob's lowest point.
pub(super) fn soles(model: &Model, goals: &Goals) -> Vec<Vec<Vector3<f64>>> {
    let mut feet = limbs(model, goals);
    feet.retain(|limb| limb.is_foot);
    let mut soles: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); goals.frames()];
    for (limb, paths) in feet.iter().zip(&paths(model, goals, &feet)) {
        for (knob, path) in limb.knobs.iter().zip(paths) {
            let down = Vector3::z() * model.knobs[*knob].radius;
            for (f, p) in path.iter().enumerate() {
                soles[f].push(p - down);
            }
        }
    }
    soles
}

/// What the ground is found from.
pub(super) fn ground_points(model: &Model, goals: &Goals) -> Points {
    let soles = soles(model, goals);
    let feet = limbs(model, goals).into_iter().filter(|l| l.is_foot);
    let in_feet: Vec<usize> = feet.flat_map(|limb| limb.knobs).collect();
    let others = |k: &usize| !in_feet.contains(k);
    let others: Vec<usize> = (0..model.knobs.len()).filter(others).collect();
    let mut pose = model.empty_pose();
    let all = |(qpos, soles): (&Vec<f64>, &Vec<Vector3<f64>>)| {
        model.evaluate(qpos, &mut pose);
        let place = |k: &usize| {
            let knob = &model.knobs[*k];
            let at = pose.bodies[knob.body] * nalgebra::Point3::from(knob.center);
            at.coords - Vector3::z() * knob.radius
        };
        soles
            .iter()
            .copied()
            .chain(others.iter().map(place))
            .collect()
    };
    let all = goals.guess.iter().zip(&soles).map(all).collect();
    Points { soles, all }
}

/// The goals' timeline; a wrapping one goes on for a cycle on both sides, so that stances may pass over the seam.
struct Timeline {
    frames: usize,
    margin: usize,
    cycle: Option<Isometry3<f64>>,
}

/// A foot or hand, and whether the source's stands, by frame.
pub(super) type Contacts = (Slot, Vec<bool>);

impl Timeline {
    fn new(frames: usize, cycle: Option<&Cycle>) -> Timeline {
        let margin = frames.saturating_sub(1);
        let step = cycle.map(|c| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), c.heading);
            Isometry3::from_parts(c.translation.into(), turn)
        });
        Timeline {
            frames,
            margin: if step.is_some() { margin } else { 0 },
            cycle: step,
        }
    }

    /// A path over the whole timeline, from its own frames.
    fn extend(&self, path: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let Some(step) = self.cycle else {
            return path.to_vec();
        };
        let cycle = self.frames - 1;
        let moved =
            |by: &Isometry3<f64>, p: &Vector3<f64>| (by * nalgebra::Point3::from(*p)).coords;
        let back = step.inverse();
        let before = path[cycle - self.margin..cycle]
            .iter()
            .map(|p| moved(&back, p));
        let after = path[1..=self.margin].iter().map(|p| moved(&step, p));
        before.chain(path.iter().copied()).chain(after).collect()
    }

    /// The same of something that is alike in every cycle.
    fn repeat(&self, flags: &[bool]) -> Vec<bool> {
        if self.cycle.is_none() {
            return flags.to_vec();
        }
        let cycle = self.frames - 1;
        let parts = [
            &flags[cycle - self.margin..cycle],
            flags,
            &flags[1..=self.margin],
        ];
        parts.concat()
    }
}

/// A knob that stands in a frame: where the goals have it, and where it should be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub knob: usize,
    pub from: Vector3<f64>,
    pub at: Vector3<f64>,
    pub weight: f64,
    pub hold: f64,
}

/// Finds what stands on the ground, which is at z = 0, and moves the goals of feet and hands along with it.
/// Returns the anchors of every frame.
pub(super) fn plant(
    model: &Model,
    goals: &mut Goals,
    contacts: &[Contacts],
    fps: f64,
    leg: f64,
    seam: Option<(&Cycle, &Closed)>,
) -> Vec<Vec<Anchor>> {
    let limbs = limbs(model, goals);
    let timeline = Timeline::new(goals.frames(), seam.map(|(cycle, _)| cycle));
    let mut anchors = vec![Vec::new(); goals.frames()];
    for (limb, paths) in limbs.iter().zip(paths(model, goals, &limbs)) {
        let paths: Vec<Vec<Vector3<f64>>> = paths.iter().map(|p| timeline.extend(p)).collect();
        let slot = goals.keys[limb.key].slot;
        let touches = contacts.iter().find(|contact| contact.0 == slot);
        let hidden = |f: usize| seam.is_some_and(|(_, closed)| closed.hides_stance(limb.key, f));
        // What a closed seam moved is believed to stand where the source's does, as hands are everywhere.
        let believed = |(f, touches): (usize, &bool)| *touches && (!limb.is_foot || hidden(f));
        let told =
            |flags: &Vec<bool>| -> Vec<bool> { flags.iter().enumerate().map(believed).collect() };
        let touches = touches.map(|(_, flags)| timeline.repeat(&told(flags)));
        let held = held(model, limb, &paths, touches.as_deref(), fps, leg);
        let own: Vec<Vector3<f64>> = goals.points.iter().map(|points| points[limb.key]).collect();
        let moves = footing::moves(&held, &timeline.extend(&own), fps);
        let own = held.iter().zip(&moves).skip(timeline.margin);
        for (f, (frame, (held, by))) in anchors.iter_mut().zip(own).enumerate() {
            let anchor = |h: &Held| Anchor {
                knob: h.knob,
                at: h.at,
                weight: h.weight,
                hold: h.hold,
            };
            frame.extend(held.iter().map(anchor));
            footing::apply(goals, f, limb.key, by);
        }
    }
    anchors
}

/// The knobs of a limb that stand, by frame. Feet stand where they rest low or the source says so; hands where the source's
/// do, which holds its wrist higher.
fn held(
    model: &Model,
    limb: &Limb,
    paths: &[Vec<Vector3<f64>>],
    touches: Option<&[bool]>,
    fps: f64,
    leg: f64,
) -> Vec<Vec<Held>> {
    let frames = paths.first().map_or(0, Vec::len);
    let bottom = |k: usize, f: usize| paths[k][f].z - model.knobs[limb.knobs[k]].radius;
    let mut held: Vec<Vec<Held>> = vec![Vec::new(); frames];
    for (k, (&knob, path)) in limb.knobs.iter().zip(paths).enumerate() {
        let radius = model.knobs[knob].radius;
        let weights: Vec<f64> = if limb.is_foot {
            let sole = |p: &Vector3<f64>| vec![p - Vector3::z() * radius];
            let soles: Vec<Vec<Vector3<f64>>> = path.iter().map(sole).collect();
            let rests = contact::detect_above(&soles, 0.0, fps, leg, LoopMode::Clamp);
            let weight = |f: usize| ramp(HELD, bottom(k, f) / leg);
            let stands = |f: usize| rests[f] || touches.is_some_and(|t| t[f]);
            (0..frames)
                .map(|f| if stands(f) { weight(f) } else { f64::NAN })
                .collect()
        } else {
            let lowest = |f: usize| (0..paths.len()).all(|o| bottom(k, f) < bottom(o, f) + PALM);
            let stands = |f: usize| touches.is_some_and(|t| t[f]) && lowest(f);
            let weight = |f: usize| ramp(HAND_HELD, bottom(k, f) / leg);
            (0..frames)
                .map(|f| if stands(f) { weight(f) } else { f64::NAN })
                .collect()
        };
        for (f, at, weight, hold) in stances(path, &weights, radius, fps, leg) {
            held[f].push(Held {
                knob,
                from: path[f],
                at,
                weight,
                // Hands are led to the ground and away from it by their goals.
                hold: if limb.is_foot { hold } else { weight },
            });
        }
    }
    held
}

/// 1 up to the first height, 0 from the second on.
pub(super) fn ramp([full, none]: [f64; 2], height: f64) -> f64 {
    ((none - height) / (none - full)).clamp(0.0, 1.0)
}
