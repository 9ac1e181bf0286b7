//! Which joints carry a figure over the ground: files put the travel on different ones.

use crate::clip::{Clip, Joint, carry};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// A joint whose transform changes by less than this, in metres or in parts of a quaternion, stands still. Chosen: clip files
/// have single precision, which rounds a distance of 100 m by 4 µm.
const STILL: f64 = 1e-5;

/// The moving part of a joint tree.
pub(super) struct Figure {
    /// The topmost joints that move. What is above them stays where it is; what is below is carried along.
    pub carriers: Vec<usize>,
    /// The joint whose path is the figure's, usually the hips: from the carrier with the most joints down, the first at which
    /// the tree forks.
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
    /// `joints` has at least one joint; `moving` says of each whether it moves.
    pub fn new(joints: &[Joint], moving: &[bool]) -> Self {
        let carriers = carriers(joints, moving);
        let mut below = vec![1_usize; joints.len()];
        // Children come after their parents, so backwards every subtree is complete when it is added to its parent.
        for j in (0..joints.len()).rev() {
            if let Some(parent) = joints[j].parent {
                below[parent] += below[j];
            }
        }
        // Props and cameras may move by themselves: the figure is what has the most joints.
        let largest = carriers.iter().rev().max_by_key(|&&j| below[j]);
        let top = largest.copied().unwrap_or(0);
        let traveller = fork(joints, top).unwrap_or(top);
        Self {
            members: subtree(joints, traveller),
            carriers,
            traveller,
        }
    }

    /// The move over the ground that brings the pose `from` to the pose `to` (world transforms): the traveller meets itself,
    /// and the turn is the one at which all members come nearest.
    pub fn carry(&self, from: &[Isometry3<f64>], to: &[Isometry3<f64>]) -> Isometry3<f64> {
        let turn = carry(&self.places(from), &self.places(to)).rotation;
        self.about_traveller(turn, from, to)
    }

    /// The same without a turn, where the turn is smaller than `straight` radians or than what the poses leave unclear: the
    /// members' remaining distance from each other, seen as an angle from the traveller.
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
        // A turn within what the poses leave unclear would only be noise.
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
        // Over the ground, not up or down.
        shift.z = 0.0;
        Isometry3::from_parts(shift.into(), turn)
    }

    /// Each carrier, and the world transform of its parent, which stands still.
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
