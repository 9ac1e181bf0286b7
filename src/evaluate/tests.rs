//! Metrics of made-up traces against what their definitions say.

use super::episode::{Frame, Start, Trace};
use super::{Failed, measure};
use crate::sim::LinkState;
use crate::skeleton::Skeleton;
use crate::task::{Dynamics, Failure, Sample, Stage, Terms};
use nalgebra::{Isometry3, Vector3};

fn stage() -> Stage {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid loads");
    Stage::new(skeleton).expect("the humanoid can be simulated")
}

/// The humanoid in its rest pose.
fn standing(stage: &Stage) -> Vec<LinkState> {
    let (rest, still) = (stage.skeleton.rest_qpos(), vec![0.0; stage.skeleton.nv]);
    stage.character.states(&stage.skeleton, &rest, &still)
}

fn feet(stage: &Stage) -> Vec<usize> {
    let foot = |name: &str| stage.character.links.iter().position(|l| l.name == name);
    vec![
        foot("left_foot").expect("a left foot"),
        foot("right_foot").expect("a right foot"),
    ]
}

/// Ten frames at 10 Hz in which the agent stands on its reference; `change` says how frame `f` differs.
fn trace(stage: &Stage, start: f64, change: impl Fn(usize, &mut Frame)) -> Trace {
    let links = standing(stage);
    let frames = (0..10).map(|f| {
        let mut frame = Frame {
            time: f as f64 / 10.0,
            agent: links.clone(),
            reference: Sample {
                links: links.clone(),
                dynamics: Dynamics::default(),
                contacts: vec![true, true],
                phase: 0.0,
                anchor: Isometry3::identity(),
            },
            dynamics: Dynamics::default(),
            contacts: vec![true, true],
            terms: Terms::default(),
            reward: 1.0,
            shove: None,
        };
        change(f, &mut frame);
        frame
    });
    Trace {
        start: Start::At(start),
        control_hz: 10.0,
        frames: frames.collect(),
        possible: 10,
        survived: 10,
        largest_momentum: 4.0,
        failure: None,
        contact_links: feet(stage),
    }
}

fn close(found: f64, expected: f64, what: &str) {
    assert!(
        (found - expected).abs() < 1e-5 * expected.abs().max(1.0),
        "{what}: {found}, not {expected}"
    );
}

#[test]
fn a_perfect_agent_has_no_error() {
    let stage = stage();
    let found = measure(&stage, &[trace(&stage, 0.0, |_, _| ())]);
    assert_eq!((found.episodes, found.survival), (1, 1.0));
    assert_eq!((found.success_mean_0_5, found.success_max_0_25), (1.0, 1.0));
    assert_eq!((found.contact_f1, found.normalized_return), (1.0, 1.0));
    for error in [
        found.mpjpe_global_mm,
        found.mpjpe_local_mm,
        found.velocity_error_m_s,
        found.com_error_m,
        found.angular_momentum_error,
        found.foot_skate_m_s,
        found.root_rotation_turned_rad,
    ] {
        assert_eq!(error, 0.0);
    }
}

#[test]
fn a_shift_is_a_global_error_and_no_local_one() {
    let stage = stage();
    let shifted = trace(&stage, 0.0, |_, frame| {
        for link in &mut frame.agent {
            link.pose.translation.vector += Vector3::new(0.3, 0.0, -0.4);
        }
    });
    let found = measure(&stage, &[shifted]);
    close(found.mpjpe_global_mm, 500.0, "global");
    assert!(found.mpjpe_local_mm < 1e-3, "{}", found.mpjpe_local_mm);
    assert_eq!(found.success_max_0_25, 0.0);
}

#[test]
fn one_body_off_counts_by_its_share_of_all_bodies() {
    let stage = stage();
    let head = stage.character.links.iter().position(|l| l.name == "head");
    let head = head.expect("a head");
    let off = trace(&stage, 0.0, |f, frame| {
        if f >= 5 {
            frame.agent[head].pose.translation.vector.y += 0.15;
            frame.agent[head].linear.z = 3.0;
        }
    });
    let found = measure(&stage, &[off]);
    let bodies = stage.character.bodies.len() as f64;
    close(found.mpjpe_global_mm, 0.5 * 150.0 / bodies, "global");
    close(found.mpjpe_local_mm, 0.5 * 150.0 / bodies, "local");
    let links = stage.character.links.len() as f64;
    close(found.velocity_error_m_s, 0.5 * 3.0 / links, "velocity");
    assert_eq!(found.success_max_0_25, 1.0);
}

#[test]
fn failures_cost_survival_and_success() {
    let stage = stage();
    let mut fallen = trace(&stage, 0.5, |_, _| ());
    fallen.frames.truncate(5);
    fallen.survived = 4;
    fallen.failure = Some(Failure::Fall);
    let found = measure(&stage, &[trace(&stage, 0.0, |_, _| ()), fallen]);
    close(found.survival, 0.7, "survival");
    close(found.survival_from_start, 1.0, "survival from the start");
    close(found.success_mean_0_5, 0.5, "success");
    close(found.normalized_return, 0.75, "normalised return");
    let failed = Failed {
        start: 0.5,
        survived_s: 0.4,
        failure: Failure::Fall,
    };
    assert_eq!(found.failures, [failed]);
}

#[test]
fn contacts_count_by_foot_and_frame() {
    let stage = stage();
    // 20 wanted; 15 of them found, and none besides: P = 1, R = 0.75.
    let missed = trace(&stage, 0.0, |f, frame| frame.contacts[0] = f >= 5);
    close(measure(&stage, &[missed]).contact_f1, 6.0 / 7.0, "F1");
}

#[test]
fn skate_is_the_speed_of_standing_soles() {
    let stage = stage();
    let feet = feet(&stage);
    let sliding = trace(&stage, 0.0, |_, frame| {
        frame.agent[feet[0]].linear = Vector3::new(0.3, 0.4, 2.0);
        frame.agent[feet[1]].linear.x = 9.0;
        frame.contacts[1] = false;
    });
    close(measure(&stage, &[sliding]).foot_skate_m_s, 0.5, "skate");
}

#[test]
fn momentum_and_turn_are_measured_against_the_references() {
    let stage = stage();
    let spinning = trace(&stage, 0.0, |_, frame| {
        frame.dynamics.angular_momentum.y = 1.0;
        frame.dynamics.com.x = 0.02;
        frame.reference.links[0].angular.y = -6.0;
        frame.agent[0].angular.y = -4.5;
    });
    let found = measure(&stage, &[spinning]);
    close(found.angular_momentum_error, 0.25, "angular momentum");
    close(found.com_error_m, 0.02, "centre of mass");
    close(found.root_rotation_turned_rad, 4.5, "turned");
    close(found.root_rotation_reference_rad, 6.0, "the reference");
}
