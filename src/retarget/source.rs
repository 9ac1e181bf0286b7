//! The source in the skeleton's size, and when its feet and hands are on the ground: what the result is measured against.
//! Nothing here depends on the goals that the solver is given.

use super::anchor::SourceContact;
use super::frames;
use super::limbs::HANDS;
use super::setting::Setting;
use crate::clip::Clip;
use crate::humanoid::{HumanoidMap, Slot};
use crate::motion::contact;
use crate::skeleton::Skeleton;
use nalgebra::{Isometry3, Vector3};
use std::collections::BTreeMap;
use std::ops::Range;

/// Feet and hands, with the joint further out that touches the ground with them.
const ENDS: [(Slot, Option<Slot>); 4] = [
    (Slot::LeftFoot, Some(Slot::LeftToes)),
    (Slot::RightFoot, Some(Slot::RightToes)),
    (Slot::LeftHand, None),
    (Slot::RightHand, None),
];
/// Heights of a wrist and of the ends of fingers on the ground, beyond those that [`contact`] allows a foot, leg lengths.
/// Chosen: a wrist is above its palm, and fingertips are where the rig's last joint is.
const PALM: f64 = 0.02;
const FINGERTIP: f64 = -0.03;
/// Factor of the leg length by which a hand's speed and height are judged. Chosen: hands roll and slide where feet stand still.
const HAND_LENGTH: f64 = 2.0;
/// How near a joint's lowest level in a clip has to be to its level in the rest pose to count as standing, leg lengths. Chosen.
const LIKE_REST: f64 = 0.08;
/// Share of frames in which a joint may be below its level: recordings have outliers. Chosen, as in [`contact`].
const QUANTILE: f64 = 0.05;
/// Heights of a rest pose's lowest joint between which it stands on z = 0, leg lengths. Chosen: toes' joints are up to a
/// shoe above the sole.
const STANDS: [f64; 2] = [-0.03, 0.15];
/// Speed below which a joint of the source is still, leg lengths per second. Chosen: 7 cm/s for a leg of 0.9 m.
const STILL: f64 = 0.08;
/// Most ends of fingers that are looked at, which bounds the time for hands of many joints.
const FINGERS: usize = 6;

/// World positions of the source's joints times the skeleton's scale, metres.
pub(super) struct Source {
    /// By slot and frame.
    pub points: BTreeMap<Slot, Vec<Vector3<f64>>>,
    /// By slot, in the rest pose.
    pub rest: BTreeMap<Slot, Vector3<f64>>,
    /// Height of the rest pose's ankles above its ground, if it stands on z = 0.
    pub ankle: Option<f64>,
    /// Ends of the left and the right hand's fingers, by frame.
    fingers: [Vec<Vec<Vector3<f64>>>; 2],
    frames: usize,
}

impl Source {
    /// Reads the clip's joints, times `scale`.
    pub fn new(clip: &Clip, map: &HumanoidMap, scale: f64, skeleton: &Skeleton) -> Source {
        let at = |world: &[Isometry3<f64>], joint: usize| world[joint].translation.vector * scale;
        let rest = clip.rest_world();
        // A foot without toes can't roll over them, so where the source does that, the skeleton has no contact.
        let toes = [Slot::LeftToes, Slot::RightToes];
        let known = |slot: &Slot| !toes.contains(slot) || skeleton.slots.contains_key(slot);
        let slots = map.matches.iter().map(|(slot, found)| (*slot, found.joint));
        let slots: Vec<(Slot, usize)> = slots.filter(|(slot, _)| known(slot)).collect();
        // A wrist is above the ground when the hand is on it, so the ends of fingers tell better.
        let hands = HANDS.map(|slot| fingers(clip, map.joint(slot)));
        let mut source = Source {
            points: slots.iter().map(|(slot, _)| (*slot, Vec::new())).collect(),
            rest: slots
                .iter()
                .map(|(slot, j)| (*slot, at(&rest, *j)))
                .collect(),
            ankle: None,
            fingers: [Vec::new(), Vec::new()],
            frames: clip.frames.len(),
        };
        for f in 0..clip.frames.len() {
            let world = clip.world(f);
            for (slot, joint) in &slots {
                let path = source.points.entry(*slot).or_default();
                path.push(at(&world, *joint));
            }
            for (tips, joints) in source.fingers.iter_mut().zip(&hands) {
                tips.push(joints.iter().map(|j| at(&world, *j)).collect());
            }
        }
        source.ankle = source.ankle_at_rest(clip, map, scale, skeleton.leg_length());
        source
    }

