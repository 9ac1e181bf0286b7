use super::*;
use approx::assert_relative_eq;
use nalgebra::{UnitQuaternion, Vector3};
use std::path::Path;

/// An arm that turns at 1 rad/s about its parent's Z, which moves at 2 m/s along X.
fn arm(frames: usize, fps: f64) -> Clip {
    let joint = |name: &str, parent| Joint {
        name: name.to_owned(),
        parent,
        rest: Isometry3::translation(0.0, 0.0, 1.0),
        bone: None,
    };
    let frame = |f: usize| {
        let time = f as f64 / fps;
        vec![
            Isometry3::translation(2.0 * time, 0.0, 1.0),
            Isometry3::new(Vector3::new(0.0, 0.5, 0.0), Vector3::new(0.0, 0.0, time)),
        ]
    };
    Clip {
        name: "arm".to_owned(),
        fps,
        loop_mode: LoopMode::Wrap,
        joints: vec![joint("root", None), joint("arm", Some(0))],
        frames: (0..frames).map(frame).collect(),
        margin: Margin::default(),
        source: Source {
            file: "arm.glb".to_owned(),
            sha256: "00".to_owned(),
            format: "gltf".to_owned(),
            take: "swing".to_owned(),
            fps,
            up_axis: "+Y".to_owned(),
            unit_m: 1.0,
        },
        problems: vec![Problem {
            id: "turned-to-forward".to_owned(),
            severity: Severity::Note,
            message: "turned 90° about the up axis".to_owned(),
        }],
    }
}

#[test]
fn sampling_follows_the_motion_between_frames() {
    let clip = arm(31, 30.0);
    for time in [0.0, 0.01, 0.37, 0.5, 0.999, 1.0] {
        let [root, arm] = clip.sample(time)[..] else {
            panic!("two joints")
        };
        assert_relative_eq!(root.translation.x, 2.0 * time, epsilon = 1e-12);
        assert_relative_eq!(arm.rotation.angle(), time, epsilon = 1e-12);
    }
    assert_eq!(clip.sample(-1.0), clip.frames[0]);
    assert_eq!(clip.sample(9.0), clip.frames[30]);
    assert_eq!(clip.sample(7.0 / 30.0), clip.frames[7]);
}

/// A joint that turns about one axis after the other, ever faster, at 16 frames a second.
#[test]
fn turns_are_as_smooth_between_frames_as_over_them() {
    let truth = |time: f64| {
        let about = |axis: Vector3<f64>| UnitQuaternion::from_scaled_axis(axis);
        about(Vector3::z() * (3.0 * time).sin()) * about(Vector3::x() * (2.0 * time * time))
    };
    let mut clip = arm(33, 16.0);
    for (f, frame) in clip.frames.iter_mut().enumerate() {
        frame[1].rotation = truth(f as f64 / 16.0);
    }
    let at = |time: f64| clip.sample(time)[1].rotation;
    let between = (4..28).map(|f| (f64::from(f) + 0.5) / 16.0);
    let off = between.map(|time| at(time).angle_to(&truth(time)));
    let worst = off.fold(0.0, f64::max);
    assert!(worst < 2e-3, "{worst} rad");
    for f in 4..28 {
        let (time, step) = (f64::from(f) / 16.0, 1e-4);
        let before = at(time - step).inverse() * at(time);
        let after = at(time).inverse() * at(time + step);
        let jump = (after.scaled_axis() - before.scaled_axis()).norm() / step;
        assert!(jump < 0.02, "frame {f}: {jump} rad/s");
    }
}

/// A joint that sways once in a cycle of eight frames.
#[test]
fn a_cycle_is_as_smooth_over_its_seam() {
    let mut clip = arm(9, 8.0);
    for (f, frame) in clip.frames.iter_mut().enumerate() {
        let angle = (std::f64::consts::TAU * f as f64 / 8.0 + 0.7).sin();
        frame[1].rotation = UnitQuaternion::from_scaled_axis(Vector3::x() * angle);
    }
    let jump = |clip: &Clip| {
        let at = |time: f64| clip.sample(time)[1].rotation.scaled_axis().x;
        let step = 1e-4;
        (at(1.0) - at(1.0 - step) - (at(step) - at(0.0))).abs() / step
    };
    assert!(jump(&clip) < 0.02, "{} rad/s", jump(&clip));
    clip.loop_mode = LoopMode::Clamp;
    assert!(jump(&clip) > 0.02, "{} rad/s", jump(&clip));
}

