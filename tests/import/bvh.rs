//! BVH files compared with a direct evaluation of the format in plain matrices, and files made to be awkward.

use mimic::clip::Clip;
use mimic::import::{self, Options};
use mimic_test_support::foreign;
use std::path::Path;

pub(super) type Place = [f64; 3];
pub(super) type Matrix = [[f64; 3]; 3];

pub(super) fn times(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| (0..3).map(|k| a[r][k] * b[k][c]).sum()))
}

/// Rotation about axis 0, 1 or 2.
pub(super) fn about(axis: usize, degrees: f64) -> Matrix {
    let (s, c) = (degrees * std::f64::consts::PI / 180.0).sin_cos();
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut m = [[0.0; 3]; 3];
    m[axis][axis] = 1.0;
    (m[u][u], m[u][v], m[v][u], m[v][v]) = (c, -s, s, c);
    m
}

struct Joint {
    parent: Option<usize>,
    offset: Place,
    channels: Vec<String>,
}

/// World positions of all joints and end sites, frame by frame, in the file's axes and units.
pub(super) fn evaluate(text: &str) -> Vec<Vec<Place>> {
    let (tree, motion) = text.split_once("MOTION").expect("a motion");
    let words: Vec<&str> = tree.split_whitespace().collect();
    let (mut joints, mut open): (Vec<Joint>, Vec<usize>) = (Vec::new(), Vec::new());
    for (at, word) in words.iter().enumerate() {
        let number = |k: usize| -> f64 { words[at + k].parse().expect("a number") };
        match *word {
            "{" => {
                let (parent, channels) = (open.last().copied(), Vec::new());
                open.push(joints.len());
                joints.push(Joint {
                    parent,
                    offset: [0.0; 3],
                    channels,
                });
            }
            "}" => drop(open.pop()),
            "OFFSET" => {
                joints.last_mut().expect("a joint").offset = [number(1), number(2), number(3)];
            }
            "CHANNELS" => {
                let names = &words[at + 2..at + 2 + number(1) as usize];
                joints.last_mut().expect("a joint").channels =
                    names.iter().map(|n| n.to_string()).collect();
            }
            _ => {}
        }
    }
    let rows = motion
        .lines()
        .filter(|line| !line.contains(':') && !line.trim().is_empty());
    rows.map(|row| {
        let mut numbers = row
            .split_whitespace()
            .map(|w| w.parse::<f64>().expect("a number"));
        let mut turns: Vec<Matrix> = Vec::new();
        let mut places: Vec<Place> = Vec::new();
        for joint in &joints {
            let mut turn = about(0, 0.0);
            let mut offset = joint.offset;
            for channel in &joint.channels {
                let axis = "XYZ".find(&channel[..1]).expect("an axis");
                let number = numbers.next().expect("a number for each channel");
                if channel.ends_with("position") {
                    offset[axis] = number;
                } else {
                    turn = times(&turn, &about(axis, number));
                }
            }
            let (above, origin) = match joint.parent {
                Some(p) => (turns[p], places[p]),
                None => (about(0, 0.0), [0.0; 3]),
            };
            places.push(std::array::from_fn(|r| {
                origin[r] + (0..3).map(|k| above[r][k] * offset[k]).sum::<f64>()
            }));
            turns.push(times(&above, &turn));
        }
        places
    })
    .collect()
}

/// A position in a file's axes as forward, left and up, before the figure is turned to face forward.
fn upright(place: &Place, up: char) -> Place {
    let [x, y, z] = *place;
    match up {
        'y' => [z, x, y],
        _ => [-y, x, z],
    }
}

