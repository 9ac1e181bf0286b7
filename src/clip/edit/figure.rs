//! Which joints carry a figure over the ground.

use crate::clip::{Clip, Joint, carry};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// A joint whose transform changes less than this, in metres or parts of a quaternion, stands still: files round.
const STILL: f64 = 1e-5;

/// The moving part of a joint tree.
pub(super) struct Figure {
    /// The topmost joints that move: whatever is above stays where it is, and the rest is carried along.
    pub carriers: Vec<usize>,
    /// The joint whose way is the figure's: the first from the largest carrier down in which the tree forks.
    pub traveller: usize,
    /// The traveller and all below it.
    pub members: Vec<usize>,
}

/// Whether each joint moves in its parent.
pub(super) fn moving(clip: &Clip) -> Vec<bool> {
    let first = &clip.frames[0];
    let differs = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
        (a.translation.vector - b.translation.vector).amax() > STILL
            || (a.rotation.coords - b.rotation.coords).amax() > STILL
    };
    (0..first.len())
        .map(|j| {
            clip.frames
                .iter()
                .any(|frame| differs(&frame[j], &first[j]))
        })
        .collect()
}

impl Figure {
    /// `joints` has at least one joint, and says the same number of times whether one moves.
    pub fn new(joints: &[Joint], moving: &[bool]) -> Self {
        let carriers = carriers(joints, moving);
        let mut below = vec![1_usize; joints.len()];
        for j in (0..joints.len()).rev() {
            if let Some(parent) = joints[j].parent {
                below[parent] += below[j];
            }
        }
        let largest = carriers.iter().rev().max_by_key(|&&j| below[j]);
        let top = largest.copied().unwrap_or(0);
        let traveller = fork(joints, top).unwrap_or(top);
        Self {
            members: subtree(joints, traveller),
            carriers,
            traveller,
        }
    }

    /// The move over the ground that brings the pose `from` to the pose `to`, both of world transforms: the traveller's
    /// place meets its place, and the heading is the one at which all members come nearest.
    pub fn carry(&self, from: &[Isometry3<f64>], to: &[Isometry3<f64>]) -> Isometry3<f64> {
        let turn = carry(&self.places(from), &self.places(to)).rotation;
        self.about_traveller(turn, from, to)
    }

    /// The same, without a turn where that is less than `straight` or than the poses leave unclear: what keeps the
    /// members apart, as an angle at their distance from the traveller.
    pub fn carry_straight(
        &self,
        from: &[Isometry3<f64>],
        to: &[Isometry3<f64>],
        straight: f64,
    ) -> Isometry3<f64> {
        let carry = self.carry(from, to);
        let (mut apart, mut away) = (0.0, 0.0);
        let middle = to[self.traveller].translation.vector;
        for (a, b) in self.places(from).iter().zip(&self.places(to)) {
            apart += (carry.rotation * a + carry.translation.vector - b).norm_squared();
            away += (b - middle).norm_squared();
        }
        if carry.rotation.angle() < straight.max((apart / away).sqrt()) {
            self.about_traveller(UnitQuaternion::identity(), from, to)
        } else {
            carry
        }
    }

    fn places(&self, world: &[Isometry3<f64>]) -> Vec<Vector3<f64>> {
        let place = |&j: &usize| world[j].translation.vector;
        self.members.iter().map(place).collect()
    }

    fn about_traveller(
        &self,
        turn: UnitQuaternion<f64>,
        from: &[Isometry3<f64>],
        to: &[Isometry3<f64>],
    ) -> Isometry3<f64> {
        let place = |world: &[Isometry3<f64>]| world[self.traveller].translation.vector;
        let mut shift = place(to) - turn * place(from);
        shift.z = 0.0;
        Isometry3::from_parts(shift.into(), turn)
    }

    /// Each carrier and the transform of its parent in the world, which stands still.
    pub fn footings<'a>(
        &'a self,
        clip: &'a Clip,
    ) -> impl Iterator<Item = (usize, Isometry3<f64>)> + 'a {
        self.carriers.iter().map(|&j| {
            let parent = clip.joints[j].parent;
            (
                j,
                parent.map_or_else(Isometry3::identity, |p| clip.world_of(p, 0)),
            )
        })
    }
}

/// The topmost joints that move; the roots where none does.
fn carriers(joints: &[Joint], moving: &[bool]) -> Vec<usize> {
    let mut carried = vec![false; joints.len()];
    let mut carriers = Vec::new();
    for (j, joint) in joints.iter().enumerate() {
        let above = joint.parent.is_some_and(|p| carried[p]);
        if !above && moving[j] {
            carriers.push(j);
        }
        carried[j] = above || moving[j];
    }
    if carriers.is_empty() {
        let is_root = |j: &usize| joints[*j].parent.is_none();
        carriers = (0..joints.len()).filter(is_root).collect();
    }
    carriers
}

/// The first joint from `top` down with several children.
fn fork(joints: &[Joint], top: usize) -> Option<usize> {
    let mut children = vec![0; joints.len()];
    let mut child = vec![None; joints.len()];
    for (j, joint) in joints.iter().enumerate() {
        if let Some(parent) = joint.parent {
            children[parent] += 1;
            child[parent] = Some(j);
        }
    }
    std::iter::successors(Some(top), |&j| child[j]).find(|&j| children[j] > 1)
}

fn subtree(joints: &[Joint], top: usize) -> Vec<usize> {
    let mut inside = vec![false; joints.len()];
    for j in top..joints.len() {
        inside[j] = j == top || joints[j].parent.is_some_and(|p| inside[p]);
    }
    (0..joints.len()).filter(|&j| inside[j]).collect()
}
