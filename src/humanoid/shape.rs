//! Arms and legs by the shape of the rest pose, where names don't tell.

use super::tree::Tree;
use super::{HumanoidMap, NotHumanoid, Slot};
use nalgebra::Vector3;

/// Confidence in a joint that only the shape speaks for.
const BY_SHAPE: f64 = 0.5;
/// Two branches are a pair when their lengths and end heights differ by no more than this part of their length.
const PAIR_TOLERANCE: f64 = 0.15;
/// Branches of one joint that are compared.
const BRANCHES: usize = 16;

const LEFT_LEG: [Slot; 4] = [
    Slot::LeftUpperLeg,
    Slot::LeftLowerLeg,
    Slot::LeftFoot,
    Slot::LeftToes,
];
const RIGHT_LEG: [Slot; 4] = [
    Slot::RightUpperLeg,
    Slot::RightLowerLeg,
    Slot::RightFoot,
    Slot::RightToes,
];
const LEFT_ARM: [Slot; 4] = [
    Slot::LeftShoulder,
    Slot::LeftUpperArm,
    Slot::LeftLowerArm,
    Slot::LeftHand,
];
const RIGHT_ARM: [Slot; 4] = [
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

/// Fills limbs that their names left incomplete.
pub(super) fn complete(tree: &Tree, found: &mut HumanoidMap) {
    let lacks =
        |found: &HumanoidMap, slots: &[Slot]| slots.iter().any(|s| found.joint(*s).is_none());
    for [lower, foot] in [
        [Slot::LeftLowerLeg, Slot::LeftFoot],
        [Slot::RightLowerLeg, Slot::RightFoot],
        [Slot::LeftLowerArm, Slot::LeftHand],
        [Slot::RightLowerArm, Slot::RightHand],
    ] {
        add_end(tree, found, lower, foot);
    }
    let legs_missing = lacks(found, &LEFT_LEG[..3]) || lacks(found, &RIGHT_LEG[..3]);
    let arms_missing = lacks(found, &LEFT_ARM[1..3]) || lacks(found, &RIGHT_ARM[1..3]);
    if !legs_missing && !arms_missing {
        return;
    }
    let reach = reaches(tree);
    if legs_missing && let Some([left, right]) = legs(tree, &reach) {
        replace(
            found,
            &LEFT_LEG,
            &left,
            "its place in a leg of the rest pose",
        );
        replace(
            found,
            &RIGHT_LEG,
            &right,
            "its place in a leg of the rest pose",
        );
    }
    if arms_missing && let Some([left, right]) = arms(tree, &reach, found) {
        replace(
            found,
            &LEFT_ARM,
            &left,
            "its place in an arm of the rest pose",
        );
        replace(
            found,
            &RIGHT_ARM,
            &right,
            "its place in an arm of the rest pose",
        );
    }
}

/// Takes the only joint below a lower leg or arm for its foot or hand.
fn add_end(tree: &Tree, found: &mut HumanoidMap, bend: Slot, end: Slot) {
    if let (Some(above), None) = (found.joint(bend), found.joint(end))
        && let [only] = tree.children[above][..]
    {
        found.insert(
            end,
            only,
            BY_SHAPE,
            format!("the only joint below the {bend}"),
        );
    }
}

fn replace(found: &mut HumanoidMap, slots: &[Slot; 4], joints: &[Option<usize>; 4], reason: &str) {
    for (slot, joint) in slots.iter().zip(joints) {
        found.matches.remove(slot);
        if let Some(joint) = joint {
            found.insert(*slot, *joint, BY_SHAPE, reason.to_owned());
        }
    }
}

/// For every joint, the child on its longest way down, and that way's length.
fn reaches(tree: &Tree) -> Vec<(Option<usize>, f64)> {
    let mut reach: Vec<(Option<usize>, f64)> = vec![(None, 0.0); tree.at.len()];
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

/// All pairs of mirrored branches that spring from one joint and have at least `least` joints each.
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

fn alike(a: f64, b: f64, whole: f64) -> bool {
    (a - b).abs() <= PAIR_TOLERANCE * whole && whole > 0.0
}

fn end(tree: &Tree, branch: &Branch) -> Vector3<f64> {
    branch
        .joints
        .last()
        .map_or_else(Vector3::zeros, |j| tree.at[*j].coords)
}

fn mirrored(tree: &Tree, pair: &[Branch; 2]) -> bool {
    let [a, b] = [end(tree, &pair[0]), end(tree, &pair[1])];
    let apart = (a - b).xy().norm();
    alike(a.z, b.z, pair[0].length) && apart > 0.05 * pair[0].length
}

/// Mirrored branches that end lowest: upper leg, lower leg, foot, toes of the left, then of the right.
fn legs(tree: &Tree, reach: &[(Option<usize>, f64)]) -> Option<[[Option<usize>; 4]; 2]> {
    let mut best: Option<(f64, [[usize; 3]; 2], [Branch; 2])> = None;
    for pair in pairs(tree, reach, 3) {
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
    Some(if tree.span(b[0], a[0]).dot(&side) > 0.0 {
        [first, second]
    } else {
        [second, first]
    })
}

/// Hip, knee and ankle: two long drops of like height, and a turn at the end.
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

/// Unit vector to the figure's left, from where its feet point; a figure whose feet don't tell faces +X.
fn facing(tree: &Tree, feet: [(usize, &Branch); 2]) -> Vector3<f64> {
    let toes = |(ankle, branch): (usize, &Branch)| end(tree, branch) - tree.at[ankle].coords;
    let mut forward = toes(feet[0]) + toes(feet[1]);
    forward.z = 0.0;
    if forward.norm() < 0.06 * feet[0].1.length {
        forward = Vector3::x();
    }
    Vector3::z().cross(&forward).normalize()
}

/// The longest mirrored pair outside of the legs: clavicle, upper arm, lower arm, hand of both sides.
fn arms(
    tree: &Tree,
    reach: &[(Option<usize>, f64)],
    found: &HumanoidMap,
) -> Option<[[Option<usize>; 4]; 2]> {
    let [left, right] = [
        found.joint(Slot::LeftUpperLeg)?,
        found.joint(Slot::RightUpperLeg)?,
    ];
    let side = tree.span(right, left);
    let in_leg = |j: usize| {
        [left, right]
            .iter()
            .any(|leg| j == *leg || tree.is_above(*leg, j) || tree.is_above(j, *leg))
    };
    let across = |pair: &[Branch; 2]| {
        let apart = end(tree, &pair[0]) - end(tree, &pair[1]);
        apart.dot(&side).abs() > 0.7 * apart.norm() * side.norm()
    };
    let best = pairs(tree, reach, 2)
        .into_iter()
        .filter(|pair| pair.iter().all(|b| !in_leg(b.joints[0])) && across(pair))
        .max_by(|a, b| a[0].length.total_cmp(&b[0].length))?;
    let [a, b] = [arm_joints(tree, &best[0]), arm_joints(tree, &best[1])];
    let leads = (end(tree, &best[0]) - end(tree, &best[1])).dot(&side) > 0.0;
    Some(if leads { [a, b] } else { [b, a] })
}

/// Clavicle, upper arm, lower arm and hand of a branch, which ends where the fingers begin.
fn arm_joints(tree: &Tree, branch: &Branch) -> [Option<usize>; 4] {
    let joints = &branch.joints;
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
    let clavicle = count >= 4 && long(0) < 0.7 * long(1);
    if clavicle {
        [at(0), at(1), at(2), at(3)]
    } else {
        [None, at(0), at(1), at(2)]
    }
}

/// Refuses a figure whose trunk doesn't continue its legs and whose arms stand as legs do.
pub(super) fn refuse_quadruped(tree: &Tree, found: &HumanoidMap) -> Result<(), NotHumanoid> {
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
    let degrees = trunk.angle(&legs).to_degrees();
    if degrees < 125.0 && arms.angle(&legs) < 1.0 {
        return Err(NotHumanoid::Quadruped { degrees });
    }
    Ok(())
}
