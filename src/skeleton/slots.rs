//! Which body takes which humanoid slot: read from the JSON beside the MJCF, or guessed from the names of the bodies.

use super::error::Defect;
use super::{Body, Skeleton};
use crate::humanoid::Slot;
use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Deserialize)]
struct SlotFile {
    slots: BTreeMap<Slot, String>,
}

/// Reads `{"slots": {"hips": "pelvis", …}}`: the body of each slot.
pub(super) fn from_json(text: &str, bodies: &[Body]) -> Result<BTreeMap<Slot, usize>, Defect> {
    let file: SlotFile = serde_json::from_str(text).map_err(|e| {
        Defect::new(
            format!("they cannot be read ({e})"),
            r#"write them as {"slots": {"hips": "pelvis"}}"#,
        )
    })?;
    let mut slots: BTreeMap<Slot, usize> = BTreeMap::new();
    for (slot, name) in file.slots {
        let body = bodies.iter().position(|body| body.name == name);
        let body = body.ok_or_else(|| {
            Defect::new(
                format!("no body is called `{name}`"),
                "use names of bodies of the MJCF file",
            )
        })?;
        if let Some((other, _)) = slots.iter().find(|(_, taken)| **taken == body) {
            let (other, slot) = (other.name(), slot.name());
            let cause = format!("body `{name}` is both `{other}` and `{slot}`");
            return Err(Defect::new(cause, "keep it in one of them"));
        }
        slots.insert(slot, body);
    }
    Ok(slots)
}

/// Guesses slots from the names of the bodies. Of several bodies for one slot, the first takes it.
pub(super) fn from_names(bodies: &[Body]) -> BTreeMap<Slot, usize> {
    let mut slots = BTreeMap::new();
    for (index, body) in bodies.iter().enumerate() {
        if let Some(slot) = slot_of_name(&body.name) {
            slots.entry(slot).or_insert(index);
        }
    }
    slots
}

/// The slot that a name stands for in common rigs: MuJoCo's humanoid, DeepMimic's, and motion capture.
fn slot_of_name(name: &str) -> Option<Slot> {
    let name = name.to_lowercase().replace(['-', '.', ' '], "_");
    let (side, part) = split_side(&name);
    match (side, part) {
        (None, "pelvis" | "hips" | "hip" | "root") => Some(Slot::Hips),
        (None, "torso" | "chest" | "thorax" | "upperback") => Some(Slot::Chest),
        (None, "neck" | "upperneck") => Some(Slot::Neck),
        (None, "head") => Some(Slot::Head),
        (Some(side), part) => limb(part).map(|(left, right)| match side {
            Side::Left => left,
            Side::Right => right,
        }),
        _ => None,
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    Left,
    Right,
}

/// Splits `left_thigh`, `l_thigh`, `lthigh` and `thigh_left` into side and part.
fn split_side(name: &str) -> (Option<Side>, &str) {
    for (word, side) in [
        ("left", Side::Left),
        ("right", Side::Right),
        ("l", Side::Left),
        ("r", Side::Right),
    ] {
        if let Some(part) = name.strip_prefix(word) {
            let part = part.trim_start_matches('_');
            if limb(part).is_some() {
                return (Some(side), part);
            }
        }
        if let Some(part) = name.strip_suffix(word).and_then(|p| p.strip_suffix('_')) {
            return (Some(side), part);
        }
    }
    (None, name)
}

/// Left and right slot of a limb's part.
fn limb(part: &str) -> Option<(Slot, Slot)> {
    Some(match part {
        "thigh" | "upper_leg" | "femur" => (Slot::LeftUpperLeg, Slot::RightUpperLeg),
        "shin" | "lower_leg" | "tibia" | "calf" => (Slot::LeftLowerLeg, Slot::RightLowerLeg),
        "foot" | "ankle" => (Slot::LeftFoot, Slot::RightFoot),
        "toe" | "toes" => (Slot::LeftToes, Slot::RightToes),
        "shoulder" | "clavicle" => (Slot::LeftShoulder, Slot::RightShoulder),
        "upper_arm" | "upperarm" | "uarm" | "humerus" => (Slot::LeftUpperArm, Slot::RightUpperArm),
        "lower_arm" | "lowerarm" | "larm" | "forearm" | "radius" => {
            (Slot::LeftLowerArm, Slot::RightLowerArm)
        }
        "hand" | "wrist" => (Slot::LeftHand, Slot::RightHand),
        _ => return None,
    })
}

impl Skeleton {
    /// The humanoid slots as JSON text, in the form that [`Skeleton::from_mjcf`] reads.
    pub fn slots_json(&self) -> String {
        let slots: BTreeMap<Slot, &str> = self
            .slots
            .iter()
            .map(|(slot, body)| (*slot, self.bodies[*body].name.as_str()))
            .collect();
        serde_json::json!({ "slots": slots }).to_string()
    }
}
