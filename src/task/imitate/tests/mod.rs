//! Terms, observations and terminations against what they are by definition.

mod measures;
mod perturb;
mod reward;
mod transitions;
mod verdict;

use super::environment::Imitation;
use super::observe::{layout, observation_size, observe};
use super::*;
use crate::import;
use crate::retarget;
use crate::sim::LinkState;
use crate::skeleton::Skeleton;
use crate::task::dynamics::Masses;
use crate::task::follow::{ObservationInputs, Terminations, failure};
use crate::task::{
    EpisodeStart, Failure, Outcome, Perturbations, ReferenceState, StartState, TaskError, step,
};
use nalgebra::{Isometry3, Vector3};
use std::path::Path;

fn model() -> CharacterModel {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid loads");
    CharacterModel::new(skeleton).expect("the humanoid can be simulated")
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
    retarget::retarget(&clip, &model().skeleton, &Default::default())
        .expect("our own clip retargets")
        .motion
}

fn sample(time: f64) -> ReferenceState {
    let (model, motion) = (model(), motion("kick.fbx", None));
    let reference = Reference::new(&motion, &model).expect("a reference");
    let mut sample = reference.blank();
    reference.sample(time, &mut sample);
    sample
}

fn seen(
    kind: Observations,
    links: &[LinkState],
    next: &ReferenceState,
    contacts: &[bool],
) -> Vec<f32> {
    let model = model();
    let dynamics = Masses::new(&model.character).dynamics(links);
    let mut out = vec![f32::NAN; observation_size(kind, &model, contacts.len())];
    let last_action = vec![0.25; model.character.dof];
    let scene = ObservationInputs {
        links,
        dynamics: &dynamics,
        contacts,
        last_action: &last_action,
        next,
        ahead: &vec![next.clone(); kind.ahead().len()],
    };
    observe(kind, &model, &scene, &mut out);
    out
}

const ALL: [Observations; 4] = [
    Observations::Tracking,
    Observations::TrackingAhead,
    Observations::Deepmimic,
    Observations::Booth2020,
];

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
    elsewhere.anchor = by * next.anchor;
    for kind in ALL {
        let here = seen(kind, &now.links, &next, &now.contacts);
        let there = seen(kind, &moved(&now.links), &elsewhere, &now.contacts);
        for (i, (a, b)) in here.iter().zip(&there).enumerate() {
            assert!(
                (a - b).abs() < 1e-3,
                "number {i} of {kind:?} is {a} here and {b} there"
            );
        }
    }
}

fn block(kind: Observations, out: &[f32], name: &str) -> Vec<f32> {
    let blocks = layout(kind, &model(), 2);
    let before = blocks.iter().take_while(|b| b.name != name);
    let start: usize = before.map(|b| b.size).sum();
    let size = blocks.iter().find(|b| b.name == name).map(|b| b.size);
    out[start..start + size.expect("a block of that name")].to_vec()
}

