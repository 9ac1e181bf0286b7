//! What every frame of the skeleton should look like: goals for points and turns, from the source's frames.

use super::align::Alignment;
use super::model::Model;
use super::pace::{self, Paces, Ways};
use crate::clip::Clip;
use crate::humanoid::{HumanoidMap, Slot};
use crate::skeleton::{Skeleton, limits};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::ops::Range;

/// A point that follows the source: the origin of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Key {
    pub slot: Slot,
    pub body: usize,
    pub weight: f64,
}

/// A body whose orientation follows the source.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    pub slot: Slot,
    pub body: usize,
    /// Metres per radian.
    pub weight: f64,
}

#[derive(Clone)]
pub(super) struct Goals {
    pub keys: Vec<Key>,
    pub turns: Vec<Turn>,
    /// `points[f][k]`, world, metres.
    pub points: Vec<Vec<Vector3<f64>>>,
    /// `rotations[f][t]`: world from body.
    pub rotations: Vec<Vec<UnitQuaternion<f64>>>,
    /// `guess[f]`: coordinates that take over the source's orientations.
    pub guess: Vec<Vec<f64>>,
    /// `hanging[f]`: from each ankle's goal to where the ankle is at the end of the skeleton's own leg.
    pub hanging: Vec<[Vector3<f64>; 2]>,
    /// How fast hinges may turn.
    pub paces: Paces,
}

/// Weight of a slot's point, and of its orientation in metres per radian; `by` has multiples of some.
fn weights(slot: Slot, by: &BTreeMap<Slot, f64>) -> (f64, f64) {
    let (point, turn) = usual_weights(slot);
    let times = by.get(&slot).copied().unwrap_or(1.0);
    (point * times, turn * times)
}

fn usual_weights(slot: Slot) -> (f64, f64) {
    match slot {
        Slot::Hips => (1.0, 0.3),
        Slot::Chest => (0.0, 0.3),
        Slot::Spine => (0.0, 0.05),
        Slot::Neck => (0.0, 0.02),
        Slot::Head => (0.0, 0.15),
        Slot::LeftUpperArm | Slot::RightUpperArm => (0.5, 0.02),
        Slot::LeftLowerArm | Slot::RightLowerArm => (0.7, 0.0),
        Slot::LeftHand | Slot::RightHand => (1.0, 0.02),
        Slot::LeftUpperLeg | Slot::RightUpperLeg => (0.0, 0.05),
        Slot::LeftLowerLeg | Slot::RightLowerLeg => (0.6, 0.0),
        Slot::LeftFoot | Slot::RightFoot => (2.0, 0.2),
        Slot::LeftToes | Slot::RightToes => (0.0, 0.02),
        Slot::LeftShoulder | Slot::RightShoulder => (0.0, 0.02),
    }
}

pub(super) const ARMS: [[Slot; 3]; 2] = [
    [Slot::LeftUpperArm, Slot::LeftLowerArm, Slot::LeftHand],
    [Slot::RightUpperArm, Slot::RightLowerArm, Slot::RightHand],
];
pub(super) const LEGS: [[Slot; 3]; 2] = [
    [Slot::LeftUpperLeg, Slot::LeftLowerLeg, Slot::LeftFoot],
    [Slot::RightUpperLeg, Slot::RightLowerLeg, Slot::RightFoot],
];

