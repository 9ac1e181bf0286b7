//! Measures of made-up episodes against what their definitions say.

use crate::sim::LinkState;
use crate::skeleton::Skeleton;
use crate::task::imitate::measures::measures;
use crate::task::{
    CharacterModel, Dynamics, Episode, EpisodeStart, Failure, Frame, Good, ReferenceState,
    StartState, TermValues,
};
use nalgebra::{Isometry3, Vector3};

fn model() -> CharacterModel {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid loads");
    CharacterModel::new(skeleton).expect("the humanoid can be simulated")
}

/// The humanoid in its rest pose.
fn standing(model: &CharacterModel) -> Vec<LinkState> {
    let (rest, still) = (model.skeleton.rest_qpos(), vec![0.0; model.skeleton.nv]);
    model.character.states(&model.skeleton, &rest, &still)
}

/// The numbers of both feet among the contact bodies of the model.
fn feet(model: &CharacterModel) -> Vec<usize> {
    let feet = (0..model.contacts.len()).filter(|c| model.contacts[*c].is_foot);
    feet.collect()
}

/// Ten frames at 10 Hz in which the agent stands on its reference; `change` says how frame `f` differs.
fn episode(model: &CharacterModel, change: impl Fn(usize, &mut Frame)) -> Episode {
    let links = standing(model);
    let frames = (0..10).map(|f| {
        let mut frame = Frame {
            time: f as f64 / 10.0,
            agent: links.clone(),
            reference: Some(ReferenceState {
                may_touch: Vec::new(),
                links: links.clone(),
                dynamics: Dynamics::default(),
                contacts: vec![true, true],
                phase: 0.0,
                anchor: Isometry3::identity(),
            }),
            dynamics: Dynamics::default(),
            contacts: vec![true, true],
            terms: TermValues::new(),
            reward: 1.0,
            push: None,
        };
        change(f, &mut frame);
        frame
    });
    let start = EpisodeStart::new(0, StartState::Reference(0.0));
    Episode {
        frames: frames.collect(),
        survived: 10,
        ..Episode::new(start, 10.0, 10)
    }
}

/// A measure by its name, of a reference whose largest angular momentum is 4 kg·m²/s.
fn measure(model: &CharacterModel, episodes: &[Episode], name: &str) -> f64 {
    let all = measures(model, &feet(model), 4.0, episodes);
    let found = all.iter().find(|measure| measure.name == name);
    found.expect("a measure of that name").value
}

fn close(found: f64, expected: f64, what: &str) {
    assert!(
        (found - expected).abs() < 1e-5 * expected.abs().max(1.0),
        "{what}: {found}, not {expected}"
    );
}

#[test]
fn an_agent_on_its_reference_makes_no_error() {
    let model = model();
    let perfect = [episode(&model, |_, _| ())];
    for measured in measures(&model, &feet(&model), 4.0, &perfect) {
        let expected = if measured.good == Good::High {
            1.0
        } else {
            0.0
        };
        assert_eq!(measured.value, expected, "{}", measured.name);
    }
}

#[test]
fn a_shift_is_a_global_error_and_no_local_one() {
    let model = model();
    let shifted = [episode(&model, |_, frame| {
        for link in &mut frame.agent {
            link.pose.translation.vector += Vector3::new(0.3, 0.0, -0.4);
        }
    })];
    close(
        measure(&model, &shifted, "mpjpe_global_mm"),
        500.0,
        "global",
    );
    let local = measure(&model, &shifted, "mpjpe_local_mm");
    assert!(local < 1e-3, "{local}");
    assert_eq!(measure(&model, &shifted, "success_max_0_25"), 0.0);
}

#[test]
fn one_body_off_counts_by_its_share_of_all_bodies() {
    let model = model();
    let head = model.character.links.iter().position(|l| l.name == "head");
    let head = head.expect("a head");
    let off = [episode(&model, |f, frame| {
        if f >= 5 {
            frame.agent[head].pose.translation.vector.y += 0.15;
            frame.agent[head].linear.z = 3.0;
        }
    })];
    let bodies = model.character.bodies.len() as f64;
    for name in ["mpjpe_global_mm", "mpjpe_local_mm"] {
        close(measure(&model, &off, name), 0.5 * 150.0 / bodies, name);
    }
    let links = model.character.links.len() as f64;
    let velocity = measure(&model, &off, "velocity_error_m_s");
    close(velocity, 0.5 * 3.0 / links, "velocity");
    assert_eq!(measure(&model, &off, "success_max_0_25"), 1.0);
}

#[test]
fn failures_cost_survival_success_and_return() {
    let model = model();
    let mut fallen = episode(&model, |_, _| ());
    fallen.frames.truncate(5);
    fallen.survived = 4;
    fallen.failure = Some(Failure::Fall);
    close(fallen.survival(), 0.4, "survival");
    close(fallen.normalized_return(), 0.5, "normalised return");
    let both = [episode(&model, |_, _| ()), fallen];
    close(measure(&model, &both, "success_mean_0_5"), 0.5, "success");
}

#[test]
fn contacts_count_by_foot_and_frame() {
    let model = model();
    // 20 wanted; 15 of them found, and none besides: P = 1, R = 0.75.
    let missed = [episode(&model, |f, frame| frame.contacts[0] = f >= 5)];
    close(measure(&model, &missed, "contact_f1"), 6.0 / 7.0, "F1");
}

#[test]
fn skate_is_the_speed_of_standing_soles() {
    let model = model();
    let feet = feet(&model);
    let links = [feet[0], feet[1]].map(|c| model.contacts[c].link);
    let sliding = [episode(&model, |_, frame| {
        frame.agent[links[0]].linear = Vector3::new(0.3, 0.4, 2.0);
        frame.agent[links[1]].linear.x = 9.0;
        frame.contacts[1] = false;
    })];
    close(measure(&model, &sliding, "foot_skate_m_s"), 0.5, "skate");
}

#[test]
fn momentum_and_turn_are_measured_against_the_references() {
    let model = model();
    let spinning = [episode(&model, |_, frame| {
        frame.dynamics.angular_momentum.y = 1.0;
        frame.dynamics.com.x = 0.02;
        frame.agent[0].angular.y = -4.5;
        let reference = frame.reference.as_mut().expect("a reference");
        reference.links[0].angular.y = -6.0;
    })];
    for (name, expected) in [
        ("angular_momentum_error", 0.25),
        ("com_error_m", 0.02),
        ("root_rotation_turned_rad", 4.5),
        ("root_rotation_reference_rad", 6.0),
    ] {
        close(measure(&model, &spinning, name), expected, name);
    }
}

/// An error is no share of nothing: where the reference hardly turns, it isn't defined.
#[test]
fn momentum_of_a_reference_that_never_turns_has_no_error() {
    let model = model();
    let turning = episode(&model, |_, frame| {
        frame.dynamics.angular_momentum = Vector3::new(0.0, 0.2, 0.0);
    });
    let error = |largest: f32| {
        let all = measures(
            &model,
            &feet(&model),
            largest,
            std::slice::from_ref(&turning),
        );
        let error = all.iter().find(|m| m.name == "angular_momentum_error");
        error.expect("it is measured").value
    };
    for largest in [0.0, 1e-6, 1e-4] {
        assert!(error(largest).is_nan(), "{largest}");
    }
    close(error(0.4), 0.5, "a turn beside a reference that turns");
}
