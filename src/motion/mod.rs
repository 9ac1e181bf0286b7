//! A motion: what a skeleton does, frame by frame, and the tracks computed from it.

mod build;
pub mod contact;
mod error;
mod file;
mod momentum;
mod nnls;
mod phase;
mod quality;
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
pub use error::MotionError;
pub use quality::Check;
pub use report::{MappedJoint, RetargetReport, Spread};
pub use source::SourceRig;
pub use summary::{ContactShare, Extent, Summary};

use crate::clip::LoopMode;
use nalgebra::{Isometry3, Vector3, Vector6};

/// Per-frame quantities computed from a motion's poses and velocities.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracks {
    /// 0 at the first frame, 1 at the last.
    pub phase: Vec<f64>,
    /// Whole-body centre of mass, metres.
    pub com: Vec<Vector3<f64>>,
    /// m/s.
    pub com_velocity: Vec<Vector3<f64>>,
    /// kg·m/s.
    pub linear_momentum: Vec<Vector3<f64>>,
    /// About the centre of mass, each body's own spin included, kg·m²/s.
    pub angular_momentum: Vec<Vector3<f64>>,
    /// `contact[f][c]`: whether contact body `c` of [`Motion::contact_bodies`] stands on the ground.
    pub contact: Vec<Vec<bool>>,
    /// Force (N) and moment about the root (N·m), world axes, that no unilateral ground contact with friction
    /// at the contact bodies can supply.
    pub root_wrench_residual: Vec<Vector6<f64>>,
}

/// The world transform from one cycle of a wrapping motion to the next: a turn about the world's Z axis, then a
/// shift. The identity for a motion that ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Metres; z is zero.
    pub translation: Vector3<f64>,
    /// Radians about +Z.
    pub heading: f64,
}

/// A reference motion on a skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    pub name: String,
    pub fps: f64,
    pub loop_mode: LoopMode,
    pub cycle: Cycle,
    pub skeleton_name: String,
    pub skeleton_sha256: String,
    pub body_names: Vec<String>,
    /// Bodies that may stand on the ground (the feet, and hands where the clip uses them).
    pub contact_bodies: Vec<usize>,
    /// `qpos[f]`: MuJoCo's coordinates for the skeleton.
    pub qpos: Vec<Vec<f64>>,
    /// `qvel[f]`: MuJoCo's velocities.
    pub qvel: Vec<Vec<f64>>,
    /// `bodies[f][b]`: world from body.
    pub bodies: Vec<Vec<Isometry3<f64>>>,
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
