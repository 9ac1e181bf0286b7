//! Files that say which joint is which bone: VRM models of both versions, and VRM animations.

use super::gltf_made::base64;
use mimic::clip::Clip;
use mimic::clip::edit::Plane;
use mimic::humanoid::{self, Slot};
use mimic::import::{self, Options};
use mimic_test_support::foreign;
use nalgebra::Vector3;
use serde_json::{Value, json};

/// The JSON of a GLB file.
fn json_of(path: &std::path::Path) -> Value {
    let bytes = std::fs::read(path).expect("the file opens");
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes"));
    serde_json::from_slice(&bytes[20..20 + length as usize]).expect("JSON")
}

/// Bones that a file names, and the names of their nodes.
fn told(file: &Value) -> Vec<(String, String)> {
    let extensions = file["extensions"].as_object().expect("extensions");
    let bones = extensions.values().map(|e| &e["humanoid"]["humanBones"]);
    let name = |node: &Value| {
        let node = node.as_u64().expect("an index") as usize;
        file["nodes"][node]["name"]
            .as_str()
            .expect("a name")
            .to_owned()
    };
    let of = |bones: &Value| -> Vec<(String, String)> {
        match bones {
            Value::Array(bones) => {
                let bone = |b: &Value| {
                    (
                        b["bone"].as_str().expect("a bone").to_owned(),
                        name(&b["node"]),
                    )
                };
                bones.iter().map(bone).collect()
            }
            Value::Object(bones) => {
                let bone = |(bone, b): (&String, &Value)| (bone.clone(), name(&b["node"]));
                bones.iter().map(bone).collect()
            }
            _ => Vec::new(),
        }
    };
    bones.flat_map(of).collect()
}

#[test]
fn vrm_files_map_as_they_say() {
    for (file, count) in [
        ("vrm/basic_armature.vrm", 21),
        ("vrm/debug_robot.vrm", 21),
        ("vrm/idle_loop.vrma", 21),
        ("vrm/test.vrma", 21),
    ] {
        let Some(path) = foreign(file) else { return };
        let joints = import::inspect(&path).expect("it can be read").joints;
        let map = humanoid::map(&joints).unwrap_or_else(|e| panic!("{file}: {e}"));
        let told = told(&json_of(&path));
        let has_upper = told.iter().any(|(bone, _)| bone == "upperChest");
        let mut sure = 0;
        for (bone, name) in &told {
            let is_it = |slot: &Slot| slot.name().replace('-', "").eq_ignore_ascii_case(bone);
            let slot = match bone.as_str() {
                "upperChest" => Some(Slot::Chest),
                "chest" if has_upper => None,
                _ => Slot::ALL.into_iter().find(is_it),
            };
            let Some(slot) = slot else { continue };
            let found = &map.matches[&slot];
            assert_eq!(&joints[found.joint].name, name, "{file}: {slot}");
            assert_eq!(
                (found.confidence, &*found.reason),
                (1.0, "the file says so"),
                "{file}"
            );
            sure += 1;
        }
        assert_eq!((sure, map.matches.len()), (count, count), "{file}");
    }
}

