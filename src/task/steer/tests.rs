use super::gaits::Gaits;
use super::guide::Guide;
use super::role::{Role, Traits};
use super::space::apart;
use super::{Steer, SteerSettings};
use crate::import;
use crate::motion::Motion;
use crate::retarget::{Options, retarget};
use crate::sim::LinkState;
use crate::skeleton::Skeleton;
use crate::task::model::CharacterModel;
use crate::task::{
    EpisodeStart, Input, Outcome, Purpose, StartState, Task, TaskError, TaskSettings, Wish, step,
};
use nalgebra::{Isometry3, Point3, Vector2, Vector3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

const DT: f32 = 1.0 / 30.0;

fn humanoid() -> CharacterModel {
    let skeleton = Skeleton::load("humanoid").expect("the character loads");
    CharacterModel::new(skeleton).expect("it can be simulated")
}

/// Clips of ours on the character.
fn motions(model: &CharacterModel, names: &[&str]) -> Vec<Motion> {
    let one = |name: &&str| {
        let path = format!("clips/{name}");
        let clip = import::load(&path, &import::Options::default());
        let clip = clip.unwrap_or_else(|e| panic!("{name}: {e}"));
        let options = Options {
            to_perform: true,
            ..Options::default()
        };
        let made = retarget(&clip, &model.skeleton, &options);
        made.unwrap_or_else(|e| panic!("{name}: {e}")).motion
    };
    names.iter().map(one).collect()
}

/// An animated character that can stand and walk, and how its links are.
struct Animated {
    model: CharacterModel,
    guide: Guide,
    links: Vec<LinkState>,
}

impl Animated {
    fn new() -> Animated {
        let model = humanoid();
        let motions = motions(&model, &["idle.glb", "walk.glb"]);
        let gaits = Gaits::new(&motions, &model).expect("it stands and walks");
        let still = LinkState {
            pose: Isometry3::identity(),
            linear: Vector3::zeros(),
            angular: Vector3::zeros(),
        };
        Animated {
            guide: Guide::new(Arc::new(gaits)),
            links: vec![still; model.character.links.len()],
            model,
        }
    }

    /// Goes on with a wish for so many seconds; `look` sees every step.
    fn go(&mut self, wish: &Wish, seconds: f32, mut look: impl FnMut(&Self)) {
        for _ in 0..(seconds / DT).round() as usize {
            self.guide.advance(wish, DT, &mut self.links);
            look(self);
        }
    }

    fn place(&self) -> Vector2<f32> {
        self.links[0].pose.translation.vector.xy()
    }

    /// Where the root faces, radians.
    fn facing(&self) -> f32 {
        let ahead = self.links[0].pose.rotation * Vector3::x();
        ahead.y.atan2(ahead.x)
    }
}

fn walk(angle: f32, speed: f32) -> Wish {
    Wish {
        velocity: Vector2::new(angle.cos(), angle.sin()) * speed,
        facing: None,
    }
}

#[test]
fn what_a_motion_is_for_is_seen_in_it() {
    let model = humanoid();
    let found = motions(&model, &["idle.glb", "walk.glb", "kick.fbx"]);
    let traits: Vec<Traits> = found
        .iter()
        .map(|m| Traits::of(m, &model.skeleton))
        .collect();
    let roles: Vec<Role> = traits.iter().map(|found| found.role).collect();
    assert_eq!(roles, [Role::Idle, Role::Gait, Role::Extra]);
    // The walk goes forward at 1.2 m/s; the character's legs are as long as its own, to a tenth.
    let velocity = traits[1].velocity;
    assert!((velocity.norm() - 1.2).abs() < 0.12, "{velocity}");
    assert_eq!(Role::direction_name(&velocity), "forward");
    assert_eq!(Role::direction_name(&-velocity), "backward");
    assert_eq!(Role::direction_name(&Vector2::y()), "left");
    assert_eq!(Role::direction_name(&-Vector2::y()), "right");
}

#[test]
fn it_goes_and_faces_where_it_is_asked_to() {
    let mut animated = Animated::new();
    for n in 0..8 {
        let angle = TAU * n as f32 / 8.0;
        let wish = walk(angle, 1.0);
        animated.go(&wish, 3.0, |_| {});
        let before = animated.place();
        // Two cycles and more: sway evens out.
        animated.go(&wish, 3.0, |_| {});
        let velocity = (animated.place() - before) / 3.0;
        assert!((velocity - wish.velocity).norm() < 0.03, "{n}: {velocity}");
        let off = apart(animated.facing(), angle);
        assert!(off.abs() < 0.15, "{n}: {off} rad");
    }
}

#[test]
fn it_answers_within_a_step_and_turns_within_three() {
    let mut animated = Animated::new();
    animated.go(&walk(0.3, 0.0), 1.0, |_| {});
    let (mut steps, mut risen) = (0, None);
    animated.go(&walk(0.3, 1.2), 3.0, |now| {
        steps += 1;
        let along = now.guide.velocity().norm() / 1.2;
        risen = risen.or((along >= 0.63).then_some(steps));
    });
    let rise = risen.map_or(f32::INFINITY, |steps| steps as f32 * DT);
    assert!(rise < 0.6, "{rise} s");
    let (mut steps, mut turned) = (0, None);
    animated.go(&walk(0.3 + PI, 1.2), 3.0, |now| {
        steps += 1;
        let velocity = now.guide.velocity();
        let off = apart(velocity.y.atan2(velocity.x), 0.3 + PI);
        let there = off.abs() < 0.35 && apart(now.facing(), 0.3 + PI).abs() < 0.35;
        turned = turned.or(there.then_some(steps));
    });
    let turn = turned.map_or(f32::INFINITY, |steps| steps as f32 * DT);
    assert!(turn < 1.5, "{turn} s");
}

#[test]
fn it_faces_its_own_way() {
    let mut animated = Animated::new();
    let sideways = Wish {
        facing: Some(FRAC_PI_2),
        ..walk(0.0, 0.5)
    };
    animated.go(&sideways, 4.0, |_| {});
    let off = apart(animated.facing(), FRAC_PI_2);
    let velocity = animated.guide.velocity();
    assert!(off.abs() < 0.2, "{off} rad");
    assert!((velocity - sideways.velocity).norm() < 0.02, "{velocity}");
}

/// Standing feet stay where they are, through starts, turns and stops; and nothing sinks into the ground.
#[test]
fn standing_feet_stay_where_they_are() {
    let mut animated = Animated::new();
    let soles = animated.model.soles.clone();
    let place =
        |links: &[LinkState], k: usize| links[soles[k].link].pose * Point3::from(soles[k].center);
    let (mut slid, mut stood, mut lowest) = (0.0_f32, 0, 0.0_f32);
    let mut before = (animated.links.clone(), [false; 2]);
    for wish in [
        walk(0.0, 0.0),
        walk(0.0, 1.2),
        walk(2.0, 0.7),
        walk(-1.5, 1.2),
        walk(0.0, 0.0),
    ] {
        animated.go(&wish, 3.0, |now| {
            let stands = now.guide.stands();
            for (foot, now_stands) in stands.into_iter().enumerate() {
                let points = 3 * foot..3 * foot + 3;
                let height = |k: &usize| place(&now.links, *k).z - soles[*k].radius;
                let low = points.min_by(|a, b| height(a).total_cmp(&height(b)));
                let low = low.expect("three points");
                lowest = lowest.min(height(&low));
                if now_stands && before.1[foot] {
                    stood += 1;
                    slid += (place(&now.links, low) - place(&before.0, low)).xy().norm();
                }
            }
            before = (now.links.clone(), stands);
        });
    }
    let speed = slid / (stood as f32 * DT);
    assert!(stood > 300 && speed < 0.04, "{speed} m/s");
    assert!(lowest > -0.02, "{lowest} m");
}

#[test]
fn it_stands_still_after_a_walk() {
    let mut animated = Animated::new();
    animated.go(&walk(1.0, 1.2), 3.3, |_| {});
    animated.go(&walk(1.0, 0.0), 4.0, |_| {});
    assert_eq!(animated.guide.stands(), [true; 2]);
    let feet: Vec<usize> = animated.model.soles.iter().map(|p| p.link).collect();
    let places = |links: &[LinkState]| -> Vec<_> {
        feet.iter()
            .map(|f| links[*f].pose.translation.vector)
            .collect()
    };
    let first = places(&animated.links);
    animated.go(&walk(1.0, 0.0), 10.0, |now| {
        let moved = places(&now.links)
            .iter()
            .zip(&first)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f32::max);
        assert!(moved < 2e-3, "{moved} m");
    });
}