#[test]
fn resampling_keeps_both_ends_and_the_loop() {
    let clip = arm(31, 30.0);
    let fast = clip.resample(120.0).expect("it resamples");
    assert_eq!(
        (fast.frames.len(), fast.fps, fast.loop_mode),
        (121, 120.0, LoopMode::Wrap)
    );
    assert_eq!(fast.frames[120], clip.frames[30]);
    assert_relative_eq!(
        fast.frames[33][1].rotation.angle(),
        33.0 / 120.0,
        epsilon = 1e-12
    );
    // Frames can't fall on both ends at 25.3 Hz; 25 Hz is the nearest rate at which they do.
    let odd = clip.resample(25.3).expect("it resamples");
    assert_eq!((odd.frames.len(), odd.fps), (26, 25.0));
    let back = fast.resample(30.0).expect("it resamples");
    assert_eq!(back.frames, clip.frames);
}

#[test]
fn trimming_takes_the_part_and_ends_the_loop() {
    let clip = arm(31, 30.0);
    let part = clip.trim(0.2, 0.5).expect("it trims");
    assert_eq!(
        (part.frames.len(), part.fps, part.loop_mode),
        (10, 30.0, LoopMode::Clamp)
    );
    assert_relative_eq!(part.frames[0][0].translation.x, 0.4, epsilon = 1e-12);
    assert_relative_eq!(part.frames[9][0].translation.x, 1.0, epsilon = 1e-12);
    assert_eq!(clip.trim(0.0, f64::INFINITY).expect("it trims"), clip);
    // A number that the clip doesn't reach is said once, and one that costs no frame not at all.
    for (from, to, said) in [
        (0.0, 99.0, 1),
        (0.3, 99.0, 1),
        (0.0, 1.01, 0),
        (0.3, 1.0, 0),
    ] {
        let part = clip.trim(from, to).expect("it trims");
        let again = part.trim(0.0, 99.0).expect("it trims");
        let count = |clip: &Clip| {
            clip.problems
                .iter()
                .filter(|p| p.id == "part-shortened")
                .count()
        };
        assert_eq!(count(&part), said, "{from}..{to}");
        assert!(count(&again) >= 1, "{from}..{to}");
    }
    assert!(clip.trim(1.5, 2.0).is_err());
    assert!(clip.trim(0.5, 0.2).is_err());
    assert!(clip.trim(f64::NAN, 1.0).is_err());
}

#[test]
fn rates_that_cannot_be_sampled_are_refused() {
    for fps in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
        assert!(arm(31, 30.0).resample(fps).is_err(), "{fps}");
    }
}

#[test]
fn no_span_is_sampled_faster_than_files_allow() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("part.clip");
    let clip = arm(31, 30.0);
    for (length, fps, frames) in [
        (0.0, 30.0, 1),
        (1e-5, 30.0, 1),
        (1.5e-4, 30.0, 2),
        (1.5e-4, 10_000.0, 2),
        (0.02, 30.0, 2),
    ] {
        let fast = Clip {
            fps,
            ..clip.clone()
        };
        let from = 0.5 * fast.duration();
        let part = fast.trim(from, from + length).expect("it trims");
        assert_eq!(part.frames.len(), frames, "{length} s at {fps} Hz");
        part.save(&path).expect("it is written");
        assert_eq!(Clip::load(&path).expect("it is read").fps, part.fps);
    }
}

#[test]
fn the_file_gives_the_clip_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("arm.clip");
    let clip = arm(31, 30.0);
    clip.save(&path).expect("it is written");
    let back = Clip::load(&path).expect("it is read");
    assert_eq!(back.source, clip.source);
    assert_eq!(back.problems, clip.problems);
    assert_eq!(
        (back.name.as_str(), back.fps, back.loop_mode),
        ("arm", 30.0, LoopMode::Wrap)
    );
    assert_eq!(back.joints, clip.joints);
    for (back, clip) in back
        .frames
        .iter()
        .flatten()
        .zip(clip.frames.iter().flatten())
    {
        assert_relative_eq!(back.to_homogeneous(), clip.to_homogeneous(), epsilon = 3e-7);
    }
    // Nothing else is left in the folder, and writing again gives the same bytes.
    let bytes = std::fs::read(&path).expect("bytes");
    clip.save(&path).expect("it is written again");
    assert_eq!(std::fs::read(&path).expect("bytes"), bytes);
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("a folder").count(),
        1
    );
}

#[test]
fn any_safetensors_reader_finds_the_named_tensors() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("arm.clip");
    arm(5, 30.0).save(&path).expect("it is written");
    let bytes = std::fs::read(&path).expect("bytes");
    let file = safetensors::SafeTensors::deserialize(&bytes).expect("safetensors");
    let shape = |name: &str| file.tensor(name).expect("a tensor").shape().to_vec();
    assert_eq!(shape("parent"), [2]);
    assert_eq!(shape("rest_translation"), [2, 3]);
    assert_eq!(shape("rest_rotation"), [2, 4]);
    assert_eq!(shape("local_translation"), [5, 2, 3]);
    assert_eq!(shape("local_rotation"), [5, 2, 4]);
    let first: Vec<u8> = [1.0f32, 0.0, 0.0, 0.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    assert_eq!(
        file.tensor("local_rotation").expect("a tensor").data()[..16],
        first
    );
}

