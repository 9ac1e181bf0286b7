//! How fast hinges may turn. A limb of hinges reaches a place in more ways than one, and each way ends at its limits: where
//! another becomes the better one, nothing but this keeps the limb from being there in the next frame.

use super::goals::{ARMS, Goals, LEGS};
use super::model::Model;
use crate::humanoid::Slot;
use crate::skeleton::JointKind;
use nalgebra::Vector3;
use std::ops::Range;

/// A hinge may turn this fast whatever the source does, rad/s.
const ALWAYS: f64 = 6.0;
/// And by this much more than the source turns the two parts of the limb.
const MORE: f64 = 1.5;

/// Most that hinges may turn from a frame to the next.
#[derive(Clone, Default)]
pub(super) struct Paces {
    /// The degrees of freedom.
    hinges: Vec<usize>,
    /// `most[f][i]`, radians.
    most: Vec<Vec<f64>>,
}

impl Paces {
    pub fn new(model: &Model, goals: &Goals, fps: f64) -> Paces {
        let limbs = ARMS.iter().chain(&LEGS);
        let limbs = limbs.map(|limb| (limb, hinges(model, limb)));
        let limbs: Vec<_> = limbs.filter(|(_, hinges)| !hinges.is_empty()).collect();
        let mut paces = Paces {
            hinges: limbs.iter().flat_map(|(_, h)| h).copied().collect(),
            most: Vec::new(),
        };
        if paces.hinges.is_empty() {
            return paces;
        }
        for f in 0..goals.frames() {
            let most = limbs.iter().flat_map(|(limb, hinges)| {
                let most = ALWAYS / fps + MORE * turned(model, goals, limb, f);
                hinges.iter().map(move |_| most)
            });
            paces.most.push(most.collect());
        }
        paces
    }

    /// Leaves the frames `own`.
    pub fn keep(&mut self, own: &Range<usize>) {
        if !self.most.is_empty() {
            super::keep(&mut self.most, own);
        }
    }

    /// Each hinge, and the most that it may turn from frame `f` to the next.
    pub fn of(&self, f: usize) -> impl Iterator<Item = (usize, f64)> {
        let most = self.most.get(f).map_or(&[][..], Vec::as_slice);
        self.hinges.iter().copied().zip(most.iter().copied())
    }
}

/// Hinges of the upper and the lower part of a limb, if there are several: one alone bends in one way.
fn hinges(model: &Model, [upper, lower, _]: &[Slot; 3]) -> Vec<usize> {
    let body = |slot: &Slot| model.skeleton.slots.get(slot).copied();
    let (Some(upper), Some(lower)) = (body(upper), body(lower)) else {
        return Vec::new();
    };
    let above = model.skeleton.bodies[upper].parent;
    let fixed = above.map_or(&[][..], |body| &model.chains[body]);
    let own = model.chains[lower]
        .iter()
        .filter(|dof| !fixed.contains(dof));
    let is_hinge = |dof: &usize| {
        let joint = model.joints().find(|joint| joint.dof == *dof);
        joint.is_some_and(|joint| matches!(joint.kind, JointKind::Hinge(_)))
    };
    let hinges: Vec<usize> = own.copied().filter(is_hinge).collect();
    if hinges.len() > 1 { hinges } else { Vec::new() }
}

/// By how much the goals turn the parts of a limb from frame `f` to the next, seen from the root, radians.
fn turned(model: &Model, goals: &Goals, limb: &[Slot; 3], f: usize) -> f64 {
    let next = (f + 1).min(goals.frames() - 1);
    let at = |slot: &Slot, f: usize| {
        let body = model.skeleton.slots.get(slot)?;
        let key = goals.keys.iter().position(|key| key.body == *body)?;
        Some(goals.root_rotation(f).inverse() * goals.points[f][key])
    };
    let part = |a: &Slot, b: &Slot| {
        let way = |f: usize| -> Option<Vector3<f64>> { Some(at(b, f)? - at(a, f)?) };
        Some(way(f)?.angle(&way(next)?))
    };
    let [upper, lower, end] = limb;
    part(upper, lower).unwrap_or(0.0) + part(lower, end).unwrap_or(0.0)
}
