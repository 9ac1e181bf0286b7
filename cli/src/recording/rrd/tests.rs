use super::*;
use crate::recording::content::{Actor, Curve, Shove, Side, parts};
use mimic::skeleton::Skeleton;
use nalgebra::{Isometry3, Vector3};

/// A character that stands and waves its coordinates about, twice: as reference and a little late as agent.
fn waving() -> Recording {
    let skeleton = Skeleton::load("humanoid").expect("a built-in skeleton loads");
    let fps = 30.0;
    let actor = |late: f64| {
        let poses: Vec<_> = (0..60)
            .map(|f| {
                let time = f64::from(f) / fps - late;
                let mut qpos = vec![0.0; skeleton.nq];
                for body in &skeleton.bodies {
                    for joint in &body.joints {
                        let (at, size) = (joint.qpos, joint.kind.nq());
                        match size {
                            7 => {
                                qpos[at] = 0.5 * time;
                                qpos[at + 2] = 0.9;
                                qpos[at + 3] = 1.0;
                            }
                            4 => {
                                let angle = 0.5 * (4.0 * time + at as f64).sin();
                                qpos[at] = (angle / 2.0).cos();
                                qpos[at + 2] = (angle / 2.0).sin();
                            }
                            _ => qpos[at] = -0.6 + 0.6 * (4.0 * time + at as f64).sin(),
                        }
                    }
                }
                skeleton.forward(&qpos)
            })
            .collect();
        let com = |f: &Vec<Isometry3<f64>>| f[0].translation.vector;
        Actor {
            com: poses.iter().map(com).collect(),
            angular_momentum: (0..60)
                .map(|f| Vector3::new(1.0, 4.0, 0.5) * (f64::from(f) * 0.13 - late).sin())
                .collect(),
            contact: (0..60).map(|f| vec![f % 30 < 15, f % 30 > 10]).collect(),
            poses,
        }
    };
    let foot = |name: &str| skeleton.bodies.iter().position(|b| b.name.contains(name));
    Recording {
        name: "waving".into(),
        fps,
        parts: parts(&skeleton),
        contact_parts: ["left_foot", "right_foot"]
            .into_iter()
            .filter_map(foot)
            .collect(),
        reference: actor(0.0),
        agent: Some(actor(0.1)),
        phase: (0..60).map(|f| f64::from(f) / 59.0).collect(),
        rewards: ["pose", "velocity", "hands and feet", "momentum"]
            .iter()
            .enumerate()
            .map(|(i, name)| Curve {
                name: (*name).into(),
                values: (0..60)
                    .map(|f| 0.8 + 0.2 * (f64::from(f) * 0.1 + i as f64).sin())
                    .collect(),
            })
            .collect(),
        beside: 0.0,
        failed_s: None,
        shoves: vec![Shove {
            at_s: 0.5,
            impulse: [20.0, -10.0, 0.0],
        }],
        trunk: 0,
    }
}

#[test]
fn a_recording_of_two_characters_is_written() {
    let bytes = bytes(&waving(), None).expect("the recording is made");
    assert_eq!(&bytes[..3], b"RRF");
    assert!(bytes.len() > 20_000, "{} bytes", bytes.len());
    if let Some(kept) = std::env::var_os("KEEP_RRD") {
        std::fs::write(kept, &bytes).expect("written");
    }
}

#[test]
fn limbs_know_their_side() {
    let skeleton = Skeleton::load("humanoid").expect("a built-in skeleton loads");
    for part in parts(&skeleton) {
        assert_eq!(
            part.side == Side::Left,
            part.name.contains("left"),
            "{}",
            part.name
        );
        assert_eq!(
            part.side == Side::Right,
            part.name.contains("right"),
            "{}",
            part.name
        );
    }
}

#[test]
fn capsules_point_from_end_to_end() {
    let (a, b) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.1, 0.2, -0.5));
    let reached = world::along(&a, &b) * nalgebra::Point3::new(0.0, 0.0, (b - a).norm());
    assert!((reached.coords - b).norm() < 1e-12);
}
