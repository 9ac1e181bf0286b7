//! What the cost counts, and how much.

use super::super::cost::LeastSquares;
use super::super::solver::Solver;
use super::super::window::Window;
use super::*;
use crate::humanoid::Slot;
use crate::import;
use crate::motion::Cycle;
use crate::retarget::anchor::Anchor;
use crate::retarget::goals::{Goals, Keypoint, Orientation};
use crate::retarget::hinge_speed::{HingeSpeeds, LimbDirections};
use crate::retarget::model::Model;
use crate::retarget::tests::{foreign_skeleton, humanoid, random};
use crate::retarget::{Options, input, pose, retarget};
use crate::skeleton::Skeleton;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Goals, anchors and coordinates at which every kind of residual is at work.
fn rough(skeleton: &Skeleton, count: usize) -> (Goals, Vec<Vec<Anchor>>, Vec<Vec<f64>>) {
    let mut random = random();
    let model = Model::new(skeleton);
    let mut wild = |size: f64| {
        let mut qpos = skeleton.rest_qpos();
        qpos[2] -= 0.1;
        let step: Vec<f64> = (0..skeleton.nv).map(|_| size * random()).collect();
        model.step(&mut qpos, &step);
        qpos
    };
    let frames: Vec<Vec<f64>> = (0..count).map(|_| wild(0.8)).collect();
    let guess: Vec<Vec<f64>> = (0..count).map(|_| wild(0.3)).collect();
    let bodies: Vec<usize> = skeleton.slots.values().copied().collect();
    let mut goals = Goals {
        keypoints: bodies
            .iter()
            .map(|b| Keypoint {
                slot: Slot::Hips,
                body: *b,
                weight: 0.7,
            })
            .collect(),
        orientations: bodies
            .iter()
            .map(|b| Orientation {
                slot: Slot::Hips,
                body: *b,
                weight: 0.2,
            })
            .collect(),
        points: guess
            .iter()
            .map(|q| {
                skeleton
                    .forward(q)
                    .iter()
                    .map(|b| b.translation.vector)
                    .collect()
            })
            .collect(),
        rotations: guess
            .iter()
            .map(|q| skeleton.forward(q).iter().map(|b| b.rotation).collect())
            .collect(),
        guess,
        ankle_offsets: Vec::new(),
        speeds: HingeSpeeds::default(),
    };
    goals.speeds = HingeSpeeds::new(&model, &vec![LimbDirections::default(); count], 30.0);
    let anchor = |point| Anchor {
        point,
        at: Vector3::new(0.1, 0.2, 0.0),
        weight: 0.6,
        hold: 0.6,
        is_level: point % 2 == 1,
    };
    (
        goals,
        vec![vec![anchor(3), anchor(model.contact_points.len() - 1)]; count],
        frames,
    )
}

#[test]
fn the_gradient_is_the_derivative_of_the_cost() {
    let marathon = Skeleton::load("marathon").expect("a built-in character");
    let mut skeletons = vec![humanoid(), marathon];
    skeletons.extend(foreign_skeleton("characters/mimickit_humanoid.xml"));
    let turning = Cycle {
        translation: Vector3::new(0.4, -0.2, 0.0),
        heading: 0.5,
    };
    for skeleton in &skeletons {
        let (goals, anchors, frames) = rough(skeleton, 6);
        let model = Model::new(skeleton);
        let problem = LeastSquares::new(&model, &goals, &anchors, 30.0);
        for (cycle, start, count) in [
            (None, 0, 6),
            (Some(&turning), 0, 6),
            (None, 2, 3),
            (Some(&turning), 4, 4),
        ] {
            let solver = Solver::new(&problem, cycle);
            let window = Window {
                start,
                count,
                total: 6,
                repeats: cycle.is_some(),
            };
            let (_, gradient) = solver.cost_and_gradient(&frames, window);
            for (place, f) in window.frames().enumerate() {
                for dof in 0..skeleton.nv {
                    let cost = |step: f64| {
                        let mut moved = frames.clone();
                        let mut tangent = vec![0.0; skeleton.nv];
                        tangent[dof] = step;
                        model.step(&mut moved[f], &tangent);
                        solver.cost_and_gradient(&moved, window).0
                    };
                    let slope = (cost(1e-6) - cost(-1e-6)) / 2e-6;
                    let found = gradient[place * skeleton.nv + dof];
                    let error = (slope - found).abs() / (1.0 + slope.abs());
                    assert!(
                        error < 1e-4,
                        "{} frame {f} dof {dof}: {slope} {found}",
                        skeleton.name
                    );
                }
            }
        }
    }
}

/// Mean distance of the left hand from its goal, metres, when it counts `weight` times; the goals ask for more than the
/// humanoid's proportions can give.
fn distance_of_hand(weight: f64) -> f64 {
    let skeleton = humanoid();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/clips/kick.fbx");
    let clip = import::load(file, &Default::default()).expect("our own clip reads");
    let input = input::prepare(&clip, &skeleton, &Options::default()).expect("it is a humanoid");
    let model = Model::new(&skeleton);
    let weights = BTreeMap::from([(Slot::LeftHand, weight)]);
    let posed = pose::pose(&input, &model, &weights).expect("it can be aligned");
    let mut goals = posed.goals;
    let hand = goals.keypoint(Slot::LeftHand).expect("a left hand");
    for (f, points) in goals.points.iter_mut().enumerate() {
        points[hand].z += 0.1 + 0.01 * f as f64 / clip.frames.len() as f64;
    }
    let fit = Fit {
        model: &model,
        anchors: &vec![Vec::new(); clip.frames.len()],
        cycle: None,
        fps: clip.fps,
        to_perform: false,
        progress: &|_| (),
    };
    let fitted = fit.run(goals.clone());
    let apart = fitted.frames.iter().zip(&goals.points).map(|(qpos, goal)| {
        let bodies = skeleton.forward(qpos);
        (bodies[goals.keypoints[hand].body].translation.vector - goal[hand]).norm()
    });
    apart.sum::<f64>() / fitted.frames.len() as f64
}

#[test]
fn what_counts_more_is_nearer() {
    let (little, usual, much) = (
        distance_of_hand(0.1),
        distance_of_hand(1.0),
        distance_of_hand(20.0),
    );
    assert!(
        much < 0.3 * usual && usual < 0.8 * little,
        "{much} {usual} {little}"
    );
}

#[test]
fn weights_out_of_range_are_refused() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/clips/kick.fbx");
    let clip = import::load(file, &Default::default()).expect("our own clip reads");
    for weight in [-1.0, 101.0, f64::NAN] {
        let options = Options {
            weights: BTreeMap::from([(Slot::Head, weight)]),
            ..Options::default()
        };
        let refused = retarget(&clip, &humanoid(), &options).expect_err("no such weight");
        assert!(refused.to_string().contains("`head`"), "{refused}");
    }
}
