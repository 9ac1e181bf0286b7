//! Every node in every frame of every take of real files, compared with `ufbx`.

use super::rewritten::as_binary;
use super::{FbxError, FbxScene, read};
use crate::import::scene::Scene;
use mimic_test_support::foreign;
use nalgebra::{Matrix4, Vector3};
use std::collections::BTreeMap;

pub(super) const TOLERANCE_M: f64 = 1e-4;
/// Of the farthest node's distance from the origin: ufbx keeps tangents as f32, and blending
/// Euler angles near a pole magnifies the difference. It exceeds `TOLERANCE_M` only beyond ten metres.
pub(super) const TOLERANCE_FAR: f64 = 1e-5;
const TOLERANCE_LINEAR: f64 = 1e-5;

/// Matrices of a file's nodes by their path and, where paths repeat, by the order of the nodes in the file.
type Worlds = BTreeMap<(String, usize), Matrix4<f64>>;

fn collect(nodes: impl Iterator<Item = (String, Matrix4<f64>)>) -> Worlds {
    let mut seen = BTreeMap::<String, usize>::new();
    let keyed = nodes.map(|(path, matrix)| {
        let count = seen.entry(path.clone()).or_default();
        *count += 1;
        ((path, *count), matrix)
    });
    keyed.collect()
}

pub(super) fn ours(scene: &FbxScene, at: Option<(usize, f64)>) -> Worlds {
    ours_by(scene, scene.placed(at))
}

pub(super) fn ours_by(scene: &FbxScene, world: Vec<Matrix4<f64>>) -> Worlds {
    let mut paths: Vec<String> = Vec::new();
    for node in scene.nodes() {
        let parent = node.parent.map_or("", |parent| paths[parent].as_str());
        paths.push(format!("{parent}/{}", node.name));
    }
    collect(paths.into_iter().zip(world))
}

pub(super) fn path(node: &ufbx::Node) -> String {
    let parent = node
        .parent
        .as_ref()
        .filter(|parent| !parent.is_root)
        .map_or_else(String::new, |parent| path(parent));
    format!("{parent}/{}", &*node.element.name)
}

pub(super) fn theirs(scene: &ufbx::Scene) -> Worlds {
    let mut nodes: Vec<&ufbx::Node> = scene
        .nodes
        .into_iter()
        .filter(|node| !node.is_root)
        .collect();
    nodes.sort_by_key(|node| node.element.element_id);
    collect(
        nodes
            .into_iter()
            .map(|node| (path(node), matrix(&node.node_to_world))),
    )
}

#[rustfmt::skip]
pub(super) fn matrix(m: &ufbx::Matrix) -> Matrix4<f64> {
    Matrix4::new(
        m.m00, m.m01, m.m02, m.m03,
        m.m10, m.m11, m.m12, m.m13,
        m.m20, m.m21, m.m22, m.m23,
        0.0, 0.0, 0.0, 1.0,
    )
}

/// Largest distance in metres, and largest difference of the linear parts relative to their size.
fn compare(ours: &Worlds, theirs: &Worlds, unit_m: f64, place: &str) -> (f64, f64) {
    let names = |worlds: &Worlds| worlds.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(ours), names(theirs), "{place}: different nodes");
    let origin = |m: &Matrix4<f64>| Vector3::from(m.fixed_view::<3, 1>(0, 3));
    let linear = |m: &Matrix4<f64>| m.fixed_view::<3, 3>(0, 0).into_owned();
    let size = theirs
        .values()
        .map(|m| origin(m).norm())
        .fold(0.0, f64::max);
    let mut worst = (0.0f64, 0.0f64);
    for (key, theirs) in theirs {
        let ours = ours[key];
        let distance = (origin(&ours) - origin(theirs)).norm() * unit_m;
        let skew = (linear(&ours) - linear(theirs)).norm() / linear(theirs).norm().max(1.0);
        assert!(
            distance < TOLERANCE_M.max(TOLERANCE_FAR * size * unit_m),
            "{place}, node {key:?}: {distance} m apart"
        );
        assert!(
            skew < TOLERANCE_LINEAR,
            "{place}, node {key:?}: axes differ by {skew}"
        );
        worst = (worst.0.max(distance), worst.1.max(skew));
    }
    worst
}

/// A file's bytes, and what they are in binary form.
pub(super) fn bytes_of(file: &str) -> Option<(Vec<u8>, Vec<u8>)> {
    let bytes = std::fs::read(foreign(file)?).expect("the file can be read");
    let binary = match read(&bytes) {
        Err(FbxError::Ascii) => as_binary(&bytes),
        _ => bytes.clone(),
    };
    Some((bytes, binary))
}