/// Bone, index of the parent, and position in the parent, in a T-pose that faces +Z with Y up and left along +X, as in VRM.
const FIGURE: [(&str, usize, [f64; 3]); 24] = [
    ("hips", 0, [0.0, 0.95, 0.0]),
    ("spine", 0, [0.0, 0.1, 0.0]),
    ("", 1, [0.0, 0.1, 0.0]),
    ("chest", 2, [0.0, 0.1, 0.0]),
    ("upperChest", 3, [0.0, 0.1, 0.0]),
    ("head", 4, [0.0, 0.2, 0.0]),
    ("leftUpperArm", 4, [0.18, 0.05, 0.0]),
    ("leftLowerArm", 6, [0.27, 0.0, 0.0]),
    ("leftHand", 7, [0.25, 0.0, 0.0]),
    ("rightUpperArm", 4, [-0.18, 0.05, 0.0]),
    ("rightLowerArm", 9, [-0.27, 0.0, 0.0]),
    ("rightHand", 10, [-0.25, 0.0, 0.0]),
    ("leftUpperLeg", 0, [0.09, -0.05, 0.0]),
    ("leftLowerLeg", 12, [0.0, -0.4, 0.0]),
    ("leftFoot", 13, [0.0, -0.42, 0.0]),
    ("rightUpperLeg", 0, [-0.09, -0.05, 0.0]),
    ("rightLowerLeg", 15, [0.0, -0.4, 0.0]),
    ("rightFoot", 16, [0.0, -0.42, 0.0]),
    ("leftIndexProximal", 8, [0.1, 0.0, 0.02]),
    ("leftLittleProximal", 8, [0.09, 0.0, -0.02]),
    ("rightIndexProximal", 11, [-0.1, 0.0, 0.02]),
    ("rightLittleProximal", 11, [-0.09, 0.0, -0.02]),
    ("", 14, [0.0, -0.05, 0.12]),
    ("", 17, [0.0, -0.05, 0.12]),
];

/// The figure in a file whose names of nodes say nothing and whose take moves the left arm. `extensions` makes the file's
/// extensions, given the node of each bone.
fn nameless(extensions: impl Fn(&dyn Fn(&str) -> Option<usize>) -> Value) -> String {
    let node = |(n, (_, _, place)): (usize, &(&str, usize, [f64; 3]))| {
        let below = (1..FIGURE.len()).filter(|&c| FIGURE[c].1 == n);
        let children: Vec<usize> = below.collect();
        let mut node = json!({ "name": format!("x{}", (n * 7) % 24), "translation": place });
        if !children.is_empty() {
            node["children"] = children.into();
        }
        node
    };
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let floats = [0.0_f32, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half];
    let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    let of = |bone: &str| FIGURE.iter().position(|(b, ..)| *b == bone);
    json!({
        "asset": { "version": "2.0" },
        "nodes": FIGURE.iter().enumerate().map(node).collect::<Vec<_>>(),
        "buffers": [{ "byteLength": 40, "uri": format!("data:;base64,{}", base64(&bytes)) }],
        "bufferViews": [{ "buffer": 0, "byteLength": 8 }, { "buffer": 0, "byteOffset": 8, "byteLength": 32 }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR" },
            { "bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC4" }
        ],
        "animations": [{
            "channels": [{ "sampler": 0, "target": { "node": of("leftUpperArm"), "path": "rotation" } }],
            "samplers": [{ "input": 0, "output": 1 }]
        }],
        "extensions": extensions(&of),
    })
    .to_string()
}

fn bones() -> impl Iterator<Item = &'static str> {
    FIGURE
        .iter()
        .map(|(bone, ..)| *bone)
        .filter(|bone| !bone.is_empty())
}

fn read(text: &str) -> Clip {
    import::read(text.as_bytes(), "a.vrm", None, &Options::default()).expect("it imports")
}

/// Clips of the figure, with its bones named in each of the three ways.
fn clips() -> [Clip; 3] {
    let named = |of: &dyn Fn(&str) -> Option<usize>| -> Value {
        let bones = bones().map(|bone| (bone.to_owned(), json!({ "node": of(bone) })));
        let bones: serde_json::Map<String, Value> = bones.collect();
        json!({ "humanoid": { "humanBones": bones } })
    };
    let listed = |of: &dyn Fn(&str) -> Option<usize>| -> Value {
        let bones = bones().map(|bone| json!({ "bone": bone, "node": of(bone) }));
        json!({ "humanoid": { "humanBones": bones.collect::<Vec<_>>() } })
    };
    [
        read(&nameless(|of| json!({ "VRM": listed(of) }))),
        read(&nameless(|of| json!({ "VRMC_vrm": named(of) }))),
        read(&nameless(|of| json!({ "VRMC_vrm_animation": named(of) }))),
    ]
}

