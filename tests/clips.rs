//! The clips of `clips/` are what `examples/author_clips` makes, open in other readers, and can be performed.

#[path = "../examples/author_clips/balance.rs"]
mod balance;
#[path = "../examples/author_clips/fbx.rs"]
mod fbx;
#[path = "../examples/author_clips/fbx_tree.rs"]
mod fbx_tree;
#[path = "../examples/author_clips/figure.rs"]
mod figure;
#[path = "../examples/author_clips/glb.rs"]
mod glb;
#[path = "../examples/author_clips/kick.rs"]
mod kick;
#[path = "../examples/author_clips/rig.rs"]
mod rig;
#[path = "../examples/author_clips/spline.rs"]
mod spline;
#[path = "../examples/author_clips/walk.rs"]
mod walk;

use balance::{Body, Ground, TOUCH, ground, margin, sole};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use rig::{JOINTS, NAMES, Pose, Rig, SHANK, STATURE, THIGH, UP_LEG, V3};

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

#[test]
fn the_walk_repeats_exactly() {
    let rig = Rig::new();
    let poses = walk::poses(&rig);
    let (first, last) = (
        poses[0].positions(&rig),
        poses[walk::CYCLE_FRAMES].positions(&rig),
    );
    for joint in 0..JOINTS {
        let travel = last[joint] - first[joint];
        assert!(
            (travel - V3::z() * walk::STRIDE).norm() < 1e-9,
            "{}",
            NAMES[joint]
        );
        assert!(poses[0].turn[joint].angle_to(&poses[walk::CYCLE_FRAMES].turn[joint]) < 1e-9);
    }
    assert!((walk::STRIDE / walk::PERIOD - 1.2).abs() < 1e-12);
}

/// How far corners of the sole move while they touch the ground without a break, and how far any corner is under it.
fn slide_and_sink(rig: &Rig, poses: &[Pose]) -> (f64, f64) {
    let (mut slide, mut sink) = (0.0f64, 0.0f64);
    for side in 0..2 {
        let mut landed = [None; 6];
        for pose in poses {
            for (corner, landed) in sole(rig, pose, side).into_iter().zip(&mut landed) {
                sink = sink.max(-corner.y);
                if corner.y > 1e-4 {
                    *landed = None;
                    continue;
                }
                let place = *landed.get_or_insert(ground(corner));
                slide = slide.max((ground(corner) - place).norm());
            }
        }
    }
    (slide, sink)
}

#[test]
fn standing_feet_neither_slide_nor_sink() {
    let rig = Rig::new();
    for (name, poses) in [("kick", kick::poses(&rig)), ("walk", walk::poses(&rig))] {
        let (slide, sink) = slide_and_sink(&rig, &poses);
        println!(
            "{name}: slides {:.3} mm, sinks {:.3} mm",
            slide * 1e3,
            sink * 1e3
        );
        assert!(
            slide < 1e-3 && sink < 1e-3,
            "{name}: slide {slide} m, sink {sink} m"
        );
    }
    let kick = kick::poses(&rig);
    let start = kick[0].positions(&rig);
    for pose in &kick {
        let now = pose.positions(&rig);
        for joint in [UP_LEG[0] + 2, UP_LEG[0] + 3] {
            assert!(
                (now[joint] - start[joint]).norm() < 1e-9,
                "the standing foot is still"
            );
        }
    }
}

fn least(rig: &Rig, poses: &[Pose], points: &[Ground]) -> f64 {
    let margins = poses
        .iter()
        .zip(points)
        .map(|(pose, p)| margin(rig, pose, *p));
    margins.fold(f64::INFINITY, f64::min)
}

/// Both clips' zero-moment points stay where the ground can push back; the kick's centre of mass as well, and with
/// room for the error of a controller.
#[test]
fn the_ground_can_hold_both_clips() {
    let rig = Rig::new();
    let body = Body::new(&rig);
    let com = |poses: &[Pose]| -> Vec<Ground> {
        poses.iter().map(|p| ground(body.com(&rig, p))).collect()
    };
    let kick = kick::poses(&rig);
    let zmp_margin = least(&rig, &kick, &kick::zmp(&body, &rig, &kick));
    let com_margin = least(&rig, &kick, &com(&kick));
    println!(
        "kick: ZMP {:.1} mm, COM {:.1} mm inside",
        zmp_margin * 1e3,
        com_margin * 1e3
    );
    assert!(zmp_margin > 0.03 && com_margin > 0.01);
    let walk = walk::poses(&rig);
    let zmp_margin = least(&rig, &walk, &walk::zmp(&body, &rig, &walk, 1.0 / walk::FPS));
    println!("walk: ZMP {:.1} mm inside", zmp_margin * 1e3);
    assert!(zmp_margin > 0.0);
}

