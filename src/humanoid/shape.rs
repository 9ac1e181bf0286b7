//! Arms and legs by the shape of the rest pose, where names don't tell.

use super::names::{Label, Side};
use super::tree::Tree;
use super::{Error, HumanoidMap, Slot};
use nalgebra::Vector3;

/// Confidence in a joint that was found by shape alone. Chosen.
const BY_SHAPE: f64 = 0.5;
/// Two branches are a pair if their lengths, and the heights of their ends, differ by no more than this fraction of their
/// length. Chosen: rest poses are nearly symmetric, while different limbs differ by more.
const PAIR_TOLERANCE: f64 = 0.15;
/// A joint farther above a bend than this fraction of the bone below the bend starts a bone; a nearer one is a twist helper.
/// Chosen: upper and lower bones of a limb are about equally long.
const LIKE_BONE: f64 = 0.5;
/// Most branches of one joint that are compared, the longest first, and most joints of a leg that are tried. Chosen, to bound
/// the search: a figure has five limbs.
const BRANCHES: usize = 16;

pub(super) const LEFT_LEG: [Slot; 4] = [
    Slot::LeftUpperLeg,
    Slot::LeftLowerLeg,
    Slot::LeftFoot,
    Slot::LeftToes,
];
pub(super) const RIGHT_LEG: [Slot; 4] = [
    Slot::RightUpperLeg,
    Slot::RightLowerLeg,
    Slot::RightFoot,
    Slot::RightToes,
];
pub(super) const LEFT_ARM: [Slot; 4] = [
    Slot::LeftShoulder,
    Slot::LeftUpperArm,
    Slot::LeftLowerArm,
    Slot::LeftHand,
];
pub(super) const RIGHT_ARM: [Slot; 4] = [
    Slot::RightShoulder,
    Slot::RightUpperArm,
    Slot::RightLowerArm,
    Slot::RightHand,
];

/// The longest way from a joint down to a leaf.
#[derive(Clone)]
struct Branch {
    joints: Vec<usize>,
    length: f64,
}

/// Fills limbs that their names left incomplete. Named joints stay, unless the rest of their limb doesn't fit them.
pub(super) fn complete(tree: &Tree, labels: &[Label], found: &mut HumanoidMap) {
    let reach = reaches(tree);
    let limbs: [&[Slot]; 4] = [
        &LEFT_LEG[..3],
        &RIGHT_LEG[..3],
        &LEFT_ARM[1..],
        &RIGHT_ARM[1..],
    ];
    for limb in limbs {
        fill_gaps(tree, &reach, found, [limb[0], limb[1], limb[2]]);
    }
    // A limb needs its first three joints; a clavicle or toes may be missing.
    let lacks =
        |found: &HumanoidMap, slots: &[Slot]| slots.iter().any(|s| found.joint(*s).is_none());
    if (lacks(found, &LEFT_LEG[..3]) || lacks(found, &RIGHT_LEG[..3]))
        && let Some([left, right]) = legs(tree, labels, &reach)
    {
        let reason = "its place in a leg of the rest pose";
        supplement(tree, found, &LEFT_LEG, &left, reason);
        supplement(tree, found, &RIGHT_LEG, &right, reason);
    }
    if (lacks(found, &LEFT_ARM[1..3]) || lacks(found, &RIGHT_ARM[1..3]))
        && let Some([left, right]) = arms(tree, labels, &reach, found)
    {
        let reason = "its place in an arm of the rest pose";
        supplement(tree, found, &LEFT_ARM, &left, reason);
        supplement(tree, found, &RIGHT_ARM, &right, reason);
    }
}

/// The one link of a limb that is missing, where it follows from the two others: root above bend above end.
fn fill_gaps(
    tree: &Tree,
    reach: &[(Option<usize>, f64)],
    found: &mut HumanoidMap,
    slots: [Slot; 3],
) {
    let length = |a: usize, b: usize| tree.span(a, b).norm();
    let [root, bend, end] = slots.map(|slot| found.joint(slot));
    let (slot, joint, reason) = match (root, bend, end) {
        (Some(root), None, Some(end)) => {
            // Upper and lower bone are about equally long, so the bend is nearest to the middle.
            let uneven = |j: &usize| (length(root, *j) - length(*j, end)).abs();
            let between = tree.path(root, end).into_iter().skip(1);
            let middle = between
                .filter(|j| *j != end)
                .min_by(|a, b| uneven(a).total_cmp(&uneven(b)));
            (slots[1], middle, "the middle of its limb")
        }
        (None, Some(bend), Some(end)) => {
            let far = |j: &usize| length(*j, bend) > LIKE_BONE * length(bend, end);
            let above = tree.upward(bend).skip(1).find(far);
            (slots[0], above, "the joint above its limb's bend")
        }
        (_, Some(bend), None) => {
            // One child can only be the end; of several, the one that leads farthest down.
            let only = match tree.children[bend][..] {
                [only] => Some(only),
                _ => reach[bend].0.filter(|_| root.is_some()),
            };
            (slots[2], only, "the joint below its limb's bend")
        }
        _ => return,
    };
    if let Some(joint) = joint.filter(|j| !found.matches.values().any(|m| m.joint == *j)) {
        found.insert(slot, joint, BY_SHAPE, reason.to_owned());
    }
}

