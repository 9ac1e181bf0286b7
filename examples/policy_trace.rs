//! Writes what a run's policy sees and does, step by step. `tests/outside/mujoco_policy.py` checks the example
//! `mujoco_policy.py` against it.
//!
//! `cargo run --release --example policy_trace RUN STEPS > TRACE.json`

use mimic::evaluate::Agent;
use mimic::run::{Memory, Run};
use mimic::sim::Target;
use mimic::task::{
    CharacterModel, Environment, EpisodeStart, Outcome, Purpose, StartState, size, step,
};
use nalgebra::UnitQuaternion;
use serde_json::{Value, json};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let usage = "usage: policy_trace RUN STEPS";
    let run = Run::open(args.next().ok_or(usage)?)?;
    let steps: usize = args.next().ok_or(usage)?.parse()?;
    let controller = run.controller()?;
    let task = controller.task();
    // Under the rules of training.
    let mut env = task.environment(Purpose::Training);
    let mut memory = Memory::default();
    let mut seen = vec![0.0; size(task.observation())];
    let mut trace = Vec::new();
    let start = |share| EpisodeStart::new(0, StartState::Reference(share));
    env.start_at(&start(0.3))?;
    for _ in 0..steps {
        env.observe(&mut seen);
        let mut record = state(task.model(), env.as_ref());
        let action = controller.act(env.as_ref(), &mut memory)?.to_vec();
        record["observation"] = json!(seen);
        record["action"] = json!(action);
        let outcome = step(env.as_mut(), &action).outcome;
        record["targets"] = env.targets().iter().map(target).collect();
        trace.push(record);
        if outcome != Outcome::Running {
            env.start_at(&start(0.0))?;
        }
    }
    println!(
        "{}",
        json!({ "momentum_scale": task.model().momentum_scale, "steps": trace })
    );
    Ok(())
}

/// Time, contacts, and for every body its position, rotation (scalar first), and linear and angular velocity, in world axes.
fn state(model: &CharacterModel, env: &dyn Environment) -> Value {
    let (mut position, mut rotation, mut linear, mut angular) = (vec![], vec![], vec![], vec![]);
    for body in 0..model.character.bodies.len() {
        let state = model.character.body_state(env.world().states(), body);
        position.push(json!(state.pose.translation.vector.as_slice()));
        rotation.push(quaternion(&state.pose.rotation));
        linear.push(json!(state.linear.as_slice()));
        angular.push(json!(state.angular.as_slice()));
    }
    json!({
        "time": env.moment().time, "touching": env.touching(),
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
