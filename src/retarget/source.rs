//! The source scaled to the skeleton, and when it stands on what: the measure of the result. Nothing here depends on
//! the goals that the solver is given.

use super::align::Alignment;
use crate::clip::{Clip, LoopMode};
use crate::humanoid::{HumanoidMap, Slot};
use crate::motion::contact;
use crate::skeleton::Skeleton;
use nalgebra::{Isometry3, Vector3};
use std::collections::BTreeMap;
use std::ops::Range;

/// Feet and hands, with the joint further out that touches the ground with them.
pub(super) const ENDS: [(Slot, Option<Slot>); 4] = [
    (Slot::LeftFoot, Some(Slot::LeftToes)),
    (Slot::RightFoot, Some(Slot::RightToes)),
    (Slot::LeftHand, None),
    (Slot::RightHand, None),
];
pub(super) const HANDS: [Slot; 2] = [Slot::LeftHand, Slot::RightHand];
/// Heights that a wrist and the ends of fingers that stand may have beyond those of feet, leg lengths. Hands roll and
/// slide where feet stand, so that they are measured by legs twice as long, which doubles the heights of feet too.
const PALM: f64 = 0.02;
const FINGERTIP: f64 = -0.03;
const LONGER: f64 = 2.0;
/// A joint's lowest level in a clip is where it stands if it is this near to where it stands at rest, leg lengths.
const LIKE_REST: f64 = 0.08;
/// Share of frames in which a joint may be below its level.
const QUANTILE: f64 = 0.05;
/// A rest pose whose lowest joint is in this range of heights stands on z = 0, leg lengths.
const STANDS: [f64; 2] = [-0.03, 0.15];
/// Speed below which a joint of the source stands still, leg lengths per second.
const STILL: f64 = 0.08;
/// Most joints of a hand that are looked at.
const FINGERS: usize = 6;

/// World positions by slot, one per frame, and those of the rest pose; metres, times the skeleton's scale.
pub(super) struct Source {
    pub points: BTreeMap<Slot, Vec<Vector3<f64>>>,
    pub rest: BTreeMap<Slot, Vector3<f64>>,
    /// Height of the rest pose's ankles above its ground, if it stands on z = 0.
    pub ankle: Option<f64>,
    /// Ends of the left and the right hand's fingers, by frame.
    fingers: [Vec<Vec<Vector3<f64>>>; 2],
    frames: usize,
}

