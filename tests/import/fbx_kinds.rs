//! ASCII, big-endian and old FBX files: those of others compared with whole scenes that ufbx evaluates, and our own clip in other
//! forms compared with itself.

use super::damage::Damage;
use super::fbx_rewritten::{Value, as_ascii, as_big_endian, node, records};
use mimic::clip::Clip;
use mimic::import::{self, Options};
use mimic_test_support::foreign;
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

const TOLERANCE_M: f64 = 1e-4;

/// Front, left and up of the file by ufbx, as rows: canonical from file. What is right for a viewer is left for the character
/// facing him.
fn canonical(oracle: &ufbx::Scene) -> Matrix3<f64> {
    use ufbx::CoordinateAxis::*;
    let row = |axis: &ufbx::CoordinateAxis, otherwise: Vector3<f64>| match axis {
        PositiveX => Vector3::x(),
        NegativeX => -Vector3::x(),
        PositiveY => Vector3::y(),
        NegativeY => -Vector3::y(),
        PositiveZ => Vector3::z(),
        NegativeZ => -Vector3::z(),
        _ => otherwise,
    };
    let axes = &oracle.settings.axes;
    let rows = [
        row(&axes.front, Vector3::z()),
        row(&axes.right, Vector3::x()),
        row(&axes.up, Vector3::y()),
    ];
    Matrix3::from_rows(&rows.map(|row| row.transpose()))
}

fn path(node: &ufbx::Node) -> String {
    let parent = node.parent.as_ref().filter(|parent| !parent.is_root);
    let parent = parent.map_or_else(String::new, |parent| path(parent));
    format!("{parent}/{}", &*node.element.name)
}

/// Places of ufbx's nodes in canonical axes and metres, by path. Paths may repeat.
fn places(oracle: &ufbx::Scene, index: usize, time: f64) -> BTreeMap<String, Vec<Vector3<f64>>> {
    let ticks = oracle.metadata.ktime_second as f64;
    let snapped = (time * ticks).round() / ticks;
    let anim = &oracle.anim_stacks[index].anim;
    let scene = ufbx::evaluate_scene(oracle, anim, snapped, Default::default());
    let canonical = canonical(oracle) * oracle.settings.unit_meters;
    let mut places = BTreeMap::<String, Vec<Vector3<f64>>>::new();
    for node in &scene.expect("ufbx evaluates").nodes {
        let m = &node.node_to_world;
        let place = canonical * Vector3::new(m.m03, m.m13, m.m23);
        places.entry(path(node)).or_default().push(place);
    }
    places
}

/// When a take begins: where it says so, or at its first key.
fn start(stack: &ufbx::AnimStack) -> f64 {
    if stack.time_end > stack.time_begin {
        return stack.time_begin;
    }
    let layers = (&stack.layers).into_iter();
    let values = layers.flat_map(|layer| &layer.anim_values);
    let curves = values.flat_map(|value| value.curves.iter().flatten());
    let keys = curves.filter_map(|curve| Some(curve.keyframes.first()?.time));
    keys.reduce(f64::min).unwrap_or(0.0)
}

/// The turn about Z that brings their places nearest to ours (planar Procrustes, about the origin).
fn heading(pairs: &[(Vector3<f64>, &Vec<Vector3<f64>>)]) -> Rotation3<f64> {
    let (mut cross, mut dot) = (0.0, 0.0);
    for (ours, theirs) in pairs.iter().filter(|pair| pair.1.len() == 1) {
        cross += theirs[0].xy().perp(&ours.xy());
        dot += theirs[0].xy().dot(&ours.xy());
    }
    Rotation3::from_axis_angle(&Vector3::z_axis(), cross.atan2(dot))
}

/// Largest distance between a clip's joints and ufbx's nodes in any frame, metres, up to a turn about the up axis if the clip
/// says that it was turned.
fn farthest(clip: &Clip, oracle: &ufbx::Scene, index: usize) -> f64 {
    let mut paths: Vec<String> = Vec::new();
    for joint in &clip.joints {
        let above = joint.parent.map_or("", |parent| paths[parent].as_str());
        paths.push(format!("{above}/{}", joint.name));
    }
    let turned = clip.problems.iter().any(|p| p.id == "turned-to-forward");
    let mut turn = (!turned).then(Rotation3::identity);
    let mut worst = 0.0f64;
    for frame in 0..clip.frames.len() {
        let time = start(&oracle.anim_stacks[index]) + frame as f64 / clip.fps;
        let world = clip.world(frame);
        let ours = world.iter().map(|joint| joint.translation.vector);
        let theirs = places(oracle, index, time);
        let pairs: Vec<_> = ours.zip(paths.iter().map(|path| &theirs[path])).collect();
        let turn = *turn.get_or_insert_with(|| heading(&pairs));
        for (ours, theirs) in pairs {
            let distances = theirs.iter().map(|place| (turn * place - ours).norm());
            worst = worst.max(distances.fold(f64::INFINITY, f64::min));
        }
    }
    worst
}

