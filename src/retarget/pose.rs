//! Stage 2, pose: finds, for every frame, what the source's pose asks of the skeleton.
//!
//! The rest poses are aligned once. Then each frame of the source becomes target positions and orientations, and coordinates
//! that take over the source's orientations as far as the joints can, from which the solver starts. Frames don't depend on
//! each other, so that the same pose gives the same goals wherever the clip begins.

mod align;
mod guess;
mod weight;

use super::error::RetargetError;
use super::goals::{Goals, Keypoint, Orientation};
use super::hinge_speed::{HingeSpeeds, LimbDirections};
use super::input::Input;
use super::limbs::{ARMS, LEGS, arms_and_legs};
use super::model::Model;
use super::qpos::quaternion;
use super::source::Source;
use crate::humanoid::{HumanoidMap, Slot};
use crate::skeleton::Skeleton;
use align::{Alignment, Bind};
use guess::Guesser;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;

/// The goals of all frames, and the source that they were taken from, both still where the clip has them, scaled to the
/// skeleton.
pub(super) struct Posed {
    /// What the skeleton should look like.
    pub goals: Goals,
    /// What the result will be measured against.
    pub source: Source,
}

/// Makes the goals of every frame. `multiples` holds the caller's weights of slots.
///
/// # Errors
/// [`RetargetError::NoLegs`] and [`RetargetError::NoSourceLegs`] if legs can't be measured, which give the scale.
pub(super) fn pose(
    input: &Input,
    model: &Model,
    multiples: &BTreeMap<Slot, f64>,
) -> Result<Posed, RetargetError> {
    let alignment = align::align(&input.clip, &input.map, model.skeleton)?;
    Ok(Posed {
        goals: goals(input, &alignment, model, multiples),
        source: Source::new(&input.clip, &input.map, alignment.scale, model.skeleton),
    })
}

/// The goals of every frame.
fn goals(
    input: &Input,
    alignment: &Alignment,
    model: &Model,
    multiples: &BTreeMap<Slot, f64>,
) -> Goals {
    let clip = &input.clip;
    let followed = orientations(alignment, model, multiples);
    let mut goals = Goals {
        keypoints: keypoints(&input.map, model.skeleton, multiples),
        orientations: followed.iter().map(|(_, turn)| *turn).collect(),
        points: Vec::with_capacity(clip.frames.len()),
        rotations: Vec::with_capacity(clip.frames.len()),
        guess: Vec::with_capacity(clip.frames.len()),
        ankle_offsets: Vec::with_capacity(clip.frames.len()),
        speeds: HingeSpeeds::default(),
    };
    let scaled = Scaled {
        map: &input.map,
        scale: alignment.scale,
    };
    let guesser = Guesser::new(alignment, model.skeleton);
    let builder = Builder::new(scaled, model.skeleton);
    let mut directions = Vec::with_capacity(clip.frames.len());
    for f in 0..clip.frames.len() {
        let source = clip.world(f);
        // Orientations first, then the pose that they make, then the targets on it.
        let mut rotations = bound_rotations(&alignment.binds, &source);
        let middle = scaled.middle_of_hips(&source);
        let (qpos, bodies) = guesser.guess(middle, &rotations, goals.guess.last());
        guesser.limit_head(&qpos, &bodies, &mut rotations);
        builder.lean(alignment, &source, &bodies, &mut rotations);
        let (points, ankle_offsets) = builder.points(&goals.keypoints, &source, &bodies);
        goals.points.push(points);
        goals.ankle_offsets.push(ankle_offsets);
        let chosen = followed.iter().map(|(i, _)| rotations[*i]);
        goals.rotations.push(chosen.collect());
        directions.push(builder.directions(&source, &qpos));
        goals.guess.push(qpos);
    }
    goals.speeds = HingeSpeeds::new(model, &directions, clip.fps);
    goals
}

/// The slots whose positions are followed: those with a weight that clip and skeleton both have.
fn keypoints(
    map: &HumanoidMap,
    skeleton: &Skeleton,
    multiples: &BTreeMap<Slot, f64>,
) -> Vec<Keypoint> {
    let keypoint = |slot: Slot| {
        let (weight, _) = weight::of(slot, multiples);
        let body = skeleton.slots.get(&slot).copied();
        let is_followed = weight > 0.0 && map.joint(slot).is_some();
        body.filter(|_| is_followed)
            .map(|body| Keypoint { slot, body, weight })
    };
    Slot::ALL.into_iter().filter_map(keypoint).collect()
}

