//! Arms and legs by name: the chain of joints, each below the one before, whose names fit best.

use super::names::{Label, Part, Side};
use super::tree::Tree;
use super::{HumanoidMap, Slot};
use crate::clip::Joint;

/// Candidates kept per part. Chosen: a rig has a few joints of a name, and the search tries all pairs of candidates, which a
/// hostile file with thousands of equal names must not multiply.
const CANDIDATES: usize = 12;

/// What a joint outside the chain of its limb loses in confidence. Chosen: below every full match (0.9 or 1), so that a
/// joint in the chain wins.
const APART: f64 = 0.4;

/// Least score of a name that is believed without the rest of its limb. Chosen: only names with one meaning score that much.
const SURE: f64 = 0.9;

type Candidate = (usize, f64);

/// Joint, confidence, and whether it stands apart from the limb.
type Link = (usize, f64, bool);

struct Limb {
    side: Side,
    /// Parts of root, bend and end; slots for them.
    parts: [Part; 3],
    slots: [Slot; 3],
    /// An optional part before the root: the clavicle.
    before: Option<(Part, Slot)>,
    /// An optional part beyond the end: the toes.
    beyond: Option<(Part, Slot)>,
}

const ARM: [Part; 3] = [Part::UpperArm, Part::LowerArm, Part::Hand];
const LEG: [Part; 3] = [Part::UpperLeg, Part::LowerLeg, Part::Foot];

const LIMBS: [Limb; 4] = [
    Limb {
        side: Side::Left,
        parts: ARM,
        slots: [Slot::LeftUpperArm, Slot::LeftLowerArm, Slot::LeftHand],
        before: Some((Part::Clavicle, Slot::LeftShoulder)),
        beyond: None,
    },
    Limb {
        side: Side::Right,
        parts: ARM,
        slots: [Slot::RightUpperArm, Slot::RightLowerArm, Slot::RightHand],
        before: Some((Part::Clavicle, Slot::RightShoulder)),
        beyond: None,
    },
    Limb {
        side: Side::Left,
        parts: LEG,
        slots: [Slot::LeftUpperLeg, Slot::LeftLowerLeg, Slot::LeftFoot],
        before: None,
        beyond: Some((Part::Toes, Slot::LeftToes)),
    },
    Limb {
        side: Side::Right,
        parts: LEG,
        slots: [Slot::RightUpperLeg, Slot::RightLowerLeg, Slot::RightFoot],
        before: None,
        beyond: Some((Part::Toes, Slot::RightToes)),
    },
];

/// Fills the slots of limbs that their names tell.
pub(super) fn find(tree: &Tree, joints: &[Joint], labels: &[Label], found: &mut HumanoidMap) {
    for limb in &LIMBS {
        limb.find(tree, joints, labels, found);
    }
}

/// Joints whose names fit, best first, the one nearer the root first among equals.
fn candidates(labels: &[Label], part: Part, side: Side) -> Vec<Candidate> {
    let fits = |(j, label): (usize, &Label)| (j, label.fits(part, Some(side)));
    let mut fitting: Vec<Candidate> = labels.iter().enumerate().map(fits).collect();
    fitting.retain(|(_, score)| *score > 0.0);
    fitting.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    // Sorted by score first, so only the worst are dropped.
    fitting.truncate(CANDIDATES);
    fitting
}

impl Limb {
    fn find(&self, tree: &Tree, joints: &[Joint], labels: &[Label], found: &mut HumanoidMap) {
        let Some(chain) = self.chain(tree, joints, labels) else {
            self.single(tree, joints, labels, found);
            return;
        };
        // A name such as `Leg` may mean the thigh, the shin or the foot. In a complete chain its place settles which, so the
        // score moves halfway to certainty.
        let whole = chain.iter().all(|link| link.is_some_and(|l| !l.2));
        let sure = |score: f64| if whole { (1.0 + score) / 2.0 } else { score };
        let said = |j: usize| format!("its name, `{}`", joints[j].name);
        for (slot, link) in self.slots.into_iter().zip(chain) {
            let Some((joint, score, apart)) = link else {
                continue;
            };
            let place = if apart {
                ", though it is apart from the limb"
            } else {
                ""
            };
            found.insert(slot, joint, sure(score), said(joint) + place);
        }
        let (root, end) = (chain[0].map(|l| l.0), chain[2].map(|l| l.0));
        if let (Some((part, slot)), Some(root)) = (self.before, root) {
            let above = candidates(labels, part, self.side);
            let mut above = above.into_iter().filter(|c| tree.is_above(c.0, root));
            if let Some(best) = above.next() {
                // Of equally good names, the one next to the arm: the others belong to the trunk.
                let mut nearest = above.filter(|c| c.1 == best.1 && tree.is_above(best.0, c.0));
                let (j, score) = nearest.next_back().unwrap_or(best);
                found.insert(slot, j, score, said(j));
            }
        }
        if let (Some((part, slot)), Some(end)) = (self.beyond, end) {
            let below = candidates(labels, part, self.side);
            // Toes with the foot's own name would be a second part of the foot.
            let is_next =
                |c: &Candidate| tree.is_above(end, c.0) && joints[c.0].name != joints[end].name;
            if let Some((j, score)) = below.into_iter().find(is_next) {
                found.insert(slot, j, score, said(j));
            }
        }
    }

