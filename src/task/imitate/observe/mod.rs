//! What the policy sees. Nothing depends on where the character is or which way it faces: directions are in the root's
//! frame, its heading, or the frame in which the reference's cycle began.

mod booth;
mod deepmimic;
mod tracking;

use super::settings::Observations;
use crate::task::follow::{ObservationInputs, Writer};
use crate::task::model::CharacterModel;
use crate::task::step::Block;

/// The blocks of an observation in order, for a motion with `contacts` contact bodies.
pub fn layout(kind: Observations, model: &CharacterModel, contacts: usize) -> Vec<Block> {
    let blocks = match kind {
        Observations::Tracking | Observations::TrackingAhead => {
            tracking::layout(model, contacts, kind.ahead().len())
        }
        Observations::Deepmimic => deepmimic::layout(model),
        Observations::Booth2020 => booth::layout(model),
    };
    let block = |(name, size)| Block { name, size };
    blocks.into_iter().map(block).collect()
}

/// Length of an observation for a motion with `contacts` contact bodies.
pub fn observation_size(kind: Observations, model: &CharacterModel, contacts: usize) -> usize {
    let blocks = layout(kind, model, contacts);
    blocks.iter().map(|block| block.size).sum()
}

/// Fills `out`, as long as [`layout`] says.
///
/// # Panics
/// If `out` is shorter.
pub fn observe(
    kind: Observations,
    model: &CharacterModel,
    scene: &ObservationInputs,
    out: &mut [f32],
) {
    let mut w = Writer::new(out);
    match kind {
        Observations::Tracking | Observations::TrackingAhead => {
            tracking::observe(model, scene, &mut w);
        }
        Observations::Deepmimic => deepmimic::observe(model, scene, &mut w),
        Observations::Booth2020 => booth::observe(model, scene, &mut w),
    }
}
