//! Real glTF files compared with an evaluation that shares no code with the importer.

use super::gltf_reference::Reference;
use mimic::clip::{Clip, LoopMode};
use mimic::import::{self, Options};
use mimic_test_support::foreign;
use nalgebra::{Matrix4, Vector3};
use std::path::Path;

fn load(path: &Path, take: &str) -> Clip {
    let options = Options {
        take: Some(take.to_owned()),
        ..Options::default()
    };
    import::load(path, &options).expect("it imports")
}

/// Largest distance of a joint from its position by `reference`, metres. No node that the take moves may be missing.
///
/// X, Y, Z are the file's z, x, y, X and Y with sign `facing`: −1 for a character that was turned by half.
fn farthest(clip: &Clip, reference: &Reference, take: &str, facing: f64) -> f64 {
    let about = reference.take(take);
    let (start, end) = reference.span(about);
    // Names may repeat (a mesh called like its bone), paths from the root don't.
    let node_paths = reference.paths();
    let mut paths: Vec<String> = Vec::new();
    for joint in &clip.joints {
        let above = joint.parent.map_or("", |parent| &paths[parent]);
        paths.push(format!("{above}/{}", joint.name));
    }
    let node_of: Vec<usize> = paths
        .iter()
        .map(|path| {
            node_paths
                .iter()
                .position(|node| node == path)
                .expect("the joint's node")
        })
        .collect();
    for node in reference.moved(about) {
        assert!(
            node_of.contains(&node),
            "no joint for `{}`",
            node_paths[node]
        );
    }
    let last = (clip.frames.len() - 1).max(1) as f64;
    let mut farthest: f64 = 0.0;
    for f in 0..clip.frames.len() {
        let expected = reference.world(about, start + (end - start) * f as f64 / last);
        for (at, &node) in clip.world(f).iter().zip(&node_of) {
            let [x, y, z] = [0, 1, 2].map(|row| expected[node][row][3]);
            farthest = farthest
                .max((at.translation.vector - Vector3::new(facing * z, facing * x, y)).norm());
        }
    }
    farthest
}

#[test]
fn xbot_walks_as_its_file_says() {
    let Some(path) = foreign("mixamo/Xbot.glb") else {
        return;
    };
    let clip = load(&path, "Walk");
    assert_eq!((clip.fps, clip.source.take.as_str()), (30.0, "walk"));
    assert!(clip.joints.len() >= 67);
    assert_eq!(clip.loop_mode, LoopMode::Wrap);
    let off = farthest(&clip, &Reference::open(&path), "walk", 1.0);
    assert!(off < 1e-4, "{off} m");
}

#[test]
fn real_rigs_are_in_their_places() {
    let files = [
        ("mixamo/Xbot.glb", "run"),
        ("mixamo/animations-mixamo-default.glb", "Walking"),
        (
            "kaykit/Med_CombatMelee.glb",
            "Rig_Medium|Melee_1H_Attack_Chop",
        ),
        (
            "quaternius/cyberpunk_Character.glb",
            "CharacterArmature|Kick_Left",
        ),
        ("quaternius/RobotExpressive.glb", "Punch"),
        ("ue-mannequin-like/mannequiny.glb", "fight_kick_root.001"),
        ("rigify/human-addon-animations.glb", "YMCA"),
        ("raylib/greenman.glb", "3_attack"),
        ("bitmoji/bitmoji_run.glb", "lbr_run_normal_anm_default"),
        ("khronos/Fox.glb", "Run"),
        ("kenney/kenney_character.glb", "walk"),
    ];
    for (name, take) in files {
        let Some(path) = foreign(name) else {
            return;
        };
        let clip = load(&path, take);
        let turned = clip
            .problems
            .iter()
            .find(|problem| problem.id == "turned-to-forward");
        assert_eq!(turned, None, "{name}");
        let off = farthest(&clip, &Reference::open(&path), take, 1.0);
        let size = clip
            .rest_world()
            .iter()
            .map(|at| at.translation.vector.norm())
            .fold(1.0, f64::max);
        assert!(off < 1e-4 * size, "{name}: {off} m");
    }
}

#[test]
fn every_interpolation_of_every_property_is_exact() {
    let Some(path) = foreign("khronos/interpolation_test.gltf") else {
        return;
    };
    let reference = Reference::open(&path);
    for kind in ["Step", "Linear", "CubicSpline"] {
        for property in ["Scale", "Rotation", "Translation"] {
            let take = format!("{kind} {property}");
            let clip = load(&path, &take);
            let off = farthest(&clip, &reference, &take, 1.0);
            assert!(off < 1e-4, "{take}: {off} m");
        }
    }
}

#[test]
fn rotations_are_the_files_own() {
    let Some(path) = foreign("torture-gltf/01_cs_rotate.gltf") else {
        return;
    };
    let reference = Reference::open(&path);
    let clip = load(&path, "CubeAction");
    let (start, end) = reference.span(reference.take("CubeAction"));
    let joint = clip
        .joints
        .iter()
        .position(|joint| joint.name == "Cube")
        .expect("the cube");
    let nodes = reference.json["nodes"].as_array().expect("nodes");
    let node = nodes
        .iter()
        .position(|node| node["name"] == "Cube")
        .expect("the cube");
    for f in 0..clip.frames.len() {
        let time = start + (end - start) * f as f64 / (clip.frames.len() - 1) as f64;
        let matrix = reference.world(reference.take("CubeAction"), time)[node];
        let turn = clip.world(f)[joint].rotation.to_rotation_matrix();
        // Axes X, Y, Z are the file's z, x, y, for rows and columns alike.
        for (row, from_row) in [2, 0, 1].into_iter().enumerate() {
            let length = (0..3).map(|r| matrix[r][0].powi(2)).sum::<f64>().sqrt();
            for (column, from_column) in [2, 0, 1].into_iter().enumerate() {
                let off = turn[(row, column)] - matrix[from_row][from_column] / length;
                assert!(off.abs() < 1e-6, "frame {f}: {off}");
            }
        }
    }
}