    /// Without a chain, the joints whose names leave no doubt. The shape of the rest pose has to find the others.
    fn single(&self, tree: &Tree, joints: &[Joint], labels: &[Label], found: &mut HumanoidMap) {
        let mut above: Option<usize> = None;
        for (part, slot) in self.parts.into_iter().zip(self.slots) {
            let fitting = candidates(labels, part, self.side);
            let sure = |c: &&Candidate| c.1 >= SURE && above.is_none_or(|a| tree.is_above(a, c.0));
            if let Some(&(joint, score)) = fitting.iter().find(sure) {
                let reason = format!("its name, `{}`", joints[joint].name);
                found.insert(slot, joint, score, reason);
                above = Some(joint);
            }
        }
    }

    /// The root, bend and end with the largest sum of scores. A limb needs root and bend; the end may be missing.
    fn chain(&self, tree: &Tree, joints: &[Joint], labels: &[Label]) -> Option<[Option<Link>; 3]> {
        let [roots, bends, ends] = self.parts.map(|part| candidates(labels, part, self.side));
        let mut best: Option<(f64, [Option<Link>; 3])> = None;
        for root in &roots {
            for bend in bends.iter().filter(|b| tree.is_above(root.0, b.0)) {
                let end = end_of(tree, &ends, root.0, bend.0, self.beyond.is_some());
                // The chain with the best names in total; of equals the first, unless another root is nearer to the bend.
                let sum = root.1 + bend.1 + end.map_or(0.0, |e| e.1);
                let wins = best.is_none_or(|(most, chain)| {
                    let equal = (sum - most).abs() <= 1e-9;
                    sum > most + 1e-9 || equal && is_nearer(tree, joints, &chain, root.0, bend.0)
                });
                if wins {
                    let link = |c: &Candidate| Some((c.0, c.1, false));
                    best = Some((sum, [link(root), link(bend), end]));
                }
            }
        }
        best.map(|(_, chain)| chain)
    }
}

/// Whether `root` is between the root of a chain with the same bend and that bend. The other root is then a joint between
/// the limb and the trunk (`LHipJoint`, `__UpLeg_L`), and `root` is nearer to where the limb bends.
fn is_nearer(
    tree: &Tree,
    joints: &[Joint],
    chain: &[Option<Link>; 3],
    root: usize,
    bend: usize,
) -> bool {
    match chain {
        [Some((old, ..)), Some((old_bend, ..)), _] => {
            *old_bend == bend
                && tree.is_above(*old, root)
                && !are_segments(&joints[*old].name, &joints[root].name)
        }
        _ => false,
    }
}

/// Whether two names differ only in their number: they are segments of one bone, which begins at the first.
fn are_segments(a: &str, b: &str) -> bool {
    let pick =
        |name: &str, is: fn(char) -> bool| name.chars().filter(|c| is(*c)).collect::<String>();
    let digits = |c: char| c.is_ascii_digit();
    pick(a, char::is_alphabetic) == pick(b, char::is_alphabetic)
        && pick(a, digits) != pick(b, digits)
}

/// The end of a limb: the best below its bend, or else (feet only) one outside the chain, where IK rigs keep it.
fn end_of(
    tree: &Tree,
    ends: &[Candidate],
    root: usize,
    bend: usize,
    may_stand_apart: bool,
) -> Option<Link> {
    // An end in the chain is preferred to one outside.
    let below = ends.iter().find(|e| tree.is_above(bend, e.0));
    let apart = ends.iter().find(|e| {
        may_stand_apart && e.1 > APART && e.0 != root && e.0 != bend && !tree.is_above(root, e.0)
    });
    let kept = below.map(|e| (e.0, e.1, false));
    kept.or_else(|| apart.map(|e| (e.0, e.1 - APART, true)))
}
