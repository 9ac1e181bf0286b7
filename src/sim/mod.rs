//! A character under drives, gravity and ground contact.
//!
//! Two engines move it, both behind [`World`]: our own in reduced coordinates, and rapier. They share characters, targets
//! and states, so that a skill learned in one can be performed in the other.

mod articulated;
mod character;
mod error;
mod rapier;
mod settings;
mod state;
#[cfg(test)]
mod tests;
mod world;

pub use articulated::LANES;
pub use character::{Attachment, Character, HingeAxis, Link, LinkJoint};
pub use error::{Diverged, SimError};
pub use settings::{Engine, Settings};
pub use state::{LinkState, Target};
pub use world::World;
