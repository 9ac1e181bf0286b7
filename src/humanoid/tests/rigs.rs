//! Rigs that other people made.

use super::super::*;
use super::assert_maps;
use crate::import;
use mimic_test_support::foreign;
use nalgebra::Isometry3;

/// The joints that the importer finds in a glTF file.
fn gltf_joints(file: &str) -> Option<Vec<Joint>> {
    let look = import::inspect(foreign(file)?).unwrap_or_else(|e| panic!("{e}"));
    Some(look.joints)
}

const MIXAMO: [(&str, &str); 21] = [
    ("hips", "Hips"),
    ("spine", "Spine"),
    ("chest", "Spine2"),
    ("neck", "Neck"),
    ("head", "Head"),
    ("left-shoulder", "LeftShoulder"),
    ("left-upper-arm", "LeftArm"),
    ("left-lower-arm", "LeftForeArm"),
    ("left-hand", "LeftHand"),
    ("right-shoulder", "RightShoulder"),
    ("right-upper-arm", "RightArm"),
    ("right-lower-arm", "RightForeArm"),
    ("right-hand", "RightHand"),
    ("left-upper-leg", "LeftUpLeg"),
    ("left-lower-leg", "LeftLeg"),
    ("left-foot", "LeftFoot"),
    ("left-toes", "LeftToeBase"),
    ("right-upper-leg", "RightUpLeg"),
    ("right-lower-leg", "RightLeg"),
    ("right-foot", "RightFoot"),
    ("right-toes", "RightToeBase"),
];