#[test]
fn the_same_wishes_give_the_same_bits() {
    let run = || {
        let mut animated = Animated::new();
        animated.go(&walk(2.0, 1.0), 2.0, |_| {});
        animated.go(&walk(-2.0, 0.4), 2.0, |_| {});
        animated
            .links
            .iter()
            .map(|l| l.pose.translation.vector)
            .collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[test]
fn who_cannot_stand_or_walk_cannot_be_steered() {
    let model = Arc::new(humanoid());
    let refused = |names: &[&str]| {
        let made = Steer::new(
            model.clone(),
            &motions(&model, names),
            SteerSettings::default(),
        );
        made.err().expect("refused")
    };
    assert!(matches!(refused(&["walk.glb"]), TaskError::NoStanding));
    assert!(matches!(
        refused(&["idle.glb", "kick.fbx"]),
        TaskError::NoGait
    ));
}

fn task() -> Arc<dyn Task> {
    let model = Arc::new(humanoid());
    let motions = motions(&model, &["idle.glb", "walk.glb"]);
    let made = Steer::new(model, &motions, SteerSettings::default());
    Arc::new(made.unwrap_or_else(|e| panic!("{e}")))
}

/// Who does nothing but what the animated character does stands, and earns nearly all there is.
#[test]
fn an_agent_on_its_reference_is_rewarded() {
    let task = task();
    let mut environment = task.environment(Purpose::Performance);
    let start = EpisodeStart::new(0, StartState::Reference(0.0));
    environment.start_at(&start).expect("it starts");
    environment
        .input(Input::Wish(Wish::default()))
        .expect("it can be steered");
    let action = vec![0.0; crate::task::size(task.action())];
    for _ in 0..10 {
        let step = step(environment.as_mut(), &action);
        assert!(
            step.reward > 0.9 && step.outcome == Outcome::Running,
            "{step:?}"
        );
    }
    let mut seen = vec![0.0; crate::task::size(task.observation())];
    environment.observe(&mut seen);
    assert!(seen.iter().all(|value| value.is_finite()));
}

/// What is asked for is what the environment says that it was asked for.
#[test]
fn a_wish_is_taken_and_another_task_takes_none() {
    let task = task();
    let mut environment = task.environment(Purpose::Performance);
    let wish = walk(1.0, 1.0);
    environment
        .input(Input::Wish(wish))
        .expect("it can be steered");
    assert_eq!(environment.wish(), Some(wish));
    let refused = environment.input(Input::Case(1));
    assert!(matches!(refused, Err(TaskError::NoSuchCase { .. })));
}

#[test]
fn settings_are_read_wherever_their_name_stands() {
    let read = |text: &str| serde_json::from_str::<TaskSettings>(text);
    let steer = TaskSettings::Steer(SteerSettings {
        leash_m: 0.5,
        ..SteerSettings::default()
    });
    for text in [
        r#"{"kind": "steer", "leash_m": 0.5}"#,
        r#"{"leash_m": 0.5, "kind": "steer"}"#,
    ] {
        assert_eq!(read(text).expect("settings"), steer, "{text}");
    }
    let whole = serde_json::to_string(&steer).expect("JSON");
    assert_eq!(read(&whole).expect("settings"), steer);
    for wrong in [
        r#"{"leash_m": 0.5}"#,
        r#"{"kind": "steer", "cycles_follow": true}"#,
        r#"{"kind": "swim"}"#,
    ] {
        assert!(read(wrong).is_err(), "{wrong}");
    }
    let none: TaskSettings = read(r#"{"transitions_s": null}"#).expect("settings");
    assert_eq!(none, TaskSettings::default());
}