/// The published states see bodies where they are: the head 0.46 m above the pelvis at rest, a spin as a spin.
#[test]
fn bodies_are_seen_where_they_are() {
    let (model, mut next) = (model(), sample(0.0));
    let rest = model.skeleton.forward(&model.skeleton.rest_qpos());
    let spin = Vector3::new(0.0, 0.0, 2.0);
    let links: Vec<LinkState> = model
        .character
        .links
        .iter()
        .map(|l| LinkState {
            pose: rest[l.body].cast(),
            linear: spin.cross(&rest[l.body].translation.vector.cast()),
            angular: spin,
        })
        .collect();
    next.anchor = Isometry3::identity();
    let head = model
        .skeleton
        .bodies
        .iter()
        .position(|b| b.name == "head")
        .expect("a head");
    let above = (rest[head].translation.vector - rest[0].translation.vector).cast::<f32>();
    let deep = seen(Observations::Deepmimic, &links, &next, &[true; 2]);
    let booth = seen(Observations::Booth2020, &links, &next, &[true; 2]);
    for (kind, out) in [
        (Observations::Deepmimic, &deep),
        (Observations::Booth2020, &booth),
    ] {
        let at = &block(kind, out, "body_position")[3 * head..3 * head + 3];
        assert!(
            (Vector3::from_column_slice(at) - above).norm() < 1e-6,
            "{kind:?}: {at:?}"
        );
    }
    let turns = block(Observations::Deepmimic, &deep, "body_angular_velocity");
    assert!(turns.chunks(3).all(|w| w == [0.0, 0.0, 2.0]), "{turns:?}");
    let axes = block(Observations::Deepmimic, &deep, "body_rotation");
    assert!(
        axes.chunks(6).all(|a| a == [1.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
        "{axes:?}"
    );
    // As one rigid body, nothing turns against the root.
    let turns = block(Observations::Booth2020, &booth, "body_angular_velocity");
    assert_eq!(turns[..3], [0.0, 0.0, 2.0]);
    assert!(turns[3..].iter().all(|w| *w == 0.0), "{turns:?}");
    let quaternions = block(Observations::Booth2020, &booth, "body_rotation");
    assert!(
        quaternions.chunks(4).all(|q| q == [1.0, 0.0, 0.0, 0.0]),
        "{quaternions:?}"
    );
    assert_eq!(
        block(Observations::Booth2020, &booth, "last_action"),
        [0.25; 28]
    );
    // It stands on both soles, heels and toes.
    assert_eq!(block(Observations::Booth2020, &booth, "sole"), [1.0; 6]);
    let up = Vector3::new(0.0, 0.0, 0.02);
    let mut raised = links;
    raised
        .iter_mut()
        .for_each(|l| l.pose.translation.vector += up);
    let booth = seen(Observations::Booth2020, &raised, &next, &[true; 2]);
    assert_eq!(block(Observations::Booth2020, &booth, "sole"), [0.0; 6]);
}

/// A looping walk goes on, and its policy sees the same in every cycle.
#[test]
fn what_is_seen_repeats_with_the_cycle() {
    let (model, motion) = (model(), motion("walk.glb", Some(LoopMode::Wrap)));
    let reference = Reference::new(&motion, &model).expect("a reference");
    let look = |kind, time| {
        let (mut now, mut next) = (reference.blank(), reference.blank());
        reference.sample(time, &mut now);
        reference.sample(time + 1.0 / 30.0, &mut next);
        seen(kind, &now.links, &next, &now.contacts)
    };
    for kind in ALL {
        let later = look(kind, 0.3 + 5.0 * reference.duration());
        for (i, (a, b)) in look(kind, 0.3).iter().zip(&later).enumerate() {
            assert!(
                (a - b).abs() < 2e-3,
                "number {i} of {kind:?} is {a}, then {b}"
            );
        }
    }
}

#[test]
fn an_agent_on_its_reference_sees_no_error() {
    let (model, now) = (model(), sample(0.4));
    let kind = Observations::Tracking;
    let out = seen(kind, &now.links, &now, &now.contacts);
    let mut at = 0;
    let mut errors = 0;
    for block in layout(kind, &model, now.contacts.len()) {
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
        let blocks = layout(kind, &model, now.contacts.len());
        let start: usize = blocks
            .iter()
            .take_while(|b| b.name != name)
            .map(|b| b.size)
            .sum();
        out[start..start + now.contacts.len()].to_vec()
    };
    assert_eq!(flags("contact"), flags("reference_contact"));
}

/// At the end of what is seen are the joints of 0.1 s and 0.3 s after the next control step, each between the root's place and
/// turn and the contacts.
#[test]
fn what_comes_is_seen() {
    let setting = ImitationSettings {
        observations: Observations::TrackingAhead,
        ..ImitationSettings::default()
    };
    let mut env = environment_of("kick.fbx", None, setting);
    env.reset(0.4);
    let mut out =
        vec![0.0; observation_size(Observations::TrackingAhead, &model(), env.touching().len())];
    env.observe(&mut out);
    let (dof, contacts) = (model().character.dof, env.touching().len());
    let size = 6 + dof + contacts;
    let coming = &out[out.len() - 2 * size..];
    for (moment, after) in coming.chunks(size).zip([0.1, 0.3]) {
        let then = sample(0.4 + setting.physics.control_dt() + after);
        let kind = Observations::Tracking;
        let there = seen(kind, &then.links, &then, &then.contacts);
        let turns = block(kind, &there, "joint_rotation");
        let apart = moment[6..6 + dof]
            .iter()
            .zip(&turns)
            .map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f32::max) < 1e-4, "{after}");
        let way =
            then.links[0].pose.translation.vector - env.world().states()[0].pose.translation.vector;
        let seen = Vector3::from_column_slice(&moment[..3]);
        assert!((seen.norm() - way.norm()).abs() < 1e-4, "{seen} {way}");
    }
}

#[test]
fn episodes_fail_by_distance_fall_or_reward() {
    let links = sample(0.4).links;
    let mut off = links.clone();
    off[2].pose.translation.vector.x += 0.6;
    // Two bodies that can touch the ground, and the first may.
    let (none, first, second) = ([false; 2], [true, false], [false, true]);
    let rules = Terminations {
        reward: Some(0.3),
        ..Terminations::default()
    };
    let judge = |agent: &[LinkState], touching: &[bool], reward| {
        failure(&rules, agent, &links, touching, &first, reward)
    };
    assert_eq!(judge(&links, &none, 0.9), None);
    assert_eq!(judge(&off, &none, 0.9), Some(Failure::Distance));
    assert_eq!(judge(&links, &second, 0.9), Some(Failure::Fall));
    assert_eq!(judge(&links, &first, 0.9), None);
    assert_eq!(judge(&links, &none, 0.2), Some(Failure::Reward));
}

