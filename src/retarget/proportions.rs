//! What the result is compared with: the source's joints, limb by limb in the skeleton's size.
//!
//! A skeleton of other proportions can't have all joints where the source has them. So each limb of the source is scaled to the
//! skeleton's length, about the place where the limb begins: what is left is how far the poses differ.

use super::limbs::{ARMS, LEGS};
use super::source::Source;
use crate::humanoid::Slot;
use crate::skeleton::Skeleton;
use nalgebra::Vector3;

/// Sizes of the skeleton relative to those of the source, which is already scaled by the length of the legs.
pub(super) struct Proportions {
    legs: f64,
    arms: f64,
    hips: f64,
    shoulders: f64,
    trunk: f64,
}

/// Where a figure's joints are, metres.
type Places<'a> = &'a dyn Fn(Slot) -> Option<Vector3<f64>>;

/// Middle between two joints.
fn middle(at: Places, slots: [Slot; 2]) -> Option<Vector3<f64>> {
    Some((at(slots[0])? + at(slots[1])?) / 2.0)
}

/// Middle between the hip joints.
fn hip_middle(at: Places) -> Option<Vector3<f64>> {
    middle(at, [LEGS[0][0], LEGS[1][0]])
}

/// Middle between the shoulder joints.
fn shoulder_middle(at: Places) -> Option<Vector3<f64>> {
    middle(at, [ARMS[0][0], ARMS[1][0]])
}

/// Distance between the joints where the left and the right limb begin, metres.
fn width(at: Places, limbs: &[[Slot; 3]; 2]) -> Option<f64> {
    Some((at(limbs[0][0])? - at(limbs[1][0])?).norm())
}

/// Length of a limb along its bones, mean of both sides, metres. A figure may lack the last joint.
fn length(at: Places, limbs: &[[Slot; 3]; 2]) -> Option<f64> {
    let bone = |a: Slot, b: Slot| Some((at(b)? - at(a)?).norm());
    let limb = |[a, b, c]: [Slot; 3]| Some(bone(a, b)? + bone(b, c).unwrap_or(0.0));
    Some((limb(limbs[0])? + limb(limbs[1])?) / 2.0)
}

/// From the middle of the hips to that of the shoulders, metres.
fn trunk(at: Places) -> Option<f64> {
    Some((shoulder_middle(at)? - hip_middle(at)?).norm())
}

impl Proportions {
    /// Measures both in their rest poses, by the slots that both have; 1 where they can't be compared.
    pub fn new(source: &Source, skeleton: &Skeleton) -> Proportions {
        let rest = skeleton.forward(&skeleton.rest_qpos());
        let common =
            |slot: Slot| skeleton.slots.contains_key(&slot) && source.rest.contains_key(&slot);
        let ours = |slot: Slot| {
            let body = skeleton.slots.get(&slot).filter(|_| common(slot))?;
            Some(rest[*body].translation.vector)
        };
        let theirs = |slot: Slot| source.rest.get(&slot).filter(|_| common(slot)).copied();
        let ratio = |of: &dyn Fn(Places) -> Option<f64>| match (of(&ours), of(&theirs)) {
            (Some(ours), Some(theirs)) if theirs > 1e-6 => ours / theirs,
            _ => 1.0,
        };
        Proportions {
            legs: ratio(&|at| length(at, &LEGS)),
            arms: ratio(&|at| length(at, &ARMS)),
            hips: ratio(&|at| width(at, &LEGS)),
            shoulders: ratio(&|at| width(at, &ARMS)),
            trunk: ratio(&trunk),
        }
    }

    /// Where the skeleton's hips, knees, ankles, shoulders, elbows and wrists should be at frame `f`, as far as the source
    /// has them; world, metres.
    pub fn places(&self, source: &Source, f: usize) -> Vec<(Slot, Vector3<f64>)> {
        let at = |slot: Slot| source.at(slot, f);
        let mut places = Vec::with_capacity(12);
        let Some(hips) = hip_middle(&at) else {
            return places;
        };
        // A limb begins beside the middle of the hips or shoulders, scaled by their width, and is scaled by its own length
        // from there.
        let mut add =
            |limbs: &[[Slot; 3]; 2], from: Vector3<f64>, to: Vector3<f64>, scales: [f64; 2]| {
                for limb in limbs {
                    let Some(root) = at(limb[0]) else { continue };
                    let moved = to + (root - from) * scales[0];
                    places.push((limb[0], moved));
                    for slot in &limb[1..] {
                        let joint = at(*slot).map(|p| moved + (p - root) * scales[1]);
                        places.extend(joint.map(|p| (*slot, p)));
                    }
                }
            };
        add(&LEGS, hips, hips, [self.hips, self.legs]);
        if let Some(shoulders) = shoulder_middle(&at) {
            // Shoulders are on a trunk of the skeleton's length.
            let to = hips + (shoulders - hips) * self.trunk;
            add(&ARMS, shoulders, to, [self.shoulders, self.arms]);
        }
        places
    }
}
