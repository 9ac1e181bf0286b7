//! How well a trained policy performs its task: how long it survives, and the task's own measures.

mod agent;
mod episode;
mod evaluation;
mod steering;

pub use agent::{Agent, EvaluateError};
pub(crate) use episode::longest;
pub use episode::{perform, perform_sequence};
pub use evaluation::{Disturbed, Evaluation, FailedEpisode, Options, evaluate};
pub use steering::{
    Figures, Pushed, Spread, SteeringEvaluation, SteeringOptions, Turn, evaluate_steering,
};