/// The error of loading `bytes` as a clip file.
fn refusal(bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("broken.clip");
    std::fs::write(&path, bytes).expect("it is written");
    let error = Clip::load(&path).expect_err("refused").to_string();
    assert!(error.contains("broken.clip"), "{error}");
    error
}

fn saved(clip: &Clip) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("arm.clip");
    clip.save(&path).expect("it is written");
    std::fs::read(&path).expect("bytes")
}

/// The error of saving a clip that couldn't be loaded again.
fn unsaved(clip: &Clip) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("broken.clip");
    let error = clip.save(&path).expect_err("refused").to_string();
    assert!(!path.exists() && error.contains("broken.clip"), "{error}");
    error
}

/// Puts other text of the same length into a file's header.
fn replaced(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let at = bytes
        .windows(from.len())
        .position(|w| w == from.as_bytes())
        .expect("the text");
    let mut bytes = bytes.to_vec();
    bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
    bytes
}

#[test]
fn broken_clip_files_are_refused_with_a_reason() {
    let bytes = saved(&arm(5, 30.0));
    let cases = [
        (
            r#"\"version\":1"#,
            r#"\"version\":7"#,
            "written by a newer version of mimic (clip version 7",
        ),
        (
            r#"\"format\":\"clip\""#,
            r#"\"format\":\"clap\""#,
            "a clap file where a clip file is needed",
        ),
        (
            r#"\"fps\":30.0,\"joints\""#,
            r#"\"fps\":-3.0,\"joints\""#,
            "-3 is no frame rate",
        ),
        (
            r#"[\"root\",\"arm\"]"#,
            r#"[\"root arm xxx\"]"#,
            "tensor `parent` is I32 [2]",
        ),
        (
            r#""local_rotation""#,
            r#""local_rotatio_""#,
            "no tensor `local_rotation`",
        ),
        (r#""mimic""#, r#""mimik""#, "no key `mimic`"),
    ];
    for (from, to, reason) in cases {
        let error = refusal(&replaced(&bytes, from, to));
        assert!(error.contains(reason), "{error}");
    }
    assert!(refusal(b"").contains("safetensors"));
    let mut clip = arm(5, 30.0);
    clip.joints[0].parent = Some(1);
    assert!(unsaved(&clip).contains("joint 0 `root` has parent 1"));
    clip.joints[0].parent = None;
    clip.frames[3][1].translation.x = f64::NAN;
    assert!(unsaved(&clip).contains("element 21 is not a finite number"));
    clip.frames[3][1].translation.x = 0.0;
    clip.frames[2][0].rotation =
        UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(0.0, 0.0, 0.0, 0.0));
    assert!(unsaved(&clip).contains("rotation 4 is zero"));
    clip.frames.clear();
    assert!(unsaved(&clip).contains("0 frames"));
}

#[test]
fn bones_are_in_the_file_only_where_they_are_told() {
    let mut clip = arm(5, 30.0);
    let has_field = |bytes: &[u8]| bytes.windows(8).any(|word| word == b"humanoid");
    let bytes = saved(&clip);
    assert!(
        !has_field(&bytes),
        "files were written so before there were bones"
    );
    let back = Clip::from_bytes(&bytes).expect("it is read");
    assert_eq!(back.joints, clip.joints);
    clip.joints[1].bone = Some("leftUpperArm".to_owned());
    let bytes = saved(&clip);
    assert!(has_field(&bytes));
    let back = Clip::from_bytes(&bytes).expect("it is read");
    assert_eq!(back.joints, clip.joints);
    let bad = replaced(&bytes, r#"leftUpperArm\":1"#, r#"leftUpperArm\":2"#);
    assert!(refusal(&bad).contains("bone `leftUpperArm` is joint 2"));
}

#[test]
fn no_damage_to_a_clip_file_brings_the_reader_down() {
    let bytes = saved(&arm(5, 30.0));
    let mut state: u64 = 1;
    for round in 0..1500 {
        let mut damaged = bytes.clone();
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let at = (state >> 33) as usize % damaged.len();
        if round % 3 == 0 {
            damaged.truncate(at);
        } else {
            damaged[at] ^= 1 << (state >> 20 & 7);
        }
        if let Ok(clip) = Clip::from_bytes(&damaged) {
            assert!(
                clip.frames
                    .iter()
                    .all(|frame| frame.len() == clip.joints.len())
            );
        }
    }
}

#[test]
fn a_clip_that_cannot_be_written_leaves_the_old_one() {
    let error = arm(5, 30.0)
        .save(Path::new("/nowhere/at/all/a.clip"))
        .expect_err("refused");
    assert!(error.to_string().contains("/nowhere/at/all/a.clip"));
}
