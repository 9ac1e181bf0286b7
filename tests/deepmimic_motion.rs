//! Tracks of recorded motions whose character has the humanoid's own proportions, so that no retargeting comes between.

use mimic::clip::LoopMode;
use mimic::motion::{Cycle, Draft, Motion};
use mimic::skeleton::{GRAVITY, Skeleton};
use mimic_test_support::foreign;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// The clips' bodies in order after the root, and whether their rotation is a hinge angle.
const JOINTS: [(&str, bool); 12] = [
    ("torso", false),
    ("head", false),
    ("right_thigh", false),
    ("right_shin", true),
    ("right_foot", false),
    ("right_upper_arm", false),
    ("right_lower_arm", true),
    ("left_thigh", false),
    ("left_shin", true),
    ("left_foot", false),
    ("left_upper_arm", false),
    ("left_lower_arm", true),
];

/// Y up and Z right to Z up and Y left.
fn rotation(q: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(q[0], q[1], -q[3], q[2]))
}

fn frame(skeleton: &Skeleton, row: &[f64], near: Option<&[f64]>) -> Vec<f64> {
    let position = Translation3::new(row[1], -row[3], row[2]);
    let root = Isometry3::from_parts(position, rotation(&row[4..8]));
    let mut rotations = vec![UnitQuaternion::identity(); skeleton.bodies.len()];
    let mut at = 8;
    for (name, hinge) in JOINTS {
        let body = skeleton.bodies.iter().position(|b| b.name == name);
        let body = body.unwrap_or_else(|| panic!("the humanoid has a body `{name}`"));
        rotations[body] = if hinge {
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -row[at])
        } else {
            rotation(&row[at..at + 4])
        };
        at += if hinge { 1 } else { 4 };
    }
    skeleton.rotations_to_qpos(&root, &rotations, near)
}

/// `None`, with a message, where the clip is not there.
fn motion(clip: &str) -> Option<(Skeleton, Motion)> {
    let path = foreign(&format!("deepmimic/humanoid3d_{clip}.txt"))?;
    let text = std::fs::read_to_string(path).expect("the clip can be read");
    let json: serde_json::Value = serde_json::from_str(&text).expect("the clip is JSON");
    let rows: Vec<Vec<f64>> = serde_json::from_value(json["Frames"].clone()).expect("has frames");
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid is valid");
    let mut qpos: Vec<Vec<f64>> = Vec::new();
    for row in &rows {
        qpos.push(frame(&skeleton, row, qpos.last().map(Vec::as_slice)));
    }
    let wrap = json["Loop"] == "wrap";
    let (first, last) = (&qpos[0], &qpos[qpos.len() - 1]);
    let travel = Vector3::new(last[0] - first[0], last[1] - first[1], 0.0);
    let feet = ["right_foot", "left_foot"];
    let body = |name: &str| skeleton.bodies.iter().position(|b| b.name == name);
    let draft = Draft {
        name: clip.into(),
        fps: 1.0 / rows[0][0],
        loop_mode: if wrap {
            LoopMode::Wrap
        } else {
            LoopMode::Clamp
        },
        cycle: Cycle {
            translation: if wrap { travel } else { Vector3::zeros() },
            heading: 0.0,
        },
        qpos,
        contact_bodies: feet.iter().filter_map(|n| body(n)).collect(),
        contact: None,
    };
    Some((skeleton.clone(), Motion::from_poses(&skeleton, draft)))
}

fn stance_share(motion: &Motion, foot: usize) -> f64 {
    let cycle = &motion.tracks.contact[1..];
    cycle.iter().filter(|row| row[foot]).count() as f64 / cycle.len() as f64
}

/// Residual force in body weights, per frame.
fn residual_force(skeleton: &Skeleton, motion: &Motion) -> Vec<f64> {
    let weight = skeleton.total_mass() * GRAVITY;
    let residuals = motion.tracks.root_wrench_residual.iter();
    residuals
        .map(|w| w.fixed_rows::<3>(0).norm() / weight)
        .collect()
}

/// People walk with each foot down for about 60 % of the stride, and never fly (Perry, Gait Analysis).
#[test]
fn a_walk_stands_as_people_do() {
    let Some((skeleton, walk)) = motion("walk") else {
        return;
    };
    for foot in 0..2 {
        let share = stance_share(&walk, foot);
        assert!((0.5..0.7).contains(&share), "foot {foot} stands {share}");
    }
    assert!(walk.tracks.contact.iter().all(|row| row[0] || row[1]));
    let residual = residual_force(&skeleton, &walk);
    let mean = residual.iter().sum::<f64>() / residual.len() as f64;
    assert!(
        mean < 0.1,
        "a recorded walk needs {mean} body weights of help"
    );
}

/// Runners fly twice per stride; each foot is down for less than half of it.
#[test]
fn a_run_flies() {
    for clip in ["run", "jog"] {
        let Some((_, run)) = motion(clip) else {
            return;
        };
        let flying = |row: &Vec<bool>| !row[0] && !row[1];
        assert!(run.tracks.contact.iter().filter(|r| flying(r)).count() >= 4);
        for foot in 0..2 {
            let share = stance_share(&run, foot);
            assert!(
                (0.1..0.45).contains(&share),
                "{clip}: foot {foot} stands {share}"
            );
        }
    }
}

/// Nothing but gravity acts in flight, so a recorded jump must be nearly ballistic there.
#[test]
fn a_jump_falls_freely() {
    let Some((skeleton, jump)) = motion("jump") else {
        return;
    };
    let residual = residual_force(&skeleton, &jump);
    let standing = |f: usize| jump.tracks.contact[f].iter().any(|c| *c);
    let reach = 6;
    let flight: Vec<f64> = (reach..residual.len() - reach)
        .filter(|&f| (f - reach..=f + reach).all(|g| !standing(g)))
        .map(|f| residual[f])
        .collect();
    assert!(flight.len() > 5);
    let mean = flight.iter().sum::<f64>() / flight.len() as f64;
    assert!(mean < 0.2, "{mean} body weights in flight");
}