impl Goals {
    pub fn new(
        clip: &Clip,
        map: &HumanoidMap,
        alignment: &Alignment,
        model: &Model,
        by: &BTreeMap<Slot, f64>,
    ) -> Goals {
        let skeleton = model.skeleton;
        let slot_body = |slot: Slot| skeleton.slots.get(&slot).copied();
        let keys: Vec<Key> = Slot::ALL
            .into_iter()
            .filter(|slot| weights(*slot, by).0 > 0.0 && map.joint(*slot).is_some())
            .filter_map(|slot| {
                Some(Key {
                    slot,
                    body: slot_body(slot)?,
                    weight: weights(slot, by).0,
                })
            })
            .collect();
        let turning = |body: usize| !model.chains[body].is_empty();
        let turns: Vec<(usize, Turn)> = (alignment.binds.iter().enumerate())
            .map(|(i, bind)| {
                (
                    i,
                    Turn {
                        slot: bind.slot,
                        body: bind.body,
                        weight: weights(bind.slot, by).1,
                    },
                )
            })
            .filter(|(_, turn)| turn.weight > 0.0 && turning(turn.body))
            .filter(|(_, turn)| !skeleton.bodies[turn.body].joints.is_empty())
            .collect();
        let mut goals = Goals {
            keys,
            turns: turns.iter().map(|(_, turn)| *turn).collect(),
            points: Vec::with_capacity(clip.frames.len()),
            rotations: Vec::with_capacity(clip.frames.len()),
            guess: Vec::with_capacity(clip.frames.len()),
            hanging: Vec::with_capacity(clip.frames.len()),
            paces: Paces::default(),
        };
        let builder = Builder::new(map, alignment, skeleton);
        let mut ways = Vec::with_capacity(clip.frames.len());
        for f in 0..clip.frames.len() {
            let source = clip.world(f);
            let mut rotations = builder.rotations(&source);
            let (qpos, bodies) = builder.guess(&source, &rotations, goals.guess.last());
            builder.turn_head_within_limits(&qpos, &bodies, &mut rotations);
            let (points, hanging) = builder.points(&goals.keys, &source, &bodies);
            goals.points.push(points);
            goals.hanging.push(hanging);
            let chosen = turns.iter().map(|(i, _)| rotations[*i]);
            goals.rotations.push(chosen.collect());
            ways.push(builder.ways(&source, &qpos));
            goals.guess.push(qpos);
        }
        goals.paces = Paces::new(model, &ways, clip.fps);
        goals
    }

    pub fn frames(&self) -> usize {
        self.points.len()
    }

    /// Leaves the frames `own`.
    pub fn keep(&mut self, own: &Range<usize>) {
        super::keep(&mut self.points, own);
        super::keep(&mut self.rotations, own);
        super::keep(&mut self.guess, own);
        super::keep(&mut self.hanging, own);
        self.paces.keep(own);
    }

    /// Moves everything at frame `f`.
    pub fn shift_frame(&mut self, f: usize, by: &Vector3<f64>) {
        self.points[f].iter_mut().for_each(|p| *p += by);
        for i in 0..3 {
            self.guess[f][i] += by[i];
        }
    }

    /// Position of the root in the guess.
    pub fn root(&self, f: usize) -> Vector3<f64> {
        super::model::vector(&self.guess[f], 0)
    }

    pub fn root_rotation(&self, f: usize) -> UnitQuaternion<f64> {
        super::model::quaternion(&self.guess[f], 3)
    }
}

struct Builder<'a> {
    map: &'a HumanoidMap,
    alignment: &'a Alignment,
    skeleton: &'a Skeleton,
    /// Place in `alignment.binds` of every body's bind.
    bind_of: Vec<Option<usize>>,
    /// The bodies in the skeleton's rest pose.
    rest: Vec<Isometry3<f64>>,
}

