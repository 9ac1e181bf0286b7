//! A take of a scene becomes a clip: which part of it, at which times, in which frame of reference.

use super::canonical::Rig;
use super::error::ErrorKind;
use super::options::Options;
use super::part::{self, Part};
use super::rigid::Frame;
use super::scene::{Scene, Take};
use super::{lead, names, seam};
use crate::clip::{Clip, LoopMode, Margin, Problem, Source};
use nalgebra::Isometry3;

/// Smallest and largest unit of length, metres. Chosen: a nanometre, and more than any motion goes.
const LEAST_UNIT: f64 = 1e-9;
const MOST_UNIT: f64 = 1e6;

/// World transforms of all joints.
type Pose = Vec<Isometry3<f64>>;

/// The part of a take that was asked for, in world transforms, and what is around it.
struct Sampled {
    before: Vec<Pose>,
    own: Vec<Pose>,
    after: Vec<Pose>,
    fps: f64,
    /// The first frame of the take was a pose apart from the motion.
    left_out_first: bool,
}

/// The frame of reference that the file states, or that the options put in its place.
pub(super) fn frame(scene: &dyn Scene, options: &Options) -> Result<Frame, ErrorKind> {
    let unit_m = options.unit_m.unwrap_or_else(|| scene.contents().unit_m);
    if !(LEAST_UNIT..=MOST_UNIT).contains(&unit_m) {
        return Err(ErrorKind::Unit { unit_m });
    }
    let axes = match options.up {
        Some(up) if up.to_string() != scene.contents().up_axis => up.canonical_from_file(),
        _ => scene.contents().canonical_from_file,
    };
    Ok(Frame {
        axes,
        unit_m,
        is_sure: options.up.is_some(),
    })
}

/// Samples take number `take`, to at most `most` frames × joints. `file` names the clip and its source.
pub(super) fn clip(
    scene: &dyn Scene,
    file: &str,
    take: usize,
    options: &Options,
    most: usize,
) -> Result<Clip, ErrorKind> {
    let about = &scene.takes()[take];
    // The take's first pose, not the part's, stands in for an unusable rest pose: so every part has the same joints.
    let first = (take, about.start);
    let span = part::span(about, options.trim)?;
    let rig = Rig::new(scene, frame(scene, options)?, Some(first))?;
    let fps = options.fps.unwrap_or(about.fps);
    let most = part::most_frames(scene, about, rig.joints.len(), most);
    let part = Part::new(scene, about, span, fps, most)?;
    let sampled = sampled(&rig, first, part, options)?;
    let wraps = wraps(about, &sampled.own, options);
    // Frame by frame, so that no two copies of all frames are in memory.
    let locals = |world: Vec<Pose>| {
        let frames = world.into_iter();
        frames.map(|frame| rig.locals(&frame)).collect()
    };
    let mut problems = scene.contents().problems.clone();
    problems.extend_from_slice(&about.problems);
    problems.extend((sampled.left_out_first && options.trim.is_none()).then(lead::problem));
    problems.extend(rate_problem(sampled.fps, fps));
    let end = options.trim.map(|(_, to)| to);
    problems.extend(end.and_then(|to| Problem::shortened(to, about.end - about.start, fps)));
    problems.extend(still_problem(&sampled.own));
    problems.extend_from_slice(&rig.problems);
    Ok(Clip {
        name: names::stem(file).to_owned(),
        fps: sampled.fps,
        loop_mode: if wraps {
            LoopMode::Wrap
        } else {
            LoopMode::Clamp
        },
        frames: locals(sampled.own),
        margin: match wraps {
            // What repeats goes on with itself.
            true => Margin::default(),
            false => Margin {
                before: locals(sampled.before),
                after: locals(sampled.after),
            },
        },
        source: source(scene, file, about, options, &rig),
        problems,
        joints: rig.joints,
    })
}

/// Places the joints at the times of `part`, a part of a take with this number and start. A first frame that is a pose apart
/// from the motion is left out, unless the caller trims from the very start.
fn sampled(
    rig: &Rig<'_>,
    (take, start): (usize, f64),
    mut part: Part,
    options: &Options,
) -> Result<Sampled, ErrorKind> {
    let mut world = rig.frames(take, &part.times)?;
    let has_first = part.times.first() == Some(&start);
    let is_asked_for = options.trim.is_some() && part.own.start == 0;
    let left_out_first = has_first && !is_asked_for && lead::is_apart(&world);
    if left_out_first {
        world.remove(0);
        part.leave_out_first();
    }
    // Frames before, in and after the part, in this order.
    let after = world.split_off(part.own.end);
    let own = world.split_off(part.own.start);
    Ok(Sampled {
        before: world,
        own,
        after,
        fps: part.fps,
        left_out_first,
    })
}

/// Whether the clip repeats: as the caller says, as the format says of the whole take, or as the frames look.
fn wraps(take: &Take, world: &[Pose], options: &Options) -> bool {
    match options.loop_mode {
        Some(mode) => mode == LoopMode::Wrap,
        None => {
            let stated = take.wraps.filter(|_| options.trim.is_none());
            stated.unwrap_or_else(|| seam::wraps(world))
        }
    }
}

fn source(scene: &dyn Scene, file: &str, take: &Take, options: &Options, rig: &Rig<'_>) -> Source {
    let contents = scene.contents();
    let up = options.up.or(rig.other_up);
    Source {
        file: file.to_owned(),
        sha256: String::new(),
        format: contents.format.to_owned(),
        take: take.name.clone(),
        fps: take.fps,
        up_axis: up.map_or_else(|| contents.up_axis.clone(), |up| up.to_string()),
        unit_m: options.unit_m.unwrap_or(contents.unit_m),
    }
}

fn rate_problem(sampled: f64, wanted: f64) -> Option<Problem> {
    (sampled != wanted).then(|| {
        Problem::note(
            "rate-adjusted",
            format!("sampled at {sampled:.3} Hz instead of {wanted} Hz, so that a frame falls on the end"),
        )
    })
}

fn still_problem(world: &[Pose]) -> Option<Problem> {
    let is_still = world.windows(2).all(|pair| pair[0] == pair[1]);
    is_still.then(|| {
        Problem::warning(
            "still-take",
            "nothing moves in this take; choose another take",
        )
    })
}
