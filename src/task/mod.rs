//! What is learned: observations, actions, reward terms, termination.
//!
//! [`Imitate`] is the phase-based imitation of a reference motion. Every observation block, reward term and
//! termination rule is a pure function that training, evaluation, plots and tests all call.

mod dynamics;
mod imitate;
mod observe;
mod reference;
mod reward;
mod setting;
mod terminate;
#[cfg(test)]
mod tests;

pub use dynamics::Dynamics;
pub use imitate::{Imitate, Outcome, Step};
pub use observe::{Block, layout, observation_size};
pub use reference::{Reference, Sample};
pub use reward::{TERM_NAMES, Terms};
pub use setting::{Actions, Rewards, Setting, Stage, TaskError, Terminations};
pub use terminate::Failure;
