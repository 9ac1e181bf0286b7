use super::contact;
use super::*;
use crate::skeleton::{GRAVITY, Skeleton};
use nalgebra::{Quaternion, UnitQuaternion};

pub(super) fn humanoid() -> Skeleton {
    Skeleton::load("humanoid").expect("the built-in humanoid is valid")
}

pub(super) fn draft(skeleton: &Skeleton, qpos: Vec<Vec<f64>>, fps: f64) -> Draft {
    let foot = |name: &str| skeleton.bodies.iter().position(|b| b.name == name);
    Draft {
        name: "test".into(),
        fps,
        loop_mode: LoopMode::Clamp,
        cycle: Cycle::NONE,
        qpos,
        contact_bodies: ["left_foot", "right_foot"]
            .iter()
            .filter_map(|n| foot(n))
            .collect(),
        contact: None,
    }
}

/// The rest pose carried along by a constant velocity of all coordinates.
fn steady(skeleton: &Skeleton, qvel: &[f64], frames: usize, fps: f64) -> Vec<Vec<f64>> {
    let rest = skeleton.rest_qpos();
    let at = |f: usize| skeleton.integrate(&rest, qvel, f as f64 / fps);
    (0..frames).map(at).collect()
}

#[test]
fn cycles_add_up() {
    for heading in [0.0, 0.4, -2.0, std::f64::consts::PI] {
        let cycle = Cycle {
            translation: Vector3::new(1.0, 0.3, 0.0),
            heading,
        };
        let one = cycle.offset(1);
        let mut naive = Isometry3::identity();
        for n in 0..7 {
            assert!((cycle.offset(n).to_homogeneous() - naive.to_homogeneous()).norm() < 1e-9);
            let back = cycle.offset(-n) * naive;
            assert!((back.to_homogeneous() - Isometry3::identity().to_homogeneous()).norm() < 1e-9);
            naive *= one;
        }
    }
}

/// Walking a circle at constant speed: the velocity is the same in every frame, seam included.
#[test]
fn velocities_pass_over_the_seam() {
    let s = humanoid();
    let (fps, frames, rate, radius) = (30.0, 16, 0.5, 2.0);
    let qpos: Vec<Vec<f64>> = (0..frames)
        .map(|f| {
            let angle = rate * f as f64 / fps;
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
            let mut q = s.rest_qpos();
            q[0] = radius * angle.sin();
            q[1] = radius * (1.0 - angle.cos());
            q[3..7].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
            q
        })
        .collect();
    let last = &qpos[frames - 1];
    let cycle = Cycle {
        translation: Vector3::new(last[0], last[1], 0.0),
        heading: rate * (frames - 1) as f64 / fps,
    };
    let motion = Motion::from_poses(
        &s,
        Draft {
            loop_mode: LoopMode::Wrap,
            cycle,
            ..draft(&s, qpos, fps)
        },
    );
    for (f, v) in motion.qvel.iter().enumerate() {
        let angle = rate * f as f64 / fps;
        let expected = Vector3::new(angle.cos(), angle.sin(), 0.0) * radius * rate;
        assert!(
            (Vector3::new(v[0], v[1], v[2]) - expected).norm() < 1e-3,
            "frame {f}"
        );
        assert!((v[5] - rate).abs() < 1e-9, "frame {f}");
    }
    let period = motion.duration();
    for k in -3..4 {
        let time = f64::from(k) * period + 0.2;
        let q = motion.sample_qpos(&s, time);
        let angle = rate * time;
        assert!((q[0] - radius * angle.sin()).abs() < 1e-3);
        let before = motion.sample_qpos(&s, f64::from(k) * period - 1e-9);
        let after = motion.sample_qpos(&s, f64::from(k) * period + 1e-9);
        let jump = s.differentiate(&before, &after, 1.0);
        assert!(jump.iter().all(|d| d.abs() < 1e-6));
        let bodies = motion.sample_bodies(time);
        assert!((bodies[0].translation.vector - Vector3::new(q[0], q[1], q[2])).norm() < 1e-9);
    }
}