#[test]
fn odd_files_are_read_or_refused_with_a_reason() {
    let folder = [
        "torture-gltf",
        "khronos",
        "vrm",
        "kaykit",
        "quaternius",
        "mixamo",
        "nonhumanoid",
    ];
    let mut read = 0;
    for folder in folder {
        let Some(folder) = foreign(folder) else {
            return;
        };
        for entry in std::fs::read_dir(folder).expect("the folder opens") {
            let path = entry.expect("an entry").path();
            let name = path
                .file_name()
                .expect("a name")
                .to_string_lossy()
                .into_owned();
            if ![".gltf", ".glb", ".vrm", ".vrma"]
                .iter()
                .any(|end| name.ends_with(end))
            {
                continue;
            }
            match import::load(&path, &Options::default()) {
                Ok(clip) => {
                    read += 1;
                    let joints = clip.joints.len();
                    assert!(
                        joints > 0 && clip.frames.iter().all(|frame| frame.len() == joints),
                        "{name}"
                    );
                }
                Err(error) => {
                    let error = error.to_string();
                    let told = ["holds no animation", "holds no joints"]
                        .iter()
                        .any(|told| error.contains(told));
                    assert!(told && error.contains(&name), "{error}");
                }
            }
        }
    }
    assert!(read > 20, "{read}");
}

#[test]
fn a_take_is_found_by_name_or_number_and_unknown_ones_list_the_others() {
    let Some(path) = foreign("mixamo/Xbot.glb") else {
        return;
    };
    let look = import::inspect(&path).expect("it opens");
    let names: Vec<&str> = look.takes.iter().map(|take| take.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "agree",
            "headShake",
            "idle",
            "run",
            "sad_pose",
            "sneak_pose",
            "walk"
        ]
    );
    assert_eq!(load(&path, "7").source.take, "walk");
    assert_eq!(load(&path, "HEADSHAKE").source.take, "headShake");
    let options = Options {
        take: Some("jump".to_owned()),
        ..Options::default()
    };
    let error = import::load(&path, &options)
        .expect_err("no such take")
        .to_string();
    assert!(
        error.contains("Xbot.glb") && error.contains("`jump`") && error.contains("7 `walk`"),
        "{error}"
    );
}

#[test]
fn a_character_that_faces_backward_is_turned() {
    let Some(path) = foreign("mixamo/Soldier.glb") else {
        return;
    };
    let clip = load(&path, "Walk");
    let turned = clip
        .problems
        .iter()
        .find(|problem| problem.id == "turned-to-forward");
    assert!(
        turned.is_some_and(|problem| problem.message.contains("180°")),
        "{turned:?}"
    );
    let off = farthest(&clip, &Reference::open(&path), "Walk", -1.0);
    assert!(off < 1e-4, "{off} m");
    let side = |name: &str| {
        let joint = clip
            .joints
            .iter()
            .position(|joint| joint.name.ends_with(name))
            .expect("a leg");
        clip.rest_world()[joint].translation.y
    };
    assert!(side("LeftUpLeg") > 0.05 && side("RightUpLeg") < -0.05);
}

#[test]
fn nodes_that_stand_in_a_pose_rest_as_their_skin_was_bound() {
    for name in [
        "quaternius/cyberpunk_Character.glb",
        "bitmoji/bitmoji_run.glb",
    ] {
        let Some(path) = foreign(name) else {
            return;
        };
        let look = import::inspect(&path).expect("it opens");
        assert!(
            look.problems
                .iter()
                .any(|problem| problem.id == "rest-from-bind-pose"),
            "{name}"
        );
        let clip = import::load(&path, &Options::default()).expect("it imports");
        let rest = clip.rest_world();
        let reference = Reference::open(&path);
        let skins = reference.json["skins"].as_array().expect("skins");
        let largest = |skin: &&serde_json::Value| skin["joints"].as_array().map_or(0, Vec::len);
        let skin = skins.iter().max_by_key(largest).expect("a skin");
        let inverse_bind = reference.floats(&skin["inverseBindMatrices"]);
        // Where each joint stood in the mesh's space, which keeps distances up to the mesh's own scale.
        let bound: Vec<(usize, Vector3<f64>)> = skin["joints"]
            .as_array()
            .expect("joints")
            .iter()
            .zip(inverse_bind.chunks_exact(16))
            .map(|(node, numbers)| {
                let node = &reference.json["nodes"][node.as_u64().expect("an index") as usize];
                let bind = Matrix4::from_column_slice(numbers)
                    .try_inverse()
                    .expect("a bind pose");
                let joint = clip
                    .joints
                    .iter()
                    .rposition(|joint| node["name"] == joint.name);
                (
                    joint.expect("the joint"),
                    bind.fixed_view::<3, 1>(0, 3).into_owned(),
                )
            })
            .collect();
        let distances = |a: usize, b: usize| {
            let rest = rest[bound[a].0].translation.vector - rest[bound[b].0].translation.vector;
            (rest.norm(), (bound[a].1 - bound[b].1).norm())
        };
        let far = (1..bound.len()).max_by(|&a, &b| distances(0, a).1.total_cmp(&distances(0, b).1));
        let (rest_size, bound_size) = distances(0, far.expect("joints"));
        for a in 0..bound.len() {
            for b in 0..a {
                let (rest, bound) = distances(a, b);
                let off = rest / rest_size - bound / bound_size;
                assert!(off.abs() < 1e-4, "{name}: joints {a} and {b} are {off} off");
            }
        }
    }
}
