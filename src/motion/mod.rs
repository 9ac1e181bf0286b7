//! A motion: what a skeleton does, frame by frame, and the tracks computed from it.
//!
//! A [`Draft`] of coordinates becomes a [`Motion`] with velocities, body poses and [`Tracks`]. The motion is sampled at any time
//! and past its ends, summed up ([`Motion::summary`]), checked for its fitness for physics ([`Motion::quality`]), and
//! saved with the [`RetargetReport`] and the [`SourceRig`] that it comes from.
//!
//! ```
//! use mimic::clip::LoopMode;
//! use mimic::motion::{Cycle, Draft, Motion};
//! use mimic::skeleton::Skeleton;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A second in the rest pose.
//! let skeleton = Skeleton::load("humanoid")?;
//! let draft = Draft {
//!     name: "stand".to_owned(),
//!     fps: 60.0,
//!     loop_mode: LoopMode::Clamp,
//!     cycle: Cycle::NONE,
//!     qpos: vec![skeleton.rest_qpos(); 61],
//!     contact_bodies: vec![skeleton.slots[&mimic::humanoid::Slot::LeftFoot]],
//!     contact: None,
//! };
//! let motion = Motion::from_poses(&skeleton, draft);
//! assert_eq!(motion.duration(), 1.0);
//! assert_eq!(motion.tracks.linear_momentum[30].norm(), 0.0);
//! # Ok(())
//! # }
//! ```

mod build;
mod carry;
mod check;
pub mod contact;
mod error;
mod file;
mod momentum;
mod nnls;
mod phase;
mod quality;
mod reach;
mod report;
mod sample;
pub mod skate;
mod source;
mod summary;
mod timeline;
mod torque;
mod velocity;
mod wrench;

pub use build::Draft;
pub(crate) use build::TOUCHING;
pub(crate) use carry::{Path, carrying};
pub use check::Check;
pub(crate) use contact::lasting;
pub use error::MotionError;
pub use report::{MappedJoint, RetargetReport, Spread};
pub use source::SourceRig;
pub use summary::{ContactShare, Extent, Summary};

use crate::clip::LoopMode;
use nalgebra::{Isometry3, Vector3, Vector6};

/// Per-frame quantities computed from a motion's poses and velocities, each one value per frame, vectors in world axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracks {
    /// 0 at the first frame, 1 at the last, linear in time.
    pub phase: Vec<f64>,
    /// Centre of mass of the whole body, metres.
    pub com: Vec<Vector3<f64>>,
    /// Velocity of the centre of mass, m/s: linear momentum over mass.
    pub com_velocity: Vec<Vector3<f64>>,
    /// Linear momentum of the whole body, kg·m/s.
    pub linear_momentum: Vec<Vector3<f64>>,
    /// Angular momentum about the centre of mass, each body's own spin included, kg·m²/s.
    pub angular_momentum: Vec<Vector3<f64>>,
    /// `contact[f][c]`: whether contact body `c` of [`Motion::contact_bodies`] stands on the ground or carries the motion.
    pub contact: Vec<Vec<bool>>,
    /// Force (N) and moment about the root (N·m), world axes, that no unilateral ground contact with friction
    /// at the contact bodies can supply.
    pub root_wrench_residual: Vec<Vector6<f64>>,
}

/// How a motion that repeats travels: the world transform from one cycle to the next, a turn about the world's Z axis and
/// then a shift. The identity for a motion that ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Shift along the ground, metres; z is zero.
    pub translation: Vector3<f64>,
    /// Turn about +Z, radians.
    pub heading: f64,
}

/// A reference motion on a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Name of the motion, usually that of its clip.
    pub name: String,
    /// Frames per second.
    pub fps: f64,
    /// Whether the motion repeats. If it does, its last frame is the first of the next cycle.
    pub loop_mode: LoopMode,
    /// Where the next cycle of a motion that repeats begins.
    pub cycle: Cycle,
    /// Name of the skeleton that the motion is for.
    pub skeleton_name: String,
    /// Lower-case hexadecimal SHA-256 of that skeleton, as in [`Skeleton::sha256`](crate::skeleton::Skeleton::sha256).
    pub skeleton_sha256: String,
    /// Names of the skeleton's bodies, in its order.
    pub body_names: Vec<String>,
    /// Indices of the bodies that can touch the ground: all that have a shape. In files of earlier versions, the feet, and hands where
    /// the clip uses them.
    pub contact_bodies: Vec<usize>,
    /// `qpos[f]`: coordinates in MuJoCo's order and conventions for the skeleton, as long as `nq`.
    pub qpos: Vec<Vec<f64>>,
    /// `qvel[f]`: velocities in MuJoCo's order and conventions, as long as `nv`.
    pub qvel: Vec<Vec<f64>>,
    /// `bodies[f][b]`: world pose of each body (world from body), metres.
    pub bodies: Vec<Vec<Isometry3<f64>>>,
    /// Quantities of every frame that follow from the poses.
    pub tracks: Tracks,
    /// What retargeting says about the motion; `None` for one that was made in another way.
    pub report: Option<RetargetReport>,
    /// The rig that it was retargeted from; `None` for a motion that was made in another way, or by an older version.
    pub source: Option<SourceRig>,
}

impl Cycle {
    /// No travel.
    pub const NONE: Self = Self {
        translation: Vector3::new(0.0, 0.0, 0.0),
        heading: 0.0,
    };
}

impl Motion {
    /// Seconds from the first frame to the last.
    pub fn duration(&self) -> f64 {
        self.qpos.len().saturating_sub(1) as f64 / self.fps
    }

    /// World transform that carries the first cycle to cycle number `n`.
    pub fn cycle_offset(&self, n: i64) -> Isometry3<f64> {
        self.cycle.offset(n)
    }
}

#[cfg(test)]
mod tests;
