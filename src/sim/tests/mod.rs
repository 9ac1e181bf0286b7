/// What holds of both engines.
macro_rules! on_both_engines {
    ($($name:ident),* $(,)?) => {
        mod articulated {
            use super::*;
            $(#[test]
            fn $name() {
                super::$name(Settings { engine: Engine::Articulated, ..Settings::default() });
            })*
        }
        mod rapier {
            use super::*;
            $(#[test]
            fn $name() {
                super::$name(Settings { engine: Engine::Rapier, ..Settings::default() });
            })*
        }
    };
}

mod errors;
mod joints;
mod together;

use super::*;
use crate::skeleton::{GRAVITY, Skeleton};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

on_both_engines!(
    in_flight_gravity_alone_changes_momentum_while_limbs_move,
    a_reset_world_gives_the_bits_of_a_new_one,
    drives_without_a_target_hold_the_rest_pose,
    a_held_pose_stands_on_the_ground,
    every_built_in_character_stands_in_its_rest_pose,
    starting_inside_the_ground_adds_no_energy,
    a_sliding_box_stops_by_coulomb_friction,
    a_world_that_runs_away_is_told,
    a_push_is_a_change_of_momentum,
);

fn humanoid() -> Character {
    let skeleton = Skeleton::load("humanoid").expect("the built-in humanoid loads");
    Character::new(&skeleton).expect("the built-in humanoid can be simulated")
}

/// All links in the rest pose, the root at height `z`.
fn standing(character: &Character, z: f32) -> Vec<LinkState> {
    let mut states: Vec<LinkState> = Vec::new();
    for link in &character.links {
        let pose = match link.parent {
            None => {
                Isometry3::from_parts(Translation3::new(0.0, 0.0, z), UnitQuaternion::identity())
            }
            Some(p) => states[p].pose * link.rest.cast(),
        };
        states.push(LinkState {
            pose,
            linear: Vector3::zeros(),
            angular: Vector3::zeros(),
        });
    }
    states
}

/// Targets that hold the rest pose.
fn held(character: &Character) -> Vec<Target> {
    let hold = |joint: &LinkJoint| match joint {
        LinkJoint::Free => Target::Free,
        LinkJoint::Ball { .. } | LinkJoint::Hinges { .. } => {
            Target::Ball(UnitQuaternion::identity())
        }
        LinkJoint::Hinge { .. } => Target::Hinge(0.0),
    };
    character
        .links
        .iter()
        .map(|link| hold(&link.joint))
        .collect()
}

/// Linear momentum, and angular momentum about the centre of mass.
fn momenta(
    character: &Character,
    states: &[LinkState],
) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    let (mut mass, mut com, mut linear) = (0.0, Vector3::zeros(), Vector3::zeros());
    let mut parts = Vec::new();
    for (link, state) in character.links.iter().zip(states) {
        let pose = state.pose.cast::<f64>();
        let (v, w) = (state.linear.cast::<f64>(), state.angular.cast::<f64>());
        let arm = pose.rotation * link.com;
        let at = pose.translation.vector + arm;
        let velocity = v + w.cross(&arm);
        let spin = pose.rotation * (link.inertia * pose.rotation.inverse_transform_vector(&w));
        mass += link.mass;
        com += at * link.mass;
        linear += velocity * link.mass;
        parts.push((link.mass, at, velocity, spin));
    }
    com /= mass;
    let drift = linear / mass;
    let about = parts
        .iter()
        .map(|(m, at, v, spin)| spin + (at - com).cross(&(v - drift)) * *m)
        .sum();
    (linear, about, com)
}

/// Targets that swing every limb, different at every control step.
fn swinging(character: &Character, step: usize) -> Vec<Target> {
    let at = |i: usize| (step as f32 * 0.35 + i as f32).sin();
    let targets = character
        .links
        .iter()
        .enumerate()
        .map(|(i, link)| match link.joint {
            LinkJoint::Free => Target::Free,
            LinkJoint::Ball { .. } | LinkJoint::Hinges { .. } => {
                Target::Ball(UnitQuaternion::from_scaled_axis(Vector3::new(
                    0.5 * at(i),
                    0.8 * at(i + 3),
                    0.3 * at(i + 5),
                )))
            }
            LinkJoint::Hinge { .. } => Target::Hinge(0.8 + 0.6 * at(i)),
        });
    targets.collect()
}