/// Puts a limb that was found by its shape into the slots that are empty. Where the named joints don't form a chain with it,
/// it takes their slots too.
fn supplement(
    tree: &Tree,
    found: &mut HumanoidMap,
    slots: &[Slot; 4],
    joints: &[Option<usize>; 4],
    reason: &str,
) {
    let chain = slots.iter().zip(joints);
    let merged: Vec<(Slot, Option<usize>, bool)> = chain
        .map(|(slot, joint)| match found.joint(*slot) {
            Some(named) => (*slot, Some(named), true),
            None => (*slot, *joint, false),
        })
        .collect();
    let links: Vec<usize> = merged.iter().filter_map(|link| link.1).collect();
    // Named and found joints must be one chain.
    let fits = links.windows(2).all(|pair| tree.is_above(pair[0], pair[1]));
    for (i, (slot, joint, named)) in merged.into_iter().enumerate() {
        let joint = if fits { joint } else { joints[i] };
        if named && fits {
            continue;
        }
        found.matches.remove(&slot);
        if let Some(joint) = joint {
            found.insert(slot, joint, BY_SHAPE, reason.to_owned());
        }
    }
}

/// For every joint, the child on its longest way down, and that way's length.
fn reaches(tree: &Tree) -> Vec<(Option<usize>, f64)> {
    let mut reach: Vec<(Option<usize>, f64)> = vec![(None, 0.0); tree.at.len()];
    // Children come after their parents, so backwards every child is done before its parent.
    for j in (0..tree.at.len()).rev() {
        for &child in &tree.children[j] {
            let length = reach[child].1 + tree.span(j, child).norm();
            if length > reach[j].1 {
                reach[j] = (Some(child), length);
            }
        }
    }
    reach
}

fn branch(reach: &[(Option<usize>, f64)], start: usize) -> Branch {
    Branch {
        joints: std::iter::successors(Some(start), |j| reach[*j].0).collect(),
        length: reach[start].1,
    }
}

/// All pairs of mirrored branches of one joint, of at least `least` joints each.
fn pairs(tree: &Tree, reach: &[(Option<usize>, f64)], least: usize) -> Vec<[Branch; 2]> {
    let mut pairs = Vec::new();
    for children in &tree.children {
        let mut branches: Vec<usize> = children.clone();
        branches.sort_by(|a, b| reach[*b].1.total_cmp(&reach[*a].1).then(a.cmp(b)));
        branches.truncate(BRANCHES);
        for (i, a) in branches.iter().enumerate() {
            for b in &branches[i + 1..] {
                if alike(reach[*a].1, reach[*b].1, reach[*a].1) {
                    let pair = [branch(reach, *a), branch(reach, *b)];
                    if pair.iter().all(|p| p.joints.len() >= least) && mirrored(tree, &pair) {
                        pairs.push(pair);
                    }
                }
            }
        }
    }
    pairs
}

/// Whether two numbers differ by no more than the tolerance of a pair, as a fraction of `whole`.
fn alike(a: f64, b: f64, whole: f64) -> bool {
    (a - b).abs() <= PAIR_TOLERANCE * whole && whole > 0.0
}

fn end(tree: &Tree, branch: &Branch) -> Vector3<f64> {
    branch
        .joints
        .last()
        .map_or_else(Vector3::zeros, |j| tree.at[*j].coords)
}

/// Whether the ends of two branches are equally high and apart. 0.05 of their length is chosen: hands and feet of
/// both sides are farther apart, and two chains of one limb end nearer to each other.
fn mirrored(tree: &Tree, pair: &[Branch; 2]) -> bool {
    let [a, b] = [end(tree, &pair[0]), end(tree, &pair[1])];
    let apart = (a - b).xy().norm();
    alike(a.z, b.z, pair[0].length) && apart > 0.05 * pair[0].length
}

