//! The joint map as a file that people edit: a JSON object from slot to joint name.

use super::{Error, HumanoidMap, Slot};
use crate::clip::Joint;
use std::collections::BTreeMap;

impl HumanoidMap {
    /// Most bytes that a map's file may have. Chosen: a map is two dozen names, and a longer file is a mistake.
    pub const MOST_BYTES: u64 = 1 << 20;

    /// The map as JSON text to edit: an object from slot to the joint's name in `joints`, in the order of the slots.
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

    /// Reads a map that [`HumanoidMap::to_json`] wrote and somebody may have edited. `joints` are those of the clip. Slots
    /// that are left out, `""` or `null` stay empty.
    ///
    /// # Errors
    /// An [`Error`] for text that isn't such an object, slots or joints that don't exist, names that several joints have, a
    /// joint in two slots, and required slots that are empty.
    pub fn from_json(text: &str, joints: &[Joint]) -> Result<HumanoidMap, Error> {
        let named: BTreeMap<String, Option<String>> =
            serde_json::from_str(text).map_err(|e| Error::MapSyntax {
                reason: e.to_string(),
            })?;
        let mut map = HumanoidMap::default();
        for (slot, joint) in named {
            let slot = slot_named(&slot)?;
            let Some(joint) = joint.filter(|name| !name.is_empty()) else {
                continue;
            };
            let index = joint_named(slot, &joint, joints)?;
            if let Some((first, _)) = map.matches.iter().find(|(_, m)| m.joint == index) {
                let (first, second) = (*first, slot);
                return Err(Error::UsedTwice {
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
            Some(slot) => Err(Error::EmptySlot { slot }),
            None => Ok(map),
        }
    }
}

fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn slot_named(name: &str) -> Result<Slot, Error> {
    let slot = Slot::ALL.into_iter().find(|slot| slot.name() == name);
    slot.ok_or_else(|| Error::UnknownSlot {
        slot: name.to_owned(),
    })
}

fn joint_named(slot: Slot, name: &str, joints: &[Joint]) -> Result<usize, Error> {
    let same = |j: &usize| joints[*j].name == name;
    let found: Vec<usize> = (0..joints.len()).filter(same).collect();
    match found[..] {
        [one] => Ok(one),
        [] => Err(Error::UnknownJoint {
            slot,
            joint: name.to_owned(),
            similar: similar(name, joints),
        }),
        _ => Err(Error::AmbiguousJoint {
            slot,
            joint: name.to_owned(),
            count: found.len(),
        }),
    }
}

/// Names of at most three joints that `name` may mean: those that contain it or that it contains, in any letter case.
fn similar(name: &str, joints: &[Joint]) -> Vec<String> {
    let wanted = name.to_lowercase();
    let close = |joint: &&Joint| {
        let have = joint.name.to_lowercase();
        !have.is_empty() && (have.contains(&wanted) || wanted.contains(&have))
    };
    let similar = joints.iter().filter(close).take(3);
    similar.map(|joint| joint.name.clone()).collect()
}
