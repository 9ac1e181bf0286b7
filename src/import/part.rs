//! Which part of a take is read, and at what times.

use super::Error;
use super::scene::{Scene, Take};
use crate::clip::{Grid, MOST_TRANSFORMS, Margin};
use std::ops::Range;

/// Nodes or channels that may be looked at for each transform: most of a file's nodes may be no joints.
const LOOKS_PER_TRANSFORM: usize = 8;
/// Joints that a frame counts for at least, as it takes memory of its own.
const LEAST_JOINTS: usize = 2;

/// Parts of a frame by which a part may miss frames of the whole take and still be of these frames.
const ON_FRAME: f64 = 0.01;

/// A part of a take, sampled with what is around it.
pub(super) struct Part {
    pub fps: f64,
    /// Times of all frames, in the take's own seconds.
    pub times: Vec<f64>,
    /// The part's own frames among all.
    pub own: Range<usize>,
}

impl Part {
    /// `most` bounds the frames of the part and of what is around it.
    pub fn new(
        scene: &dyn Scene,
        file: &str,
        take: &Take,
        span: Range<f64>,
        fps: f64,
        most: usize,
    ) -> Result<Part, Error> {
        let grid = grid(scene, file, take, span.end - span.start, fps, most)?;
        let part = Part::of_whole(take, &span, fps).unwrap_or_else(|| {
            let time = |f: usize| span.start + grid.time(f);
            let (first, last) = (time(0), time(grid.frames - 1));
            let before = Margin::frames(first - take.start, grid.fps);
            let after = Margin::frames(take.end - last, grid.fps);
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

    /// A part that begins and ends with a frame of the whole take is sampled when that is, to the last bit.
    fn of_whole(take: &Take, span: &Range<f64>, fps: f64) -> Option<Part> {
        let whole = Grid::new(take.end - take.start, fps, MOST_TRANSFORMS)?;
        let frame = |time: f64| {
            let frame = (time - take.start) * whole.fps;
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

    pub fn leave_out_first(&mut self) {
        self.times.remove(0);
        self.own = match self.own.start {
            0 => 0..self.own.end - 1,
            start => start - 1..self.own.end - 1,
        };
    }

    /// With less around it, where there would be more frames than `most`.
    fn of_at_most(mut self, most: usize) -> Part {
        let left = most.saturating_sub(self.own.len());
        let before = self.own.start.min(left);
        self.times.truncate(self.own.end + left - before);
        self.times.drain(..self.own.start - before);
        self.own = before..before + self.own.len();
        self
    }
}

/// Start and end, in the take's own seconds, of the part to keep.
pub(super) fn span(take: &Take, file: &str, trim: Option<(f64, f64)>) -> Result<Range<f64>, Error> {
    let Some((from, to)) = trim else {
        return Ok(take.start..take.end);
    };
    let duration = take.end - take.start;
    let (start, end) = (from.max(0.0), to.min(duration));
    if !(from <= to && start <= end) {
        return Err(Error::EmptyTrim {
            file: file.to_owned(),
            take: take.name.clone(),
            from,
            to,
            duration,
        });
    }
    Ok(take.start + start..take.start + end)
}

/// Most frames that a take may be sampled to, given the most `transforms`: what is kept are the joints, but the time
/// goes to all nodes and channels.
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
    file: &str,
    take: &Take,
    duration: f64,
    fps: f64,
    most: usize,
) -> Result<Grid, Error> {
    let nodes = scene.nodes().len();
    let Some(one) = Grid::new(0.0, fps, 2) else {
        return Err(Error::Rate {
            file: file.to_owned(),
            fps,
        });
    };
    Grid::new(duration, one.fps, most).ok_or_else(|| Error::TooLong {
        file: file.to_owned(),
        take: take.name.clone(),
        frames: (duration * fps).round() + 1.0,
        nodes,
    })
}
