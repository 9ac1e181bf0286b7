//! Long trajectories are solved window by window.

use super::super::cost::LeastSquares;
use super::super::solver::Solver;
use super::super::weight;
use crate::humanoid::Slot;
use crate::motion::Cycle;
use crate::retarget::goals::{Goals, Keypoint, Orientation};
use crate::retarget::hinge_speed::HingeSpeeds;
use crate::retarget::model::Model;
use crate::retarget::tests::humanoid;
use nalgebra::{Isometry3, Vector3};
use std::f64::consts::TAU;

const FRAMES: usize = 200;
const TRAVEL: f64 = 0.01;

/// Goals that swing twice in the trajectory and travel, high above the ground, and guesses that swing less.
fn swinging(model: &Model) -> Goals {
    let skeleton = model.skeleton;
    let pose = |f: usize, size: f64| {
        let angle = 2.0 * TAU * f as f64 / FRAMES as f64;
        let wave = |i: usize| size * (angle + i as f64).sin();
        let mut step: Vec<f64> = (0..skeleton.nv).map(wave).collect();
        step[0] += TRAVEL * f as f64;
        step[2] += 2.0;
        let mut qpos = skeleton.rest_qpos();
        model.step(&mut qpos, &step);
        qpos
    };
    let bodies: Vec<usize> = skeleton.slots.values().copied().collect();
    let key = |b: &usize| Keypoint {
        slot: Slot::Hips,
        body: *b,
        weight: 1.0,
    };
    let turn = |b: &usize| Orientation {
        slot: Slot::Hips,
        body: *b,
        weight: 0.3,
    };
    let poses = |f: usize| -> Vec<Isometry3<f64>> {
        let poses = skeleton.forward(&pose(f, 0.3));
        bodies.iter().map(|b| poses[*b]).collect()
    };
    let places = |f: usize| poses(f).iter().map(|p| p.translation.vector).collect();
    let rotations = |f: usize| poses(f).iter().map(|p| p.rotation).collect();
    Goals {
        keypoints: bodies.iter().map(key).collect(),
        orientations: bodies.iter().map(turn).collect(),
        points: (0..FRAMES).map(places).collect(),
        rotations: (0..FRAMES).map(rotations).collect(),
        guess: (0..FRAMES).map(|f| pose(f, 0.2)).collect(),
        ankle_offsets: Vec::new(),
        speeds: HingeSpeeds::default(),
    }
}

/// Neighbouring windows share a second, after which a frame no longer feels what the other window didn't see.
#[test]
fn windows_give_what_one_solution_over_all_frames_gives() {
    let skeleton = humanoid();
    let mut model = Model::new(&skeleton);
    // These limbs swing through each other, and a search that can't please both ends before its end.
    model.pairs.clear();
    let goals = swinging(&model);
    let anchors = vec![Vec::new(); FRAMES];
    let problem = LeastSquares::new(&model, &goals, &anchors, 30.0);
    let ahead = Cycle {
        translation: Vector3::x() * TRAVEL * FRAMES as f64,
        heading: 0.0,
    };
    for cycle in [None, Some(&ahead)] {
        let solved = |longest: usize| {
            let mut frames = goals.guess.clone();
            let solver = Solver::new(&problem, cycle).with_windows_of(longest);
            solver.run(&mut frames, |_| ());
            frames
        };
        let mut apart = vec![0.0; skeleton.nv];
        for (f, (a, b)) in solved(FRAMES).iter().zip(&solved(120)).enumerate() {
            model.difference(a, b, &mut apart);
            let most = apart.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            assert!(most < 1e-3, "frame {f}: {most}");
        }
    }
}

/// An hour at 120 Hz takes no more memory for its equations than a minute.
#[test]
fn windows_cover_every_frame_and_are_bounded() {
    let skeleton = humanoid();
    let model = Model::new(&skeleton);
    let goals = swinging(&model);
    let problem = LeastSquares {
        model: &model,
        goals: &goals,
        anchors: &[],
        fps: 120.0,
        limit: weight::LIMIT,
        ground: weight::GROUND,
    };
    let still = Cycle::NONE;
    for total in [0, 1, 5, 2_000, 2_400, 3_600 * 120] {
        for cycle in [None, Some(&still)] {
            let mut seen = vec![0_u8; total];
            for window in Solver::new(&problem, cycle).windows(total) {
                // Two systems of a block and two bands of five, and a factor of three blocks and some padding.
                let n = skeleton.nv;
                let numbers = 2 * (n * n + 2 * 5 * n) + n * (3 * n + 8);
                assert!(window.count * numbers * 8 <= 64 << 20);
                window.frames().for_each(|f| seen[f] += 1);
            }
            assert!(seen.iter().all(|times| (1..4).contains(times)), "{total}");
        }
    }
}