#[test]
fn a_mean_velocity_is_the_way_over_its_time() {
    let s = humanoid();
    let (fps, frames) = (60.0, 31);
    let path = |f: usize| (f as f64 * 1.7).sin() + 0.1 * f as f64;
    let mut qpos = vec![s.rest_qpos(); frames];
    for (f, q) in qpos.iter_mut().enumerate() {
        q[0] = path(f);
    }
    let motion = Motion::from_poses(&s, draft(&s, qpos, fps));
    for (half, steps) in [(0.0, 1), (1.0 / 60.0, 1), (1.0 / 30.0, 2), (0.05, 3)] {
        for f in steps..frames - steps {
            let way = path(f + steps) - path(f - steps);
            let expected = way * fps / (2 * steps) as f64;
            let v = motion.mean_qvel(f as f64 / fps, half);
            assert!((v[0] - expected).abs() < 1e-9, "frame {f}, {steps} steps");
        }
    }
    let ends = [0.0, motion.duration()].map(|time| motion.mean_qvel(time, 1.0 / 30.0)[0]);
    let near = |a: usize, b: usize| (motion.qvel[a][0] + motion.qvel[b][0]) / 2.0;
    assert!((ends[0] - near(0, 1)).abs() < 1e-9 && (ends[1] - near(29, 30)).abs() < 1e-9);
}

/// It stands, jumps and stands again: means are of the flight or of the ground, and where the two meet of the steps next to
/// it.
#[test]
fn mean_velocities_know_takeoff_and_landing() {
    let s = humanoid();
    let (fps, takes_off, flies) = (120.0, 20, 48);
    let lands = takes_off + flies;
    let up = GRAVITY * flies as f64 / fps / 2.0;
    let since = |f: usize| (f.clamp(takes_off, lands) - takes_off) as f64 / fps;
    let height = |f: usize| since(f) * (up - GRAVITY * since(f) / 2.0);
    let mut qpos = vec![s.rest_qpos(); lands + takes_off + 1];
    for (f, q) in qpos.iter_mut().enumerate() {
        q[2] += height(f);
    }
    let motion = Motion::from_poses(&s, draft(&s, qpos, fps));
    for f in 1..motion.qpos.len() - 1 {
        let expected = match f {
            f if f < takes_off || f > lands => 0.0,
            f if f == takes_off || f == lands => (height(f + 1) - height(f - 1)) * fps / 2.0,
            f => up - GRAVITY * since(f),
        };
        let v = motion.mean_qvel(f as f64 / fps, 1.0 / 30.0)[2];
        assert!(
            (v - expected).abs() < 1e-9,
            "frame {f}: {v}, not {expected}"
        );
    }
}

#[test]
fn one_sided_ends_are_of_second_order() {
    let s = humanoid();
    let mut qpos = vec![s.rest_qpos(); 9];
    for (f, q) in qpos.iter_mut().enumerate() {
        q[0] = 0.5 * 3.0 * (f as f64 / 10.0).powi(2);
    }
    let motion = Motion::from_poses(&s, draft(&s, qpos, 10.0));
    for (f, v) in motion.qvel.iter().enumerate() {
        assert!((v[0] - 3.0 * f as f64 / 10.0).abs() < 1e-9);
    }
}