/// The bodies whose orientations are followed, each with its place in the alignment's binds: those with a weight and a joint of
/// their own.
fn orientations(
    alignment: &Alignment,
    model: &Model,
    multiples: &BTreeMap<Slot, f64>,
) -> Vec<(usize, Orientation)> {
    let orientation = |bind: &Bind| Orientation {
        slot: bind.slot,
        body: bind.body,
        weight: weight::of(bind.slot, multiples).1,
    };
    // A body without joints is fixed to its parent, so its orientation can't be chosen.
    let moves = |body: usize| {
        !model.chains[body].is_empty() && !model.skeleton.bodies[body].joints.is_empty()
    };
    let all = alignment.binds.iter().map(orientation).enumerate();
    all.filter(|(_, turn)| turn.weight > 0.0 && moves(turn.body))
        .collect()
}

/// The orientation that every bound body should have in a frame of the source, world from body.
fn bound_rotations(binds: &[Bind], source: &[Isometry3<f64>]) -> Vec<UnitQuaternion<f64>> {
    let goal = |bind: &Bind| source[bind.joint].rotation * bind.joint_from_body;
    binds.iter().map(goal).collect()
}

/// The source in the skeleton's size.
#[derive(Clone, Copy)]
struct Scaled<'a> {
    map: &'a HumanoidMap,
    scale: f64,
}

impl Scaled<'_> {
    /// Position of a slot's joint, world, metres.
    fn point(&self, source: &[Isometry3<f64>], slot: Slot) -> Option<Vector3<f64>> {
        let joint = self.map.joint(slot)?;
        Some(source[joint].translation.vector * self.scale)
    }

    /// Middle between the hip joints; the hips' own joint where the clip lacks one of them.
    fn middle_of_hips(&self, source: &[Isometry3<f64>]) -> Vector3<f64> {
        let hip = |slot| self.point(source, slot);
        match (hip(Slot::LeftUpperLeg), hip(Slot::RightUpperLeg)) {
            (Some(left), Some(right)) => (left + right) / 2.0,
            _ => hip(Slot::Hips).unwrap_or_else(Vector3::zeros),
        }
    }
}

/// Makes the target positions of a frame.
struct Builder<'a> {
    scaled: Scaled<'a>,
    skeleton: &'a Skeleton,
    /// The bodies in the skeleton's rest pose.
    rest: Vec<Isometry3<f64>>,
}

