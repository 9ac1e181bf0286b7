//! What tasks with a reference share, be it a motion or an animated character: what a policy sees of it, what its actions mean, what
//! it is rewarded for, and when it has failed.

mod aim;
mod heading;
mod inputs;
mod reward;
mod seen;
mod settings;
mod terminate;

pub use aim::aim;
pub use heading::{anchor, heading};
pub use inputs::{ObservationInputs, Writer};
pub use reward::{Kernels, TERM_NAMES, Terms, terms};
pub use seen::{Named, agent, agent_layout, ahead_layout, error_layout, errors, further_ahead};
pub use settings::{Actions, Rewards, Terminations};
pub use terminate::{failure, mean_distance};
