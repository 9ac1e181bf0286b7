//! Our own engine: a character in reduced coordinates on a plane.
//!
//! The coordinates are those of the joints, so joints can't come apart. A step is semi-implicit: drives and joint limits act
//! with the velocities at its end, which makes them stable at any stiffness, and contacts are solved over the inertia of the
//! whole character. Up to eight characters take a step together, each number of theirs in one lane of a vector. What a
//! character does depends neither on the others nor on its lane.
//!
//! Names and equations follow Featherstone, "Rigid Body Dynamics Algorithms", Springer 2008 (RBDA).

mod algebra;
mod contact;
mod dynamics;
mod engine;
mod ground;
mod lanes;
mod matrix;
mod pose;
mod solve;
mod spatial;
mod state;
mod step;
#[cfg(test)]
mod tests;
mod tree;

pub(super) use engine::{Articulated, Stepped};
pub use lanes::LANES;
