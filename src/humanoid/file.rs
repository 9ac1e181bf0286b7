//! The joint map as a file that people edit: a JSON object from slot to joint name.

use super::{HumanoidMap, Slot};
use crate::clip::Joint;
use std::collections::BTreeMap;

/// Why a map file can't be used.
#[derive(Debug, thiserror::Error)]
pub enum MapFileError {
    #[error("the joint map is no JSON object from slot to joint name: {0}")]
    Json(#[from] serde_json::Error),
    #[error("the joint map names an unknown slot `{slot}`; slots are {known}")]
    UnknownSlot { slot: String, known: String },
    #[error("the joint map puts `{joint}` in slot `{slot}`, but the clip has no such joint{near}")]
    UnknownJoint {
        slot: Slot,
        joint: String,
        near: String,
    },
    #[error(
        "the joint map puts `{joint}` in slot `{slot}`, but {count} joints of the clip have that name"
    )]
    AmbiguousJoint {
        slot: Slot,
        joint: String,
        count: usize,
    },
    #[error("the joint map puts `{joint}` in both `{first}` and `{second}`")]
    UsedTwice {
        joint: String,
        first: Slot,
        second: Slot,
    },
    #[error("the joint map leaves `{slot}` empty, which a humanoid needs")]
    Missing { slot: Slot },
}

impl HumanoidMap {
    /// The map as JSON text: slot to joint name, in the order of the slots.
    pub fn to_json(&self, joints: &[Joint]) -> String {
        let names = self.matches.iter().filter_map(|(slot, found)| {
            let joint = joints.get(found.joint)?;
            Some(format!(
                "  {}: {}",
                quoted(slot.name()),
                quoted(&joint.name)
            ))
        });
        let lines: Vec<String> = names.collect();
        format!("{{\n{}\n}}\n", lines.join(",\n"))
    }

    /// Reads what [`HumanoidMap::to_json`] wrote, perhaps edited. Slots that are left out, empty or `null` stay empty.
    ///
    /// # Errors
    /// [`MapFileError`] names the slot or joint that doesn't fit.
    pub fn from_json(text: &str, joints: &[Joint]) -> Result<HumanoidMap, MapFileError> {
        let named: BTreeMap<String, Option<String>> = serde_json::from_str(text)?;
        let mut map = HumanoidMap::default();
        for (slot, joint) in named {
            let slot = slot_named(&slot)?;
            let Some(joint) = joint.filter(|name| !name.is_empty()) else {
                continue;
            };
            let index = joint_named(slot, &joint, joints)?;
            if let Some((first, _)) = map.matches.iter().find(|(_, m)| m.joint == index) {
                let (first, second) = (*first, slot);
                return Err(MapFileError::UsedTwice {
                    joint,
                    first,
                    second,
                });
            }
            map.insert(slot, index, 1.0, "the map file names it".to_owned());
        }
        match Slot::REQUIRED
            .into_iter()
            .find(|slot| map.joint(*slot).is_none())
        {
            Some(slot) => Err(MapFileError::Missing { slot }),
            None => Ok(map),
        }
    }
}

fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn slot_named(name: &str) -> Result<Slot, MapFileError> {
    let known = || Slot::ALL.map(Slot::name).join(", ");
    let slot = Slot::ALL.into_iter().find(|slot| slot.name() == name);
    slot.ok_or_else(|| MapFileError::UnknownSlot {
        slot: name.to_owned(),
        known: known(),
    })
}

fn joint_named(slot: Slot, name: &str, joints: &[Joint]) -> Result<usize, MapFileError> {
    let same = |j: &usize| joints[*j].name == name;
    let found: Vec<usize> = (0..joints.len()).filter(same).collect();
    match found[..] {
        [one] => Ok(one),
        [] => Err(MapFileError::UnknownJoint {
            slot,
            joint: name.to_owned(),
            near: near(name, joints),
        }),
        _ => Err(MapFileError::AmbiguousJoint {
            slot,
            joint: name.to_owned(),
            count: found.len(),
        }),
    }
}

/// A hint at joints that the writer may have meant.
fn near(name: &str, joints: &[Joint]) -> String {
    let wanted = name.to_lowercase();
    let close = |joint: &&Joint| {
        let have = joint.name.to_lowercase();
        !have.is_empty() && (have.contains(&wanted) || wanted.contains(&have))
    };
    let names: Vec<&str> = joints
        .iter()
        .filter(close)
        .take(3)
        .map(|j| j.name.as_str())
        .collect();
    if names.is_empty() {
        String::new()
    } else {
        format!("; did you mean `{}`?", names.join("`, `"))
    }
}
