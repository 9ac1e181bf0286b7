//! What is learned: observations, actions, reward terms, and when an episode ends.
//!
//! [`Task`] and [`Environment`] are all that a learner, an evaluation, a replay or a live player knows of a task.
//! [`TaskSettings`] says which task it is and makes it; [`Imitate`] is the phase-based imitation of reference motions.

mod contact;
mod disturbance;
mod dynamics;
mod environment;
mod episode;
mod error;
mod follow;
mod imitate;
mod model;
mod settings;
mod starts;
mod steer;
mod step;
mod verdict;

pub use contact::ContactBody;
pub use disturbance::Perturbations;
pub use dynamics::Dynamics;
pub use environment::{Draws, Environment, Stepping, Task, frame, step, step_together};
pub(crate) use episode::mean;
pub use episode::{Episode, Frame, Good, Measure, Unit};
pub use error::TaskError;
pub use follow::{Actions, Kernels, ObservationInputs, Rewards, TERM_NAMES, Terminations, Terms};
pub use imitate::{
    Imitate, ImitationSettings, Observations, Placement, Reference, layout, observation_size,
    observe,
};
pub use model::{CharacterModel, SolePoint};
pub use settings::{TASKS, TaskSettings};
pub use starts::{Moment, Span, StartDistribution, Tally};
pub use steer::{InputSettings, Role, Steer, SteerSettings, Traits};
pub use step::{
    Block, Case, EpisodeStart, Failure, Input, MAX_TERMS, Outcome, Purpose, ReferenceState,
    StartState, Step, TermValues, Wish, size,
};
pub use verdict::{Performance, Verdict};
