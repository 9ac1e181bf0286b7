//! Every humanoid rig is mapped without help, as somebody mapped it by hand (`maps.txt`).

use mimic::humanoid::{self, Slot};
use mimic::import;
use mimic_test_support::foreign;

/// Files that share a rig, and the names of its joints by slot.
struct Rig {
    files: Vec<&'static str>,
    joints: Vec<(Slot, &'static str)>,
}

fn slot(name: &str) -> Slot {
    let found = Slot::ALL.into_iter().find(|slot| slot.to_string() == name);
    found.unwrap_or_else(|| panic!("`{name}` is no slot"))
}

fn rigs() -> Vec<Rig> {
    let mut rigs: Vec<Rig> = Vec::new();
    for line in include_str!("maps.txt").lines() {
        let words = line.split_whitespace();
        if let Some(files) = line.strip_prefix("file ") {
            let files = files.split_whitespace();
            match rigs.last_mut().filter(|rig| rig.joints.is_empty()) {
                Some(rig) => rig.files.extend(files),
                None => rigs.push(Rig {
                    files: files.collect(),
                    joints: Vec::new(),
                }),
            }
        } else if let Some(rig) = rigs.last_mut() {
            let pairs = words.filter_map(|word| word.split_once('='));
            rig.joints
                .extend(pairs.map(|(name, joint)| (slot(name), joint)));
        }
    }
    rigs
}

#[test]
fn every_rig_maps_by_itself() {
    let rigs = rigs();
    assert!(rigs.len() >= 20 && rigs.iter().all(|rig| rig.joints.len() >= 14));
    let mut seen = 0;
    for rig in &rigs {
        for file in &rig.files {
            let Some(path) = foreign(file) else { continue };
            seen += 1;
            let joints = import::inspect(path).expect("it can be read").joints;
            let map = humanoid::map(&joints).unwrap_or_else(|e| panic!("{file}: {e}"));
            for (slot, name) in &rig.joints {
                let found = map.joint(*slot).map(|joint| joints[joint].name.as_str());
                // Mixamo's prefix differs between files of one rig.
                let found = found.map(|found| found.rsplit(':').next().unwrap_or(found));
                let name = name.rsplit(':').next().unwrap_or(name).replace('~', " ");
                assert_eq!(found, Some(&*name), "{file}: {slot}");
            }
        }
    }
    eprintln!("{seen} files of {} rigs", rigs.len());
}