#[test]
fn the_kick_is_a_kick() {
    let rig = Rig::new();
    let poses = kick::poses(&rig);
    assert_eq!(poses.len(), kick::FRAMES);
    let ball = |p: &Pose| p.positions(&rig)[UP_LEG[1] + 3];
    let hip = rig.rest[UP_LEG[1]].y;
    let top = poses.iter().map(|p| ball(p).y).fold(0.0, f64::max);
    assert!(
        top > hip,
        "the foot gets to {top} m, above the hip at {hip} m"
    );
    for (k, pose) in poses.iter().enumerate() {
        let t = k as f64 / kick::FPS;
        let raised = sole(&rig, pose, 1).iter().all(|c| c.y > TOUCH);
        let well_inside = (kick::LIFT_OFF + 0.06..kick::TOUCH_DOWN - 0.06).contains(&t);
        let well_outside = !(kick::LIFT_OFF..=kick::TOUCH_DOWN).contains(&t);
        assert!(
            !(well_inside && !raised || well_outside && raised),
            "at {t} s"
        );
    }
    let (first, last) = (
        poses[0].positions(&rig),
        poses[kick::FRAMES - 1].positions(&rig),
    );
    for (a, b) in first.iter().zip(&last) {
        assert!(
            (a - b).norm() < 1e-3,
            "it ends in the stance in which it began"
        );
    }
}

/// Sagittal angles of the left leg: thigh against the vertical, knee flexion; degrees.
fn leg_angles(rig: &Rig, pose: &Pose) -> [f64; 2] {
    let at = pose.positions(rig);
    let first = UP_LEG[0];
    let lean = |from: usize| {
        let bone = at[from + 1] - at[from];
        bone.z.atan2(-bone.y).to_degrees()
    };
    [lean(first), lean(first) - lean(first + 1)]
}

/// Planting the feet moves the joints away from the published curves; it must not move them far.
#[test]
fn the_walk_follows_published_joint_angles() {
    let rig = Rig::new();
    let poses = walk::poses(&rig);
    let mut squares = [0.0; 2];
    let tables = [&walk::THIGH_ANGLE, &walk::KNEE_FLEXION];
    for pose_at in 0..walk::CYCLE_FRAMES {
        let tenth = 10.0 * pose_at as f64 / walk::CYCLE_FRAMES as f64;
        let (low, part) = (tenth.floor() as usize, tenth.fract());
        let angles = leg_angles(&rig, &poses[pose_at]);
        for i in 0..2 {
            let want = tables[i][low] * (1.0 - part) + tables[i][(low + 1) % 10] * part;
            squares[i] += (angles[i] - want).powi(2) / walk::CYCLE_FRAMES as f64;
        }
    }
    let [thigh, knee] = squares.map(f64::sqrt);
    println!("root mean square against the tables: thigh {thigh:.1}°, knee {knee:.1}°");
    assert!(thigh < 6.0 && knee < 11.0);
}

/// Both feet stand for about a fifth of the cycle, one foot always does, and no leg is stretched to its end.
#[test]
fn the_walk_is_a_walk() {
    let rig = Rig::new();
    let poses = walk::poses(&rig);
    let stands = |p: &Pose, side: usize| sole(&rig, p, side).iter().any(|c| c.y < TOUCH);
    let cycle = &poses[..walk::CYCLE_FRAMES];
    assert!(cycle.iter().all(|p| stands(p, 0) || stands(p, 1)));
    let both = cycle
        .iter()
        .filter(|p| stands(p, 0) && stands(p, 1))
        .count();
    let share = both as f64 / walk::CYCLE_FRAMES as f64;
    assert!((0.14..=0.32).contains(&share), "double support {share}");
    for pose in &poses {
        let at = pose.positions(&rig);
        for leg in UP_LEG {
            assert!((at[leg + 2] - at[leg]).norm() < 0.9985 * (THIGH + SHANK));
        }
    }
    let body = Body::new(&rig);
    let heights: Vec<f64> = cycle.iter().map(|p| body.com(&rig, p).y).collect();
    let rise = heights.iter().copied().fold(f64::MIN, f64::max)
        - heights.iter().copied().fold(f64::MAX, f64::min);
    println!(
        "centre of mass rises {:.1} mm, double support {:.0} %",
        rise * 1e3,
        share * 100.0
    );
    assert!((0.02..0.05).contains(&rise));
}
