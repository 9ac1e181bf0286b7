//! What the policy sees: the agent, what it lacks against the animated character, what is asked for, and what comes next. There is
//! no phase.

use crate::task::follow::{
    ObservationInputs, Writer, agent, agent_layout, ahead_layout, error_layout, errors,
    further_ahead, heading,
};
use crate::task::model::CharacterModel;
use crate::task::step::Block;
use crate::task::step::Wish;
use nalgebra::{UnitQuaternion, Vector3};

/// The moments of the animated character that are seen beside the next control step's, seconds after it.
pub(super) const AHEAD: [f32; 2] = [0.15, 0.4];

/// The blocks of an observation, for a character of so many contact bodies.
pub(super) fn layout(model: &CharacterModel, contacts: usize) -> Vec<Block> {
    let mut blocks = agent_layout(model, contacts);
    blocks.extend(error_layout(model, contacts));
    blocks.extend([("wished_velocity", 2), ("wished_facing", 2)]);
    for _ in AHEAD {
        blocks.extend(ahead_layout(model, contacts));
    }
    let block = |(name, size)| Block { name, size };
    blocks.into_iter().map(block).collect()
}

/// Fills `out`, as long as [`layout`] says.
pub(super) fn observe(
    model: &CharacterModel,
    scene: &ObservationInputs,
    wish: &Wish,
    out: &mut [f32],
) {
    let mut w = Writer::new(out);
    agent(model, scene, &mut w);
    errors(model, scene, &mut w);
    let root = &scene.links[0];
    wished(wish, &heading(&root.pose.rotation), &mut w);
    for sample in scene.ahead {
        further_ahead(model, root, sample, &mut w);
    }
}

/// The wished velocity along the agent's heading and to its left, m/s, and cosine and sine of the turn to the wished facing.
fn wished(wish: &Wish, heading: &UnitQuaternion<f32>, w: &mut Writer) {
    let into = heading.inverse();
    let velocity = into * wish.velocity.push(0.0);
    let facing = match wish.facing {
        Some(angle) => into * Vector3::new(angle.cos(), angle.sin(), 0.0),
        None => velocity.try_normalize(1e-3).unwrap_or_else(Vector3::x),
    };
    for value in [velocity.x, velocity.y, facing.x, facing.y] {
        w.one(value);
    }
}