    /// Mean height of the ankles in the rest pose, metres, if the pose stands: its lowest foot joint is near z = 0, and its
    /// ankles are level.
    fn ankle_at_rest(&self, clip: &Clip, map: &HumanoidMap, scale: f64, leg: f64) -> Option<f64> {
        let world = clip.rest_world();
        let feet = [Slot::LeftFoot, Slot::RightFoot].map(|slot| map.joint(slot));
        let [left, right] = [feet[0]?, feet[1]?];
        let mut in_foot = vec![false; world.len()];
        let mut lowest = f64::INFINITY;
        for (j, joint) in clip.joints.iter().enumerate() {
            // Joints come after their parents; whatever hangs on an ankle is part of the foot.
            let below = joint.parent.is_some_and(|p| p < j && in_foot[p]);
            in_foot[j] = below || j == left || j == right;
            if in_foot[j] {
                lowest = lowest.min(world[j].translation.z * scale / leg);
            }
        }
        let heights = [left, right].map(|j| world[j].translation.z * scale);
        // A rest pose in mid-stride has one foot in the air, and doesn't tell.
        let level = (heights[0] - heights[1]).abs() < LIKE_REST * leg;
        let stands = (STANDS[0]..STANDS[1]).contains(&lowest) && level;
        stands.then_some((heights[0] + heights[1]) / 2.0)
    }

    /// Drops everything but the frames `own`.
    pub fn keep(&mut self, own: &Range<usize>) {
        let paths = self.points.values_mut();
        paths.for_each(|path| frames::keep(path, own));
        let hands = self.fingers.iter_mut();
        hands.for_each(|tips| frames::keep(tips, own));
        self.frames = own.len();
    }

    /// Moves frame `f`.
    pub fn shift_frame(&mut self, f: usize, by: &Vector3<f64>) {
        let joints = self.points.values_mut().filter_map(|path| path.get_mut(f));
        let tips = self.fingers.iter_mut().filter_map(|tips| tips.get_mut(f));
        joints.chain(tips.flatten()).for_each(|point| *point += by);
    }

    /// Position of a slot's joint at frame `f`, if the source has that joint.
    pub fn at(&self, slot: Slot, f: usize) -> Option<Vector3<f64>> {
        self.points.get(&slot)?.get(f).copied()
    }

    /// When each foot and hand that the source has is on the ground, which is at height `floor`, metres.
    pub fn contacts(&self, floor: f64, setting: &Setting) -> Vec<SourceContact> {
        let contact = |slot: Slot| {
            let touches = self.touches(slot, floor, setting)?;
            Some(SourceContact { slot, touches })
        };
        let ends = ENDS.iter().map(|(end, _)| *end);
        ends.filter_map(contact).collect()
    }

    /// Whether a foot or hand is on the ground, by frame; `None` without such a joint.
    fn touches(&self, end: Slot, floor: f64, setting: &Setting) -> Option<Vec<bool>> {
        let path = self.points.get(&end)?;
        let leg = setting.leg;
        let (paths, size) = match HANDS.iter().position(|hand| *hand == end) {
            Some(hand) => (self.hand_paths(hand, path, leg), leg * HAND_LENGTH),
            None => (self.foot_paths(end, path, floor, setting), leg),
        };
        let stands = |path: &Vec<Vector3<f64>>| -> Vec<bool> {
            let points: Vec<Vec<Vector3<f64>>> = path.iter().map(|p| vec![*p]).collect();
            contact::detect_above(&points, floor, setting.fps, size, setting.loop_mode)
        };
        // Heel or toes are enough: a foot rolls from one to the other.
        let each: Vec<Vec<bool>> = paths.iter().map(stands).collect();
        let any = |f: usize| each.iter().any(|stands| stands[f]);
        Some((0..self.frames).map(any).collect())
    }