/// Compares all takes of a file, and returns how many frames they have.
fn check(file: &str) -> usize {
    let Some(at) = foreign(&format!("torture-fbx/{file}.fbx")) else {
        return 0;
    };
    let bytes = std::fs::read(&at).expect("the file opens");
    let oracle = ufbx::load_memory(&bytes, Default::default()).expect("ufbx reads the file");
    let look = import::inspect(&at).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(look.takes.len(), oracle.anim_stacks.len(), "{file}");
    let (mut frames, mut worst) = (0, 0.0f64);
    for (index, stack) in (&oracle.anim_stacks).into_iter().enumerate() {
        assert_eq!(look.takes[index].name, &*stack.element.name, "{file}");
        let options = Options {
            take: Some((index + 1).to_string()),
            ..Options::default()
        };
        let clip = import::load(&at, &options).unwrap_or_else(|error| panic!("{error}"));
        worst = worst.max(farthest(&clip, &oracle, index));
        frames += clip.frames.len();
    }
    eprintln!("{file}: {frames} frames, {:.2e} mm", worst * 1e3);
    assert!(worst < TOLERANCE_M, "{file}: {worst} m");
    frames
}

#[test]
fn every_joint_of_every_frame_is_where_ufbx_has_it() {
    let files = [
        "animation-multi-clip",
        "animation-pre-rotation",
        "blender_279_sausage_6100_ascii",
        "max2009_cube_anim_5800_ascii",
        "max2009_cube_anim_5800_binary",
        "max2009_cube_anim_6100_binary",
        "maya_anim_interpolation_6100_ascii",
        "maya_anim_layers_over_acc_7500_ascii",
        "maya_auto_clamp_7100_ascii",
        "maya_axes_anim_7700_ascii",
        "maya_mixed_inherit_mode_7700_ascii",
        "maya_null_pivots_7700_ascii",
        "motionbuilder_tangent_tcb_7700_ascii",
        "synthetic_tcdefinition_127_7100_ascii",
    ];
    let frames: usize = files.into_iter().map(check).sum();
    eprintln!("{frames} frames in all");
}

#[test]
fn files_of_meshes_alone_are_refused_for_that() {
    for file in [
        "casegen_rotation_space_7500_ascii",
        "maya_post_rotate_order_6100_binary",
        "synthetic_pre_post_rotate_7500_ascii",
    ] {
        let Some(at) = foreign(&format!("torture-fbx/{file}.fbx")) else {
            return;
        };
        let refused = import::inspect(at).expect_err("refused").to_string();
        assert!(refused.contains("holds no joints"), "{refused}");
    }
}

fn kick() -> Vec<u8> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/clips/kick.fbx");
    std::fs::read(path).expect("our own clip")
}

fn read(bytes: &[u8]) -> Result<Clip, String> {
    let read = import::read(bytes, "kick.fbx", None, &Options::default());
    read.map_err(|error| error.to_string())
}

#[test]
fn our_own_clip_is_the_same_in_every_form() {
    let records = records(&kick());
    let binary = read(&kick()).expect("it imports");
    for (form, bytes) in [
        ("ASCII", as_ascii(&records)),
        ("big-endian", as_big_endian(&records)),
    ] {
        let other = read(&bytes).unwrap_or_else(|error| panic!("{form}: {error}"));
        assert_eq!((other.fps, other.loop_mode), (binary.fps, binary.loop_mode));
        assert_eq!(other.frames.len(), binary.frames.len());
        assert_eq!(other.problems, binary.problems);
        let names = |clip: &Clip| {
            clip.joints
                .iter()
                .map(|j| j.name.clone())
                .collect::<Vec<_>>()
        };
        assert_eq!(names(&other), names(&binary));
        let worlds =
            (0..binary.frames.len()).map(|frame| (binary.world(frame), other.world(frame)));
        let worlds = worlds.chain([(binary.rest_world(), other.rest_world())]);
        let mut worst = (0.0f64, 0.0f64);
        for (ours, theirs) in worlds.flat_map(|(a, b)| a.into_iter().zip(b)) {
            let apart = (ours.translation.vector - theirs.translation.vector).norm();
            let turned = ours.rotation.angle_to(&theirs.rotation);
            worst = (worst.0.max(apart), worst.1.max(turned));
        }
        eprintln!("{form}: {:.2e} mm, {:.2e} rad", worst.0 * 1e3, worst.1);
        assert!(worst.0 < 1e-5 && worst.1 < 1e-4, "{form}: {worst:?}");
    }
}

