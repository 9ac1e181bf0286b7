//! The clips of real files, and the rest poses of their joints, compared with `ufbx`: the positions of its nodes must survive the
//! choice of joints, canonical axes, metres, rigid transforms and single precision.

use super::FbxScene;
use super::against_ufbx::{
    TOLERANCE_FAR, TOLERANCE_M, bytes_of, matrix, open, ours, ours_by, path, theirs,
};
use crate::import::scene::Scene;
use crate::import::{self, ErrorKind, Options};
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::collections::BTreeMap;

/// Front, left and up of the file by ufbx, as rows: canonical from file. What is right for a viewer is left for the character
/// facing him.
fn canonical(oracle: &ufbx::Scene) -> Matrix3<f64> {
    let axes = &oracle.settings.axes;
    let row = |axis: &ufbx::CoordinateAxis| match axis {
        ufbx::CoordinateAxis::PositiveX => Vector3::x(),
        ufbx::CoordinateAxis::NegativeX => -Vector3::x(),
        ufbx::CoordinateAxis::PositiveY => Vector3::y(),
        ufbx::CoordinateAxis::NegativeY => -Vector3::y(),
        ufbx::CoordinateAxis::PositiveZ => Vector3::z(),
        ufbx::CoordinateAxis::NegativeZ => -Vector3::z(),
        _ => panic!("ufbx doesn't know the axes"),
    };
    let rows = [row(&axes.front), row(&axes.right), row(&axes.up)];
    Matrix3::from_rows(&rows.map(|row| row.transpose()))
}

/// Places of ufbx's nodes in canonical axes and metres, by path. Paths may repeat.
fn places(oracle: &ufbx::Scene, index: usize, time: f64) -> BTreeMap<String, Vec<Vector3<f64>>> {
    let ticks = oracle.metadata.ktime_second as f64;
    let snapped = (time * ticks).round() / ticks;
    let anim = &oracle.anim_stacks[index].anim;
    let evaluated =
        ufbx::evaluate_scene(oracle, anim, snapped, Default::default()).expect("ufbx evaluates");
    let canonical = canonical(oracle) * oracle.settings.unit_meters;
    let mut places = BTreeMap::<String, Vec<Vector3<f64>>>::new();
    for ((path, _), matrix) in theirs(&evaluated) {
        let place = canonical * matrix.fixed_view::<3, 1>(0, 3);
        places.entry(path).or_default().push(place);
    }
    places
}

/// Largest distance between the joints of all takes' clips and ufbx's nodes in any frame, metres, up to a turn about the up axis
/// if the clip says that it was turned.
pub(super) fn check(file: &str, scene: &FbxScene, oracle: &ufbx::Scene) -> f64 {
    let (_, binary) = bytes_of(file).expect("it was there");
    let mut worst = 0.0f64;
    for (index, take) in scene.takes().iter().enumerate() {
        let options = Options {
            take: Some(take.name.clone()),
            trim: Some((0.0, f64::INFINITY)),
            ..Options::default()
        };
        let clip = match import::read(&binary, file, None, &options) {
            Err(error) if matches!(error.kind, ErrorKind::NoJoints) => continue,
            clip => clip.expect("it imports"),
        };
        let mut paths: Vec<String> = Vec::new();
        for joint in &clip.joints {
            let above = joint.parent.map_or("", |parent| paths[parent].as_str());
            paths.push(format!("{above}/{}", joint.name));
        }
        let turned = clip.problems.iter().any(|p| p.id == "turned-to-forward");
        let mut turn = (!turned).then(Rotation3::identity);
        for frame in 0..clip.frames.len() {
            let time = take.start + frame as f64 / clip.fps;
            let world = clip.world(frame);
            let ours = world.iter().map(|joint| joint.translation.vector);
            let theirs = places(oracle, index, time);
            let pairs: Vec<_> = ours.zip(paths.iter().map(|path| &theirs[path])).collect();
            let turn = *turn.get_or_insert_with(|| heading(&pairs));
            let distance = |(ours, theirs): &(Vector3<f64>, &Vec<Vector3<f64>>)| {
                let distances = theirs.iter().map(|place| (turn * place - ours).norm());
                distances.fold(f64::INFINITY, f64::min)
            };
            let off = pairs.iter().map(distance).fold(0.0, f64::max);
            let size = pairs.iter().map(|pair| pair.0.norm()).fold(0.0, f64::max);
            let most = TOLERANCE_M.max(TOLERANCE_FAR * size);
            assert!(off < most, "{file}, {}, frame {frame}: {off} m", take.name);
            worst = worst.max(off);
        }
    }
    worst
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

/// Every bone below another one rests as it was bound, by ufbx. A topmost bone keeps the heading of its node.
#[test]
fn bones_rest_in_their_bind_pose() {
    let Some((scene, oracle)) = open("torture-fbx/blender_293_barbarian_7400_binary.fbx") else {
        return;
    };
    let (rest, stands) = (ours_by(&scene, scene.world(None)), ours(&scene, None));
    let poses = (&oracle.poses).into_iter().filter(|pose| pose.is_bind_pose);
    let mut compared = 0;
    for bone in poses.flat_map(|pose| &pose.bone_poses) {
        let key = (path(&bone.bone_node), 1);
        if bone.bone_node.bone.is_none() {
            continue;
        }
        let above = bone.bone_node.parent.as_ref();
        let Some(above) = above.filter(|node| node.bone.is_some()) else {
            let turn = rest[&key] * stands[&key].try_inverse().expect("a turn");
            // A turn about Y alone takes X to Z, or Z to X.
            let twist = turn[(0, 2)] - turn[(2, 0)];
            assert!(twist.abs() < 1e-4, "{}: {twist}", key.0);
            continue;
        };
        let above = rest[&(path(above), 1)];
        let found = above.try_inverse().expect("a parent") * rest[&key];
        let expected = matrix(&bone.bone_to_parent);
        let off = (found - expected).norm() / expected.norm();
        assert!(off < 1e-4, "{}: {off}", key.0);
        compared += 1;
    }
    assert!(compared > 15, "{compared}");
    assert_eq!(scene.contents().problems[0].id, "rest-from-bind-pose");
}

/// These were bound with other joint axes, a quarter turn about the up axis away from their joints.
#[test]
fn a_bind_pose_that_only_faces_another_way_is_left() {
    for name in ["MMAKick", "Backflip", "Running", "Walking"] {
        let Some((scene, oracle)) = open(&format!("mixamo/MarathonMan{name}.fbx")) else {
            return;
        };
        assert!((&oracle.poses).into_iter().any(|pose| pose.is_bind_pose));
        assert_eq!(scene.world(None), scene.placed(None), "{name}");
    }
}
