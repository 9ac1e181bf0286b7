mod odd;
mod rigs;
mod sides;

use super::*;
use nalgebra::{Isometry3, Vector3};

/// Joints from name, parent's name and world position.
fn figure(joints: &[(&str, &str, [f64; 3])]) -> Vec<Joint> {
    let place = |name: &str| joints.iter().position(|j| j.0 == name);
    let build = |(name, parent, at): &(&str, &str, [f64; 3])| {
        let up = place(parent);
        let base = up.map_or_else(Vector3::zeros, |p| Vector3::from(joints[p].2));
        let offset = Vector3::from(*at) - base;
        Joint {
            name: (*name).to_owned(),
            parent: up,
            rest: Isometry3::translation(offset.x, offset.y, offset.z),
            bone: None,
        }
    };
    joints.iter().map(build).collect()
}

/// A figure in T-pose whose names say nothing; it faces −Y, so that its left is +X.
fn nameless() -> Vec<Joint> {
    figure(&[
        ("a", "", [0.0, 0.0, 0.0]),
        ("b", "a", [0.0, 0.0, 0.95]),
        ("c", "b", [0.0, 0.0, 1.1]),
        ("d", "c", [0.0, 0.0, 1.35]),
        ("e", "d", [0.0, 0.0, 1.5]),
        ("f", "e", [0.0, 0.0, 1.6]),
        ("g", "d", [0.05, 0.0, 1.4]),
        ("h", "g", [0.18, 0.0, 1.4]),
        ("i", "h", [0.45, 0.0, 1.4]),
        ("j", "i", [0.70, 0.0, 1.4]),
        ("k", "d", [-0.05, 0.0, 1.4]),
        ("l", "k", [-0.18, 0.0, 1.4]),
        ("m", "l", [-0.45, 0.0, 1.4]),
        ("n", "m", [-0.70, 0.0, 1.4]),
        ("o", "b", [-0.09, 0.0, 0.9]),
        ("p", "o", [-0.09, 0.0, 0.5]),
        ("q", "p", [-0.09, 0.0, 0.08]),
        ("r", "q", [-0.09, -0.15, 0.02]),
        ("s", "b", [0.09, 0.0, 0.9]),
        ("t", "s", [0.09, 0.0, 0.5]),
        ("u", "t", [0.09, 0.0, 0.08]),
        ("v", "u", [0.09, -0.15, 0.02]),
    ])
}

fn names(joints: &[Joint]) -> Vec<(&'static str, String)> {
    let map = map(joints).unwrap_or_else(|e| panic!("{e}"));
    let name = |(slot, found): (&Slot, &Match)| (slot.name(), joints[found.joint].name.clone());
    map.matches.iter().map(name).collect()
}