/// A file as we and as ufbx read it.
pub(super) fn open(file: &str) -> Option<(FbxScene, ufbx::SceneRoot)> {
    let (bytes, binary) = bytes_of(file)?;
    let scene = read(&binary);
    let options = ufbx::LoadOpts {
        ignore_geometry: true,
        ..Default::default()
    };
    let oracle = ufbx::load_memory(&bytes, options).expect("ufbx reads the file");
    Some((
        scene.unwrap_or_else(|error| panic!("{file}: {error}")),
        oracle,
    ))
}

/// Compares all takes of a file in memory at `times`.
pub(super) fn compare_bytes(bytes: &[u8], times: &[f64], place: &str) {
    let scene = read(bytes).unwrap_or_else(|error| panic!("{place}: {error}"));
    let oracle = ufbx::load_memory(bytes, Default::default()).expect("ufbx reads the file");
    for index in 0..scene.takes().len() {
        for &time in times {
            check_moment(&scene, &oracle, index, time, &format!("{place}, {time} s"));
        }
    }
}

/// Compares all nodes at `time` of the take `index`.
fn check_moment(
    scene: &FbxScene,
    oracle: &ufbx::Scene,
    index: usize,
    time: f64,
    place: &str,
) -> (f64, f64) {
    // The oracle isn't told to take times to the nearest tick.
    let ticks = oracle.metadata.ktime_second as f64;
    let snapped = (time * ticks).round() / ticks;
    let anim = &oracle.anim_stacks[index].anim;
    let evaluated =
        ufbx::evaluate_scene(oracle, anim, snapped, Default::default()).expect("ufbx evaluates");
    compare(
        &ours(scene, Some((index, time))),
        &theirs(&evaluated),
        scene.contents().unit_m,
        place,
    )
}

fn check(file: &str) {
    let Some((scene, oracle)) = open(file) else {
        return;
    };
    let mut worst = compare(
        &ours(&scene, None),
        &theirs(&oracle),
        scene.contents().unit_m,
        &format!("{file} at rest"),
    );
    assert_eq!(
        scene.takes().len(),
        oracle.anim_stacks.len(),
        "{file}: different takes"
    );
    let mut frames = 0;
    for (index, stack) in (&oracle.anim_stacks).into_iter().enumerate() {
        let take = &scene.takes()[index];
        assert_eq!(take.name, &*stack.element.name);
        if stack.time_end > stack.time_begin {
            assert_eq!(
                (take.start, take.end),
                (stack.time_begin, stack.time_end),
                "{file}: span of {}",
                take.name
            );
        }
        for frame in 0..=((take.end - take.start) * take.fps).round() as usize {
            let time = take.start + frame as f64 / take.fps;
            let place = format!("{file}, take {}, frame {frame}", take.name);
            let found = check_moment(&scene, &oracle, index, time, &place);
            worst = (worst.0.max(found.0), worst.1.max(found.1));
            frames += 1;
        }
    }
    let clips = super::clips_against_ufbx::check(file, &scene, &oracle);
    eprintln!(
        "{file}: clips {:.2e} mm, {} nodes, {frames} frames, {:.2e} mm, axes {:.2e}",
        clips * 1e3,
        scene.nodes().len(),
        worst.0 * 1e3,
        worst.1
    );
}

/// Its take of 92 hours isn't sampled frame by frame.
#[test]
fn torture_maya_long_keyframes() {
    let file = "torture-fbx/maya_long_keyframes_7700_binary.fbx";
    let Some((scene, oracle)) = open(file) else {
        return;
    };
    let stack = &oracle.anim_stacks[0];
    for sample in 0..=5000 {
        let time =
            stack.time_begin + (stack.time_end - stack.time_begin) * f64::from(sample) / 5000.0;
        check_moment(&scene, &oracle, 0, time, &format!("{file}, {time} s"));
    }
    let problems = &scene.takes()[0].problems;
    assert!(problems.iter().any(|problem| problem.id == "cut-take"));
}

/// Extrapolation and the time between frames: each take sampled at odd times, from before its start to after its end.
#[test]
fn between_and_beyond_frames() {
    for file in [
        "mixamo/locomotion-pack/walking.fbx",
        "torture-fbx/maya_anim_interpolation_7700_binary.fbx",
        "torture-fbx/maya_anim_layers_7500_binary.fbx",
        "torture-fbx/maya_auto_clamp_7100_ascii.fbx",
        "torture-fbx/maya_game_sausage_7500_binary_combined.fbx",
        "torture-fbx/motionbuilder_tangent_tcb_7700_ascii.fbx",
    ] {
        let Some((scene, oracle)) = open(file) else {
            return;
        };
        for (index, take) in scene.takes().iter().enumerate() {
            let length = take.end - take.start;
            for sample in 0..211 {
                let time = take.start + length * (f64::from(sample) * 0.01 - 0.55);
                check_moment(&scene, &oracle, index, time, &format!("{file}, {time} s"));
            }
        }
    }
}