#[test]
fn standing_is_explained_by_the_feet() {
    let s = humanoid();
    let still = steady(&s, &vec![0.0; s.nv], 12, 30.0);
    let standing = Motion::from_poses(&s, draft(&s, still.clone(), 30.0));
    assert!(standing.tracks.contact.iter().flatten().all(|c| *c));
    let weight = s.total_mass() * GRAVITY;
    for w in &standing.tracks.root_wrench_residual {
        assert!(w.norm() < 1e-6 * weight);
    }

    // In the air, nothing carries it.
    let lift = |mut qpos: Vec<f64>| {
        qpos[2] += 0.5;
        qpos
    };
    let lifted = still.into_iter().map(lift).collect();
    let held = Motion::from_poses(&s, draft(&s, lifted, 30.0));
    assert!(held.tracks.contact.iter().flatten().all(|c| !c));
    let arm = held.tracks.com[0] - held.bodies[0][0].translation.vector;
    let expected = Vector3::new(0.0, 0.0, weight);
    for w in &held.tracks.root_wrench_residual {
        assert!((w.fixed_rows::<3>(0) - expected).norm() < 1e-6);
        assert!((w.fixed_rows::<3>(3) - arm.cross(&expected)).norm() < 1e-6);
    }
}

/// Whoever lies still on the back is carried by the ground, though neither feet nor hands stand.
#[test]
fn lying_is_explained_by_what_lies_on_the_ground() {
    let s = humanoid();
    let mut lying = s.rest_qpos();
    let back = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -std::f64::consts::FRAC_PI_2);
    lying[3..7].copy_from_slice(&[back.w, back.i, back.j, back.k]);
    lying[2] -= s.lowest_point(&s.forward(&lying));
    let none = Draft {
        contact: Some(vec![vec![false; 2]; 12]),
        ..draft(&s, vec![lying; 12], 30.0)
    };
    let weight = s.total_mass() * GRAVITY;
    for w in &Motion::from_poses(&s, none).tracks.root_wrench_residual {
        assert!(w.fixed_rows::<3>(0).norm() < 0.05 * weight, "{w}");
    }
}

#[test]
fn free_fall_needs_nothing() {
    let s = humanoid();
    let mut qpos = vec![s.rest_qpos(); 40];
    for (f, q) in qpos.iter_mut().enumerate() {
        let t = f as f64 / 60.0;
        q[0] += 2.0 * t;
        q[2] += 5.0 + 3.0 * t - 0.5 * GRAVITY * t * t;
    }
    let motion = Motion::from_poses(&s, draft(&s, qpos, 60.0));
    assert!(motion.tracks.contact.iter().flatten().all(|c| !c));
    for w in &motion.tracks.root_wrench_residual {
        assert!(w.norm() < 1e-6);
    }
    assert!(motion.beyond_reach(&s).is_empty());
}

/// A point that rests for 0.6 s and swings for 0.4 s, both at any size and frame rate.
#[test]
fn contacts_do_not_depend_on_size_or_frame_rate() {
    for (size, fps) in [
        (1.0, 30.0),
        (1.0, 60.0),
        (1.0, 120.0),
        (0.3, 50.0),
        (10.0, 100.0),
    ] {
        let path = |time: f64| {
            let swing = ((time - 0.6) / 0.4).max(0.0) * std::f64::consts::PI;
            Vector3::new(1.0 - swing.cos(), 0.0, 0.3 * swing.sin()) * size
        };
        let frames = fps as usize + 1;
        let points: Vec<_> = (0..frames).map(|f| vec![path(f as f64 / fps)]).collect();
        for labels in [
            contact::detect(&points, fps, size, LoopMode::Wrap),
            contact::detect_above(&points, 0.0, fps, size, LoopMode::Wrap),
        ] {
            let share = labels[1..].iter().filter(|c| **c).count() as f64 / (frames - 1) as f64;
            assert!((share - 0.6).abs() < 0.09, "size {size}, {fps} Hz: {share}");
            assert_eq!(labels[0], labels[frames - 1]);
        }
    }
}

