//! Terms, observations and terminations against what they are by definition.

use super::dynamics::Masses;
use super::observe::{layout, observation_size, observe};
use super::reward::{Terms, terms};
use super::terminate::failure;
use super::*;
use crate::clip::LoopMode;
use crate::import;
use crate::motion::Motion;
use crate::retarget;
use crate::sim::LinkState;
use crate::skeleton::Skeleton;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::path::Path;
use std::sync::Arc;

fn stage() -> Stage {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid loads");
    Stage::new(skeleton).expect("the humanoid can be simulated")
}

fn motion(clip: &str, loop_mode: Option<LoopMode>) -> Motion {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("clips")
        .join(clip);
    let options = import::Options {
        loop_mode,
        ..import::Options::default()
    };
    let clip = import::load(file, &options).expect("our own clip reads");
    retarget::retarget(&clip, &stage().skeleton, &Default::default())
        .expect("our own clip retargets")
        .motion
}

fn sample(time: f64) -> Sample {
    let (stage, motion) = (stage(), motion("kick.fbx", None));
    let reference = Reference::new(&motion, &stage).expect("a reference");
    let mut sample = reference.blank();
    reference.sample(time, &mut sample);
    sample
}

/// Terms of an agent that differs from its reference by `change`.
fn changed(change: impl Fn(&mut Vec<LinkState>)) -> Terms {
    let (stage, sample) = (stage(), sample(0.4));
    let masses = Masses::new(&stage.character);
    let mut agent = sample.links.clone();
    change(&mut agent);
    let dynamics = masses.dynamics(&agent);
    terms(
        &stage,
        (&agent, &dynamics),
        (&sample.links, &sample.dynamics),
    )
}

fn close(found: f32, expected: f64, what: &str) {
    assert!(
        (f64::from(found) - expected).abs() < 1e-4,
        "{what}: {found}, not {expected}"
    );
}

#[test]
fn a_perfect_agent_earns_everything() {
    let terms = changed(|_| ());
    for (name, value) in TERM_NAMES.iter().zip(terms.values()) {
        close(value, 1.0, name);
    }
    close(terms.total(&Rewards::default()), 1.0, "the reward");
}

#[test]
fn a_shift_costs_the_root_term_alone() {
    let shift = Vector3::new(0.1, -0.2, 0.05);
    let terms = changed(|links| {
        for link in links.iter_mut() {
            link.pose.translation.vector += shift;
        }
    });
    close(
        terms.root,
        (-10.0 * f64::from(shift.norm_squared())).exp(),
        "root",
    );
    for (name, value) in TERM_NAMES.iter().zip(terms.values()) {
        if *name != "root" {
            close(value, 1.0, name);
        }
    }
}

#[test]
fn a_drift_costs_the_velocities_of_root_and_centre() {
    let drift = Vector3::new(0.3, 0.0, -0.4);
    let terms = changed(|links| {
        for link in links.iter_mut() {
            link.linear += drift;
        }
    });
    close(terms.root_velocity, (-0.25_f64).exp(), "root velocity");
    close(terms.com, (-0.5_f64).exp(), "centre of mass");
    close(terms.angular_momentum, 1.0, "angular momentum");
    close(
        terms.pose * terms.position * terms.velocity,
        1.0,
        "the rest",
    );
}

#[test]
fn a_turned_head_costs_by_the_mean_over_joints() {
    let stage = stage();
    let head = |l: &crate::sim::Link| l.name == "head";
    let head = stage.character.links.iter().position(head).expect("a head");
    let terms = changed(|links| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.0, 0.4));
        links[head].pose.rotation *= turn;
        links[head].angular += Vector3::new(0.0, 2.0, 0.0);
    });
    let joints = (stage.character.links.len() - 1) as f64;
    close(terms.pose, (-6.0 * 0.25 / joints).exp(), "pose");
    close(terms.velocity, (-0.1 * 4.0 / joints).exp(), "velocity");
    close(terms.root * terms.position, 1.0, "root and position");
}

fn seen(links: &[LinkState], next: &Sample, contacts: &[bool]) -> Vec<f32> {
    let stage = stage();
    let dynamics = Masses::new(&stage.character).dynamics(links);
    let mut out = vec![f32::NAN; observation_size(&stage, contacts.len())];
    observe(&stage, links, &dynamics, contacts, next, &mut out);
    out
}

#[test]
fn what_is_seen_depends_neither_on_place_nor_on_heading() {
    let (now, next) = (sample(0.4), sample(0.45));
    let by = Isometry3::new(Vector3::new(3.0, -7.0, 0.0), Vector3::z() * 2.2);
    let moved = |links: &[LinkState]| -> Vec<LinkState> {
        let link = |l: &LinkState| LinkState {
            pose: by * l.pose,
            linear: by.rotation * l.linear,
            angular: by.rotation * l.angular,
        };
        links.iter().map(link).collect()
    };
    let mut elsewhere = next.clone();
    elsewhere.links = moved(&next.links);
    let here = seen(&now.links, &next, &now.contacts);
    let there = seen(&moved(&now.links), &elsewhere, &now.contacts);
    for (i, (a, b)) in here.iter().zip(&there).enumerate() {
        assert!((a - b).abs() < 1e-3, "number {i} is {a} here and {b} there");
    }
}

