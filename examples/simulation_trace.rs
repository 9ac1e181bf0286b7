//! Simulates a character whose drives hold its rest pose, for `tests/outside/mujoco_simulation.py` to do the same.
//!
//! `cargo run --release --example simulation_trace START.json SKELETON HZ > TRACE.json`, where START holds `qpos`, `qvel` and
//! `steps` of 1/30 s, and HZ is the rate of physics. Prints positions of all bodies after every step.

use mimic::sim::{Character, LinkJoint, LinkState, Settings, Target, World};
use mimic::skeleton::Skeleton;
use nalgebra::UnitQuaternion;
use serde_json::{Value, json};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let usage = "usage: simulation_trace START.json SKELETON HZ";
    let mut args = std::env::args().skip(1);
    let mut next = || args.next().ok_or(usage);
    let start: Value = serde_json::from_str(&std::fs::read_to_string(next()?)?)?;
    let skeleton = Skeleton::load(&next()?)?;
    let settings = Settings {
        steps_per_control: (next()?.parse::<f64>()? / 30.0).round() as u32,
        substeps: 1,
        ..Settings::default()
    };
    let character = Character::new(&skeleton)?;
    let mut world = World::new(&character, settings);
    world.reset(&states(&skeleton, &character, &start)?);
    world.set_targets(&rest(&character));
    let mut trace = Vec::new();
    for _ in 0..start["steps"].as_u64().ok_or(usage)? {
        world.step()?;
        trace.push(positions(&character, world.states()));
    }
    println!("{}", json!(trace));
    Ok(())
}

fn states(
    skeleton: &Skeleton,
    character: &Character,
    start: &Value,
) -> Result<Vec<LinkState>, Box<dyn Error>> {
    let qpos: Vec<f64> = serde_json::from_value(start["qpos"].clone())?;
    let qvel: Vec<f64> = serde_json::from_value(start["qvel"].clone())?;
    let (poses, twists) = (skeleton.forward(&qpos), skeleton.twists(&qpos, &qvel));
    let state = |body: usize| LinkState {
        pose: poses[body].cast(),
        linear: twists[body].linear.cast(),
        angular: twists[body].angular.cast(),
    };
    Ok(character
        .links
        .iter()
        .map(|link| state(link.body))
        .collect())
}

fn rest(character: &Character) -> Vec<Target> {
    let hold = |joint: &LinkJoint| match joint {
        LinkJoint::Free => Target::Free,
        LinkJoint::Hinge { .. } => Target::Hinge(0.0),
        LinkJoint::Ball { .. } | LinkJoint::Hinges { .. } => {
            Target::Ball(UnitQuaternion::identity())
        }
    };
    character
        .links
        .iter()
        .map(|link| hold(&link.joint))
        .collect()
}

fn positions(character: &Character, states: &[LinkState]) -> Vec<Vec<f32>> {
    let place = |&(link, offset): &(usize, nalgebra::Isometry3<f64>)| {
        let pose = states[link].pose * offset.cast::<f32>();
        pose.translation.vector.as_slice().to_vec()
    };
    character.bodies.iter().map(place).collect()
}