/// Bytes that are refused, soon and in one line.
fn refused(name: &str, bytes: &[u8]) {
    let start = Instant::now();
    let said = read(bytes).expect_err(name);
    assert!(start.elapsed() < Duration::from_secs(10), "{name}");
    assert!(
        said.starts_with("`kick.fbx`: ") && said.lines().count() == 1,
        "{said}"
    );
}

#[test]
fn lengths_and_depths_of_the_file_are_not_believed() {
    let head = "; FBX 7.5.0 project file\nFBXHeaderExtension:  {\n FBXVersion: 7500\n}\n";
    refused("empty", head.as_bytes());
    let claims = "Objects: {\n AnimationCurve: 1, \"AnimCurve::\", \"\" {\n KeyTime: *999999999999 {\n a: 0,1\n }\n}\n}\n";
    refused("claims", format!("{head}{claims}").as_bytes());
    refused(
        "deep",
        format!("{head}{}", "Deep: {\n".repeat(1_000_000)).as_bytes(),
    );
    // Twenty million keys of 8 bytes that compress to a few hundred thousand.
    let zeros = miniz_oxide::deflate::compress_to_vec_zlib(&vec![0; 160_000_000], 6);
    let times = Value::Compressed(b'l', 20_000_000, zeros);
    let curve = [
        1_i64.into(),
        "\0\x01AnimCurve".to_owned().into(),
        String::new().into(),
    ];
    let curve = curve.map(Value::Plain).into();
    let curve = node(
        "AnimationCurve",
        curve,
        vec![node("KeyTime", vec![times], vec![])],
    );
    let bytes = as_big_endian(&[node("Objects", vec![], vec![curve])]);
    assert!(bytes.len() < 1_000_000);
    let said = read(&bytes).expect_err("refused");
    assert!(said.contains("memory"), "{said}");
}

/// ufbx looks up every node in every layer: 8000 of each, in two takes, would cost their product.
#[test]
fn takes_of_implausibly_many_layers_are_refused() {
    let many = 8000;
    let mut text = "; FBX 7.5.0 project file\nObjects: {\n".to_owned();
    for stack in [1, 2] {
        text += &format!("AnimationStack: {stack}, \"AnimStack::{stack}\", \"\" {{\n}}\n");
    }
    let mut links = String::new();
    for k in 0..many {
        let (layer, model) = (100_000 + k, 200_000 + k);
        text += &format!("AnimationLayer: {layer}, \"AnimLayer::\", \"\" {{\n}}\n");
        text += &format!("Model: {model}, \"Model::m\", \"LimbNode\" {{\n}}\n");
        links += &format!("C: \"OO\",{layer},{}\nC: \"OO\",{model},0\n", 1 + k % 2);
    }
    text += &format!("}}\nConnections: {{\n{links}}}\n");
    let start = Instant::now();
    let said = read(text.as_bytes()).expect_err("refused");
    assert!(
        start.elapsed() < Duration::from_secs(10),
        "{:?}",
        start.elapsed()
    );
    assert!(
        said.contains("4000 layers") && said.contains("merge"),
        "{said}"
    );
}

#[test]
fn damaged_files_are_refused_or_read_whole() {
    let records = records(&kick());
    let mut damage = Damage::new();
    for form in [as_ascii(&records), as_big_endian(&records)] {
        let mut read_still = 0;
        for _ in 0..400 {
            let mut bytes = form.clone();
            damage.apply(&mut bytes, 30_000);
            match read(&bytes) {
                Ok(clip) => {
                    read_still += 1;
                    let mut locals = clip.frames.iter().flatten();
                    assert!(locals.all(|t| t.to_homogeneous().iter().all(|x| x.is_finite())));
                }
                Err(said) => assert!(said.starts_with("`kick.fbx`: "), "{said}"),
            }
        }
        assert!((1..400).contains(&read_still), "{read_still}");
    }
}