impl Source {
    pub fn new(
        clip: &Clip,
        map: &HumanoidMap,
        alignment: &Alignment,
        skeleton: &Skeleton,
    ) -> Source {
        let scale = alignment.scale;
        let at = |world: &[Isometry3<f64>], joint: usize| world[joint].translation.vector * scale;
        let rest = clip.rest_world();
        // A foot without toes can't roll over them: where the source does that, it doesn't stand.
        let toes = [Slot::LeftToes, Slot::RightToes];
        let known = |slot: &Slot| !toes.contains(slot) || skeleton.slots.contains_key(slot);
        let slots = map.matches.iter().map(|(slot, found)| (*slot, found.joint));
        let slots: Vec<(Slot, usize)> = slots.filter(|(slot, _)| known(slot)).collect();
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

    fn ankle_at_rest(&self, clip: &Clip, map: &HumanoidMap, scale: f64, leg: f64) -> Option<f64> {
        let world = clip.rest_world();
        let feet = [Slot::LeftFoot, Slot::RightFoot].map(|slot| map.joint(slot));
        let [left, right] = [feet[0]?, feet[1]?];
        let mut in_foot = vec![false; world.len()];
        let mut lowest = f64::INFINITY;
        for (j, joint) in clip.joints.iter().enumerate() {
            let below = joint.parent.is_some_and(|p| p < j && in_foot[p]);
            in_foot[j] = below || j == left || j == right;
            if in_foot[j] {
                lowest = lowest.min(world[j].translation.z * scale / leg);
            }
        }
        let heights = [left, right].map(|j| world[j].translation.z * scale);
        let level = (heights[0] - heights[1]).abs() < LIKE_REST * leg;
        let stands = (STANDS[0]..STANDS[1]).contains(&lowest) && level;
        stands.then_some((heights[0] + heights[1]) / 2.0)
    }

    /// Leaves the frames `own`.
    pub fn keep(&mut self, own: &Range<usize>) {
        self.points
            .values_mut()
            .for_each(|path| super::keep(path, own));
        self.fingers
            .iter_mut()
            .for_each(|tips| super::keep(tips, own));
        self.frames = own.len();
    }

    /// Moves frame `f`.
    pub fn shift_frame(&mut self, f: usize, by: &Vector3<f64>) {
        let joints = self.points.values_mut().filter_map(|path| path.get_mut(f));
        let tips = self.fingers.iter_mut().filter_map(|tips| tips.get_mut(f));
        joints.chain(tips.flatten()).for_each(|point| *point += by);
    }

    pub fn at(&self, slot: Slot, f: usize) -> Option<Vector3<f64>> {
        self.points.get(&slot)?.get(f).copied()
    }

    /// Whether a foot or hand stands on ground of height `floor`, per frame; `None` without such a joint.
    pub fn contact(
        &self,
        end: Slot,
        floor: f64,
        fps: f64,
        leg: f64,
        ankle: f64,
        loop_mode: LoopMode,
    ) -> Option<Vec<bool>> {
        let path = self.points.get(&end)?;
        let lowered = |path: &[Vector3<f64>], by: f64| -> Vec<Vector3<f64>> {
            path.iter().map(|p| p - Vector3::z() * by).collect()
        };
        let mut paths: Vec<Vec<Vector3<f64>>> = Vec::new();
        let mut size = leg;
        if let Some(hand) = HANDS.iter().position(|hand| *hand == end) {
            size *= LONGER;
            let tips = self.tips(hand);
            paths.extend(tips.iter().map(|path| lowered(path, FINGERTIP * leg)));
            if paths.is_empty() {
                paths.push(lowered(path, PALM * leg));
            }
        } else {
            let height = self.ankle.unwrap_or(ankle);
            paths.push(lowered(path, level(path, floor + height, leg) - floor));
            let toes = ENDS.iter().find(|e| e.0 == end).and_then(|e| e.1);
            if let Some(path) = toes.and_then(|toes| self.points.get(&toes)) {
                paths.push(lowered(
                    path,
                    level(path, floor + height / 2.0, leg) - floor,
                ));
            }
        }
        let stands = |path: &Vec<Vector3<f64>>| -> Vec<bool> {
            let points: Vec<Vec<Vector3<f64>>> = path.iter().map(|p| vec![*p]).collect();
            contact::detect_above(&points, floor, fps, size, loop_mode)
        };
        let each: Vec<Vec<bool>> = paths.iter().map(stands).collect();
        let any = |f: usize| each.iter().any(|stands| stands[f]);
        Some((0..self.frames).map(any).collect())
    }

    /// Whether a foot's ankle or toes, or a wrist, hardly move from a frame to the next.
    pub fn is_still(&self, end: Slot, f: usize, fps: f64, leg: f64) -> bool {
        let toes = ENDS.iter().find(|e| e.0 == end).and_then(|e| e.1);
        let still = |slot: Slot| match (self.at(slot, f), self.at(slot, f + 1)) {
            (Some(a), Some(b)) => (b - a).norm() * fps < STILL * leg,
            _ => false,
        };
        still(end) || toes.is_some_and(still)
    }

    /// Paths of a hand's finger ends.
    fn tips(&self, hand: usize) -> Vec<Vec<Vector3<f64>>> {
        let count = self.fingers[hand].first().map_or(0, Vec::len);
        let path = |i: usize| self.fingers[hand].iter().map(|tips| tips[i]).collect();
        (0..count).map(path).collect()
    }
}

/// The level on which a joint stands: its lowest in the clip, unless it never comes down.
fn level(path: &[Vector3<f64>], expected: f64, leg: f64) -> f64 {
    let mut heights: Vec<f64> = path.iter().map(|p| p.z).collect();
    heights.sort_by(f64::total_cmp);
    let at = (heights.len().saturating_sub(1) as f64 * QUANTILE).round() as usize;
    let lowest = heights.get(at).copied().unwrap_or(expected);
    if (lowest - expected).abs() < LIKE_REST * leg {
        lowest
    } else {
        expected
    }
}

/// Joints below a hand that have none below them.
fn fingers(clip: &Clip, hand: Option<usize>) -> Vec<usize> {
    let Some(hand) = hand else {
        return Vec::new();
    };
    let mut below = vec![false; clip.joints.len()];
    let mut ends = vec![true; clip.joints.len()];
    for (j, joint) in clip.joints.iter().enumerate() {
        if let Some(p) = joint.parent.filter(|p| *p < j) {
            below[j] = p == hand || below[p];
            ends[p] = false;
        }
    }
    let tips = (0..below.len()).filter(|j| below[*j] && ends[*j]);
    tips.take(FINGERS).collect()
}
