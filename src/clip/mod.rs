//! A clip: a tree of joints and their sampled rigid local transforms, in canonical space (Z up, X forward, metres).

mod carry;
pub mod edit;
mod error;
mod extent;
mod file;
mod margin;
mod problem;
mod sampling;
pub(crate) mod stored;
#[cfg(test)]
mod tests;

pub(crate) use carry::carry;
pub use error::Error;
pub(crate) use extent::extent;
pub use margin::Margin;
pub use problem::{Problem, Severity};
pub(crate) use sampling::{
    Grid, LEAST_FPS, MOST_FPS, MOST_SECONDS, MOST_TRANSFORMS, length_flaw, rate_flaw, slerp,
};

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

/// One joint of a clip's tree. Parents come before their children.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Its name in the source; several joints may have the same.
    pub name: String,
    /// Index of the parent joint; `None` for a root.
    pub parent: Option<usize>,
    /// Rest transform, parent from joint, in metres.
    pub rest: Isometry3<f64>,
    /// The bone of a humanoid that the source says this is, by VRM's name for it, e.g. `leftUpperLeg`.
    pub bone: Option<String>,
}

/// What happens when the end of a clip or motion is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LoopMode {
    /// It repeats: the last frame is the first frame of the next cycle, moved over the ground by the cycle's travel.
    Wrap,
    /// It plays once and ends.
    Clamp,
}

/// Where a clip comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// File name without folders.
    pub file: String,
    /// Lower-case hexadecimal SHA-256 of the file's bytes.
    pub sha256: String,
    /// `fbx`, `gltf`, `bvh`, `amc` or `deepmimic`.
    pub format: String,
    /// Name of the take in the file.
    pub take: String,
    /// Frame rate that the file states or its keys keep, Hz.
    pub fps: f64,
    /// Up axis of the file, e.g. `+Y`.
    pub up_axis: String,
    /// Metres per unit of the file.
    pub unit_m: f64,
}

/// A joint tree and its motion, sampled at a constant rate.
///
/// Transforms are rigid: scale in the source file is resolved so that every joint has the world position that it has there.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Name of the clip: the source's file name without its extension, unless somebody changed it.
    pub name: String,
    /// Frames per second, Hz.
    pub fps: f64,
    /// What happens at its end.
    pub loop_mode: LoopMode,
    /// The joint tree, parents first.
    pub joints: Vec<Joint>,
    /// `frames[f][j]`: transform of joint `j` in its parent, metres, at time `f / fps` seconds.
    pub frames: Vec<Vec<Isometry3<f64>>>,
    /// What was around the frames, where they are a part of a longer take.
    pub margin: Margin,
    /// Where it comes from.
    pub source: Source,
    /// What the importer and later edits found out, guessed or left out.
    pub problems: Vec<Problem>,
}

impl Clip {
    /// Seconds from the first frame to the last.
    pub fn duration(&self) -> f64 {
        self.frames.len().saturating_sub(1) as f64 / self.fps
    }

    /// World transforms of all joints at frame `frame`, parents first, metres.
    ///
    /// # Panics
    /// If the clip has no such frame.
    pub fn world(&self, frame: usize) -> Vec<Isometry3<f64>> {
        self.world_from(&self.frames[frame])
    }

    /// World transforms of all joints with these local ones.
    fn world_from(&self, local: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
        self.compose(|j| local[j])
    }

    /// World transforms of all joints in the rest pose.
    pub fn rest_world(&self) -> Vec<Isometry3<f64>> {
        self.compose(|j| self.joints[j].rest)
    }

    /// World transform of joint `joint` at frame `frame`.
    fn world_of(&self, joint: usize, frame: usize) -> Isometry3<f64> {
        let up = std::iter::successors(Some(joint), |&j| self.joints[j].parent);
        up.fold(Isometry3::identity(), |below, j| {
            self.frames[frame][j] * below
        })
    }

    /// The same joints and origin with other frames, and nothing around them.
    fn with_frames(&self, frames: Vec<Vec<Isometry3<f64>>>, fps: f64, loop_mode: LoopMode) -> Clip {
        Clip {
            name: self.name.clone(),
            fps,
            loop_mode,
            joints: self.joints.clone(),
            frames,
            margin: Margin::default(),
            source: self.source.clone(),
            problems: self.problems.clone(),
        }
    }

    fn compose(&self, local: impl Fn(usize) -> Isometry3<f64>) -> Vec<Isometry3<f64>> {
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(self.joints.len());
        for (j, joint) in self.joints.iter().enumerate() {
            let parent = joint.parent.map_or_else(Isometry3::identity, |p| world[p]);
            world.push(parent * local(j));
        }
        world
    }
}