/// Checks that the clip has the file's positions, up to the unit and one turn about the vertical.
pub(super) fn agrees(clip: &Clip, expected: &[Vec<Place>], up: char, unit: f64, what: &str) {
    assert_eq!(clip.frames.len(), expected.len(), "{what}");
    let pairs: Vec<(Place, Place)> = (0..expected.len())
        .flat_map(|f| {
            let world = clip.world(f);
            assert_eq!(world.len(), expected[f].len(), "{what}");
            let found = world
                .iter()
                .map(|j| j.translation.vector.into())
                .collect::<Vec<Place>>();
            let wanted = expected[f].iter().map(|p| upright(p, up).map(|x| x * unit));
            found.into_iter().zip(wanted.collect::<Vec<_>>())
        })
        .collect();
    // The turn that brings the horizontal parts together best.
    let (mut dot, mut cross) = (0.0, 0.0);
    for (a, b) in &pairs {
        dot += a[0] * b[0] + a[1] * b[1];
        cross += a[1] * b[0] - a[0] * b[1];
    }
    let (s, c) = cross.atan2(dot).sin_cos();
    for (i, (a, b)) in pairs.iter().enumerate() {
        let turned = [c * b[0] - s * b[1], s * b[0] + c * b[1], b[2]];
        let off = (0..3)
            .map(|k| (a[k] - turned[k]).powi(2))
            .sum::<f64>()
            .sqrt();
        assert!(off < 1e-5, "{what}: place {i} is {a:?}, not {turned:?}");
    }
}

#[test]
fn every_joint_of_every_frame_is_in_its_place() {
    let cmu = 0.0254 / 0.45;
    for (name, up, unit) in [
        ("cmu/cmu_12_01_walk.bvh", 'y', cmu),
        ("cmu/jumping_jacks.bvh", 'y', cmu),
        ("poser-bvh/walk.bvh", 'y', 0.01),
        ("poser-bvh/boxing.bvh", 'y', 0.01),
        ("games105/walk_and_turn_left.bvh", 'y', 1.0),
        ("games105/run_forward.bvh", 'y', 1.0),
        ("makehuman/mh_walk1.bvh", 'z', 0.1),
    ] {
        let Some(path) = foreign(name) else { return };
        let text = std::fs::read_to_string(&path).expect("the file opens");
        let options = Options {
            trim: Some((0.0, f64::INFINITY)),
            ..Options::default()
        };
        let clip = import::load(&path, &options).expect("it imports");
        agrees(&clip, &evaluate(&text), up, unit, name);
    }
}

#[test]
fn rates_are_those_that_the_frame_times_stand_for() {
    for (name, fps) in [
        ("cmu/cmu_12_01_walk.bvh", 120.0),
        ("cmu/jumping_jacks.bvh", 30.0),
        ("games105/run_forward.bvh", 60.0),
        ("makehuman/mh_walk1.bvh", 24.0),
        ("poser-bvh/walk.bvh", 100.0 / 3.0),
    ] {
        let Some(path) = foreign(name) else { return };
        let clip = import::load(&path, &Options::default()).expect("it imports");
        assert!((clip.fps - fps).abs() < 1e-9, "{name}: {}", clip.fps);
    }
}

/// The same recording in its own format has as many frames, without a pose before them.
#[test]
fn a_pose_before_the_motion_is_left_out_unless_it_is_asked_for() {
    let Some(path) = foreign("cmu/01_01.bvh") else {
        return;
    };
    let Some(recording) = foreign("cmu/01_01.amc") else {
        return;
    };
    let text = std::fs::read_to_string(recording).expect("the file opens");
    let is_number = |line: &&str| line.trim().parse::<u32>().is_ok();
    let recorded = text.lines().filter(is_number).count();
    let frames = |trim| {
        let options = Options {
            trim,
            ..Options::default()
        };
        let clip = import::load(&path, &options).expect("it imports");
        let told = clip.problems.iter().any(|p| p.id == "first-frame-left-out");
        (clip.frames.len(), told)
    };
    assert_eq!(frames(None), (recorded, true));
    assert_eq!(frames(Some((0.0, f64::INFINITY))), (recorded + 1, false));
}

/// Two joints as few programs write them: no end site, position channels on a joint, an exponent, a decimal comma, an unusual
/// order of channels, a name of two words, and a header that counts three frames.
const AWKWARD: &str = "hierarchy\r\nRoot Hip Joint {\r\n offset 0 1e0 0\r\n channels 6 Yposition Xposition Zposition \
    Zrotation Xrotation Yrotation\r\n joint Tip\r\n {\r\n OFFSET 0 .5 0\r\n CHANNELS 4 xrotation Xposition Yposition \
    ZPOSITION\r\n }\r\n}\r\nMotion\r\nFrames: 3\r\nFrame Time: 0,04\r\n1 2 3 90 0 0 0 0 0,5 0\r\n\
    1 2 3 0 90 0 45 0 2.5E-1 0\r\n";

