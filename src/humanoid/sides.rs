//! Which left joint belongs to which right joint.

use super::{HumanoidMap, Slot};
use crate::clip::Joint;
use std::collections::BTreeMap;

/// Spellings of left and right.
const WORDS: [(&str, &str); 8] = [
    ("Left", "Right"),
    ("left", "right"),
    ("LEFT", "RIGHT"),
    ("左", "右"),
    ("gauche", "droite"),
    ("gauche", "droit"),
    ("lf", "rt"),
    ("lt", "rt"),
];

/// Pairs of indices (left, right) into `joints`: the joints in opposite slots of `map`, and joints outside the map, such as
/// fingers, whose names (or the bones that the file calls them) differ only in the side.
pub fn pairs(joints: &[Joint], map: &HumanoidMap) -> Vec<(usize, usize)> {
    let mut pairs: Vec<(usize, usize)> = Slot::ALL
        .into_iter()
        .filter_map(|slot| Some((map.joint(slot)?, map.joint(slot.opposite()?)?)))
        .filter(|(left, right)| left != right)
        .collect();
    let mut paired = vec![false; joints.len()];
    // Joints in the middle of the body have no partner, whatever their names.
    let centre = map.matches.iter().filter(|(slot, _)| slot.is_central());
    let placed = centre.map(|(_, found)| found.joint);
    for joint in placed.chain(pairs.iter().flat_map(|&(left, right)| [left, right])) {
        if let Some(paired) = paired.get_mut(joint) {
            *paired = true;
        }
    }
    let names = unique(joints, |joint| Some(&joint.name));
    let bones = unique(joints, |joint| joint.bone.as_deref());
    for (left, joint) in joints.iter().enumerate() {
        // What the file says goes before the name.
        let bone = joint.bone.iter().flat_map(|bone| mirrored_names(bone));
        let bone = bone.map(|bone| bones.get(bone.as_str()));
        let name = mirrored_names(&joint.name).into_iter();
        let name = name.map(|name| names.get(name.as_str()));
        let right = bone.chain(name).find_map(|found| found.copied().flatten());
        if let Some(right) = right.filter(|&right| !paired[left] && !paired[right]) {
            (paired[left], paired[right]) = (true, true);
            pairs.push((left, right));
        }
    }
    pairs
}

impl Slot {
    fn is_central(self) -> bool {
        !self.name().starts_with("left-") && !self.name().starts_with("right-")
    }

    /// The right slot of a left one.
    fn opposite(self) -> Option<Slot> {
        let name = self.name().strip_prefix("left-")?;
        let is_it = |slot: &Slot| slot.name().strip_prefix("right-") == Some(name);
        Slot::ALL.into_iter().find(is_it)
    }
}

/// The joint of each name; `None` where several have it.
fn unique<'a>(
    joints: &'a [Joint],
    name: impl Fn(&'a Joint) -> Option<&'a str>,
) -> BTreeMap<&'a str, Option<usize>> {
    let mut names = BTreeMap::new();
    for (j, joint) in joints.iter().enumerate() {
        if let Some(name) = name(joint) {
            names
                .entry(name)
                .and_modify(|place| *place = None)
                .or_insert(Some(j));
        }
    }
    names
}

/// What the right partner of a left joint may be called.
fn mirrored_names(name: &str) -> Vec<String> {
    let words = WORDS.iter().filter(|(left, _)| name.contains(left));
    let words = words.map(|(left, right)| name.replacen(left, right, 1));
    let letters = name.char_indices().filter_map(|(at, c)| {
        let other = match c {
            'l' => "r",
            'L' => "R",
            _ => return None,
        };
        stands_alone(name, at).then(|| format!("{}{other}{}", &name[..at], &name[at + 1..]))
    });
    words.chain(letters).collect()
}

/// Whether the letter at byte `at` is a word of its own, as in `hand.l`, `lThumb1`, `J_Bip_L_Index` and `HandL`.
fn stands_alone(name: &str, at: usize) -> bool {
    let letter = name[at..].chars().next().unwrap_or_default();
    let before = name[..at].chars().next_back();
    let after = name[at + letter.len_utf8()..].chars().next();
    let starts = match before {
        Some(c) if c.is_alphabetic() => c.is_lowercase() && letter.is_uppercase(),
        _ => true,
    };
    starts && after.is_none_or(|c| !c.is_alphabetic() || c.is_uppercase())
}
