//! The rows of numbers after the header, one per frame.
//!
//! Lines tell where frames begin, so a row of the wrong length is found where it stands and not taken for the beginning of
//! the next frame. To the format itself line ends are blanks: frames that share lines, or that take several, are believed
//! where the header counts as many.

use super::error::BvhError;
use super::words::Words;
use crate::clip::Problem;

/// The numbers of all frames, and what is wrong with them.
pub(super) struct Rows {
    /// One frame after the other.
    pub numbers: Vec<f64>,
    pub problems: Vec<Problem>,
}

/// A line with another number of numbers than a frame has.
struct Odd {
    line: usize,
    found: usize,
}

/// Reads the frames, of `width` numbers each, of which the header states `count`.
pub(super) fn rows(words: &mut Words, width: usize, count: u64) -> Result<Rows, BvhError> {
    // Growing would take twice the memory.
    let mut numbers = Vec::with_capacity(words.left());
    let mut odd = None;
    let (mut line, mut begun) = (words.line, 0);
    while let Some(word) = words.next() {
        if words.line != line {
            odd = odd.or_else(|| is_odd(line, numbers.len() - begun, width));
            (line, begun) = (words.line, numbers.len());
        }
        numbers.push(words.parsed(word, "a number")?);
    }
    let last = numbers.len() - begun;
    let (frames, over) = (numbers.len() / width, numbers.len() % width);
    let whole = over == 0 && frames as u64 == count;
    // A file that was cut off ends within a frame.
    let cut = is_odd(line, last, width).filter(|_| last > width || frames == 0);
    if let Some(Odd { line, found }) = odd.or(cut).filter(|_| !whole) {
        return Err(BvhError::Row { line, found, width });
    }
    if frames == 0 {
        return Err(BvhError::NoFrames);
    }
    let mut problems = Vec::new();
    if over > 0 {
        problems.push(Problem::warning(
            "frame-cut",
            format!("line {line}: the last frame has {over} of {width} numbers and is left out; the file may be cut off"),
        ));
    }
    numbers.truncate(frames * width);
    problems.extend(other_count(count, frames));
    Ok(Rows { numbers, problems })
}

fn is_odd(line: usize, found: usize, width: usize) -> Option<Odd> {
    (found != width && found > 0).then_some(Odd { line, found })
}

fn other_count(stated: u64, found: usize) -> Option<Problem> {
    (stated != found as u64).then(|| {
        Problem::warning(
            "frame-count",
            format!(
                "the header counts {stated} frames, but {found} follow: these were read; the file may be cut off, or joined by hand"
            ),
        )
    })
}
