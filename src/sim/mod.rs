//! A character under drives, gravity and ground contact.
//!
//! Two engines move it, both behind [`World`]: our own in reduced coordinates, and rapier. They share characters, targets
//! and states, so that a skill learned in one can be performed in the other.
//!
//! ```
//! use mimic::sim::{Character, Settings, World};
//! use mimic::skeleton::Skeleton;
//!
//! let skeleton = Skeleton::load("humanoid")?;
//! let character = Character::new(&skeleton)?;
//! let mut world = World::new(&character, Settings::default());
//! let (qpos, qvel) = (skeleton.rest_qpos(), vec![0.0; skeleton.nv]);
//! world.reset(&character.states(&skeleton, &qpos, &qvel));
//!
//! // Until they are given targets, the drives hold the rest pose: here for a third of a second.
//! for _ in 0..10 {
//!     world.step()?;
//! }
//! let root = character.body_pose(world.states(), 0);
//! assert!((f64::from(root.translation.z) - qpos[2]).abs() < 0.01, "it stands");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
