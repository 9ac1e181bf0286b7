//! Hips, spine, chest, neck and head: mostly where limbs meet in the tree.
//!
//! Confidence is 1 where the tree leaves no choice, or the name has one meaning. The smaller numbers are chosen, in this
//! order: 0.9 for the only joint that can be meant, 0.8 for hips without a telling name, 0.6 for a chest by its name
//! alone, and 0.5 for a guess by place.

use super::names::{Label, Part};
use super::tree::Tree;
use super::{HumanoidMap, Slot};
use crate::clip::Joint;

/// Fills the slots of the trunk, given those of the limbs.
pub(super) fn find(tree: &Tree, joints: &[Joint], labels: &[Label], found: &mut HumanoidMap) {
    let (Some(left), Some(right)) = (
        found.joint(Slot::LeftUpperLeg),
        found.joint(Slot::RightUpperLeg),
    ) else {
        return;
    };
    let Some(legs_meet) = tree.meet(left, right) else {
        return;
    };
    // Hips first: chest and neck are found from there.
    let hips = hips(tree, labels, legs_meet, [left, right]);
    let reason = if hips == legs_meet {
        "both legs branch off from it".to_owned()
    } else {
        format!("its name, `{}`", joints[hips].name)
    };
    let named = labels[hips].fits(Part::Hips, None) > 0.0;
    found.insert(Slot::Hips, hips, if named { 1.0 } else { 0.8 }, reason);
    if let Some((chest, confidence, reason)) = chest(tree, joints, labels, found, hips) {
        found.insert(Slot::Chest, chest, confidence, reason);
        spine(tree, found, hips, chest);
        neck_and_head(tree, joints, labels, found, chest);
    }
}

/// Where the legs meet, unless that is far from the legs (a node on the ground that moves the whole figure, for one) and a
/// joint named for the hips is below it, nearer. Far is twice the distance between the legs. Chosen.
fn hips(tree: &Tree, labels: &[Label], meet: usize, legs: [usize; 2]) -> usize {
    let middle = (tree.at[legs[0]].coords + tree.at[legs[1]].coords) / 2.0;
    let width = tree.span(legs[0], legs[1]).norm();
    let off = |j: usize| (tree.at[j].coords - middle).norm();
    let named = (0..labels.len())
        .filter(|j| labels[*j].fits(Part::Hips, None) > 0.0 && tree.is_above(meet, *j))
        .min_by(|a, b| off(*a).total_cmp(&off(*b)));
    named
        .filter(|j| off(meet) > 2.0 * width && off(*j) < off(meet))
        .unwrap_or(meet)
}

/// Where the arms meet above the hips; failing that, the topmost joint that is named for the trunk.
fn chest(
    tree: &Tree,
    joints: &[Joint],
    labels: &[Label],
    found: &HumanoidMap,
    hips: usize,
) -> Option<(usize, f64, String)> {
    let arm = |clavicle, upper| found.joint(clavicle).or_else(|| found.joint(upper));
    let left = arm(Slot::LeftShoulder, Slot::LeftUpperArm)?;
    let right = arm(Slot::RightShoulder, Slot::RightUpperArm)?;
    let meet = tree.meet(left, right)?;
    // Arms that meet at the hips or below share no trunk joint of their own.
    if meet != hips && !tree.is_above(meet, hips) {
        return Some((meet, 1.0, "both arms branch off from it".to_owned()));
    }
    // Then the topmost joint that is named for the trunk, unless it is above the hips in the tree.
    let is_trunk = |j: &usize| *j != hips && labels[*j].fits(Part::Trunk, None) > 0.0;
    let last = (0..joints.len())
        .filter(|j| is_trunk(j) && !tree.is_above(*j, hips))
        .max_by(|a, b| tree.at[*a].z.total_cmp(&tree.at[*b].z).then(b.cmp(a)))?;
    Some((last, 0.6, format!("its name, `{}`", joints[last].name)))
}

/// The first joint on the way from the hips to the chest, if there is one between them.
fn spine(tree: &Tree, found: &mut HumanoidMap, hips: usize, chest: usize) {
    let Some(base) = tree.meet(hips, chest) else {
        return;
    };
    let path = tree.path(base, chest);
    if let Some(first) = path.get(1).filter(|j| **j != chest) {
        found.insert(
            Slot::Spine,
            *first,
            0.9,
            "the first joint from the hips to the chest".to_owned(),
        );
    }
}

/// By name. A single joint above the chest turns the head, whatever its name.
fn neck_and_head(
    tree: &Tree,
    joints: &[Joint],
    labels: &[Label],
    found: &mut HumanoidMap,
    chest: usize,
) {
    let named = |part: Part| {
        let fit = |j: usize| labels[j].fits(part, None);
        let fitting = (0..labels.len()).filter(|&j| fit(j) > 0.0 && tree.is_above(chest, j));
        fitting.reduce(|best, j| if fit(j) > fit(best) { j } else { best })
    };
    let said = |j: usize| format!("its name, `{}`", joints[j].name);
    match (named(Part::Neck), named(Part::Head)) {
        (Some(neck), Some(head)) if tree.is_above(neck, head) => {
            let fit = labels[neck].fits(Part::Neck, None);
            found.insert(Slot::Neck, neck, fit, said(neck));
            found.insert(Slot::Head, head, 1.0, said(head));
        }
        (_, Some(head)) => found.insert(Slot::Head, head, 1.0, said(head)),
        (Some(neck), None) => {
            let reason = format!("`{}` is the only joint above the chest", joints[neck].name);
            found.insert(Slot::Head, neck, 0.9, reason);
        }
        (None, None) => by_place(tree, labels, found, chest),
    }
}

/// By place: on the branch of the chest that has no arm and goes up, the first joint is the neck and the second the head. If
/// the second is only an end of the first, the first is the head.
fn by_place(tree: &Tree, labels: &[Label], found: &mut HumanoidMap, chest: usize) {
    let arms = [Slot::LeftUpperArm, Slot::RightUpperArm].map(|slot| found.joint(slot));
    let holds_arm = |j: usize| {
        arms.iter()
            .flatten()
            .any(|a| *a == j || tree.is_above(j, *a))
    };
    // A neck goes up; capes and holsters hang down.
    let above = |j: &&usize| !holds_arm(**j) && tree.span(chest, **j).z > 0.0;
    let Some(&first) = tree.children[chest].iter().find(above) else {
        return;
    };
    let reason = "its place above the chest".to_owned();
    let second = tree.children[first].first();
    match second.filter(|second| !labels[**second].is_foreign) {
        Some(&second) => {
            found.insert(Slot::Neck, first, 0.5, reason.clone());
            found.insert(Slot::Head, second, 0.5, reason);
        }
        None => found.insert(Slot::Head, first, 0.5, reason),
    }
}