fn in_flight_gravity_alone_changes_momentum_while_limbs_move(settings: Settings) {
    let character = humanoid();
    let mut world = World::new(&character, settings);
    let mut states = standing(&character, 50.0);
    // A somersault about an axis that is no principal one, about the centre of mass.
    let spin = Vector3::new(1.0, 4.0, 0.5);
    let (_, _, com) = momenta(&character, &states);
    for state in &mut states {
        state.angular = spin;
        state.linear = spin.cross(&(state.pose.translation.vector - com.cast()))
            + Vector3::new(1.0, -0.5, 5.0);
    }
    world.reset(&states);
    let mass: f64 = character.links.iter().map(|l| l.mass).sum();
    let (p0, l0, _) = momenta(&character, world.states());
    let steps = 30;
    let mut moved: f32 = 0.0;
    for step in 0..steps {
        world.set_targets(&swinging(&character, step));
        world.step().expect("free flight stays finite");
        let (a, b) = (&world.states()[0], &world.states()[1]);
        moved = moved.max(a.pose.rotation.angle_to(&b.pose.rotation));
        let t = (step + 1) as f64 / 30.0;
        let (p, l, _) = momenta(&character, world.states());
        let expected = p0 + Vector3::new(0.0, 0.0, -GRAVITY * mass * t);
        assert!(
            (p - expected).norm() < 1e-3 * p0.norm(),
            "linear momentum {p:?}, not {expected:?}, after {t} s"
        );
        assert!(
            (l - l0).norm() < 0.01 * l0.norm(),
            "angular momentum {l:?}, not {l0:?}, after {t} s"
        );
    }
    assert!(moved > 0.5, "the limbs hardly moved: {moved} rad");
}

fn a_reset_world_gives_the_bits_of_a_new_one(settings: Settings) {
    let character = humanoid();
    let states = standing(&character, 0.875);
    let play = |world: &mut World| -> Vec<LinkState> {
        world.reset(&states);
        for step in 0..40 {
            world.set_targets(&swinging(&character, step));
            world.step().expect("a falling humanoid stays finite");
        }
        world.states().to_vec()
    };
    let mut fresh = World::new(&character, settings);
    let first = play(&mut fresh);
    let mut used = World::new(&character, settings);
    used.reset(&standing(&character, 0.7));
    for step in 0..90 {
        used.set_targets(&swinging(&character, step * 7));
        used.step().expect("a falling humanoid stays finite");
    }
    assert_eq!(first, play(&mut used), "the reset remembers something");
    assert_eq!(
        first,
        play(&mut used),
        "the second reset differs from the first"
    );
}

/// Of every kind of joint that the built-in characters have: balls, single hinges, and several hinges of one body.
fn drives_without_a_target_hold_the_rest_pose(settings: Settings) {
    for name in Skeleton::built_in() {
        let skeleton = Skeleton::load(name).expect("a built-in character loads");
        let character = Character::new(&skeleton).expect("it can be simulated");
        let mut worlds = [(); 2].map(|()| World::new(&character, settings));
        worlds[1].set_targets(&held(&character));
        for world in &mut worlds {
            world.reset(&standing(&character, 50.0));
            for _ in 0..10 {
                world.step().expect("flight stays finite");
            }
        }
        assert_eq!(worlds[0].states(), worlds[1].states(), "{name}");
    }
}

fn a_held_pose_stands_on_the_ground(settings: Settings) {
    let character = humanoid();
    let mut world = World::new(&character, settings);
    let states = standing(&character, 0.8815);
    world.reset(&states);
    let hold = held(&character);
    world.set_targets(&hold);
    for _ in 0..10 {
        world.step().expect("standing stays finite");
    }
    let root = world.states()[0].pose.translation.vector;
    assert!(
        (root.z - 0.8815).abs() < 0.01,
        "the root sank or rose to {}",
        root.z
    );
    let standing: Vec<&str> = character
        .links
        .iter()
        .zip(world.contacts())
        .filter_map(|(l, c)| c.then_some(l.name.as_str()))
        .collect();
    assert_eq!(standing, ["right_foot", "left_foot"]);
}