#[test]
fn mixamo_rigs_with_any_prefix_map_alike() {
    for (file, prefix) in [
        ("mixamo/Xbot.glb", "mixamorig:"),
        ("mixamo/Soldier.glb", "mixamorig:"),
        ("mixamo/animations-mixamo-default.glb", "mixamorig_"),
    ] {
        let Some(joints) = gltf_joints(file) else {
            return;
        };
        for spelling in [prefix, "mixamorig1:", "mixamorig_", ""] {
            let renamed: Vec<Joint> = joints
                .iter()
                .map(|j| Joint {
                    name: j.name.replace(prefix, spelling),
                    ..j.clone()
                })
                .collect();
            let expected: Vec<(&'static str, String)> = MIXAMO
                .map(|(slot, joint)| (slot, format!("{spelling}{joint}")))
                .into();
            let expected: Vec<(&'static str, &str)> =
                expected.iter().map(|(s, j)| (*s, j.as_str())).collect();
            assert_maps(&renamed, &expected);
        }
    }
}

#[test]
fn kaykit_maps_to_its_twelve_and_its_wrists() {
    let Some(joints) = gltf_joints("kaykit/Med_MovementBasic.glb") else {
        return;
    };
    assert_maps(
        &joints,
        &[
            ("hips", "hips"),
            ("spine", "spine"),
            ("chest", "chest"),
            ("head", "head"),
            ("left-upper-arm", "upperarm.l"),
            ("left-lower-arm", "lowerarm.l"),
            ("left-hand", "wrist.l"),
            ("right-upper-arm", "upperarm.r"),
            ("right-lower-arm", "lowerarm.r"),
            ("right-hand", "wrist.r"),
            ("left-upper-leg", "upperleg.l"),
            ("left-lower-leg", "lowerleg.l"),
            ("left-foot", "foot.l"),
            ("left-toes", "toes.l"),
            ("right-upper-leg", "upperleg.r"),
            ("right-lower-leg", "lowerleg.r"),
            ("right-foot", "foot.r"),
            ("right-toes", "toes.r"),
        ],
    );
}

#[test]
fn unreal_names_map() {
    let Some(joints) = gltf_joints("ue-mannequin-like/mannequiny.glb") else {
        return;
    };
    assert_maps(
        &joints,
        &[
            ("hips", "pelvis"),
            ("spine", "spine_01"),
            ("chest", "spine_02"),
            ("neck", "neck_01"),
            ("head", "head"),
            ("left-shoulder", "clavicle.l"),
            ("left-upper-arm", "upperarm.l"),
            ("left-lower-arm", "lowerarm.l"),
            ("left-hand", "hand.l"),
            ("right-shoulder", "clavicle.r"),
            ("right-upper-arm", "upperarm.r"),
            ("right-lower-arm", "lowerarm.r"),
            ("right-hand", "hand.r"),
            ("left-upper-leg", "thigh.l"),
            ("left-lower-leg", "calf.l"),
            ("left-foot", "foot.l"),
            ("left-toes", "ball.l"),
            ("right-upper-leg", "thigh.r"),
            ("right-lower-leg", "calf.r"),
            ("right-foot", "foot.r"),
            ("right-toes", "ball.r"),
        ],
    );
}

/// Joints of DeepMimic's humanoid from its character file, whose axes are Y up and X forward.
fn deepmimic_joints() -> Option<Vec<Joint>> {
    let file: serde_json::Value =
        serde_json::from_slice(&std::fs::read(foreign("deepmimic/humanoid3d.txt")?).unwrap())
            .unwrap();
    let joints = file["Skeleton"]["Joints"].as_array().unwrap();
    let number = |joint: &serde_json::Value, key: &str| joint[key].as_f64().unwrap();
    let build = |joint: &serde_json::Value| Joint {
        name: joint["Name"].as_str().unwrap().to_owned(),
        parent: joint["Parent"].as_u64().map(|p| p as usize),
        rest: Isometry3::translation(
            number(joint, "AttachX"),
            -number(joint, "AttachZ"),
            number(joint, "AttachY"),
        ),
        bone: None,
    };
    Some(joints.iter().map(build).collect())
}

#[test]
fn deepmimic_names_mean_the_bones_below_them() {
    let Some(joints) = deepmimic_joints() else {
        return;
    };
    assert_maps(
        &joints,
        &[
            ("hips", "root"),
            ("chest", "chest"),
            ("head", "neck"),
            ("left-upper-arm", "left_shoulder"),
            ("left-lower-arm", "left_elbow"),
            ("left-hand", "left_wrist"),
            ("right-upper-arm", "right_shoulder"),
            ("right-lower-arm", "right_elbow"),
            ("right-hand", "right_wrist"),
            ("left-upper-leg", "left_hip"),
            ("left-lower-leg", "left_knee"),
            ("left-foot", "left_ankle"),
            ("right-upper-leg", "right_hip"),
            ("right-lower-leg", "right_knee"),
            ("right-foot", "right_ankle"),
        ],
    );
}

#[test]
fn other_rigs_map_whole() {
    for (file, feet) in [
        ("quaternius/RobotExpressive.glb", "Foot.L"),
        ("quaternius/cyberpunk_Character.glb", "Foot.L"),
        ("quaternius/main_skeleton.glb", "Foot.L"),
        ("rigify/human-skeleton.glb", "DEF-foot.L"),
        ("khronos/CesiumMan.glb", "leg_joint_L_3"),
        ("bitmoji/bitmoji_walk.glb", "L_foot0001_bind_JNT"),
        ("vrm/basic_armature.vrm", "foot.L"),
        ("vrm/idle_loop.vrma", "l_foot"),
    ] {
        let Some(joints) = gltf_joints(file) else {
            return;
        };
        let map = map(&joints).unwrap_or_else(|e| panic!("{file}: {e}"));
        let foot = map.joint(Slot::LeftFoot).unwrap();
        assert_eq!(joints[foot].name, feet, "{file}");
        assert!(map.joint(Slot::Head).is_some(), "{file}");
    }
}

#[test]
fn animals_and_toys_are_refused() {
    for file in [
        "khronos/Fox.glb",
        "nonhumanoid/quad-creature-animations.glb",
    ] {
        let Some(joints) = gltf_joints(file) else {
            return;
        };
        assert!(
            matches!(map(&joints), Err(Error::Quadruped { .. })),
            "{file}"
        );
    }
    let Some(joints) = gltf_joints("raylib/greenman.glb") else {
        return;
    };
    assert!(matches!(map(&joints), Err(Error::Missing { .. })));
}
