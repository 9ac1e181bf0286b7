//! Which part of a take is read, and at what times.

use super::error::ErrorKind;
use super::scene::{Scene, Take};
use crate::clip::{Grid, MOST_TRANSFORMS, Margin, length_flaw};
use std::ops::Range;

/// Nodes or channels that may be evaluated for each transform that is kept: most of a file's nodes may not be joints.
/// Chosen: room for a rig with many helpers and controls per joint.
const LOOKS_PER_TRANSFORM: usize = 8;
/// Joints that a frame counts as at least, because the list that holds it takes memory of its own.
const LEAST_JOINTS: usize = 2;

/// How far, in frames, the ends of a part may be from frames of the whole take and still mean these frames. Chosen: times
/// are typed with two or three digits after the point, and 0.01 frames at 30 Hz are 0.3 ms.
const ON_FRAME: f64 = 0.01;

/// The times at which a part of a take, and what is around it, is sampled.
pub(super) struct Part {
    /// Frames per second, Hz.
    pub fps: f64,
    /// Times of all frames, in the take's own seconds.
    pub times: Vec<f64>,
    /// The part's own frames among all.
    pub own: Range<usize>,
}

impl Part {
    /// The part `span` of `take`, in the take's own seconds, at about `fps` Hz: at the nearest rate at which a frame falls on
    /// its end. At most `most` frames, what is around it included.
    pub fn new(
        scene: &dyn Scene,
        take: &Take,
        span: Range<f64>,
        fps: f64,
        most: usize,
    ) -> Result<Part, ErrorKind> {
        // The part's own grid decides whether it can be sampled at all, even where the whole take's grid is used below.
        let grid = grid(scene, take, span.end - span.start, fps, most)?;
        let part = Part::of_whole(take, &span, fps).unwrap_or_else(|| {
            let time = |f: usize| span.start + grid.time(f);
            let (first, last) = (time(0), time(grid.frames - 1));
            let before = Margin::frames(first - take.start, grid.fps);
            let after = Margin::frames(take.end - last, grid.fps);
            // Frames around the part continue its rate in both directions.
            let led = (1..=before).rev().map(|k| first - k as f64 / grid.fps);
            let left = (1..=after).map(|k| last + k as f64 / grid.fps);
            Part {
                fps: grid.fps,
                times: led.chain((0..grid.frames).map(time)).chain(left).collect(),
                own: before..before + grid.frames,
            }
        });
        Ok(part.of_at_most(most))
    }

    /// A part that begins and ends at frames of the whole take is sampled at exactly their times, so that it is equal to that
    /// part of the whole clip, bit for bit.
    fn of_whole(take: &Take, span: &Range<f64>, fps: f64) -> Option<Part> {
        let whole = Grid::new(take.end - take.start, fps, MOST_TRANSFORMS)?;
        let frame = |time: f64| {
            let frame = (time - take.start) * whole.fps;
            // The nearest frame of the whole take, if the time means one.
            let near = (frame - frame.round()).abs() < ON_FRAME;
            (near && whole.frames > 1).then(|| (frame.round() as usize).min(whole.frames - 1))
        };
        let (first, last) = (frame(span.start)?, frame(span.end)?);
        let before = Margin::frames(first as f64 / whole.fps, whole.fps).min(first);
        let after = whole.frames - 1 - last;
        let after = Margin::frames(after as f64 / whole.fps, whole.fps).min(after);
        let times = first - before..=last + after;
        Some(Part {
            fps: whole.fps,
            times: times.map(|f| take.start + whole.time(f)).collect(),
            own: before..before + last + 1 - first,
        })
    }

    /// Drops the first of all frames.
    pub fn leave_out_first(&mut self) {
        self.times.remove(0);
        self.own = match self.own.start {
            0 => 0..self.own.end - 1,
            start => start - 1..self.own.end - 1,
        };
    }

    /// The part with less around it, where there would be more than `most` frames.
    fn of_at_most(mut self, most: usize) -> Part {
        // The part itself is kept whole; what is left of the limit goes to the frames before it, then to those after.
        let left = most.saturating_sub(self.own.len());
        let before = self.own.start.min(left);
        self.times.truncate(self.own.end + left - before);
        self.times.drain(..self.own.start - before);
        self.own = before..before + self.own.len();
        self
    }
}

/// Start and end, in the take's own seconds, of the part to keep.
pub(super) fn span(take: &Take, trim: Option<(f64, f64)>) -> Result<Range<f64>, ErrorKind> {
    let Some((from, to)) = trim else {
        return Ok(take.start..take.end);
    };
    let duration = take.end - take.start;
    let (start, end) = (from.max(0.0), to.min(duration));
    if !(from <= to && start <= end) {
        return Err(ErrorKind::EmptyTrim {
            take: take.name.clone(),
            from,
            to,
            duration,
        });
    }
    Ok(take.start + start..take.start + end)
}

/// Most frames that a take may be sampled to, given the most `transforms`. Memory goes to the joints, which are kept; time
/// goes to all nodes and channels, which are evaluated.
pub(super) fn most_frames(
    scene: &dyn Scene,
    take: &Take,
    joints: usize,
    transforms: usize,
) -> usize {
    let transforms = transforms.min(MOST_TRANSFORMS);
    let looks = scene.nodes().len().max(take.channels);
    let kept = transforms / joints.max(LEAST_JOINTS);
    kept.min(transforms.saturating_mul(LOOKS_PER_TRANSFORM) / looks.max(1))
}

fn grid(
    scene: &dyn Scene,
    take: &Take,
    duration: f64,
    fps: f64,
    most: usize,
) -> Result<Grid, ErrorKind> {
    let nodes = scene.nodes().len();
    let Some(one) = Grid::new(0.0, fps, 2) else {
        return Err(ErrorKind::Rate { fps });
    };
    let grid = Grid::new(duration, one.fps, most).ok_or_else(|| ErrorKind::TooLong {
        take: take.name.clone(),
        frames: (duration * fps).round() + 1.0,
        nodes,
    })?;
    match length_flaw(duration) {
        Some(_) => Err(ErrorKind::Lasting {
            take: take.name.clone(),
            seconds: duration,
        }),
        None => Ok(grid),
    }
}
