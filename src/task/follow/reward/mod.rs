//! Reward terms: each is exp(−error) in (0, 1]. Which errors, and how they are weighed in the exponent, is a choice of
//! [`Kernels`].

mod booth;
mod deepmimic;
mod errors;
mod program;
mod term_values;
mod tracking;

pub use term_values::{Kernels, TERM_NAMES, Terms};

use crate::sim::LinkState;
use crate::task::dynamics::Dynamics;
use crate::task::model::CharacterModel;

/// Compares an agent with its reference; link 0 is the root.
pub fn terms(
    kernels: Kernels,
    model: &CharacterModel,
    agent: (&[LinkState], &Dynamics),
    reference: (&[LinkState], &Dynamics),
) -> Terms {
    match kernels {
        Kernels::Tracking => tracking::terms(model, agent, reference),
        Kernels::Deepmimic => deepmimic::terms(model, agent, reference),
        Kernels::DeepmimicProgram => program::terms(model, agent, reference),
        Kernels::Booth2020 => booth::terms(model, agent, reference),
    }
}