    /// The paths of what of a hand can touch the ground, lowered to where its skin is: fingertips, or the wrist of a hand
    /// without fingers.
    fn hand_paths(&self, hand: usize, wrist: &[Vector3<f64>], leg: f64) -> Vec<Vec<Vector3<f64>>> {
        let tips = self.tips(hand);
        if tips.is_empty() {
            return vec![lowered(wrist, PALM * leg)];
        }
        let tips = tips.iter();
        tips.map(|path| lowered(path, FINGERTIP * leg)).collect()
    }

    /// The paths of a foot's ankle and toes, lowered so that they are at the ground's height where the foot stands. Toes are
    /// taken to be half as high as the ankle.
    fn foot_paths(
        &self,
        foot: Slot,
        ankle: &[Vector3<f64>],
        floor: f64,
        setting: &Setting,
    ) -> Vec<Vec<Vector3<f64>>> {
        let leg = setting.leg;
        let height = self.ankle.unwrap_or(setting.ankle);
        // The clip's own lowest level counts before the rest pose's, for soles of characters sink in or float.
        let mut paths = vec![lowered(ankle, level(ankle, floor + height, leg) - floor)];
        let toes = ENDS.iter().find(|e| e.0 == foot).and_then(|e| e.1);
        if let Some(path) = toes.and_then(|toes| self.points.get(&toes)) {
            let by = level(path, floor + height / 2.0, leg) - floor;
            paths.push(lowered(path, by));
        }
        paths
    }

    /// Whether a foot's ankle or toes, or a wrist, hardly move from frame `f` to the next.
    pub fn is_still(&self, end: Slot, f: usize, setting: &Setting) -> bool {
        let toes = ENDS.iter().find(|e| e.0 == end).and_then(|e| e.1);
        let still = |slot: Slot| match (self.at(slot, f), self.at(slot, f + 1)) {
            (Some(a), Some(b)) => (b - a).norm() * setting.fps < STILL * setting.leg,
            _ => false,
        };
        still(end) || toes.is_some_and(still)
    }

    /// Paths of the ends of a hand's fingers.
    fn tips(&self, hand: usize) -> Vec<Vec<Vector3<f64>>> {
        let count = self.fingers[hand].first().map_or(0, Vec::len);
        let path = |i: usize| self.fingers[hand].iter().map(|tips| tips[i]).collect();
        (0..count).map(path).collect()
    }
}

/// A path shifted down, metres.
fn lowered(path: &[Vector3<f64>], by: f64) -> Vec<Vector3<f64>> {
    path.iter().map(|p| p - Vector3::z() * by).collect()
}

/// Height of a joint when its foot stands, metres: its lowest level in the clip, or the one `expected` from the rest pose
/// where the lowest is far from that, as in a clip in which the foot never comes down.
fn level(path: &[Vector3<f64>], expected: f64, leg: f64) -> f64 {
    let mut heights: Vec<f64> = path.iter().map(|p| p.z).collect();
    heights.sort_by(f64::total_cmp);
    // The height nearest to the quantile.
    let at = (heights.len().saturating_sub(1) as f64 * QUANTILE).round() as usize;
    let lowest = heights.get(at).copied().unwrap_or(expected);
    if (lowest - expected).abs() < LIKE_REST * leg {
        lowest
    } else {
        expected
    }
}

/// The ends of a hand's fingers: joints below it that have none below them.
fn fingers(clip: &Clip, hand: Option<usize>) -> Vec<usize> {
    let Some(hand) = hand else {
        return Vec::new();
    };
    let mut below = vec![false; clip.joints.len()];
    let mut ends = vec![true; clip.joints.len()];
    // Joints come after their parents, so one pass tells what is below the hand and what has nothing below it.
    for (j, joint) in clip.joints.iter().enumerate() {
        if let Some(p) = joint.parent.filter(|p| *p < j) {
            below[j] = p == hand || below[p];
            ends[p] = false;
        }
    }
    let tips = (0..below.len()).filter(|j| below[*j] && ends[*j]);
    tips.take(FINGERS).collect()
}
