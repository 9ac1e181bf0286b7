//! `mimic` takes an animation clip to a physics character that performs it.
//!
//! The rooms stand in the order in which data walks through them:
//! [`import`] reads bytes into a [`clip`], [`retarget`] carries the clip onto a [`skeleton`] and makes a
//! [`motion`], [`sim`] moves the skeleton under physics, [`task`] says what is learned and [`learn`] how,
//! [`evaluate`] measures the result.
//!
//! Conventions, everywhere: right-handed, Z up, X forward, Y left; metres, kilograms, seconds, radians;
//! quaternions scalar first in files; a transform named `a_from_b` maps coordinates in `b` to coordinates in `a`.

pub mod clip;
pub mod evaluate;
pub mod explain;
pub mod file;
pub mod humanoid;
pub mod import;
pub mod learn;
pub mod motion;
pub mod retarget;
pub mod sim;
pub mod skeleton;
pub mod task;
