//! What is in a file, before any of it is sampled.

use super::canonical::Rig;
use super::scene::{Scene, Take};
use super::{Error, Options, frame, take};
use crate::clip::{Grid, Joint, Problem, Severity};
use serde::Serialize;

/// One take of a file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TakeInfo {
    pub name: String,
    /// Frames per second, Hz.
    pub fps: f64,
    pub frames: usize,
    pub duration_s: f64,
}

/// What is in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspection {
    /// `fbx`, `gltf`, `bvh`, `asf`, `amc` or `deepmimic`.
    pub format: String,
    pub takes: Vec<TakeInfo>,
    /// Place in `takes` of the one that is loaded when none is named.
    pub default_take: Option<usize>,
    /// The joints with their rest pose, in canonical space.
    pub joints: Vec<Joint>,
    pub up_axis: String,
    /// Metres per unit of the file.
    pub unit_m: f64,
    pub problems: Vec<Problem>,
}

pub(super) fn inspection(scene: &dyn Scene, file: &str) -> Result<Inspection, Error> {
    let default_take = (!scene.takes().is_empty()).then(|| take::most_motion(scene));
    let first = default_take.map(|take| (take, scene.takes()[take].start));
    let rig = Rig::new(scene, file, frame(scene, file, &Options::default())?, first)?;
    let mut problems = scene.contents().problems.clone();
    problems.extend(scene.takes().iter().flat_map(|take| take.problems.clone()));
    problems.extend(scene.takes().iter().filter_map(broken_take));
    problems.extend(rig.problems);
    if default_take.is_none() {
        problems.push(Problem {
            id: "no-takes".to_owned(),
            severity: Severity::Error,
            message: format!("the file {}", scene.contents().no_takes),
        });
    }
    Ok(Inspection {
        format: scene.contents().format.to_owned(),
        takes: scene.takes().iter().map(take_info).collect(),
        default_take,
        joints: rig.joints,
        up_axis: rig
            .other_up
            .map_or_else(|| scene.contents().up_axis.clone(), |up| up.to_string()),
        unit_m: scene.contents().unit_m,
        problems,
    })
}

fn broken_take(take: &Take) -> Option<Problem> {
    Some(Problem {
        id: "broken-take".to_owned(),
        severity: Severity::Error,
        message: take.fault.clone()?,
    })
}

fn take_info(take: &Take) -> TakeInfo {
    let duration_s = take.end - take.start;
    // Keys may be farther apart than frames can be counted.
    let grid = Grid::new(duration_s, take.fps, usize::MAX);
    TakeInfo {
        name: take.name.clone(),
        fps: take.fps,
        frames: grid.map_or(usize::MAX, |grid| grid.frames),
        duration_s,
    }
}
