//! Writes what a run's policy sees and does, step by step. `tests/outside/mujoco_policy.py` checks the example
//! `mujoco_policy.py` against it.
//!
//! `cargo run --release --example policy_trace RUN STEPS > TRACE.json`

use mimic::learn::{Memory, Run};
use mimic::sim::Target;
use mimic::task::{Imitate, Outcome, Stage};
use nalgebra::UnitQuaternion;
use serde_json::{Value, json};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let usage = "usage: policy_trace RUN STEPS";
    let run = Run::open(Path::new(&args.next().ok_or(usage)?))?;
    let steps: usize = args.next().ok_or(usage)?.parse()?;
    let performer = run.performer()?;
    let mut env = performer.environment(0, performer.setting());
    let mut memory = Memory::default();
    let mut seen = vec![0.0; env.observation_size()];
    let mut trace = Vec::new();
    env.reset(0.3 * env.last_start());
    for _ in 0..steps {
        env.observe(&mut seen);
        let mut step = state(performer.stage(), &env);
        let action = performer.act(&env, &mut memory)?.to_vec();
        step["observation"] = json!(seen);
        step["action"] = json!(action);
        let outcome = env.step(&action).outcome;
        step["targets"] = env.targets().iter().map(target).collect();
        trace.push(step);
        if outcome != Outcome::Running {
            env.reset(0.0);
        }
    }
    println!(
        "{}",
        json!({ "momentum_scale": performer.stage().momentum_scale, "steps": trace })
    );
    Ok(())
}

/// Time, contacts, and for every body its position, rotation (scalar first), and linear and angular velocity, in world axes.
fn state(stage: &Stage, env: &Imitate) -> Value {
    let (mut position, mut rotation, mut linear, mut angular) = (vec![], vec![], vec![], vec![]);
    for body in 0..stage.character.bodies.len() {
        let state = stage.character.body_state(env.states(), body);
        position.push(json!(state.pose.translation.vector.as_slice()));
        rotation.push(quaternion(&state.pose.rotation));
        linear.push(json!(state.linear.as_slice()));
        angular.push(json!(state.angular.as_slice()));
    }
    json!({
        "time": env.time(), "touching": env.touching(),
        "position": position, "rotation": rotation, "linear": linear, "angular": angular,
    })
}

fn quaternion(q: &UnitQuaternion<f32>) -> Value {
    json!([q.w, q.i, q.j, q.k])
}

/// A hinge's angle, a ball's rotation, nothing for the root.
fn target(target: &Target) -> Value {
    match target {
        Target::Free => Value::Null,
        Target::Hinge(angle) => json!(angle),
        Target::Ball(turn) => quaternion(turn),
    }
}
