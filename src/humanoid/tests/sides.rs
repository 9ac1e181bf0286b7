//! Left and right joints that belong together.

use super::super::*;
use super::nameless;

fn pair_names(joints: &[Joint]) -> Vec<(&str, &str)> {
    let map = map(joints).unwrap_or_else(|e| panic!("{e}"));
    let name = |j: usize| joints[j].name.as_str();
    pairs(joints, &map)
        .into_iter()
        .map(|(l, r)| (name(l), name(r)))
        .collect()
}

#[test]
fn slots_pair_joints_whose_names_say_nothing() {
    // It faces −Y: its left is +X, where g to j and s to v are.
    let joints = nameless();
    let mut found = pair_names(&joints);
    found.sort_unstable();
    let wanted = [
        ("g", "k"),
        ("h", "l"),
        ("i", "m"),
        ("j", "n"),
        ("s", "o"),
        ("t", "p"),
        ("u", "q"),
        ("v", "r"),
    ];
    assert_eq!(found, wanted);
}

#[test]
fn names_pair_the_joints_outside_the_map() {
    for (left, right) in [
        ("mixamorig:LeftHandThumb1", "mixamorig:RightHandThumb1"),
        ("index_01_l", "index_01_r"),
        ("J_Bip_L_Index1", "J_Bip_R_Index1"),
        ("lThumb1", "rThumb1"),
        ("f_index.01.L", "f_index.01.R"),
        ("Bip01 L Finger0", "Bip01 R Finger0"),
        ("左親指", "右親指"),
        ("eyeL", "eyeR"),
    ] {
        let mut joints = nameless();
        for name in [right, left, "Lamp", "Ramp", "tail"] {
            joints.push(Joint {
                name: name.to_owned(),
                parent: Some(5),
                ..joints[5].clone()
            });
        }
        let found = pair_names(&joints);
        assert_eq!(found.len(), 9, "{left}: {found:?}");
        assert_eq!(found[8], (left, right));
    }
}

#[test]
fn names_that_several_joints_have_pair_none() {
    let mut joints = nameless();
    for name in ["ear.l", "ear.r", "ear.r"] {
        joints.push(Joint {
            name: name.to_owned(),
            parent: Some(5),
            ..joints[5].clone()
        });
    }
    assert_eq!(pair_names(&joints).len(), 8);
}