fn assert_maps(joints: &[Joint], expected: &[(&'static str, &str)]) {
    let mut expected: Vec<_> = expected
        .iter()
        .map(|(s, j)| (*s, (*j).to_owned()))
        .collect();
    let mut found = names(joints);
    expected.sort();
    found.sort();
    assert_eq!(found, expected);
}

#[test]
fn a_figure_without_names_is_read_from_its_shape() {
    let joints = nameless();
    assert_maps(
        &joints,
        &[
            ("hips", "b"),
            ("spine", "c"),
            ("chest", "d"),
            ("neck", "e"),
            ("head", "f"),
            ("left-shoulder", "g"),
            ("left-upper-arm", "h"),
            ("left-lower-arm", "i"),
            ("left-hand", "j"),
            ("right-shoulder", "k"),
            ("right-upper-arm", "l"),
            ("right-lower-arm", "m"),
            ("right-hand", "n"),
            ("right-upper-leg", "o"),
            ("right-lower-leg", "p"),
            ("right-foot", "q"),
            ("right-toes", "r"),
            ("left-upper-leg", "s"),
            ("left-lower-leg", "t"),
            ("left-foot", "u"),
            ("left-toes", "v"),
        ],
    );
    assert!(
        map(&joints)
            .unwrap()
            .matches
            .values()
            .all(|m| m.confidence < 1.01 && !m.reason.is_empty())
    );
}

#[test]
fn a_four_legged_animal_with_human_names_is_refused() {
    let mut parts = vec![
        ("Hips", "", [-0.4, 0.0, 0.6]),
        ("Spine", "Hips", [0.0, 0.0, 0.62]),
        ("Chest", "Spine", [0.3, 0.0, 0.62]),
        ("Head", "Chest", [0.5, 0.0, 0.8]),
    ];
    for (arm, fore, hand, leg, knee, foot, y) in [
        (
            "LeftArm",
            "LeftForeArm",
            "LeftHand",
            "LeftUpLeg",
            "LeftLeg",
            "LeftFoot",
            0.1,
        ),
        (
            "RightArm",
            "RightForeArm",
            "RightHand",
            "RightUpLeg",
            "RightLeg",
            "RightFoot",
            -0.1,
        ),
    ] {
        parts.extend([
            (arm, "Chest", [0.3, y, 0.55]),
            (fore, arm, [0.28, y, 0.3]),
            (hand, fore, [0.3, y, 0.05]),
            (leg, "Hips", [-0.4, y, 0.55]),
            (knee, leg, [-0.38, y, 0.3]),
            (foot, knee, [-0.4, y, 0.05]),
        ]);
    }
    assert!(matches!(map(&figure(&parts)), Err(Error::Quadruped { .. })));
}

#[test]
fn a_figure_without_arms_is_refused_by_slot() {
    let joints: Vec<Joint> = nameless()
        .into_iter()
        .filter(|j| !"hijlmn".contains(&j.name))
        .collect();
    let kept = |name: &str| joints.iter().position(|j| j.name == name);
    let whole = nameless();
    let relinked: Vec<Joint> = joints
        .iter()
        .map(|j| Joint {
            parent: j.parent.and_then(|p| kept(&whole[p].name)),
            ..j.clone()
        })
        .collect();
    let error = map(&relinked).unwrap_err();
    assert!(error.to_string().contains("left-upper-arm"), "{error}");
    let cube = figure(&[("Cube", "", [0.0; 3])]);
    assert_eq!(map(&cube), Err(Error::TooFewJoints { joints: 1 }));
}

#[test]
fn the_map_file_survives_editing_and_names_its_mistakes() {
    let joints = nameless();
    let found = map(&joints).unwrap();
    let text = found.to_json(&joints);
    let back = HumanoidMap::from_json(&text, &joints).unwrap();
    for (slot, m) in &found.matches {
        assert_eq!(back.joint(*slot), Some(m.joint), "{slot}");
    }
    let wrong = |from: &str, to: &str| {
        let text = text.replace(from, to);
        HumanoidMap::from_json(&text, &joints)
            .unwrap_err()
            .to_string()
    };
    assert!(wrong("\"hips\"", "\"hip\"").contains("unknown slot `hip`"));
    assert!(wrong("\"hips\": \"b\"", "\"hips\": \"bb\"").contains("did you mean `b`"));
    assert!(wrong("\"hips\": \"b\"", "\"hips\": \"c\"").contains("both `hips` and `spine`"));
    assert!(
        wrong("\"hips\": \"b\"", "\"hips\": null")
            .contains("slot `hips`: the joint map leaves it empty")
    );
    assert!(HumanoidMap::from_json("[]", &joints).is_err());
}

#[test]
fn hostile_trees_cost_no_more_than_their_size() {
    let arm = |j: usize| Joint {
        name: ["LeftArm", "LeftForeArm", "LeftUpLeg", "LeftLeg"][j % 4].to_owned(),
        parent: if j.is_multiple_of(3) {
            Some(j + 5)
        } else {
            j.checked_sub(1)
        },
        rest: Isometry3::translation(0.0, 0.0, f64::NAN),
        bone: None,
    };
    let joints: Vec<Joint> = (0..20_000).map(arm).collect();
    assert!(map(&joints).is_err());
}
