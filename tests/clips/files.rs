//! The files: their bytes, and what other readers find in them.

use crate::rig::{JOINTS, NAMES, Rig, STATURE, V3};
use crate::{fbx, glb, kick, walk};
use fbxcel::tree::any::AnyTree;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::io::Cursor;

fn committed(name: &str) -> Vec<u8> {
    let path = format!("{}/clips/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read(path).expect("the clip is committed")
}

#[test]
fn regenerating_gives_the_committed_bytes() {
    let rig = Rig::new();
    let kick = fbx::document(&rig, &kick::poses(&rig), "kick").expect("memory takes every byte");
    assert!(kick == committed("kick.fbx"), "kick.fbx differs");
    let walk = glb::document(&rig, &walk::poses(&rig), walk::FPS, "walk");
    assert!(walk == committed("walk.glb"), "walk.glb differs");
}

#[test]
fn ufbx_sees_the_authored_kick() {
    let rig = Rig::new();
    let poses = kick::poses(&rig);
    let scene =
        ufbx::load_memory(&committed("kick.fbx"), ufbx::LoadOpts::default()).expect("opens");
    assert_eq!(
        scene
            .metadata
            .warnings
            .iter()
            .map(|w| w.description.to_string())
            .collect::<Vec<_>>(),
        [""; 0]
    );
    assert_eq!(scene.metadata.version, 7400);
    assert_eq!(scene.settings.frames_per_second, 60.0);
    assert_eq!(scene.settings.unit_meters, 0.01);
    assert_eq!(scene.anim_stacks.len(), 1);
    assert_eq!(scene.anim_stacks[0].element.name.to_string(), "kick");
    let last = (poses.len() - 1) as f64 / kick::FPS;
    assert!((scene.anim_stacks[0].time_end - last).abs() < 1e-9);

    assert_positions(&scene, &rig.rest, "rest");
    for (frame, pose) in poses.iter().enumerate() {
        let time = frame as f64 / kick::FPS;
        let now = ufbx::evaluate_scene(&scene, &scene.anim, time, ufbx::EvaluateOpts::default());
        let place = format!("frame {frame}");
        assert_positions(&now.expect("evaluates"), &pose.positions(&rig), &place);
    }
}

fn assert_positions(scene: &ufbx::Scene, expected: &[V3; JOINTS], place: &str) {
    for (name, want) in NAMES.iter().zip(expected) {
        let node = scene
            .find_node(name)
            .unwrap_or_else(|| panic!("{name} is in the file"));
        let m = &node.node_to_world;
        let got = V3::new(m.m03, m.m13, m.m23) * 0.01;
        let error = (got - want).norm();
        assert!(error < 1e-4, "{place}, {name}: {error} m");
    }
}

/// Between its keys the file must not leave the motion either: no Euler angle may swing through a jump.
#[test]
fn the_kick_is_smooth_between_its_keys() {
    let rig = Rig::new();
    let poses = kick::poses(&rig);
    let scene =
        ufbx::load_memory(&committed("kick.fbx"), ufbx::LoadOpts::default()).expect("opens");
    for frame in 0..poses.len() - 1 {
        let time = (frame as f64 + 0.5) / kick::FPS;
        let now = ufbx::evaluate_scene(&scene, &scene.anim, time, ufbx::EvaluateOpts::default())
            .expect("evaluates");
        let (a, b) = (
            poses[frame].positions(&rig),
            poses[frame + 1].positions(&rig),
        );
        for (joint, name) in NAMES.iter().enumerate() {
            let m = &now.find_node(name).expect("a joint").node_to_world;
            let off = V3::new(m.m03, m.m13, m.m23) * 0.01 - (a[joint] + b[joint]) * 0.5;
            assert!(
                off.norm() < 0.003,
                "{name} after frame {frame}: {} m",
                off.norm()
            );
        }
    }
}

/// World transforms of the file's joints in its frame `frame`, in its own order of nodes.
fn glb_world(
    document: &gltf::Document,
    blob: &[u8],
    frame: usize,
) -> Vec<(String, Isometry3<f64>)> {
    let mut local: Vec<Isometry3<f64>> = document
        .nodes()
        .map(|n| rigid(n.transform().decomposed()))
        .collect();
    let animation = document.animations().next().expect("an animation");
    for channel in animation.channels() {
        let reader = channel.reader(|_| Some(blob));
        let to = &mut local[channel.target().node().index()];
        match reader.read_outputs().expect("outputs") {
            gltf::animation::util::ReadOutputs::Translations(mut v) => {
                let v = v.nth(frame).expect("a key per frame").map(f64::from);
                to.translation = Translation3::from(V3::from(v));
            }
            gltf::animation::util::ReadOutputs::Rotations(v) => {
                to.rotation = quaternion(v.into_f32().nth(frame).expect("a key per frame"));
            }
            _ => panic!("only translations and rotations move"),
        }
    }
    let mut out = Vec::new();
    for node in document.scenes().flat_map(|s| s.nodes()) {
        walk_tree(&node, Isometry3::identity(), &local, &mut out);
    }
    out
}

fn walk_tree(
    node: &gltf::Node,
    parent: Isometry3<f64>,
    local: &[Isometry3<f64>],
    out: &mut Vec<(String, Isometry3<f64>)>,
) {
    let world = parent * local[node.index()];
    out.push((node.name().unwrap_or_default().to_owned(), world));
    for child in node.children() {
        walk_tree(&child, world, local, out);
    }
}

fn quaternion(xyzw: [f32; 4]) -> UnitQuaternion<f64> {
    let [x, y, z, w] = xyzw.map(f64::from);
    assert!((Quaternion::new(w, x, y, z).norm() - 1.0).abs() < 1e-6);
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

fn rigid((translation, rotation, scale): ([f32; 3], [f32; 4], [f32; 3])) -> Isometry3<f64> {
    assert_eq!(scale, [1.0; 3]);
    Isometry3::from_parts(
        V3::from(translation.map(f64::from)).into(),
        quaternion(rotation),
    )
}

/// The crate `gltf` validates on opening.
#[test]
fn gltf_sees_the_authored_walk() {
    let rig = Rig::new();
    let poses = walk::poses(&rig);
    let bytes = committed("walk.glb");
    assert!(bytes.len() < 300_000);
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).expect("valid");
    let blob = blob.expect("a binary chunk");
    let animation = document.animations().next().expect("an animation");
    assert_eq!(animation.name(), Some("walk"));
    for channel in animation.channels() {
        assert_eq!(
            channel.sampler().interpolation(),
            gltf::animation::Interpolation::Linear
        );
        let times: Vec<f32> = channel
            .reader(|_| Some(&blob))
            .read_inputs()
            .expect("times")
            .collect();
        assert_eq!(times.len(), walk::CYCLE_FRAMES + 1);
        assert!(
            times
                .iter()
                .enumerate()
                .all(|(k, t)| (t - k as f32 / 30.0).abs() < 1e-6)
        );
    }
    for (frame, pose) in poses.iter().enumerate() {
        let world = glb_world(&document, &blob, frame);
        let expected = pose.positions(&rig);
        for (name, want) in NAMES.iter().zip(expected) {
            let got = world.iter().find(|(n, _)| n == name).expect("a joint").1;
            assert!(
                (got.translation.vector - want).norm() < 1e-5,
                "frame {frame}, {name}"
            );
        }
    }
}

/// The inverse bind matrices undo the joints' rest transforms, and every corner of the body hangs on one joint.
#[test]
fn the_walk_has_a_skinned_body() {
    let bytes = committed("walk.glb");
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).expect("valid");
    let blob = blob.expect("a binary chunk");
    let rig = Rig::new();
    let skin = document.skins().next().expect("a skin");
    let inverse: Vec<_> = skin
        .reader(|_| Some(&blob))
        .read_inverse_bind_matrices()
        .expect("matrices")
        .collect();
    assert_eq!(inverse.len(), JOINTS);
    for (joint, columns) in inverse.into_iter().enumerate() {
        let inverse = nalgebra::Matrix4::from(columns).map(f64::from);
        let product = rig.rest_world(joint).to_homogeneous() * inverse;
        assert!((product - nalgebra::Matrix4::identity()).norm() < 1e-5);
    }
    let mesh = document.meshes().next().expect("a mesh");
    let primitive = mesh.primitives().next().expect("a primitive");
    let reader = primitive.reader(|_| Some(&blob));
    let heights: Vec<f32> = reader
        .read_positions()
        .expect("positions")
        .map(|p| p[1])
        .collect();
    let tallest = heights.iter().copied().fold(0.0, f32::max);
    assert!((f64::from(tallest) - STATURE).abs() < 1e-5);
    let indices: Vec<usize> = reader
        .read_indices()
        .expect("indices")
        .into_u32()
        .map(|i| i as usize)
        .collect();
    let positions: Vec<V3> = reader
        .read_positions()
        .expect("positions")
        .map(|p| V3::from(p.map(f64::from)))
        .collect();
    let normals: Vec<V3> = reader
        .read_normals()
        .expect("normals")
        .map(|p| V3::from(p.map(f64::from)))
        .collect();
    for t in indices.chunks(3) {
        let across =
            (positions[t[1]] - positions[t[0]]).cross(&(positions[t[2]] - positions[t[0]]));
        assert!(across.dot(&normals[t[0]]) > 0.0, "faces look outward");
    }
}

/// A strict parser finds no fault from the first byte to the footer.
#[test]
fn the_kick_is_whole_to_its_footer() {
    let bytes = committed("kick.fbx");
    match AnyTree::from_seekable_reader(Cursor::new(bytes)).expect("parses") {
        AnyTree::V7400(_, tree, footer) => {
            assert!(footer.is_ok(), "{footer:?}");
            assert!(tree.root().first_child_by_name("Takes").is_some());
        }
        _ => panic!("an FBX 7.4 file"),
    }
}