fn every_built_in_character_stands_in_its_rest_pose(settings: Settings) {
    for (name, dof) in [("humanoid", 28), ("marathon", 21), ("robot", 23)] {
        let skeleton = Skeleton::load(name).expect("a built-in character loads");
        let character = Character::new(&skeleton).expect("it can be simulated");
        assert_eq!(character.dof, dof, "{name}");
        let mut rest = skeleton.rest_qpos();
        rest[2] -= skeleton.lowest_point(&skeleton.forward(&rest));
        let mut world = World::new(&character, settings);
        world.reset(&standing(&character, rest[2] as f32));
        let hold = held(&character);
        world.set_targets(&hold);
        for _ in 0..15 {
            world.step().expect("standing stays finite");
        }
        let root = world.states()[0].pose;
        assert!(
            (root.translation.z - rest[2] as f32).abs() < 0.02 && root.rotation.angle() < 0.1,
            "{name}: {root}"
        );
    }
}

fn starting_inside_the_ground_adds_no_energy(settings: Settings) {
    let character = humanoid();
    for depth in [0.03, 0.08] {
        let mut world = World::new(&character, settings);
        world.reset(&standing(&character, 0.8815 - depth));
        let hold = held(&character);
        world.set_targets(&hold);
        let mut highest: f32 = 0.0;
        for _ in 0..30 {
            world.step().expect("standing stays finite");
            highest = highest.max(world.states()[0].pose.translation.z);
        }
        assert!(
            highest < 0.8815 + 0.01,
            "{depth} m inside, and thrown up to {highest}"
        );
    }
}

#[test]
fn settings_say_the_physics_rate() {
    assert!((Settings::default().physics_hz() - 240.0).abs() < 1e-12);
}

fn a_sliding_box_stops_by_coulomb_friction(settings: Settings) {
    let friction = 0.5;
    let text = format!(
        r#"<mujoco><worldbody><body name="box"><freejoint/>
        <geom type="box" size="0.3 0.3 0.05" mass="5" friction="{friction}"/></body></worldbody></mujoco>"#
    );
    let skeleton = Skeleton::from_mjcf("box", &text, None).expect("the text is MJCF");
    let character = Character::new(&skeleton).expect("it can be simulated");
    let mut world = World::new(&character, settings);
    let mut states = standing(&character, 0.05);
    let speed = 2.0;
    states[0].linear = Vector3::new(1.2, -1.6, 0.0);
    world.reset(&states);
    for _ in 0..30 {
        world.step().expect("sliding stays finite");
    }
    let way = world.states()[0].pose.translation.vector.xy().norm();
    let expected = speed * speed / (2.0 * friction * GRAVITY as f32);
    assert!(
        (way - expected).abs() < 0.05 * expected,
        "slid {way} m, not v²/2μg = {expected} m"
    );
}

fn a_world_that_runs_away_is_told(settings: Settings) {
    let character = humanoid();
    let mut world = World::new(&character, settings);
    let mut states = standing(&character, 1.0);
    states[0].linear = Vector3::new(1e20, 0.0, 0.0);
    world.reset(&states);
    assert_eq!(world.step(), Err(Diverged));
    world.reset(&standing(&character, 1.0));
    assert_eq!(world.step(), Ok(()), "a reset world works again");
}

/// In flight an impulse is the change of the whole character's momentum, whatever its joints do with it; of twice the
/// mass the velocities change by half.
fn a_push_is_a_change_of_momentum(settings: Settings) {
    let character = humanoid();
    let states = standing(&character, 50.0);
    let impulse = Vector3::new(20.0, -10.0, 0.0);
    let pushed = |mass: f32| {
        let mut world = World::new(&character, settings);
        world.reset(&states);
        world.vary(mass, 1.0);
        world.set_targets(&held(&character));
        world.step().expect("free flight stays finite");
        let (before, _, _) = momenta(&character, world.states());
        world.push(1, impulse);
        world.step().expect("free flight stays finite");
        momenta(&character, world.states()).0 - before
    };
    for (mass, share) in [(1.0, 1.0), (2.0, 0.5)] {
        let change = pushed(mass);
        let expected = impulse.cast::<f64>() * share;
        assert!(
            (change.xy() - expected.xy()).norm() < 1e-3 * expected.norm(),
            "{change:?}, not {expected:?}, of {mass} times the mass"
        );
    }
    let mut world = World::new(&character, settings);
    world.vary(2.0, 0.3);
    world.reset(&states);
    world.set_targets(&held(&character));
    let mut fresh = World::new(&character, settings);
    fresh.reset(&states);
    fresh.set_targets(&held(&character));
    world.step().expect("it stays finite");
    fresh.step().expect("it stays finite");
    assert_eq!(world.states(), fresh.states(), "a reset forgets it");
}
