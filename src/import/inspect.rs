//! What is in a file, without sampling its motion.

use super::canonical::Rig;
use super::error::{ErrorKind, NoTakes};
use super::options::Options;
use super::sample::frame;
use super::scene::{Scene, Take};
use super::take;
use crate::clip::{Grid, Joint, Problem};
use serde::Serialize;

/// One take of a file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TakeInfo {
    /// Its name in the file; of a format without names, the file's.
    pub name: String,
    /// Frames per second, Hz, that the file states or its keys keep.
    pub fps: f64,
    /// Frames at that rate, the first and the last included; `usize::MAX` where they can't be counted.
    pub frames: usize,
    /// Seconds from the first frame to the last.
    pub duration_s: f64,
}

/// What is in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspection {
    /// `fbx`, `gltf`, `bvh`, `asf`, `amc` or `deepmimic`.
    pub format: String,
    /// The takes, in the file's order.
    pub takes: Vec<TakeInfo>,
    /// Index in `takes` of the one that is loaded when none is named; `None` without takes.
    pub default_take: Option<usize>,
    /// The joints with their rest pose, in canonical space: metres, Z up, facing +X.
    pub joints: Vec<Joint>,
    /// Up axis of the file's data, e.g. `+Y`: the figure's where the file states a wrong one.
    pub up_axis: String,
    /// Metres per unit of the file.
    pub unit_m: f64,
    /// What was found wrong, guessed, or left out.
    pub problems: Vec<Problem>,
}

pub(super) fn inspection(scene: &dyn Scene) -> Result<Inspection, ErrorKind> {
    let default_take = (!scene.takes().is_empty()).then(|| take::most_motion(scene));
    // The same rest pose as the clip of the default take will have.
    let first = default_take.map(|take| (take, scene.takes()[take].start));
    let rig = Rig::new(scene, frame(scene, &Options::default())?, first)?;
    let mut problems = scene.contents().problems.clone();
    problems.extend(scene.takes().iter().flat_map(|take| take.problems.clone()));
    problems.extend(scene.takes().iter().filter_map(broken_take));
    problems.extend(rig.problems);
    if default_take.is_none() {
        let NoTakes { cause, remedy } = scene.contents().no_takes;
        problems.push(Problem::error(
            "no-takes",
            format!("the file {cause}; {remedy}"),
        ));
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
    let fault = take.fault.as_ref()?;
    Some(Problem::error("broken-take", fault.to_string()))
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