impl<'a> Builder<'a> {
    fn new(map: &'a HumanoidMap, alignment: &'a Alignment, skeleton: &'a Skeleton) -> Builder<'a> {
        let mut bind_of = vec![None; skeleton.bodies.len()];
        for (i, bind) in alignment.binds.iter().enumerate() {
            bind_of[bind.body] = Some(i);
        }
        Builder {
            map,
            alignment,
            skeleton,
            bind_of,
            rest: skeleton.forward(&skeleton.rest_qpos()),
        }
    }

    /// Scaled position of a slot's joint.
    fn source_point(&self, source: &[Isometry3<f64>], slot: Slot) -> Option<Vector3<f64>> {
        let joint = self.map.joint(slot)?;
        Some(source[joint].translation.vector * self.alignment.scale)
    }

    /// Where the source's limbs go, seen from the root of a pose.
    fn ways(&self, source: &[Isometry3<f64>], qpos: &[f64]) -> Ways {
        let root = super::model::quaternion(qpos, 3);
        pace::limbs().map(|limb| {
            let [a, b, c] = limb.map(|slot| self.source_point(source, slot));
            let way = |from: Option<Vector3<f64>>, to: Option<Vector3<f64>>| {
                Some(root.inverse() * (to? - from?))
            };
            [way(a, b), way(b, c)]
        })
    }

    fn rotations(&self, source: &[Isometry3<f64>]) -> Vec<UnitQuaternion<f64>> {
        let goal = |bind: &super::align::Bind| source[bind.joint].rotation * bind.joint_from_body;
        self.alignment.binds.iter().map(goal).collect()
    }

    /// Coordinates and bodies of the pose that has the source's orientations where its joints can turn that way.
    fn guess(
        &self,
        source: &[Isometry3<f64>],
        rotations: &[UnitQuaternion<f64>],
        before: Option<&Vec<f64>>,
    ) -> (Vec<f64>, Vec<Isometry3<f64>>) {
        let hips = |slot| self.source_point(source, slot);
        let middle = match (hips(Slot::LeftUpperLeg), hips(Slot::RightUpperLeg)) {
            (Some(left), Some(right)) => (left + right) / 2.0,
            _ => hips(Slot::Hips).unwrap_or_else(Vector3::zeros),
        };
        let facing = self
            .goal(0, rotations)
            .unwrap_or_else(UnitQuaternion::identity);
        let root = Isometry3::from_parts(Translation3::identity(), facing);
        let bodies = &self.skeleton.bodies;
        let mut world: Vec<UnitQuaternion<f64>> = vec![facing; bodies.len()];
        for (b, body) in bodies.iter().enumerate().skip(1) {
            let parent = body.parent.map_or(facing, |p| world[p]);
            let carried = parent * body.rest.rotation;
            world[b] = self.goal(b, rotations).unwrap_or(carried);
        }
        // Hinges take what they can; what they leave is made up for by the joints below them.
        let mut qpos = Vec::new();
        let mut reached = Vec::new();
        for _ in 0..2 {
            let local = |b: usize| {
                let body = &bodies[b];
                let parent = body.parent.map_or(facing, |p| world[p]);
                (parent * body.rest.rotation).inverse() * world[b]
            };
            let turns: Vec<UnitQuaternion<f64>> = (0..bodies.len()).map(local).collect();
            // No history: the same pose gives the same coordinates, wherever the clip begins.
            qpos = self.skeleton.rotations_to_qpos(&root, &turns, None);
            limits::clamp_hinges(self.skeleton, &mut qpos);
            reached = self.skeleton.forward(&qpos);
            for (b, rotation) in world.iter_mut().enumerate().skip(1) {
                let goal = self.goal(b, rotations);
                let free = goal.filter(|_| self.turns_freely(b));
                *rotation = free.unwrap_or(reached[b].rotation);
            }
        }
        // The hips hang on the root by whatever joints the skeleton has there.
        let shift = middle - self.hip_middle(&reached);
        qpos[..3].copy_from_slice(shift.as_slice());
        let shift = Translation3::from(shift);
        reached.iter_mut().for_each(|body| *body = shift * *body);
        if let Some(before) = before {
            limits::unwrap(self.skeleton, before, &mut qpos);
        }
        (qpos, reached)
    }

    /// A head that turns further than a neck can must not take chest and arms along.
    fn turn_head_within_limits(
        &self,
        qpos: &[f64],
        bodies: &[Isometry3<f64>],
        rotations: &mut [UnitQuaternion<f64>],
    ) {
        let Some(&head) = self.skeleton.slots.get(&Slot::Head) else {
            return;
        };
        let (Some(bind), Some(neck)) = (self.bind_of[head], self.skeleton.bodies[head].parent)
        else {
            return;
        };
        let mut within = qpos.to_vec();
        limits::clamp(self.skeleton, &mut within);
        let within = self.skeleton.forward(&within);
        let turn = within[neck].rotation.inverse() * within[head].rotation;
        rotations[bind] = bodies[neck].rotation * turn;
    }

    /// Middle between the hip joints.
    fn hip_middle(&self, bodies: &[Isometry3<f64>]) -> Vector3<f64> {
        let hip = |slot: Slot| {
            let body = self.skeleton.slots.get(&slot)?;
            Some(bodies[*body].translation.vector)
        };
        match (hip(Slot::LeftUpperLeg), hip(Slot::RightUpperLeg)) {
            (Some(left), Some(right)) => (left + right) / 2.0,
            _ => bodies[0].translation.vector,
        }
    }

    fn turns_freely(&self, body: usize) -> bool {
        let joints = &self.skeleton.bodies[body].joints;
        joints.iter().map(|j| j.kind.nv()).sum::<usize>() >= 3
    }

    fn goal(&self, body: usize, rotations: &[UnitQuaternion<f64>]) -> Option<UnitQuaternion<f64>> {
        self.bind_of[body].map(|i| rotations[i])
    }

    /// Goals of the keys: hips and shoulders where the guess has them, limbs in the source's directions with the
    /// skeleton's lengths, ankles where the scaled source has them; and how far that is from the end of the leg.
    fn points(
        &self,
        keys: &[Key],
        source: &[Isometry3<f64>],
        bodies: &[Isometry3<f64>],
    ) -> (Vec<Vector3<f64>>, [Vector3<f64>; 2]) {
        let at = |body: usize| bodies[body].translation.vector;
        let mut points: Vec<Vector3<f64>> = keys.iter().map(|key| at(key.body)).collect();
        let place = |slot: Slot| keys.iter().position(|key| key.slot == slot);
        for limb in ARMS.iter().chain(&LEGS) {
            let Some(mut joint) = self.skeleton.slots.get(&limb[0]).map(|b| at(*b)) else {
                continue;
            };
            for pair in limb.windows(2) {
                let Some(bone) = self.bone(source, pair[0], pair[1]) else {
                    break;
                };
                joint += bone;
                if let Some(k) = place(pair[1]) {
                    points[k] = joint;
                }
            }
        }
        let mut hanging = [Vector3::zeros(); 2];
        for (leg, hanging) in LEGS.iter().zip(&mut hanging) {
            if let (Some(k), Some(p)) = (place(leg[2]), self.source_point(source, leg[2])) {
                let p = p + self.hip_offset(leg[0], source, bodies);
                *hanging = points[k] - p;
                points[k] = p;
            }
        }
        (points, hanging)
    }

    /// Where the skeleton's hip joint is beside the source's: feet stand as far apart as suits its hips.
    fn hip_offset(
        &self,
        hip: Slot,
        source: &[Isometry3<f64>],
        bodies: &[Isometry3<f64>],
    ) -> Vector3<f64> {
        let ours = self.skeleton.slots.get(&hip);
        match (ours, self.source_point(source, hip)) {
            (Some(body), Some(theirs)) => {
                let offset = bodies[*body].translation.vector - theirs;
                Vector3::new(offset.x, offset.y, 0.0)
            }
            _ => Vector3::zeros(),
        }
    }

    /// The skeleton's bone from one slot to the next in the source's direction.
    fn bone(&self, source: &[Isometry3<f64>], from: Slot, to: Slot) -> Option<Vector3<f64>> {
        // There may be links between the two: an ankle of two hinges has one.
        let body = |slot: Slot| self.skeleton.slots.get(&slot).copied();
        let ends = [self.rest[body(from)?], self.rest[body(to)?]];
        let length = (ends[1].translation.vector - ends[0].translation.vector).norm();
        let direction = self.source_point(source, to)? - self.source_point(source, from)?;
        Some(direction.try_normalize(1e-9)? * length)
    }
}