fn read(text: &str) -> Result<Clip, String> {
    let options = Options {
        unit_m: Some(1.0),
        ..Options::default()
    };
    import::read(text.as_bytes(), "a.bvh", None, &options).map_err(|e| e.to_string())
}

#[test]
fn awkward_files_are_read() {
    let clip = read(AWKWARD).expect("it imports");
    let names: Vec<&str> = clip.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(
        (names, clip.frames.len(), clip.fps),
        (vec!["Hip Joint", "Tip"], 2, 25.0)
    );
    assert!(clip.problems.iter().any(|p| p.id == "frame-count"));
    let place = |f: usize, j: usize| -> Place { clip.world(f)[j].translation.vector.into() };
    let near = |a: Place, b: Place| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    // x, y, z of the file are left, up and forward.
    assert!(near(place(0, 0), [3.0, 2.0, 1.0]));
    // A quarter turn about z carries up to the right.
    assert!(near(place(0, 1), [3.0, 1.5, 1.0]), "{:?}", place(0, 1));
    // A quarter turn about x carries up to forward.
    assert!(near(place(1, 1), [3.25, 2.0, 1.0]), "{:?}", place(1, 1));
}

#[test]
fn broken_files_are_refused_by_line() {
    for (from, to, line, says) in [
        ("offset 0 1e0 0", "offset 0 up 0", 3, "`up`"),
        ("xrotation Xposition", "wrotation Xposition", 8, "wrotation"),
        ("channels 6", "channels 7", 4, "7"),
        ("Frames: 3", "Frames: many", 12, "`many`"),
        ("Frames: 3", "Frames: -3", 12, "`-3`"),
        (" }\r\n}\r\nMotion", " }\r\nMotion", 10, "`Hip Joint`"),
        (
            " }\r\n}\r\nMotion",
            " }\r\nroot B {\r\n}\r\nMotion",
            10,
            "`Hip Joint`",
        ),
        (
            "ZPOSITION\r\n",
            "ZPOSITION\r\nCHANNELS 1 Zrotation\r\n",
            9,
            "CHANNELS",
        ),
        ("90 0 0 0 0 0,5 0", "90 0 0 0 0 0,5", 14, "9 numbers"),
        ("90 0 0 0 0 0,5 0", "90 0 0 0 0 0,5 0 0", 14, "11 numbers"),
        ("2.5E-1 0", "2.5E-1 0 0 0", 15, "12 numbers"),
        ("Frame Time:", "Frame Rate:", 13, "Rate"),
        ("0,5 0", "0,5 nan", 14, "nan"),
        (" joint Tip\r\n", " joint Tip\r\n}\r\n", 6, "`}`"),
    ] {
        let text = AWKWARD.replacen(from, to, 1);
        assert_ne!(text, AWKWARD, "{from}");
        let said = read(&text).expect_err(to);
        assert!(
            said.starts_with(&format!("`a.bvh`: line {line}: ")),
            "{said}"
        );
        assert!(said.contains(says), "{said}");
    }
}

#[test]
fn cut_files_are_refused_or_read_in_part() {
    for end in 0..AWKWARD.len() {
        if let Ok(clip) = read(&AWKWARD[..end]) {
            assert!(clip.frames.len() <= 2);
        }
    }
    let whole = AWKWARD.rfind("1 2 3").expect("a last row");
    let cut = read(&AWKWARD[..whole + 9]).expect("the frames before the cut");
    assert_eq!(cut.frames.len(), 1);
    assert!(cut.problems.iter().any(|p| p.id == "frame-cut"));
}

