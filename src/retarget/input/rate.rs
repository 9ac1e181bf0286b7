//! Clips of few frames get more of them: between frames that are far apart a body's velocity is uncertain, most of all in
//! flight.

use crate::clip::{Clip, Problem};
use std::borrow::Cow;
use std::ops::Range;

/// Rate below which a clip is retargeted at a multiple of it, Hz. Chosen so that film's 24 and 25 get more frames and
/// television's 29.97 doesn't.
const LOW: f64 = 27.0;
/// The rate that the multiple reaches, Hz. At DeepMimic's 16 Hz central differences are wrong by up to 0.9 m/s in flight
/// (measured on its backflip); at 60 Hz and more the cubic curves between frames tell the velocity.
const ENOUGH: f64 = 60.0;
/// The largest multiple: frames that are an eighth of a second apart tell little about what is between them. Chosen.
const MOST_TIMES: f64 = 8.0;
/// The most frames that a clip is brought to. Chosen, to bound time and memory.
const MOST_FRAMES: usize = 100_000;

/// The clip or one with more frames, the indices of its own frames among them, and a note if the clip had few.
pub(super) fn raise(
    clip: Cow<'_, Clip>,
    own: Range<usize>,
) -> (Cow<'_, Clip>, Range<usize>, Option<Problem>) {
    let fps = clip.fps;
    if fps >= LOW {
        return (clip, own, None);
    }
    // A part that isn't cut at frames has a rate a little off that of its whole; taking off a tenth before rounding up gives
    // both the same multiple.
    let times = (ENOUGH / fps - 0.1).ceil().min(MOST_TIMES) as usize;
    let is_short = clip.frames.len().saturating_mul(times) <= MOST_FRAMES;
    match is_short.then(|| clip.resample(fps * times as f64)) {
        Some(Ok(resampled)) => {
            let own = own.start * times..(own.end - 1) * times + 1;
            let message = format!(
                "the clip has only {fps:.1} frames a second; the motion has {times} times as many, interpolated along \
                 smooth curves"
            );
            let note = Problem::note("few-frames", message);
            (Cow::Owned(resampled), own, Some(note))
        }
        _ => {
            let message = format!(
                "the clip has only {fps:.1} frames a second, and is too long to interpolate more; velocities in the motion \
                 are uncertain"
            );
            (clip, own, Some(Problem::note("few-frames", message)))
        }
    }
}