fn environment(clip: &str, loop_mode: Option<LoopMode>, episode_s: f64) -> Imitation {
    environment_of(
        clip,
        loop_mode,
        ImitationSettings {
            episode_s,
            terminations: Terminations {
                distance: None,
                fall: false,
                reward: None,
            },
            ..ImitationSettings::default()
        },
    )
}

fn environment_of(
    clip: &str,
    loop_mode: Option<LoopMode>,
    setting: ImitationSettings,
) -> Imitation {
    let model = Arc::new(model());
    let reference = Reference::new(&motion(clip, loop_mode), &model).expect("a reference");
    Imitation::new(
        model,
        [Arc::new(reference)].into(),
        &setting,
        Purpose::Training,
    )
}

/// Zero for every coordinate.
fn no_action() -> Vec<f32> {
    vec![0.0; model().character.dof]
}

#[test]
fn a_time_limit_is_no_failure_and_comes_on_time() {
    let mut env = environment("walk.glb", Some(LoopMode::Wrap), 0.2);
    env.reset(0.3);
    assert_eq!(env.possible_steps(), 6.0);
    let action = no_action();
    let outcomes: Vec<Outcome> = (0..6).map(|_| step(&mut env, &action).outcome).collect();
    assert_eq!(outcomes[..5], [Outcome::Running; 5]);
    assert_eq!(outcomes[5], Outcome::TimeLimit);
}

#[test]
fn a_motion_that_ends_is_finished_at_its_end() {
    let mut env = environment("kick.fbx", Some(LoopMode::Clamp), 60.0);
    env.reset(0.0);
    let possible = env.possible_steps() as usize;
    let action = no_action();
    for _ in 1..possible {
        assert_eq!(step(&mut env, &action).outcome, Outcome::Running);
    }
    assert_eq!(step(&mut env, &action).outcome, Outcome::Finished);
}

#[test]
fn an_episode_starts_in_the_references_own_state() {
    let mut env = environment("walk.glb", Some(LoopMode::Wrap), 20.0);
    let (model, motion) = (model(), motion("walk.glb", Some(LoopMode::Wrap)));
    let reference = Reference::new(&motion, &model).expect("a reference");
    let mut sample = reference.blank();
    for time in [0.0, 0.417, 0.9] {
        env.reset(time);
        reference.sample(time, &mut sample);
        assert_eq!(env.world().states(), sample.links);
    }
}

#[test]
fn limbs_keep_their_length_between_the_frames_of_a_slow_clip() {
    let model = model();
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
    let reference = Reference::new(&slow, &model).expect("a reference");
    let mut sample = reference.blank();
    for step in 0..400 {
        reference.sample(reference.duration() * f64::from(step) / 400.0, &mut sample);
        for (link, state) in model.character.links.iter().zip(&sample.links) {
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

#[test]
fn an_episode_can_start_at_rest_where_the_motion_starts() {
    let mut env = environment("walk.glb", Some(LoopMode::Wrap), 20.0);
    env.reset_at_rest();
    let model = model();
    let poses: Vec<_> = env
        .world()
        .states()
        .iter()
        .map(|s| s.pose.cast::<f64>())
        .collect();
    let bodies = model.character.links.iter().zip(&poses);
    let lowest = bodies.flat_map(|(link, pose)| link.shapes.iter().map(|s| s.lowest(pose)));
    let lowest = lowest.fold(f64::INFINITY, f64::min);
    assert!(lowest.abs() < 1e-5, "{lowest} m above the ground");
    assert!(
        env.world()
            .states()
            .iter()
            .all(|s| s.linear.norm() == 0.0 && s.angular.norm() == 0.0)
    );
    let standing = model.contacts.iter().zip(env.touching());
    assert!(
        standing
            .into_iter()
            .all(|(contact, on)| contact.is_foot == *on)
    );
    let motion = motion("walk.glb", Some(LoopMode::Wrap));
    let first = Reference::new(&motion, &model)
        .expect("a reference")
        .blank();
    let apart =
        env.world().states()[0].pose.translation.vector - first.links[0].pose.translation.vector;
    assert!(apart.xy().norm() < 1e-4, "{apart:?}");
    let straight = env.world().states()[3]
        .pose
        .rotation
        .angle_to(&env.world().states()[0].pose.rotation);
    assert!(straight < 1e-5, "the rest pose has straight arms");
}

#[test]
fn a_case_that_the_task_lacks_is_an_error() {
    let mut env = environment("walk.glb", None, 20.0);
    let start = |case| EpisodeStart::new(case, StartState::Reference(0.0));
    env.start_at(&start(0)).expect("there is one");
    for case in [1, usize::MAX] {
        let error = env
            .start_at(&start(case))
            .expect_err("there is no such one");
        assert!(matches!(error, TaskError::NoSuchCase { number, cases: 1 } if number == case));
    }
}