#[test]
fn short_touches_and_gaps_vanish() {
    let fps = 100.0;
    let mut points = vec![vec![Vector3::new(0.0, 0.0, 0.0)]; 100];
    points[40..44].fill(vec![Vector3::new(0.0, 0.0, 0.5)]);
    assert!(
        contact::detect_above(&points, 0.0, fps, 1.0, LoopMode::Clamp)
            .iter()
            .all(|c| *c)
    );
    let mut points = vec![vec![Vector3::new(0.0, 0.0, 0.5)]; 100];
    points[40..44].fill(vec![Vector3::zeros()]);
    assert!(
        contact::detect_above(&points, 0.0, fps, 1.0, LoopMode::Clamp)
            .iter()
            .all(|c| !c)
    );
}

fn report() -> RetargetReport {
    let spread = Spread {
        mean: 0.1,
        max: 1.0 / 3.0,
    };
    RetargetReport {
        frames: 20,
        keypoint_error_m: spread,
        foot_skate_m_s: 0.01,
        penetration_m: Spread::default(),
        float_m: 0.002,
        contact_disagreement: Some(0.0625),
        joint_limit_violations: 3,
        map: vec![MappedJoint {
            slot: crate::humanoid::Slot::LeftFoot,
            joint: "mixamorig:LeftFoot".into(),
            confidence: 0.9,
            reason: "its name".into(),
        }],
        problems: Vec::new(),
    }
}

/// A hip with a finger that turns and a pen that slides, over `frames` frames.
fn source(frames: usize) -> SourceRig {
    let joint = |name: &str, parent, bone: Option<&str>| crate::clip::Joint {
        name: name.into(),
        parent,
        rest: Isometry3::translation(0.0, 0.25, 1.0),
        bone: bone.map(str::to_owned),
    };
    // Quarters and eighths are exact in single precision, and so is a half turn.
    let turn = |f: usize| match f % 2 {
        0 => UnitQuaternion::identity(),
        _ => UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 1.0, 0.0)),
    };
    SourceRig {
        joints: vec![
            joint("hips", None, Some("hips")),
            joint("finger", Some(0), None),
            joint("pen", Some(1), None),
        ],
        map: [(crate::humanoid::Slot::Hips, 0)].into(),
        first: vec![Isometry3::translation(0.5, 0.125, 0.0); 3],
        rotations: [(1, (0..frames).map(turn).collect())].into(),
        translations: [(2, vec![Vector3::new(0.0, 0.5, 0.25); frames])].into(),
    }
}

/// What retargeting reports is judged, whatever the motion itself looks like.
#[test]
fn the_report_is_part_of_the_quality() {
    let s = humanoid();
    let mut motion = Motion::from_poses(&s, draft(&s, vec![s.rest_qpos(); 12], 30.0));
    let ids = |motion: &Motion| -> Vec<(&str, f64)> {
        let checks = motion.quality(&s).into_iter().map(|c| (c.id, c.value));
        let of_report = ["keypoint-error", "contact-disagreement"];
        checks.filter(|(id, _)| of_report.contains(id)).collect()
    };
    assert_eq!(ids(&motion), []);
    motion.report = Some(report());
    let expected = [("keypoint-error", 0.1), ("contact-disagreement", 0.0625)];
    assert_eq!(ids(&motion), expected);
}

#[test]
fn files_come_back_as_they_were() {
    let s = humanoid();
    let qvel: Vec<f64> = (0..s.nv).map(|i| (i as f64).sin()).collect();
    let mut motion = Motion::from_poses(&s, draft(&s, steady(&s, &qvel, 20, 60.0), 60.0));
    motion.report = Some(report());
    motion.source = Some(source(20));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("test.motion");
    motion.save(&path).expect("it can be written");
    let back = Motion::load(&path).expect("it can be read");
    back.check_skeleton(&s).expect("it fits its skeleton");
    assert_eq!(back, motion);
}

#[test]
fn a_rotation_of_zero_is_an_error() {
    let s = humanoid();
    let qpos = steady(&s, &vec![0.1; s.nv], 3, 60.0);
    let mut motion = Motion::from_poses(&s, draft(&s, qpos, 60.0));
    motion.bodies[1][2].rotation = UnitQuaternion::new_unchecked(Quaternion::from([0.0; 4]));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("test.motion");
    let error = motion.save(&path).expect_err("no body can be turned so");
    assert!(error.to_string().contains("rotation"), "{error}");
    assert!(!path.exists(), "what can't be loaded isn't written");
}

