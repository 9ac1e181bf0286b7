//! Slots of joints that the file itself calls bones of a humanoid, as VRM files do. The names of bones are VRM's.

use super::shape::{LEFT_ARM, LEFT_LEG, RIGHT_ARM, RIGHT_LEG};
use super::tree::Tree;
use super::{HumanoidMap, Slot};
use crate::clip::Joint;

const REASON: &str = "the file says so";
/// VRM's bones of the trunk, upward. Each but the first may be missing.
const TRUNK: [&str; 3] = ["spine", "chest", "upperChest"];
/// Slots whose joints are below each other, in order.
const CHAINS: [&[Slot]; 5] = [
    &[Slot::Chest, Slot::Neck, Slot::Head],
    &LEFT_ARM,
    &RIGHT_ARM,
    &LEFT_LEG,
    &RIGHT_LEG,
];

/// The slots that the file states: none in most files.
pub(super) fn find(joints: &[Joint]) -> HumanoidMap {
    let of = |bone: &str| joints.iter().position(|j| j.bone.as_deref() == Some(bone));
    let mut found = HumanoidMap::default();
    let mut put = |slot, joint| found.insert(slot, joint, 1.0, REASON.to_owned());
    let limbs = Slot::ALL.into_iter().filter(|s| !is_trunk(*s));
    for (slot, joint) in limbs.filter_map(|slot| Some((slot, of(&bone(slot))?))) {
        put(slot, joint);
    }
    // The chest is the uppermost bone of the trunk that there is: neck and shoulders branch off there.
    let trunk: Vec<usize> = TRUNK.into_iter().filter_map(of).collect();
    if let Some((&chest, below)) = trunk.split_last() {
        put(Slot::Chest, chest);
        if let Some(&spine) = below.first() {
            put(Slot::Spine, spine);
        }
    }
    found
}

fn is_trunk(slot: Slot) -> bool {
    matches!(slot, Slot::Spine | Slot::Chest)
}

/// The slot's name as VRM writes it: `leftUpperLeg` for `left-upper-leg`.
fn bone(slot: Slot) -> String {
    let mut words = slot.name().split('-');
    let first = words.next().unwrap_or_default().to_owned();
    words.fold(first, |name, word| {
        let (letter, rest) = word.split_at(1);
        name + &letter.to_uppercase() + rest
    })
}

/// Fills slots that the file leaves out with `guesses`, where they don't contradict what it states.
pub(super) fn supplement(tree: &Tree, found: &mut HumanoidMap, guesses: HumanoidMap) {
    let stated = found.clone();
    for (slot, guess) in guesses.matches {
        let is_free = stated.matches.values().all(|m| m.joint != guess.joint);
        // The file states the trunk as a whole: a bone that it leaves out isn't there.
        let is_open = stated.joint(slot).is_none() && !is_trunk(slot);
        if is_free && is_open && fits(tree, &stated, slot, guess.joint) {
            found.matches.insert(slot, guess);
        }
    }
}

/// Whether a joint is between those that the file states before and after it in its chain.
fn fits(tree: &Tree, stated: &HumanoidMap, slot: Slot, joint: usize) -> bool {
    let chains = CHAINS.iter().filter_map(|chain| {
        let at = chain.iter().position(|s| *s == slot)?;
        Some((&chain[..at], &chain[at + 1..]))
    });
    let joints =
        |slots: &[Slot]| -> Vec<usize> { slots.iter().filter_map(|s| stated.joint(*s)).collect() };
    chains.into_iter().all(|(before, after)| {
        joints(before).into_iter().all(|j| tree.is_above(j, joint))
            && joints(after).into_iter().all(|j| tree.is_above(joint, j))
    })
}
