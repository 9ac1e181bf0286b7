//! Lines of words, of which both files consist.

use super::error::AcclaimError;
use std::str::SplitWhitespace;

/// Numbers beyond this are damage, in the file's units or degrees. Chosen.
const MOST: f64 = 1e9;

/// A line's first word and what follows it.
pub(super) struct Line<'a> {
    /// Counted from 1.
    pub number: usize,
    /// The first word.
    pub key: &'a str,
    words: SplitWhitespace<'a>,
}

/// The lines of a text, without blank ones and comments.
pub(super) fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text.lines().enumerate().filter_map(|(number, line)| {
        let mut words = line.split_whitespace();
        let key = words.next().filter(|key| !key.starts_with('#'))?;
        Some(Line {
            number: number + 1,
            key,
            words,
        })
    })
}

impl<'a> Line<'a> {
    /// The next word.
    pub fn next(&mut self) -> Option<&'a str> {
        self.words.next()
    }

    /// The next word, which must be there.
    pub fn expect(&mut self, expected: &'static str) -> Result<&'a str, AcclaimError> {
        self.next()
            .ok_or_else(|| self.unexpected("the line's end", expected))
    }

    /// The next word as a number.
    pub fn number(&mut self, expected: &'static str) -> Result<f64, AcclaimError> {
        let word = self.expect(expected)?;
        match word.parse() {
            Ok(number) if f64::abs(number) < MOST => Ok(number),
            _ => Err(self.unexpected(word, expected)),
        }
    }

    /// The next words as numbers.
    pub fn numbers<const N: usize>(
        &mut self,
        expected: &'static str,
    ) -> Result<[f64; N], AcclaimError> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number(expected)?;
        }
        Ok(numbers)
    }

    /// The error of a word where another should be.
    pub fn unexpected(&self, found: &str, expected: &'static str) -> AcclaimError {
        AcclaimError::Unexpected {
            line: self.number,
            found: short(found),
            expected,
        }
    }

    /// The error of a line that contradicts others.
    pub fn broken(&self, reason: String, remedy: &'static str) -> AcclaimError {
        AcclaimError::Broken {
            line: self.number,
            reason,
            remedy,
        }
    }
}

/// A word short enough for a message.
pub(super) fn short(word: &str) -> String {
    word.chars().take(40).collect()
}
