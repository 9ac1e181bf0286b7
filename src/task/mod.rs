//! What is learned: observations, actions, reward terms, termination.
//!
//! [`Imitate`] is the phase-based imitation of a reference motion. Every observation block, reward term and
//! termination rule is a pure function that training, evaluation, plots and tests all call.

mod aim;
mod blend;
mod clock;
mod course;
mod dynamics;
mod imitate;
mod observe;
mod perturb;
mod reference;
mod reward;
mod setting;
mod stage;
mod terminate;
#[cfg(test)]
mod tests;
mod transition;

pub use dynamics::Dynamics;
pub use imitate::{Imitate, Outcome, Step};
pub use observe::{Block, Scene, layout, observation_size, observe};
pub use perturb::Perturbations;
pub use reference::{Reference, Sample};
pub use reward::{Kernels, TERM_NAMES, Terms};
pub use setting::{Actions, Observations, Rewards, Setting, TaskError, Terminations};
pub use stage::{SolePoint, Stage};
pub use terminate::Failure;
pub use transition::Placement;
