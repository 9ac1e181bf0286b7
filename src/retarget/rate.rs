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

/// The clip, or one of more frames, which of them are its own, and what there is to tell of that.
pub(super) fn often_enough(
    clip: Cow<'_, Clip>,
    own: Range<usize>,
) -> (Cow<'_, Clip>, Range<usize>, Option<Problem>) {
    let fps = clip.fps;
    if fps >= SLOW {
        return (clip, own, None);
    }
    // A part that isn't cut at frames has a rate that is nearly its whole's, and is to have as many.
    let times = (OFTEN / fps - 0.1).ceil().min(MOST_TIMES) as usize;
    let few = clip.frames.len().saturating_mul(times) <= MOST_FRAMES;
    match few.then(|| clip.resample(fps * times as f64)) {
        Some(Ok(often)) => {
            let own = own.start * times..(own.end - 1) * times + 1;
            let told = format!(
                "{fps:.1} frames a second are few: the motion has {times} times as many, the ones in between along smooth curves"
            );
            (Cow::Owned(often), own, Some(problem(told)))
        }
        _ => {
            let told = format!(
                "{fps:.1} frames a second are few, and the clip is too long to make more of them: speeds in the motion are uncertain"
            );
            (clip, own, Some(problem(told)))
        }
    }
}

fn problem(message: String) -> Problem {
    Problem {
        id: "few-frames".to_owned(),
        severity: Severity::Note,
        message,
    }
}
