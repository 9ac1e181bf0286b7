//! What is drawn of a run's log, read line by line: a log may be longer than the memory.

use super::FIGURES;
use crate::failure::{Failure, Outcome};
use mimic::file::lines_at_most;
use serde::de::{IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::io;
use std::iter::repeat_n;
use std::path::Path;

/// Most bytes that are read of a run's log and of one of its lines, and most lines. Chosen: a line of a log has about five hundred
/// bytes, and no run has a million iterations.
const MOST_BYTES: u64 = 1 << 30;
const MOST_OF_LINE: u64 = 1 << 16;
const MOST_LINES: usize = 1_000_000;

/// The samples of the iterations, and the fields of [`FIGURES`]. NaN stands for no number, and so does the end of a column.
#[derive(Default)]
pub struct Columns {
    /// How many there are.
    pub iterations: usize,
    /// Samples learned from so far.
    pub samples: Vec<f64>,
    /// The figures, in their order.
    pub figures: [Vec<f64>; FIGURES.len()],
}

impl Columns {
    fn add(&mut self, line: &Line) {
        let columns = std::iter::once(&mut self.samples).chain(&mut self.figures);
        let values = std::iter::once(&line.samples).chain(&line.figures);
        for (column, &value) in columns.zip(values).filter(|(_, value)| !value.is_nan()) {
            column.resize(self.iterations, f64::NAN);
            column.push(value);
        }
        self.iterations += 1;
    }

    /// Every iteration's value of a column.
    pub fn values(&self, column: &[f64]) -> impl Iterator<Item = f64> {
        let missing = self.iterations - column.len();
        column.iter().copied().chain(repeat_n(f64::NAN, missing))
    }
}

/// What is drawn of a line of the log. Other fields are passed over, for a log may have any number of any size.
struct Line {
    samples: f64,
    figures: [f64; FIGURES.len()],
}

/// The iterations of a log.
pub fn columns(path: &Path) -> Outcome<Columns> {
    let mut columns = Columns::default();
    let read = lines_at_most(path, MOST_BYTES, MOST_OF_LINE, |number, text| {
        if number > MOST_LINES {
            let cause = format!("it has more than {MOST_LINES} lines, the most that are drawn");
            return Err(Unread::Said(
                Failure::input(path, cause).with_remedy("draw another run"),
            ));
        }
        let line: Line = serde_json::from_str(text).map_err(|e| {
            // The reader counts lines too, from the start of this one.
            let e = e.to_string();
            let cause = e.split(" at line ").next().unwrap_or(&e);
            let failure = Failure::input(path, format!("this is not an iteration ({cause})"));
            let failure = failure.with_place(format!("line {number}"));
            Unread::Said(failure.with_remedy("remove the line"))
        })?;
        columns.add(&line);
        Ok(())
    });
    match read {
        Ok(()) if columns.iterations == 0 => {
            Err(Failure::input(path, "it holds no iteration yet").with_remedy("train longer"))
        }
        Ok(()) => Ok(columns),
        Err(Unread::Said(failure)) => Err(failure),
        Err(Unread::System(e)) if e.kind() == io::ErrorKind::NotFound => {
            Err(Failure::unreadable(path, &e).with_remedy("train the run first"))
        }
        Err(Unread::System(e)) => Err(Failure::unreadable(path, &e)),
    }
}

/// Why a log isn't read.
enum Unread {
    System(io::Error),
    Said(Failure),
}

impl From<io::Error> for Unread {
    fn from(error: io::Error) -> Self {
        Self::System(error)
    }
}

impl<'de> Deserialize<'de> for Line {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Drawn)
    }
}

struct Drawn;

impl<'de> Visitor<'de> for Drawn {
    type Value = Line;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Line, A::Error> {
        let mut line = Line {
            samples: f64::NAN,
            figures: [f64::NAN; FIGURES.len()],
        };
        while let Some(key) = map.next_key::<String>()? {
            let figure = FIGURES.iter().position(|(field, ..)| *field == key);
            let place = match figure {
                Some(figure) => &mut line.figures[figure],
                None if key == "samples" => &mut line.samples,
                None => {
                    map.next_value::<IgnoredAny>()?;
                    continue;
                }
            };
            *place = map.next_value::<Option<f64>>()?.unwrap_or(f64::NAN);
        }
        Ok(line)
    }
}