/// The mirrored branches that end lowest: upper leg, lower leg, foot and toes, of the left and then of the right.
fn legs(
    tree: &Tree,
    labels: &[Label],
    reach: &[(Option<usize>, f64)],
) -> Option<[[Option<usize>; 4]; 2]> {
    let mut best: Option<(f64, [[usize; 3]; 2], [Branch; 2])> = None;
    for pair in pairs(tree, reach, 3) {
        // Feet are the lowest ends of a figure that stands.
        let low = end(tree, &pair[0]).z + end(tree, &pair[1]).z;
        if best.as_ref().is_none_or(|(lowest, ..)| low < *lowest)
            && let (Some(a), Some(b)) = (leg_joints(tree, &pair[0]), leg_joints(tree, &pair[1]))
        {
            best = Some((low, [a, b], pair));
        }
    }
    let (_, [a, b], pair) = best?;
    let side = facing(tree, [(a[2], &pair[0]), (b[2], &pair[1])]);
    let chain = |leg: [usize; 3], branch: &Branch| {
        let toes = branch
            .joints
            .iter()
            .copied()
            .find(|j| *j > leg[2] && tree.parent[*j] == Some(leg[2]));
        [Some(leg[0]), Some(leg[1]), Some(leg[2]), toes]
    };
    let (first, second) = (chain(a, &pair[0]), chain(b, &pair[1]));
    // Hip joints may be in one place, so knees and ankles count too.
    let across: Vector3<f64> = (0..3).map(|i| tree.span(b[i], a[i])).sum();
    let leads = named_first(labels, &pair).unwrap_or(across.dot(&side) > 0.0);
    Some(if leads {
        [first, second]
    } else {
        [second, first]
    })
}

/// Hip, knee and ankle of a branch: the three joints with the longest shorter drop (thigh and shin are about equally long),
/// and where the foot turns away from the shin. The turn counts 0.2 against the drop's fraction of the leg. Chosen: it
/// settles ties between ankle and ball, and no more. A branch that goes down less than half its length isn't a leg.
fn leg_joints(tree: &Tree, branch: &Branch) -> Option<[usize; 3]> {
    let joints = &branch.joints[..branch.joints.len().min(BRANCHES)];
    let drop = |from: usize, to: usize| -tree.span(from, to).z;
    let total = drop(*joints.first()?, *joints.last()?);
    if total <= 0.5 * branch.length {
        return None;
    }
    let mut best: Option<(f64, [usize; 3])> = None;
    for (i, &hip) in joints.iter().enumerate() {
        for (k, &knee) in joints.iter().enumerate().skip(i + 1) {
            for (a, &ankle) in joints.iter().enumerate().skip(k + 1) {
                // 1 − cosine of the angle between shin and foot: 0 in a straight chain, 1 at a right angle.
                let turn = joints.get(a + 1).map_or(0.0, |next| {
                    let (shin, foot) = (tree.span(knee, ankle), tree.span(ankle, *next));
                    1.0 - shin.dot(&foot) / (shin.norm() * foot.norm()).max(1e-12)
                });
                let score = drop(hip, knee).min(drop(knee, ankle)) / total + 0.2 * turn;
                if best.is_none_or(|(most, _)| score > most + 1e-6) {
                    best = Some((score, [hip, knee, ankle]));
                }
            }
        }
    }
    best.map(|(_, chain)| chain)
}

/// Whether names say that the first branch is the left one. Names know better than the shape.
fn named_first(labels: &[Label], pair: &[Branch; 2]) -> Option<bool> {
    let side = |branch: &Branch| {
        // A name that is only a letter says nothing about a side.
        let named = branch
            .joints
            .iter()
            .filter(|j| !labels[**j].core.is_empty());
        // Joints vote for a side.
        let names = named.filter_map(|j| labels[*j].side);
        names.fold(0, |sum, side| sum + if side == Side::Left { 1 } else { -1 })
    };
    let [first, second] = [side(&pair[0]), side(&pair[1])];
    (first != second).then_some(first > second)
}

/// Unit vector to the figure's left, by where its feet point. If they reach less far forward than 0.06 of the leg (chosen, far
/// below the length of a foot), they don't tell, and the figure is taken to face +X.
fn facing(tree: &Tree, feet: [(usize, &Branch); 2]) -> Vector3<f64> {
    let toes = |(ankle, branch): (usize, &Branch)| end(tree, branch) - tree.at[ankle].coords;
    let mut forward = toes(feet[0]) + toes(feet[1]);
    forward.z = 0.0;
    if forward.norm() < 0.06 * feet[0].1.length {
        forward = Vector3::x();
    }
    Vector3::z().cross(&forward).normalize()
}