#[test]
fn an_agent_on_its_reference_sees_no_error() {
    let (stage, now) = (stage(), sample(0.4));
    let out = seen(&now.links, &now, &now.contacts);
    let mut at = 0;
    let mut errors = 0;
    for block in layout(&stage, now.contacts.len()) {
        let part = &out[at..at + block.size];
        at += block.size;
        assert!(part.iter().all(|x| x.is_finite()), "{}", block.name);
        if block.name.ends_with("_error") {
            errors += 1;
            let worst = part.iter().fold(0.0_f32, |w, x| w.max(x.abs()));
            assert!(worst < 2e-3, "{}: {worst}", block.name);
        }
    }
    assert_eq!((at, errors), (out.len(), 6));
    let flags = |name: &str| {
        let blocks = layout(&stage, now.contacts.len());
        let start: usize = blocks
            .iter()
            .take_while(|b| b.name != name)
            .map(|b| b.size)
            .sum();
        out[start..start + now.contacts.len()].to_vec()
    };
    assert_eq!(flags("contact"), flags("reference_contact"));
}

#[test]
fn episodes_fail_by_distance_fall_or_reward() {
    let links = sample(0.4).links;
    let mut off = links.clone();
    off[2].pose.translation.vector.x += 0.6;
    let none = vec![false; links.len()];
    let mut touching = none.clone();
    touching[0] = true;
    let rules = Terminations {
        reward: Some(0.3),
        ..Terminations::default()
    };
    let judge = |agent: &[LinkState], contacts: &[bool], allowed: &[usize], reward| {
        failure(&rules, agent, &links, contacts, allowed, reward)
    };
    assert_eq!(judge(&links, &none, &[], 0.9), None);
    assert_eq!(judge(&off, &none, &[], 0.9), Some(Failure::Distance));
    assert_eq!(judge(&links, &touching, &[1], 0.9), Some(Failure::Fall));
    assert_eq!(judge(&links, &touching, &[0], 0.9), None);
    assert_eq!(judge(&links, &none, &[], 0.2), Some(Failure::Reward));
}

fn environment(clip: &str, loop_mode: Option<LoopMode>, episode_s: f64) -> Imitate {
    let stage = Arc::new(stage());
    let reference = Reference::new(&motion(clip, loop_mode), &stage).expect("a reference");
    let setting = Setting {
        episode_s,
        terminations: Terminations {
            distance: 1e3,
            fall: false,
            reward: None,
        },
        ..Setting::default()
    };
    Imitate::new(stage, Arc::new(reference), &setting)
}

#[test]
fn a_time_limit_is_no_failure_and_comes_on_time() {
    let mut env = environment("walk.glb", Some(LoopMode::Wrap), 0.2);
    env.reset(0.3);
    assert_eq!(env.possible_steps(), 6.0);
    let action = vec![0.0; env.action_size()];
    let outcomes: Vec<Outcome> = (0..6).map(|_| env.step(&action).outcome).collect();
    assert_eq!(outcomes[..5], [Outcome::Running; 5]);
    assert_eq!(outcomes[5], Outcome::TimeLimit);
}

#[test]
fn a_motion_that_ends_is_finished_at_its_end() {
    let mut env = environment("kick.fbx", Some(LoopMode::Clamp), 60.0);
    env.reset(0.0);
    let possible = env.possible_steps() as usize;
    let action = vec![0.0; env.action_size()];
    for _ in 1..possible {
        assert_eq!(env.step(&action).outcome, Outcome::Running);
    }
    assert_eq!(env.step(&action).outcome, Outcome::Finished);
}

#[test]
fn an_episode_starts_in_the_references_own_state() {
    let mut env = environment("walk.glb", Some(LoopMode::Wrap), 20.0);
    let (stage, motion) = (stage(), motion("walk.glb", Some(LoopMode::Wrap)));
    let reference = Reference::new(&motion, &stage).expect("a reference");
    let mut sample = reference.blank();
    for time in [0.0, 0.417, 0.9] {
        env.reset(time);
        reference.sample(time, &mut sample);
        assert_eq!(env.states(), sample.links);
    }
}

#[test]
fn limbs_keep_their_length_between_the_frames_of_a_slow_clip() {
    let stage = stage();
    let mut slow = motion("kick.fbx", None);
    // Every fourth frame: about 8 Hz.
    let keep = |f: &usize| f.is_multiple_of(4);
    let qpos = (0..slow.qpos.len())
        .filter(keep)
        .map(|f| slow.qpos[f].clone());
    let qpos: Vec<_> = qpos.collect();
    let qvel = (0..slow.qvel.len())
        .filter(keep)
        .map(|f| slow.qvel[f].clone());
    slow.qvel = qvel.collect();
    let contact = (0..slow.tracks.contact.len()).filter(keep);
    slow.tracks.contact = contact.map(|f| slow.tracks.contact[f].clone()).collect();
    slow.qpos = qpos;
    slow.fps /= 4.0;
    slow.loop_mode = LoopMode::Clamp;
    let reference = Reference::new(&slow, &stage).expect("a reference");
    let mut sample = reference.blank();
    for step in 0..400 {
        reference.sample(reference.duration() * f64::from(step) / 400.0, &mut sample);
        for (link, state) in stage.character.links.iter().zip(&sample.links) {
            let Some(parent) = link.parent else { continue };
            let from = sample.links[parent].pose.translation.vector;
            let length = (state.pose.translation.vector - from).norm();
            let own = link.rest.translation.vector.norm() as f32;
            assert!(
                (length - own).abs() < 5e-4,
                "{} is {length} m from its parent, not {own}",
                link.name
            );
        }
    }
}
