//! DeepMimic motions compared with a direct evaluation of the format's formulas, in its own axes (Y up, X forward).

use mimic::clip::LoopMode;
use mimic::import::{self, Options};
use mimic_test_support::foreign;
use nalgebra::Vector3;
use std::path::Path;

/// Clips hold single precision: metres of error in a figure of a few metres.
const SINGLE: f64 = 1e-6;

type Matrix = [[f64; 3]; 3];

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| (0..3).map(|k| a[r][k] * b[k][c]).sum()))
}

fn apply(a: &Matrix, v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|r| (0..3).map(|k| a[r][k] * v[k]).sum())
}

fn of_quaternion(q: &[f64]) -> Matrix {
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [w, x, y, z] = [0, 1, 2, 3].map(|i| q[i] / norm);
    [
        [
            1. - 2. * (y * y + z * z),
            2. * (x * y - w * z),
            2. * (x * z + w * y),
        ],
        [
            2. * (x * y + w * z),
            1. - 2. * (x * x + z * z),
            2. * (y * z - w * x),
        ],
        [
            2. * (x * z - w * y),
            2. * (y * z + w * x),
            1. - 2. * (x * x + y * y),
        ],
    ]
}

fn about_z(angle: f64) -> Matrix {
    let (s, c) = angle.sin_cos();
    [[c, -s, 0.], [s, c, 0.], [0., 0., 1.]]
}

/// Joint, parent and offset in the order of the character file; the number of coordinates follows from the name.
const TREE: [(&str, usize, [f64; 3]); 15] = [
    ("root", 0, [0.0, 0.0, 0.0]),
    ("chest", 0, [0.0, 0.236151, 0.0]),
    ("neck", 1, [0.0, 0.223894, 0.0]),
    ("right_hip", 0, [0.0, 0.0, 0.084887]),
    ("right_knee", 3, [0.0, -0.421546, 0.0]),
    ("right_ankle", 4, [0.0, -0.409870, 0.0]),
    ("right_shoulder", 1, [-0.02405, 0.24350, 0.18311]),
    ("right_elbow", 6, [0.0, -0.274788, 0.0]),
    ("right_wrist", 7, [0.0, -0.258947, 0.0]),
    ("left_hip", 0, [0.0, 0.0, -0.084887]),
    ("left_knee", 9, [0.0, -0.421546, 0.0]),
    ("left_ankle", 10, [0.0, -0.409870, 0.0]),
    ("left_shoulder", 1, [-0.02405, 0.24350, -0.18311]),
    ("left_elbow", 12, [0.0, -0.274788, 0.0]),
    ("left_wrist", 13, [0.0, -0.258947, 0.0]),
];

/// World positions of all joints for one row of the file.
fn evaluate(row: &[f64]) -> Vec<[f64; 3]> {
    let mut at = 4;
    let mut turns: Vec<Matrix> = Vec::new();
    let mut places: Vec<[f64; 3]> = Vec::new();
    for (j, (name, parent, offset)) in TREE.iter().enumerate() {
        let local = if name.ends_with("wrist") {
            about_z(0.0)
        } else if name.ends_with("knee") || name.ends_with("elbow") {
            at += 1;
            about_z(row[at - 1])
        } else {
            at += 4;
            of_quaternion(&row[at - 4..at])
        };
        if j == 0 {
            turns.push(local);
            places.push([row[1], row[2], row[3]]);
            continue;
        }
        let shift = apply(&turns[*parent], *offset);
        places.push(std::array::from_fn(|k| places[*parent][k] + shift[k]));
        turns.push(multiply(&turns[*parent], &local));
    }
    assert_eq!(at, row.len());
    places
}

fn rows(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).expect("the file opens");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    serde_json::from_value(json["Frames"].clone()).expect("rows of numbers")
}

#[test]
fn every_joint_of_every_frame_is_in_its_place() {
    for name in [
        "walk",
        "backflip",
        "kick",
        "cartwheel",
        "spin",
        "getup_faceup",
    ] {
        let Some(path) = foreign(&format!("deepmimic/humanoid3d_{name}.txt")) else {
            return;
        };
        let clip = import::load(&path, &Options::default()).expect("it imports");
        let rows = rows(&path);
        assert_eq!(clip.frames.len(), rows.len(), "{name}");
        for (f, row) in rows.iter().enumerate() {
            let world = clip.world(f);
            for (j, [x, y, z]) in evaluate(row).into_iter().enumerate() {
                let off = (world[j].translation.vector - Vector3::new(x, -z, y)).norm();
                assert!(off < 1e-4, "{name} frame {f} joint {}: {off} m", TREE[j].0);
            }
        }
    }
}

