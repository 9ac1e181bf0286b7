//! Clips of few frames: between frames that are far apart a body's velocity is anyone's guess, and the more so where it flies.

use crate::clip::{Clip, Problem, Severity};
use std::borrow::Cow;
use std::ops::Range;

/// Rate below which a clip is retargeted at a multiple of it, Hz: film's 24 and 25 are, television's 29.97 isn't.
const SLOW: f64 = 27.0;
/// What the multiple comes to, about, Hz, …
const OFTEN: f64 = 60.0;
/// … if it isn't more than so many times …
const MOST_TIMES: f64 = 8.0;
/// … or makes more frames than this.
const MOST_FRAMES: usize = 100_000;

/// The clip, or one of more frames, and which of them are its own.
pub(super) fn often_enough(
    clip: Cow<'_, Clip>,
    own: Range<usize>,
) -> (Cow<'_, Clip>, Range<usize>) {
    let times = times(&clip);
    if times == 1 {
        return (clip, own);
    }
    match clip.resample(clip.fps * times as f64) {
        Ok(often) => {
            let own = own.start * times..(own.end - 1) * times + 1;
            (Cow::Owned(often), own)
        }
        Err(_) => (clip, own),
    }
}

/// How many frames become of one.
fn times(clip: &Clip) -> usize {
    if clip.fps >= SLOW {
        return 1;
    }
    // A part that isn't cut at frames has a rate that is nearly its whole's, and is to have as many.
    let times = (OFTEN / clip.fps - 0.1).ceil().min(MOST_TIMES) as usize;
    if clip.frames.len().saturating_mul(times) > MOST_FRAMES {
        return 1;
    }
    times
}

/// Tells of the frames that a clip lacks.
pub(super) fn problem(clip: &Clip) -> Option<Problem> {
    let times = times(clip);
    let message = match times {
        1 if clip.fps < SLOW => format!(
            "{:.1} frames a second are few, and the clip is too long to make more of them: speeds in the motion are uncertain",
            clip.fps
        ),
        1 => return None,
        _ => format!(
            "{:.1} frames a second are few: the motion has {times} times as many, the ones in between along smooth curves",
            clip.fps
        ),
    };
    Some(Problem {
        id: "few-frames".to_owned(),
        severity: Severity::Note,
        message,
    })
}
