//! The clips of `clips/` are what `examples/author_clips` makes, open in other readers, and can be performed.

#[path = "../examples/author_clips/balance.rs"]
mod balance;
#[path = "../examples/author_clips/fbx.rs"]
mod fbx;
#[path = "../examples/author_clips/fbx_tree.rs"]
mod fbx_tree;
#[path = "../examples/author_clips/figure.rs"]
mod figure;
#[path = "clips/files.rs"]
mod files;
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
use rig::{JOINTS, NAMES, Pose, Rig, SHANK, THIGH, UP_LEG, V3};

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
    for (frame, pose) in poses.iter().enumerate().take(walk::CYCLE_FRAMES) {
        let tenth = 10.0 * frame as f64 / walk::CYCLE_FRAMES as f64;
        let (low, part) = (tenth.floor() as usize, tenth.fract());
        let angles = leg_angles(&rig, pose);
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

/// What the same poses become through both of our writers and the importers of both formats.
#[test]
fn a_take_in_two_formats_is_one_clip() {
    let rig = Rig::new();
    for (name, poses) in [("kick", kick::poses(&rig)), ("walk", walk::poses(&rig))] {
        let read = |bytes: &[u8], file: &str| {
            mimic::import::read(bytes, file, None, &Default::default()).expect("it imports")
        };
        let fbx = fbx::document(&rig, &poses, name).expect("it is written");
        let (fbx, glb) = (
            read(&fbx, "a.fbx"),
            read(&glb::document(&rig, &poses, kick::FPS, name), "a.glb"),
        );
        assert!((fbx.fps - glb.fps).abs() < 1e-9, "{name}");
        assert_eq!(fbx.loop_mode, glb.loop_mode, "{name}");
        assert_eq!(fbx.frames.len(), glb.frames.len(), "{name}");
        let partner =
            |joint: &mimic::clip::Joint| glb.joints.iter().position(|o| o.name == joint.name);
        let pairs: Vec<(usize, usize)> = (fbx.joints.iter().enumerate())
            .filter_map(|(j, joint)| Some((j, partner(joint)?)))
            .collect();
        assert!(pairs.len() >= JOINTS, "{name}: {} of {JOINTS}", pairs.len());
        for frame in 0..fbx.frames.len() {
            let (a, b) = (fbx.world(frame), glb.world(frame));
            for &(i, j) in &pairs {
                let off = (a[i].translation.vector - b[j].translation.vector).norm();
                assert!(
                    off < 0.5e-3,
                    "{name} {frame} {}: {off} m",
                    fbx.joints[i].name
                );
            }
        }
    }
}
