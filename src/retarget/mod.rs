//! Retargeting: carries a clip onto a physics skeleton.
//!
//! [`retarget`] goes through seven stages. Each is in the file of its name, and takes the result of the one before.
//!
//! 1. `input` checks the clip and maps its joints to the humanoid's slots.
//! 2. `pose` aligns the rest poses and turns every frame of the clip into goals for the skeleton.
//! 3. `placement` puts the goals on the ground, gives a clip that walks on the spot its travel back, and sets hands down.
//! 4. `seam` closes the loop of a clip that repeats.
//! 5. `stance` finds which points of feet and hands stand on the ground, when and where.
//! 6. `fit` solves one least-squares problem over the whole trajectory and makes flights follow the laws of motion.
//! 7. `result` makes the motion with its tracks, and a report that measures it against the source.
//!
//! The motion keeps the clip's heading. It is moved over the ground so that the root starts above the origin, and in height
//! so that the ground is z = 0.

mod anchor;
mod end_effector;
mod error;
mod fade;
mod fit;
mod frames;
mod goals;
mod hinge_speed;
mod input;
mod limbs;
mod model;
mod options;
mod overlap;
mod placement;
mod pose;
mod proportions;
mod qpos;
mod report;
mod result;
mod rotation;
mod seam;
mod setting;
mod source;
mod stance;
mod way;

pub use error::RetargetError;
pub use options::Options;

use crate::clip::Clip;
use crate::motion::{Motion, RetargetReport};
use crate::skeleton::Skeleton;
use fit::Fit;
use model::Model;
use result::Outcome;
use setting::Setting;
use std::time::Instant;

/// A retargeted motion. The time it took is kept beside it, so that equal inputs give equal motions.
#[derive(Clone, Debug)]
pub struct Retargeted {
    /// The motion; its [`Motion::report`] is `report`.
    pub motion: Motion,
    /// How well the motion follows its source.
    pub report: RetargetReport,
    /// Wall-clock time spent, s.
    pub seconds: f64,
    /// Most steps that the trajectory solver took over one window of frames.
    pub iterations: usize,
}

/// Carries `clip` onto `skeleton`.
///
/// ```
/// use mimic::skeleton::Skeleton;
/// use mimic::{import, retarget};
///
/// let clip = import::load("clips/walk.glb", &import::Options::default())?;
/// let skeleton = Skeleton::load("humanoid")?;
/// let done = retarget::retarget(&clip, &skeleton, &retarget::Options::default())?;
/// // Joints are within 3 cm of the clip's on average, and feet slide by less than 2 cm/s while the clip's stand.
/// assert!(done.report.keypoint_error_m.mean < 0.03);
/// assert!(done.report.foot_skate_m_s < 0.02);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// The motion has the clip's frame rate. Of a clip of fewer than 27 frames a second it has a multiple of that, which reaches
/// 60 Hz or is eight times as many.
///
/// # Errors
/// [`RetargetError`] if the clip is malformed or no humanoid, a weight is out of range, or the skeleton has no free root or
/// no legs.
pub fn retarget(
    clip: &Clip,
    skeleton: &Skeleton,
    options: &Options,
) -> Result<Retargeted, RetargetError> {
    retarget_watched(clip, skeleton, options, &|_| ())
}

/// The same, and tells `progress` now and then which share of the work is done, from 0 to 1. A minute of motion takes seconds.
///
/// # Errors
/// As [`retarget`].
pub fn retarget_watched(
    clip: &Clip,
    skeleton: &Skeleton,
    options: &Options,
    progress: &dyn Fn(f64),
) -> Result<Retargeted, RetargetError> {
    let start = Instant::now();
    let model = Model::new(skeleton);
    let input = input::prepare(clip, skeleton, options)?;
    let setting = Setting::new(&input.clip, skeleton);
    // Goals: from the clip's poses, on the ground, closed to a loop, with feet and hands planted.
    let posed = pose::pose(&input, &model, &options.weights)?;
    let placed = placement::place(posed, &model, &setting, input.own.start);
    let closed = seam::close(placed.goals, &input, &model);
    let seam = closed.seam.as_ref();
    let planted = stance::plant(closed.goals, seam, &placed.contacts, &model, &setting);
    // The trajectory that comes nearest to these goals and that a body could follow.
    let fit = Fit {
        model: &model,
        anchors: &planted.anchors,
        cycle: seam.map(|seam| &seam.cycle),
        fps: setting.fps,
        to_perform: options.to_perform,
        progress,
    };
    let fitted = fit.run(planted.goals);
    // All that the stages found, in their order.
    let found = placed.problems.into_iter().chain(closed.problem);
    let problems = input.problems.iter().cloned().chain(found);
    let outcome = Outcome {
        frames: fitted.frames,
        anchors: fitted.anchors,
        effectors: planted.effectors,
        cycle: closed.seam.map(|seam| seam.cycle),
        source: placed.source,
        contacts: placed.contacts,
        problems: problems.chain(fitted.problems).collect(),
    };
    let (motion, report) = result::finish(outcome, &input, &model, &setting);
    Ok(Retargeted {
        motion,
        report,
        seconds: start.elapsed().as_secs_f64(),
        iterations: fitted.iterations,
    })
}

#[cfg(test)]
mod tests;