#[test]
fn damaged_files_never_panic() {
    let s = humanoid();
    let mut motion = Motion::from_poses(&s, draft(&s, steady(&s, &vec![0.1; s.nv], 3, 60.0), 60.0));
    motion.source = Some(source(3));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("test.motion");
    motion.save(&path).expect("it can be written");
    let bytes = std::fs::read(&path).expect("it was written");
    let mut state = 7_u64;
    let mut below = |count: usize| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as usize % count
    };
    for _ in 0..2000 {
        let mut damaged = bytes.clone();
        // Mostly the header: that is where lengths and shapes are.
        for _ in 0..=below(3) {
            let at = if below(4) == 0 {
                below(damaged.len())
            } else {
                below(4000)
            };
            damaged[at] = b"0129\"[],{}x\x00\xff"[below(13)];
        }
        if below(5) == 0 {
            damaged.truncate(below(bytes.len()));
        }
        std::fs::write(&path, &damaged).expect("it can be written");
        if let Ok(read) = Motion::load(&path) {
            assert!(read.qpos.len() == read.bodies.len());
            if let Some(source) = &read.source {
                let tracks = source.rotations.values().map(Vec::len);
                let tracks = tracks.chain(source.translations.values().map(Vec::len));
                assert!(tracks.into_iter().all(|length| length == read.qpos.len()));
                assert_eq!(source.first.len(), source.joints.len());
            }
        }
    }
}

/// The checks of a character that stands in its rest pose: weight borne by its feet, and hardly any torque.
#[test]
fn a_standing_character_passes_every_check() {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid loads");
    let feet = ["left_foot", "right_foot"]
        .map(|name| skeleton.bodies.iter().position(|b| b.name == name))
        .map(|foot| foot.expect("it has feet"));
    let mut qpos = skeleton.rest_qpos();
    qpos[2] -= skeleton.lowest_point(&skeleton.forward(&qpos));
    let draft = |qpos: Vec<Vec<f64>>| Draft {
        name: "standing".into(),
        fps: 60.0,
        loop_mode: LoopMode::Clamp,
        cycle: Cycle::NONE,
        qpos,
        contact_bodies: feet.to_vec(),
        contact: None,
    };
    let still = Motion::from_poses(&skeleton, draft(vec![qpos.clone(); 60]));
    let quality = still.quality(&skeleton);
    let failed: Vec<_> = quality.iter().filter(|c| !c.passed).collect();
    assert!(failed.is_empty(), "{failed:?}");
    // Knees under the hips: each leg bears half of what is above it along the bone.
    let knees = skeleton.bodies.iter().filter(|b| b.name.ends_with("shin"));
    let dofs: Vec<usize> = knees.map(|b| b.joints[0].dof).collect();
    let torques = still.joint_torques(&skeleton);
    assert!(dofs.iter().all(|dof| torques[30][*dof].abs() < 5.0));

    let sunk = |f: usize| {
        qpos.iter()
            .enumerate()
            .map(move |(i, q)| q - if i == 2 && f == 40 { 0.05 } else { 0.0 })
    };
    let jumps = (0..60).map(|f| sunk(f).collect()).collect();
    let jumping = Motion::from_poses(&skeleton, draft(jumps)).quality(&skeleton);
    let failed: Vec<_> = jumping
        .iter()
        .filter(|c| !c.passed)
        .map(|c| (c.id, c.frame))
        .collect();
    assert!(failed.contains(&("penetration", Some(40))), "{failed:?}");
    assert!(
        failed.iter().any(|(id, _)| *id == "smoothness"),
        "{failed:?}"
    );
}
