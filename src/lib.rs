//! `mimic` takes an animation clip to a physics character that performs it.
//!
//! There is a module for each stage that data goes through: [`import`] reads a file into a [`clip`]; [`retarget`] carries
//! the clip onto the character of a [`skeleton`] and makes a [`motion`]; [`sim`] moves the character under physics;
//! [`task`] defines what a policy has to learn and [`learn`] how it learns; [`run`] keeps the training on disk, and
//! [`evaluate`] measures the result.
//!
//! Conventions, everywhere: right-handed, Z up, X forward, Y left; metres, kilograms, seconds, radians;
//! quaternions scalar first in files; a transform named `a_from_b` maps coordinates in `b` to coordinates in `a`.
//!
//! # From a clip to a motion
//!
//! ```
//! use mimic::skeleton::Skeleton;
//! use mimic::{import, retarget};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let clip = import::load("clips/walk.glb", &import::Options::default())?;
//! let skeleton = Skeleton::load("humanoid")?;
//! let retargeted = retarget::retarget(&clip, &skeleton, &retarget::Options::default())?;
//!
//! // Joint positions of the character, on average within some centimetres of the clip's.
//! assert!(retargeted.report.keypoint_error_m.mean < 0.05);
//! // Coordinates in MuJoCo's order, for every frame: 7 of the root, then those of the joints.
//! assert!(retargeted.motion.qpos.iter().all(|frame| frame.len() == skeleton.nq));
//! # Ok(())
//! # }
//! ```
//!
//! # From a motion to a policy
//!
//! A policy takes minutes to train, so this example is compiled but not run; `examples/train.rs` is the whole of it.
//!
//! ```no_run
//! use mimic::run::{Plan, Run, Session};
//! # use mimic::{motion::Motion, skeleton::Skeleton};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let skeleton = Skeleton::load("humanoid")?;
//! # let motion = Motion::load("walk.motion")?;
//! let run = Run::create("runs/walk", Plan::default(), skeleton, vec![motion])?;
//! let mut session = Session::open(run)?;
//! while !session.is_done() {
//!     session.train_round()?;
//! }
//! for case in session.finish(&Default::default())? {
//!     println!("{}: {:?}", case.motion, case.evaluation.measure("survival"));
//! }
//! # Ok(())
//! # }
//! ```

#![warn(missing_docs)]
// A library reports through its results, never to a terminal.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod clip;
pub mod evaluate;
pub mod explain;
pub mod file;
pub mod humanoid;
pub mod import;
pub mod learn;
pub mod motion;
pub mod retarget;
pub mod run;
pub mod schema;
pub mod sim;
pub mod skeleton;
pub mod task;

/// The linear algebra that the interface of this crate speaks: vectors, rotations, rigid transforms. Use this instead of
/// a dependency of your own, which may be of another version and then has other types.
pub use nalgebra;
