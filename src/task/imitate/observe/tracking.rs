//! Our own observation: agent, errors and phase, in the root's frame.

use crate::task::follow::{
    Named, ObservationInputs, Writer, agent, agent_layout, ahead_layout, error_layout, errors,
    further_ahead,
};
use crate::task::model::CharacterModel;

/// The blocks of an observation that sees `ahead` moments of the reference beyond the next control step.
pub(super) fn layout(model: &CharacterModel, contacts: usize, ahead: usize) -> Vec<Named> {
    let mut blocks = agent_layout(model, contacts);
    blocks.extend(error_layout(model, contacts));
    blocks.push(("phase", 5));
    for _ in 0..ahead {
        blocks.extend(ahead_layout(model, contacts));
    }
    blocks
}

/// The agent, its errors against the reference at the next control step, the phase, and the reference further ahead; all in the
/// root's frame.
pub(super) fn observe(model: &CharacterModel, scene: &ObservationInputs, w: &mut Writer) {
    agent(model, scene, w);
    errors(model, scene, w);
    phase(scene.next.phase, w);
    for sample in scene.ahead {
        further_ahead(model, &scene.links[0], sample, w);
    }
}

/// The phase, and sine and cosine of one and two turns of it: these don't jump where a cycle begins anew.
fn phase(phase: f32, w: &mut Writer) {
    let turn = std::f32::consts::TAU * phase;
    for value in [
        phase,
        turn.sin(),
        turn.cos(),
        (2.0 * turn).sin(),
        (2.0 * turn).cos(),
    ] {
        w.one(value);
    }
}
