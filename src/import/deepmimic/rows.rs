//! The rows of numbers in a file, one after the other: a list of lists would take many times the memory.

use super::ROW;
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, SeqAccess, Visitor};
use std::fmt;

/// The numbers of all frames.
#[derive(Default)]
pub(super) struct Rows {
    /// [`ROW`] numbers per frame, up to the first frame that has another number of them.
    pub numbers: Vec<f64>,
    /// That frame, and how many numbers it has.
    pub odd: Option<(usize, usize)>,
}

impl<'de> Deserialize<'de> for Rows {
    fn deserialize<D: Deserializer<'de>>(rows: D) -> Result<Self, D::Error> {
        rows.deserialize_seq(OfRows)
    }
}

struct OfRows;

impl<'de> Visitor<'de> for OfRows {
    type Value = Rows;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of frames")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Rows, A::Error> {
        let mut rows = Rows::default();
        let mut frame = 0;
        while let Some(found) = list.next_element_seed(Row(&mut rows.numbers))? {
            if found != ROW {
                rows.odd = Some((frame, found));
                while list.next_element::<IgnoredAny>()?.is_some() {}
                break;
            }
            frame += 1;
        }
        Ok(rows)
    }
}

/// Appends the numbers of a frame, and tells how many it has.
struct Row<'r>(&'r mut Vec<f64>);

impl<'de> DeserializeSeed<'de> for Row<'_> {
    type Value = usize;

    fn deserialize<D: Deserializer<'de>>(self, row: D) -> Result<usize, D::Error> {
        row.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Row<'_> {
    type Value = usize;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut row: A) -> Result<usize, A::Error> {
        let mut found = 0;
        while let Some(number) = row.next_element::<f64>()? {
            // A dog's frame has more, and is counted to the end.
            if found < ROW {
                self.0.push(number);
            }
            found += 1;
        }
        Ok(found)
    }
}
