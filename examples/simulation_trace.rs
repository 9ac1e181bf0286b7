//! Simulates a character whose drives hold a pose. `tests/outside/mujoco_simulation.py` lets MuJoCo do the same and compares.
//!
//! `cargo run --release --example simulation_trace START.json SKELETON HZ CONTACT_S > TRACE.json`
//!
//! START.json holds `qpos`, `qvel`, the drives' targets `control`, and the number of control steps `steps`, 1/30 s each. HZ is
//! the rate of physics, CONTACT_S the time constant with which the ground gives way. It prints the positions of all bodies
//! after every control step.

use mimic::sim::{Character, Link, LinkJoint, LinkState, Settings, Target, World};
use mimic::skeleton::Skeleton;
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let usage = "usage: simulation_trace START.json SKELETON HZ CONTACT_S";
    let mut args = std::env::args().skip(1);
    let mut next = || args.next().ok_or(usage);
    let start: Value = serde_json::from_str(&std::fs::read_to_string(next()?)?)?;
    let skeleton = Skeleton::load(&next()?)?;
    let settings = Settings {
        steps_per_control: (next()?.parse::<f64>()? / 30.0).round() as u32,
        substeps: 1,
        contact_s: next()?.parse()?,
        ..Settings::default()
    };
    let character = Character::new(&skeleton)?;
    let mut world = World::new(&character, settings);
    world.reset(&states(&skeleton, &character, &start)?);
    let control: Vec<f32> = serde_json::from_value(start["control"].clone())?;
    world.set_targets(&targets(&character, &control));
    let mut trace = Vec::new();
    for _ in 0..start["steps"].as_u64().ok_or(usage)? {
        world.step()?;
        trace.push(positions(&character, world.states()));
    }
    println!("{}", json!(trace));
    Ok(())
}

/// Where all links start.
fn states(
    skeleton: &Skeleton,
    character: &Character,
    start: &Value,
) -> Result<Vec<LinkState>, Box<dyn Error>> {
    let qpos: Vec<f64> = serde_json::from_value(start["qpos"].clone())?;
    let qvel: Vec<f64> = serde_json::from_value(start["qvel"].clone())?;
    Ok(character.states(skeleton, &qpos, &qvel))
}

/// Targets of all links from the drive coordinates: angles of hinges and rotation vectors of balls, in the order of drives.
fn targets(character: &Character, control: &[f32]) -> Vec<Target> {
    let turn = |v: &[f32]| UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(v));
    let target = |link: &Link| {
        let own = &control[link.dof..link.dof + link.joint.dof()];
        match link.joint {
            LinkJoint::Free => Target::Free,
            LinkJoint::Hinge { .. } => Target::Hinge(own[0]),
            LinkJoint::Ball { .. } => Target::Ball(turn(own)),
            // Several hinges of one body hold their rest pose.
            LinkJoint::Hinges { .. } => Target::Ball(UnitQuaternion::identity()),
        }
    };
    character.links.iter().map(target).collect()
}

/// Position of every body, world frame, metres.
fn positions(character: &Character, states: &[LinkState]) -> Vec<Vec<f32>> {
    let position = |body| {
        let pose = character.body_pose(states, body);
        pose.translation.vector.as_slice().to_vec()
    };
    (0..character.bodies.len()).map(position).collect()
}