#[test]
fn figures_that_stand_along_another_axis_are_set_upright() {
    for (name, axis) in [
        ("makehuman/mh_walk1.bvh", "+Z"),
        ("cmu/cmu_12_01_walk.bvh", "+Y"),
        ("cmu/07_01_cmu.fbx", "+Y"),
        ("cmu/49_08_cmu.fbx", "+Y"),
        ("cmu/91_48.fbx", "+Y"),
        ("deepmimic/humanoid3d_getup_faceup.txt", "+Y"),
        ("mixamo/MarathonManBackflip.fbx", "+Y"),
    ] {
        let Some(path) = foreign(name) else { return };
        let clip = import::load(&path, &Options::default()).expect("it imports");
        assert_eq!(clip.source.up_axis, axis, "{name}");
        let corrected = clip.problems.iter().any(|p| p.id == "up-axis-corrected");
        assert_eq!(corrected, axis == "+Z", "{name}");
        let word = Options {
            up: Some("y".parse().expect("an axis")),
            ..Options::default()
        };
        let taken = import::load(Path::new(&path), &word).expect("it imports");
        assert_eq!(taken.source.up_axis, "+Y", "{name}: the option counts");
    }
}

/// Rows of `lengths` numbers under a header that counts `count` frames of four numbers.
fn rows(lengths: &[usize], count: &str) -> Result<Clip, String> {
    let numbers = |length: &usize| format!("{}\n", vec!["1"; *length].join(" "));
    let rows: String = lengths.iter().map(numbers).collect();
    read(&format!(
        "HIERARCHY\nROOT a\n{{\nOFFSET 0 0 0\nCHANNELS 4 Xposition Yposition Zposition Zrotation\n}}\nMOTION\nFrames: {count}\n\
        Frame Time: 0.04\n{rows}"
    ))
}

#[test]
fn rows_are_frames_or_are_refused() {
    let told = |clip: &Clip, id: &str| clip.problems.iter().any(|p| p.id == id);
    // Frames that share lines, or take several, are believed where the header counts them.
    for lengths in [&[4, 4, 4][..], &[12], &[8, 4], &[1; 12], &[2, 2, 3, 1, 4]] {
        let clip = rows(lengths, "3").expect("it imports");
        assert_eq!(clip.frames.len(), 3, "{lengths:?}");
        assert!(!told(&clip, "frame-count") && !told(&clip, "frame-cut"));
    }
    for (lengths, count, line) in [
        (&[6, 6, 6][..], "3", 10),
        (&[4, 3, 5], "4", 11),
        (&[4, 5, 4], "3", 11),
        (&[8, 8, 8], "3", 10),
        (&[2, 2, 2, 2], "4", 10),
        (&[4, 4, 6], "3", 12),
        (&[3], "1", 10),
    ] {
        let said = rows(lengths, count).expect_err("refused");
        assert!(
            said.contains(&format!("line {line}: this row has")),
            "{lengths:?}: {said}"
        );
    }
    for count in ["2", "4", "1000000000", "18446744073709551615"] {
        let clip = rows(&[4, 4, 4], count).expect("it imports");
        assert_eq!(clip.frames.len(), 3);
        assert!(told(&clip, "frame-count"), "{count}");
    }
    let cut = rows(&[4, 4, 1], "3").expect("it imports");
    assert!(cut.frames.len() == 2 && told(&cut, "frame-cut") && told(&cut, "frame-count"));
}

/// Old machines end lines with a carriage return alone.
#[test]
fn lines_may_end_in_carriage_returns() {
    let text = AWKWARD.replace("\r\n", "\r");
    assert_eq!(read(&text).expect("it imports").frames.len(), 2);
    let said = read(&text.replace("0,5 0", "0,5 nan")).expect_err("refused");
    assert!(said.contains("line 14"), "{said}");
}

/// The examples of others.
#[test]
fn known_faults_are_told_by_line() {
    let folder = "../cases/solid/bvh-";
    for (name, says) in [
        (
            "12-numbers-per-9-channel-row-read-as-4-frames",
            "line 19: this row has 12 numbers",
        ),
        (
            "missing-closing-brace-accepted",
            "line 15: the block of joint `Hips`",
        ),
    ] {
        let Some(path) = foreign(&format!("{folder}{name}.bvh")) else {
            return;
        };
        let said = import::load(path, &Options::default())
            .expect_err(name)
            .to_string();
        assert!(said.contains(says), "{said}");
    }
    let Some(path) = foreign(&format!("{folder}frames-1e9-misleading-message.bvh")) else {
        return;
    };
    let clip = import::load(path, &Options::default()).expect("it imports");
    let problem = clip.problems.iter().find(|p| p.id == "frame-count");
    assert!(problem.is_some_and(|p| p.message.contains("1000000000")));
}
