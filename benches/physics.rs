//! Physics steps a second of one core: our engine with one character and with eight at once, and rapier, the same
//! characters doing the same, in turn.
//!
//! `cargo bench -p mimic --bench physics [SKELETON]`; `benches/mujoco_physics.py` measures MuJoCo at the same.

use mimic::sim::{Character, Engine, LANES, LinkJoint, LinkState, Settings, Target, World};
use mimic::skeleton::Skeleton;
use nalgebra::{UnitQuaternion, Vector3};
use std::time::Instant;

const ROUNDS: usize = 7;

fn main() {
    let named = std::env::args().skip(1).find(|a| !a.starts_with('-'));
    let name = named.unwrap_or_else(|| "humanoid".to_owned());
    let skeleton = Skeleton::load(&name).expect("a skeleton by name or file");
    let character = Character::new(&skeleton).expect("it can be simulated");
    let mut rest = skeleton.rest_qpos();
    rest[2] -= skeleton.lowest_point(&skeleton.forward(&rest));
    let start = character.states(&skeleton, &rest, &vec![0.0; skeleton.nv]);
    println!("{name}: thousands of physics steps a second, median of {ROUNDS}");
    for (what, lift, swing) in [
        ("stands", 0.0, 0.0),
        ("flails on the ground", 0.0, 1.0),
        ("flails in the air", 50.0, 1.0),
    ] {
        let cases = [
            (Engine::Articulated, 1),
            (Engine::Articulated, LANES),
            (Engine::Rapier, 1),
        ];
        let mut rates = [const { Vec::new() }; 3];
        for _ in 0..ROUNDS {
            for (case, rates) in cases.into_iter().zip(&mut rates) {
                rates.push(rate(&character, &start, case, (lift, swing)));
            }
        }
        let [one, eight, rapier] = rates.map(|mut rates| {
            rates.sort_by(f64::total_cmp);
            rates[rates.len() / 2]
        });
        println!(
            "{what:>22}: articulated {one:6.1}, {LANES} at once {eight:6.1}, rapier {rapier:6.1}; to rapier {:.2}, {:.2}",
            one / rapier,
            eight / rapier
        );
    }
}

/// Of `count` characters, each a moment later in its movement than the one before.
fn rate(
    character: &Character,
    start: &[LinkState],
    (engine, count): (Engine, usize),
    (lift, swing): (f32, f32),
) -> f64 {
    let settings = Settings {
        engine,
        ..Settings::default()
    };
    let new = |_| World::new(character, settings);
    let mut worlds: Vec<World> = (0..count).map(new).collect();
    let mut results = vec![Ok(()); count];
    let mut start = start.to_vec();
    for state in &mut start {
        state.pose.translation.z += lift;
    }
    let (seconds, episodes) = (60, 10);
    let began = Instant::now();
    for _ in 0..episodes {
        worlds.iter_mut().for_each(|world| world.reset(&start));
        let mut all: Vec<&mut World> = worlds.iter_mut().collect();
        for step in 0..seconds {
            for (late, world) in all.iter_mut().enumerate() {
                world.set_targets(&targets(character, step + late, swing));
            }
            World::step_together(&mut all, &mut results);
            assert!(results.iter().all(Result::is_ok), "it stays finite");
        }
    }
    let steps = f64::from(settings.steps_per_control * settings.substeps)
        * (seconds * episodes * count) as f64;
    steps / began.elapsed().as_secs_f64() / 1e3
}

/// Every joint a sine of its own, as wide as `swing`.
fn targets(character: &Character, step: usize, swing: f32) -> Vec<Target> {
    let at = |i: usize| swing * (step as f32 * 0.35 + i as f32).sin();
    let turn = |i| {
        UnitQuaternion::from_scaled_axis(Vector3::new(
            0.5 * at(i),
            0.8 * at(i + 3),
            0.3 * at(i + 5),
        ))
    };
    let links = character.links.iter().enumerate();
    links
        .map(|(i, link)| match link.joint {
            LinkJoint::Free => Target::Free,
            LinkJoint::Hinge { .. } => Target::Hinge(0.8 * swing + 0.6 * at(i)),
            LinkJoint::Ball { .. } | LinkJoint::Hinges { .. } => Target::Ball(turn(i)),
        })
        .collect()
}
