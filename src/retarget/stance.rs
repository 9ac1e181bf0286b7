//! Which points of feet and hands rest on the ground when, and where; and how high the ground is.

use super::footing;
use super::goals::Goals;
use super::model::{Model, Pose};
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
    /// From 0 to 1.
    pub weight: f64,
}

/// A foot or hand: its key among the goals, and the knobs that it carries.
struct Limb {
    key: usize,
    is_foot: bool,
    knobs: Vec<usize>,
}

const FEET: [Slot; 2] = [Slot::LeftFoot, Slot::RightFoot];
const HANDS: [Slot; 2] = [Slot::LeftHand, Slot::RightHand];

/// Heights, in leg lengths, up to which a standing point is held fully, and from which on not at all.
const HELD: [f64; 2] = [0.015, 0.05];

fn limbs(model: &Model, goals: &Goals) -> Vec<Limb> {
    let slots = FEET
        .into_iter()
        .map(|s| (s, true))
        .chain(HANDS.into_iter().map(|s| (s, false)));
    slots
        .filter_map(|(slot, is_foot)| {
            let key = goals.keys.iter().position(|key| key.slot == slot)?;
            let body = goals.keys[key].body;
            let carried = |k: &usize| under(model, body, model.knobs[*k].body);
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

/// Weight from which on an anchor means contact.
const TOUCHES: f64 = 0.5;

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

/// `paths[limb][knob][f]`: centre of a limb's knob when the limb's key is at its goal.
fn paths(model: &Model, goals: &Goals, limbs: &[Limb]) -> Vec<Vec<Vec<Vector3<f64>>>> {
    let mut pose: Pose = model.empty_pose();
    let mut paths: Vec<Vec<Vec<Vector3<f64>>>> = limbs
        .iter()
        .map(|limb| vec![Vec::new(); limb.knobs.len()])
        .collect();
    for f in 0..goals.frames() {
        model.evaluate(&goals.guess[f], &mut pose);
        for (limb, paths) in limbs.iter().zip(&mut paths) {
            let guessed = pose.bodies[goals.keys[limb.key].body].translation.vector;
            let offset = goals.points[f][limb.key] - guessed;
            for (knob, path) in limb.knobs.iter().zip(paths) {
                let knob = &model.knobs[*knob];
                let at = pose.bodies[knob.body] * nalgebra::Point3::from(knob.center);
                path.push(at.coords + offset);
            }
        }
    }
    paths
}

/// `soles[f][k]`: every foot knob's lowest point.
pub(super) fn soles(model: &Model, goals: &Goals) -> Vec<Vec<Vector3<f64>>> {
    let limbs: Vec<Limb> = limbs(model, goals)
        .into_iter()
        .filter(|l| l.is_foot)
        .collect();
    let paths = paths(model, goals, &limbs);
    let mut soles: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); goals.frames()];
    for (limb, paths) in limbs.iter().zip(&paths) {
        for (knob, path) in limb.knobs.iter().zip(paths) {
            let down = Vector3::z() * model.knobs[*knob].radius;
            for (f, p) in path.iter().enumerate() {
                soles[f].push(p - down);
            }
        }
    }
    soles
}

/// Height of the ground below the goals: the median of the lowest foot points while they stand.
pub(super) fn ground(soles: &[Vec<Vector3<f64>>], fps: f64, leg: f64, loop_mode: LoopMode) -> f64 {
    let lowest = |f: usize| soles[f].iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let heights = |frames: &mut dyn Iterator<Item = usize>| {
        let mut heights: Vec<f64> = frames.map(lowest).filter(|h| h.is_finite()).collect();
        heights.sort_by(f64::total_cmp);
        heights
    };
    let all = heights(&mut (0..soles.len()));
    let low = all.get(all.len() / 20).copied().unwrap_or(0.0);
    let stands = contact::detect_above(soles, low, fps, leg, loop_mode);
    let standing = heights(&mut (0..soles.len()).filter(|f| stands[*f]));
    standing.get(standing.len() / 2).copied().unwrap_or(low)
}

/// The goals' timeline; a wrapping one goes on for a cycle on both sides, so that stances may pass over the seam.
struct Timeline {
    frames: usize,
    margin: usize,
    cycle: Option<Isometry3<f64>>,
}

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
}

/// A knob that stands in a frame: where the goals have it, and where it should be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub knob: usize,
    pub from: Vector3<f64>,
    pub at: Vector3<f64>,
    pub weight: f64,
}

/// Finds what stands on the ground, which is at z = 0, and moves the goals of feet and hands along with it.
/// Returns the anchors of every frame.
pub(super) fn plant(
    model: &Model,
    goals: &mut Goals,
    fps: f64,
    leg: f64,
    cycle: Option<&Cycle>,
) -> Vec<Vec<Anchor>> {
    let limbs = limbs(model, goals);
    let timeline = Timeline::new(goals.frames(), cycle);
    let mut anchors = vec![Vec::new(); goals.frames()];
    for (limb, paths) in limbs.iter().zip(paths(model, goals, &limbs)) {
        let mut held: Vec<Vec<Held>> = vec![Vec::new(); goals.frames() + 2 * timeline.margin];
        for (&knob, path) in limb.knobs.iter().zip(&paths) {
            let path = timeline.extend(path);
            for (f, at, weight) in stances(&path, model.knobs[knob].radius, fps, leg) {
                held[f].push(Held {
                    knob,
                    from: path[f],
                    at,
                    weight,
                });
            }
        }
        let own: Vec<Vector3<f64>> = goals.points.iter().map(|points| points[limb.key]).collect();
        let moves = footing::moves(&held, &timeline.extend(&own), fps);
        let own = held.iter().zip(&moves).skip(timeline.margin);
        for (f, (frame, (held, by))) in anchors.iter_mut().zip(own).enumerate() {
            let anchor = |h: &Held| Anchor {
                knob: h.knob,
                at: h.at,
                weight: h.weight,
            };
            frame.extend(held.iter().map(anchor));
            footing::apply(goals, f, limb.key, by);
        }
    }
    anchors
}

/// Frame, place and weight wherever a knob's path stands on the ground.
fn stances(
    path: &[Vector3<f64>],
    radius: f64,
    fps: f64,
    leg: f64,
) -> Vec<(usize, Vector3<f64>, f64)> {
    let sole: Vec<Vec<Vector3<f64>>> = path
        .iter()
        .map(|p| vec![p - Vector3::z() * radius])
        .collect();
    let stands = contact::detect_above(&sole, 0.0, fps, leg, LoopMode::Clamp);
    let weight = |f: usize| {
        let height = sole[f][0].z / leg;
        ((HELD[1] - height) / (HELD[1] - HELD[0])).clamp(0.0, 1.0)
    };
    let mut found = Vec::new();
    let mut f = 0;
    while f < path.len() {
        let end = (f..path.len()).find(|g| !stands[*g]).unwrap_or(path.len());
        let total: f64 = (f..end).map(weight).sum();
        if total > 0.0 {
            let sum: Vector3<f64> = (f..end).map(|g| path[g] * weight(g)).sum();
            let mean = sum / total;
            let at = Vector3::new(mean.x, mean.y, radius);
            found.extend((f..end).map(|g| (g, at, weight(g))).filter(|w| w.2 > 0.0));
        }
        f = end + 1;
    }
    found
}