macro_rules! files {
    ($($name:ident: $($file:literal),+;)+) => {
        $(#[test] fn $name() { $(check($file);)+ })+
    };
}

files! {
    mixamo_marathon_man_mma_kick: "mixamo/MarathonManMMAKick.fbx";
    mixamo_locomotion_walking: "mixamo/locomotion-pack/walking.fbx";
    mixamo_marathon_man_backflip: "mixamo/MarathonManBackflip.fbx";
    mixamo_marathon_man_jazz_dancing: "mixamo/MarathonManJazzDancing.fbx";
    mixamo_marathon_man_punching_bag: "mixamo/MarathonManPunchingBag.fbx";
    mixamo_marathon_man_running: "mixamo/MarathonManRunning.fbx";
    mixamo_marathon_man_walking: "mixamo/MarathonManWalking.fbx";
    mixamo_samba_dancing: "mixamo/Samba-Dancing.fbx";
    mixamo_chapa_giratoria: "mixamo/Chapa-Giratoria.fbx";
    mixamo_locomotion_idle: "mixamo/locomotion-pack/idle.fbx";
    mixamo_locomotion_jump: "mixamo/locomotion-pack/jump.fbx";
    mixamo_locomotion_running: "mixamo/locomotion-pack/running.fbx";
    mixamo_locomotion_strafes: "mixamo/locomotion-pack/left-strafe.fbx", "mixamo/locomotion-pack/right-strafe-walking.fbx";
    mixamo_locomotion_turns: "mixamo/locomotion-pack/left-turn-90.fbx", "mixamo/locomotion-pack/right-turn.fbx";
    cmu_07_01: "cmu/07_01_cmu.fbx";
    cmu_49_08: "cmu/49_08_cmu.fbx";
    cmu_91: "cmu/91_48.fbx", "cmu/91_50.fbx", "cmu/91_53.fbx";
    torture_animation_space_y_up_cm: "torture-fbx/animation-space-y-up-cm.fbx";
    torture_animation_space_z_up_m: "torture-fbx/animation-space-z-up-m.fbx";
    torture_animation_with_skeleton: "torture-fbx/animation_with_skeleton.fbx";
    torture_blender_279_sausage: "torture-fbx/blender_279_sausage_7400_binary.fbx";
    torture_blender_293_barbarian: "torture-fbx/blender_293_barbarian_7400_binary.fbx";
    torture_blender_340_z_up: "torture-fbx/blender_340_z_up_7400_binary.fbx";
    torture_max_transformed_skin: "torture-fbx/max_transformed_skin_7500_binary.fbx";
    torture_maya_anim_interpolation: "torture-fbx/maya_anim_interpolation_7700_binary.fbx";
    torture_maya_anim_layers: "torture-fbx/maya_anim_layers_7500_binary.fbx";
    torture_maya_game_sausage: "torture-fbx/maya_game_sausage_7500_binary_combined.fbx";
    torture_maya_human_ik: "torture-fbx/maya_human_ik_7400_binary.fbx";
    torture_maya_kenney_character: "torture-fbx/maya_kenney_character_7700_binary.fbx";
    torture_maya_pivots: "torture-fbx/maya_pivots_7500_binary.fbx";
    torture_maya_resampled: "torture-fbx/maya_resampled_7500_binary.fbx";
    torture_maya_rotation_order: "torture-fbx/maya_rotation_order_7500_binary.fbx";
    torture_maya_tangent_sign: "torture-fbx/maya_tangent_sign_7700_binary.fbx";
    ascii_casegen_rotation_space: "torture-fbx/casegen_rotation_space_7500_ascii.fbx";
    ascii_maya_anim_layers_over_acc: "torture-fbx/maya_anim_layers_over_acc_7500_ascii.fbx";
    ascii_maya_auto_clamp: "torture-fbx/maya_auto_clamp_7100_ascii.fbx";
    ascii_maya_axes_anim: "torture-fbx/maya_axes_anim_7700_ascii.fbx";
    ascii_maya_mixed_inherit_mode: "torture-fbx/maya_mixed_inherit_mode_7700_ascii.fbx";
    ascii_maya_null_pivots: "torture-fbx/maya_null_pivots_7700_ascii.fbx";
    ascii_motionbuilder_tangent_tcb: "torture-fbx/motionbuilder_tangent_tcb_7700_ascii.fbx";
    ascii_synthetic_pre_post_rotate: "torture-fbx/synthetic_pre_post_rotate_7500_ascii.fbx";
    ascii_synthetic_tcdefinition: "torture-fbx/synthetic_tcdefinition_127_7100_ascii.fbx";
}
