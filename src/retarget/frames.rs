//! Sequences with one item per frame.

use std::ops::Range;

/// Drops everything but the frames `kept`.
pub(super) fn keep<T>(frames: &mut Vec<T>, kept: &Range<usize>) {
    frames.truncate(kept.end);
    frames.drain(..kept.start);
}
