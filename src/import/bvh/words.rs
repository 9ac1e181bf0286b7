//! Words of a BVH file and the lines that they are on.

use super::error::BvhError;

/// Numbers beyond this are damage, in the file's units or degrees. Chosen.
const MOST: f64 = 1e9;

/// The words of a text, one after the other. Line ends are blanks to the format, except after a joint's name.
pub(super) struct Words<'a> {
    lines: std::iter::Enumerate<std::str::Split<'a, char>>,
    /// Line of the last word, counted from 1.
    pub line: usize,
    rest: &'a str,
}

impl<'a> Words<'a> {
    pub fn new(text: &'a str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        // A lone carriage return ends a line in files from old machines.
        let end = if text.contains('\n') { '\n' } else { '\r' };
        Self {
            lines: text.split(end).enumerate(),
            line: 1,
            rest: "",
        }
    }

    /// The next word; a brace is a word of its own.
    pub fn next(&mut self) -> Option<&'a str> {
        let space = |c: char| c.is_whitespace() || c == '\0';
        loop {
            self.rest = self.rest.trim_start_matches(space);
            if !self.rest.is_empty() {
                break;
            }
            let (number, line) = self.lines.next()?;
            (self.line, self.rest) = (number + 1, line);
        }
        let brace = self.rest.starts_with(['{', '}']);
        let end = match brace {
            true => 1,
            false => self
                .rest
                .find(|c| space(c) || c == '{' || c == '}')
                .unwrap_or(self.rest.len()),
        };
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        Some(word)
    }

    /// How many words are left, if none of them is a brace.
    pub fn left(&self) -> usize {
        let lines = self.lines.clone().map(|(_, line)| line);
        let words = |line: &str| line.split_whitespace().count();
        words(self.rest) + lines.map(words).sum::<usize>()
    }

    /// The words up to the end of the line or a brace, as one name.
    pub fn name(&mut self) -> String {
        let end = self.rest.find(['{', '}', '\r']).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        self.rest = rest;
        name.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// The next word, which must be there.
    pub fn expect(&mut self, expected: &'static str) -> Result<&'a str, BvhError> {
        let line = self.line;
        self.next().ok_or(BvhError::Missing {
            line,
            what: expected,
        })
    }

    /// Reads the word `word`, in any letter case.
    pub fn keyword(&mut self, word: &'static str) -> Result<(), BvhError> {
        match self.expect(word)? {
            found if found.eq_ignore_ascii_case(word) => Ok(()),
            found => Err(self.unexpected(found, word)),
        }
    }

    /// The next word as a number.
    pub fn number(&mut self, what: &'static str) -> Result<f64, BvhError> {
        let word = self.expect(what)?;
        self.parsed(word, what)
    }

    /// `word` as a number.
    pub fn parsed(&self, word: &str, what: &'static str) -> Result<f64, BvhError> {
        // Some locales write a decimal comma.
        let number = word.parse().or_else(|_| word.replacen(',', ".", 1).parse());
        match number {
            Ok(number) if f64::abs(number) < MOST => Ok(number),
            _ => Err(self.unexpected(word, what)),
        }
    }

    /// The error of a word where another should be.
    pub fn unexpected(&self, found: &str, expected: &'static str) -> BvhError {
        BvhError::Unexpected {
            line: self.line,
            found: found.chars().take(40).collect(),
            expected,
        }
    }
}