impl<'a> Builder<'a> {
    /// Measures the skeleton's bones.
    fn new(scaled: Scaled<'a>, skeleton: &'a Skeleton) -> Builder<'a> {
        Builder {
            scaled,
            skeleton,
            rest: skeleton.forward(&skeleton.rest_qpos()),
        }
    }

    /// Directions of the source's limbs in the frame of the root at `qpos`.
    fn directions(&self, source: &[Isometry3<f64>], qpos: &[f64]) -> LimbDirections {
        // Seen from the root, for only the limb's own motion is the hinges' to make.
        let root = quaternion(qpos, 3);
        arms_and_legs().map(|limb| {
            let [a, b, c] = limb.map(|slot| self.scaled.point(source, slot));
            let direction = |from: Option<Vector3<f64>>, to: Option<Vector3<f64>>| {
                Some(root.inverse() * (to? - from?))
            };
            [direction(a, b), direction(b, c)]
        })
    }

    /// The targets of the keypoints, and the ankles' offsets of [`Goals::ankle_offsets`]. `bodies` is the guess.
    ///
    /// Hips are where the guess has them, and shoulders in the source's direction from there; knees, elbows and wrists are at the end of bones that have the
    /// source's directions and the skeleton's lengths, so that poses look alike on a body of other proportions. Ankles are
    /// where the scaled source has them instead: with the skeleton's bones, feet would slide over the ground.
    fn points(
        &self,
        keypoints: &[Keypoint],
        source: &[Isometry3<f64>],
        bodies: &[Isometry3<f64>],
    ) -> (Vec<Vector3<f64>>, [Vector3<f64>; 2]) {
        let at = |body: usize| bodies[body].translation.vector;
        let mut points: Vec<Vector3<f64>> = keypoints.iter().map(|key| at(key.body)).collect();
        let keypoint = |slot: Slot| keypoints.iter().position(|key| key.slot == slot);
        // Down each limb from its first joint, bone by bone, as far as the source has them.
        let shoulders = self.shoulders(source, bodies);
        for limb in ARMS.iter().chain(&LEGS) {
            let Some(mut joint) = self.skeleton.slots.get(&limb[0]).map(|b| at(*b)) else {
                continue;
            };
            let shoulder = shoulders.and_then(|s| Some(s[ARMS.iter().position(|a| a == limb)?]));
            if let Some(place) = shoulder {
                joint = place;
                if let Some(k) = keypoint(limb[0]) {
                    points[k] = place;
                }
            }
            for pair in limb.windows(2) {
                let Some(bone) = self.bone(source, pair[0], pair[1]) else {
                    break;
                };
                joint += bone;
                if let Some(k) = keypoint(pair[1]) {
                    points[k] = joint;
                }
            }
        }
        let mut ankle_offsets = [Vector3::zeros(); 2];
        // Ankles replace the ends of legs; the difference is kept for feet in the air.
        for (leg, offset) in LEGS.iter().zip(&mut ankle_offsets) {
            if let (Some(k), Some(p)) = (keypoint(leg[2]), self.scaled.point(source, leg[2])) {
                let p = p + self.hip_offset(leg[0], source, bodies);
                *offset = points[k] - p;
                points[k] = p;
            }
        }
        (points, ankle_offsets)
    }

    /// Where the shoulders are in the source's direction from the middle of the hips, as far from it as the guess has them, and
    /// as far apart. A rig may bend its trunk elsewhere than the skeleton, or have a rest pose that leans, so orientations
    /// alone would lean otherwise than the source does.
    fn shoulders(
        &self,
        source: &[Isometry3<f64>],
        bodies: &[Isometry3<f64>],
    ) -> Option<[Vector3<f64>; 2]> {
        let ends = |at: &dyn Fn(Slot) -> Option<Vector3<f64>>, limbs: &[[Slot; 3]; 2]| {
            Some([at(limbs[0][0])?, at(limbs[1][0])?])
        };
        let middle = |[left, right]: [Vector3<f64>; 2]| (left + right) / 2.0;
        let ours = |slot: Slot| Some(bodies[*self.skeleton.slots.get(&slot)?].translation.vector);
        let theirs = |slot: Slot| self.scaled.point(source, slot);
        let (hips, shoulders) = (ends(&ours, &LEGS)?, ends(&ours, &ARMS)?);
        let wanted = ends(&theirs, &ARMS)?;
        let length = (middle(shoulders) - middle(hips)).norm();
        let half = (shoulders[0] - shoulders[1]).norm() / 2.0;
        let up = (middle(wanted) - middle(ends(&theirs, &LEGS)?)).try_normalize(1e-9)?;
        let aside = (wanted[0] - wanted[1]).try_normalize(1e-9)? * half;
        let center = middle(hips) + up * length;
        Some([center + aside, center - aside])
    }

    /// Turns the chest's target so that it leads to the shoulders' places.
    fn lean(
        &self,
        alignment: &Alignment,
        source: &[Isometry3<f64>],
        bodies: &[Isometry3<f64>],
        rotations: &mut [UnitQuaternion<f64>],
    ) {
        let chest = self.skeleton.slots.get(&Slot::Chest);
        let (Some(chest), Some([left, right])) = (chest, self.shoulders(source, bodies)) else {
            return;
        };
        let at = |body: usize| bodies[body].translation.vector;
        let shoulder = |side: usize| self.skeleton.slots.get(&ARMS[side][0]).map(|b| at(*b));
        let (Some(a), Some(b)) = (shoulder(0), shoulder(1)) else {
            return;
        };
        let [from, to] = [(a + b) / 2.0, (left + right) / 2.0].map(|p| p - at(*chest));
        let lean = UnitQuaternion::rotation_between(&from, &to);
        for (bind, rotation) in alignment.binds.iter().zip(rotations) {
            if bind.slot == Slot::Chest {
                *rotation = lean.unwrap_or_else(UnitQuaternion::identity) * *rotation;
            }
        }
    }

    /// From the source's hip joint to the skeleton's, horizontally, metres: feet stand as far apart as suits the skeleton's
    /// hips.
    fn hip_offset(
        &self,
        hip: Slot,
        source: &[Isometry3<f64>],
        bodies: &[Isometry3<f64>],
    ) -> Vector3<f64> {
        let ours = self.skeleton.slots.get(&hip);
        match (ours, self.scaled.point(source, hip)) {
            (Some(body), Some(theirs)) => {
                // Only sideways and forward: in height, feet are where the ground is.
                let offset = bodies[*body].translation.vector - theirs;
                Vector3::new(offset.x, offset.y, 0.0)
            }
            _ => Vector3::zeros(),
        }
    }

    /// The skeleton's bone from one slot to the next, in the source's direction, metres.
    fn bone(&self, source: &[Isometry3<f64>], from: Slot, to: Slot) -> Option<Vector3<f64>> {
        // Measured between the slots, for there may be bodies between the two: an ankle of two hinges has one.
        let body = |slot: Slot| self.skeleton.slots.get(&slot).copied();
        let ends = [self.rest[body(from)?], self.rest[body(to)?]];
        let length = (ends[1].translation.vector - ends[0].translation.vector).norm();
        let direction = self.scaled.point(source, to)? - self.scaled.point(source, from)?;
        Some(direction.try_normalize(1e-9)? * length)
    }
}