/// The longest mirrored pair outside the legs: clavicle, upper arm, lower arm and hand, of the left and then of the right.
fn arms(
    tree: &Tree,
    labels: &[Label],
    reach: &[(Option<usize>, f64)],
    found: &HumanoidMap,
) -> Option<[[Option<usize>; 4]; 2]> {
    let [left, right] = [
        found.joint(Slot::LeftUpperLeg)?,
        found.joint(Slot::RightUpperLeg)?,
    ];
    let apart = |slots: [Slot; 2]| match slots.map(|slot| found.joint(slot)) {
        [Some(left), Some(right)] => tree.span(right, left),
        _ => Vector3::zeros(),
    };
    let side = apart([Slot::LeftUpperLeg, Slot::RightUpperLeg])
        + apart([Slot::LeftLowerLeg, Slot::RightLowerLeg])
        + apart([Slot::LeftFoot, Slot::RightFoot]);
    // A leg, its parts, and everything above it: arms are none of these.
    let in_leg = |j: usize| {
        [left, right]
            .iter()
            .any(|leg| j == *leg || tree.is_above(*leg, j) || tree.is_above(j, *leg))
    };
    // Arms are apart in the direction in which legs are, within 45° (its cosine is 0.7).
    let across = |pair: &[Branch; 2]| {
        let apart = end(tree, &pair[0]) - end(tree, &pair[1]);
        apart.dot(&side).abs() > 0.7 * apart.norm() * side.norm()
    };
    let best = pairs(tree, reach, 2)
        .into_iter()
        .filter(|pair| pair.iter().all(|b| !in_leg(b.joints[0])) && across(pair))
        .max_by(|a, b| a[0].length.total_cmp(&b[0].length))?;
    // A clavicle begins nearer to the middle than a leg does. What begins farther out is an upper arm.
    let apart = |a: usize, b: usize| tree.span(a, b).norm();
    let inside = apart(best[0].joints[0], best[1].joints[0]) < apart(left, right);
    let [a, b] = [0, 1].map(|i| arm_joints(tree, &best[i], inside));
    let across = (end(tree, &best[0]) - end(tree, &best[1])).dot(&side);
    let leads = named_first(labels, &best).unwrap_or(across > 0.0);
    Some(if leads { [a, b] } else { [b, a] })
}

/// Clavicle, upper arm, lower arm and hand of a branch. The hand is where the fingers branch off. A branch that starts
/// `inside` may begin with a clavicle: a bone shorter than 0.7 of the next one. Chosen.
fn arm_joints(tree: &Tree, branch: &Branch, inside: bool) -> [Option<usize>; 4] {
    let joints = &branch.joints;
    // A joint with several children ends the arm: it is the hand.
    let fingers = joints
        .iter()
        .skip(2)
        .position(|j| tree.children[*j].len() > 1);
    let count = fingers.map_or(joints.len(), |at| at + 3).min(joints.len());
    let at = |i: usize| joints[..count].get(i).copied();
    let long = |i: usize| match (at(i), at(i + 1)) {
        (Some(a), Some(b)) => tree.span(a, b).norm(),
        _ => 0.0,
    };
    let clavicle = inside && count >= 4 && long(0) < 0.7 * long(1);
    if clavicle {
        [at(0), at(1), at(2), at(3)]
    } else {
        [None, at(0), at(1), at(2)]
    }
}

/// Refuses a figure whose trunk doesn't continue its legs, and whose arms point down as its legs do.
pub(super) fn refuse_quadruped(tree: &Tree, found: &HumanoidMap) -> Result<(), Error> {
    let span = |from: Slot, to: Slot| match (found.joint(from), found.joint(to)) {
        (Some(a), Some(b)) => tree.span(a, b),
        _ => Vector3::zeros(),
    };
    let trunk = span(Slot::LeftUpperLeg, Slot::LeftUpperArm)
        + span(Slot::RightUpperLeg, Slot::RightUpperArm);
    let legs =
        span(Slot::LeftUpperLeg, Slot::LeftFoot) + span(Slot::RightUpperLeg, Slot::RightFoot);
    let arm = |upper, lower, hand| {
        let whole = span(upper, hand);
        if whole == Vector3::zeros() {
            span(upper, lower)
        } else {
            whole
        }
    };
    let arms = arm(Slot::LeftUpperArm, Slot::LeftLowerArm, Slot::LeftHand)
        + arm(Slot::RightUpperArm, Slot::RightLowerArm, Slot::RightHand);
    // Upright, the trunk is at 180° to the legs, on all fours at 90°. 125° and 1 rad are chosen between people who bend
    // forward at rest and animals on their toes.
    let degrees = trunk.angle(&legs).to_degrees();
    if degrees < 125.0 && arms.angle(&legs) < 1.0 {
        return Err(Error::Quadruped { degrees });
    }
    Ok(())
}