#[test]
fn bones_are_told_where_names_say_nothing() {
    for clip in clips() {
        assert_eq!(clip.joints.len(), FIGURE.len());
        let map = humanoid::map(&clip.joints).expect("a humanoid");
        let bone = |slot: Slot| map.joint(slot).and_then(|j| clip.joints[j].bone.clone());
        for (slot, name) in [
            (Slot::Hips, "hips"),
            (Slot::Spine, "spine"),
            (Slot::Chest, "upperChest"),
            (Slot::Head, "head"),
            (Slot::LeftHand, "leftHand"),
            (Slot::RightUpperArm, "rightUpperArm"),
            (Slot::RightFoot, "rightFoot"),
        ] {
            assert_eq!(bone(slot).as_deref(), Some(name), "{slot}");
        }
        assert_eq!(map.joint(Slot::Neck), None);
        // Left out by the file, and found by its place below the foot that the file tells.
        let toes = &map.matches[&Slot::LeftToes];
        assert!(toes.confidence < 1.0);
        let foot = clip.joints[toes.joint].parent;
        assert_eq!(foot, map.joint(Slot::LeftFoot));
    }
}

#[test]
fn bones_stay_with_their_joints_in_files_and_edits() {
    let [clip, ..] = clips();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.clip");
    clip.save(&path).expect("it is written");
    assert_eq!(Clip::load(&path).expect("it is read"), clip);

    let map = humanoid::map(&clip.joints).expect("a humanoid");
    let pairs = humanoid::pairs(&clip.joints, &map);
    let joint = |clip: &Clip, bone: &str| {
        let is_it = |j: &mimic::clip::Joint| j.bone.as_deref() == Some(bone);
        clip.joints.iter().position(is_it).expect("it is there")
    };
    let finger = |side: &str| joint(&clip, &format!("{side}IndexProximal"));
    assert!(pairs.contains(&(finger("left"), finger("right"))));

    let plane = Plane::sagittal(&clip.joints, &pairs);
    let mirrored = clip.mirror(&pairs, &plane).expect("it has both sides");
    assert_eq!(mirrored.joints, clip.joints);
    // The left arm turns forward; in the mirror it is the right one.
    let hand = |clip: &Clip, bone: &str| {
        let last = clip.frames.len() - 1;
        clip.world(last)[joint(clip, bone)].translation.vector
    };
    let flipped = |v: Vector3<f64>| Vector3::new(v.x, -v.y, v.z);
    let off = hand(&mirrored, "rightHand") - flipped(hand(&clip, "leftHand"));
    assert!(off.norm() < 1e-5, "{off}");
    assert!((hand(&clip, "leftHand") - flipped(hand(&clip, "rightHand"))).norm() > 0.3);

    let half = clip.trim(0.0, 0.5).expect("it is that long");
    assert_eq!(half.joints, clip.joints);
}

#[test]
fn bones_that_cannot_be_are_passed_over() {
    let told = |bones: Value| {
        let file = json!({ "humanoid": { "humanBones": bones } });
        read(&nameless(|_| json!({ "VRMC_vrm": file })))
    };
    let of = |clip: &Clip, bone: &str| {
        clip.joints
            .iter()
            .filter(|j| j.bone.as_deref() == Some(bone))
            .count()
    };
    let clip =
        told(json!({ "hips": { "node": 99 }, "head": { "node": -1 }, "spine": { "node": 5 } }));
    assert_eq!(
        (of(&clip, "hips"), of(&clip, "head"), of(&clip, "spine")),
        (0, 0, 1)
    );
    // Two bones in one node, and one bone in two: the first counts.
    let clip = told(
        json!([{ "bone": "a", "node": 1 }, { "bone": "b", "node": 1 }, { "bone": "a", "node": 2 }]),
    );
    assert_eq!((of(&clip, "a"), of(&clip, "b")), (1, 0));
}
