//! A training run on disk: everything needed to go on with it, to evaluate and replay it, and to reproduce it.
//!
//! [`Run`] is the folder, [`Plan`] what it learns and how, [`Session`] the training of it, round after round, and
//! [`Controller`] the trained policy, ready to act.

mod checkpoint;
mod claim;
mod controller;
mod error;
mod evaluation;
pub mod files;
mod folder;
mod plan;
mod presets;
mod scores;
mod session;

pub use checkpoint::{Checkpoint, PolicyFile};
pub use claim::{Claim, Unsaved};
pub use controller::{Controller, Memory};
pub use error::RunError;
pub use evaluation::CaseEvaluation;
pub use folder::Run;
pub use plan::Plan;
pub use presets::{PRESETS, Preset, preset};
pub use scores::Scores;
pub use session::{Iteration, Session};