#[test]
fn rate_loop_and_rest_are_those_of_the_file() {
    let Some(walk) = foreign("deepmimic/humanoid3d_walk.txt") else {
        return;
    };
    let clip = import::load(&walk, &Options::default()).expect("it imports");
    assert_eq!((clip.fps, clip.loop_mode), (30.0, LoopMode::Wrap));
    assert!((clip.duration() - 38.0 * 0.033332).abs() < 1e-3);
    let rest = clip.rest_world();
    let left_ankle = clip
        .joints
        .iter()
        .position(|j| j.name == "left_ankle")
        .expect("a joint");
    let foot = rest[left_ankle].translation.vector - rest[0].translation.vector;
    assert!((foot - Vector3::new(0.0, 0.084887, -0.831416)).norm() < SINGLE);
    // The walk travels forward, and its knees bend backward.
    let travel = clip.world(38)[0].translation.vector - clip.world(0)[0].translation.vector;
    assert!(travel.x > 1.0 && travel.y.abs() < 0.2, "{travel}");
    assert!(clip.problems.is_empty(), "{:?}", clip.problems);
}

#[test]
fn knees_bend_backward_and_elbows_forward() {
    for name in ["walk", "run", "kick"] {
        let Some(path) = foreign(&format!("deepmimic/humanoid3d_{name}.txt")) else {
            return;
        };
        let clip = import::load(&path, &Options::default()).expect("it imports");
        let index = |name: &str| {
            clip.joints
                .iter()
                .position(|j| j.name == name)
                .expect("a joint")
        };
        for f in 0..clip.frames.len() {
            for side in ["left", "right"] {
                let world = clip.world(f);
                let forward_of = |upper: &str, lower: &str| {
                    let bend = world[index(&format!("{side}_{upper}"))].inverse_transform_point(
                        &world[index(&format!("{side}_{lower}"))]
                            .translation
                            .vector
                            .into(),
                    );
                    bend.x
                };
                assert!(
                    forward_of("hip", "ankle") < 1e-3,
                    "{name} frame {f} {side} knee"
                );
                assert!(
                    forward_of("shoulder", "wrist") > -1e-3,
                    "{name} frame {f} {side} elbow"
                );
            }
        }
    }
}

#[test]
fn other_rates_keep_both_ends() {
    let Some(kick) = foreign("deepmimic/humanoid3d_kick.txt") else {
        return;
    };
    let options = Options {
        fps: Some(60.0),
        ..Options::default()
    };
    let clip = import::load(&kick, &options).expect("it imports");
    let rows = rows(&kick);
    assert_eq!(clip.loop_mode, LoopMode::Clamp);
    assert_eq!(clip.frames.len(), 2 * rows.len() - 1);
    let last = evaluate(rows.last().expect("rows"));
    for (at, [x, y, z]) in clip.world(clip.frames.len() - 1).iter().zip(last) {
        assert!((at.translation.vector - Vector3::new(x, -z, y)).norm() < SINGLE);
    }
}

#[test]
fn dogs_and_characters_are_refused_with_a_reason() {
    for (name, reason) in [("dog3d_trot.txt", "dog"), ("humanoid3d.txt", "character")] {
        let Some(path) = foreign(&format!("deepmimic/{name}")) else {
            return;
        };
        let error = import::load(&path, &Options::default())
            .expect_err("refused")
            .to_string();
        assert!(error.contains(name) && error.contains(reason), "{error}");
    }
}

#[test]
fn broken_motions_are_refused_with_a_reason() {
    let row = |change: &dyn Fn(&mut Vec<f64>)| {
        let mut row = vec![0.0; 44];
        for (at, value) in [
            (0, 0.1),
            (4, 1.0),
            (8, 1.0),
            (12, 1.0),
            (16, 1.0),
            (21, 1.0),
        ] {
            row[at] = value;
        }
        for at in [25, 30, 35, 39] {
            row[at] = 1.0;
        }
        change(&mut row);
        serde_json::json!({ "Loop": "none", "Frames": [row.clone(), row] }).to_string()
    };
    let read = |text: &str| import::read(text.as_bytes(), "a.txt", None, &Options::default());
    let clip = read(&row(&|_| {})).expect("the row is sound");
    assert_eq!((clip.frames.len(), clip.fps), (2, 10.0));
    type Change<'a> = &'a dyn Fn(&mut Vec<f64>);
    let cases: [(Change<'_>, &str); 5] = [
        (&|row| row[0] = 0.0, "frame 0: it lasts 0 s"),
        (&|row| row[0] = -1.0, "frame 0: it lasts -1 s"),
        (&|row| row[12] = 0.0, "`neck`: its rotation is zero"),
        (&|row| row[1] = 1e300, "too large"),
        (&|row| row.truncate(43), "43 numbers"),
    ];
    for (change, reason) in cases {
        let error = read(&row(change)).expect_err(reason).to_string();
        assert!(error.contains(reason), "{error}");
    }
    assert!(read("{\"Frames\":[]}").is_err());
    assert!(read("{\"Frames\":[[1,2,\"x\"]]}").is_err());
}
