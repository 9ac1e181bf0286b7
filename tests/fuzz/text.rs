//! Damage to texts, word by word and line by line: BVH, ASF, AMC, ASCII FBX and MJCF.

use super::random::Random;
use std::ops::Range;

/// Numbers that a parser or arithmetic may trip over.
const NUMBERS: [&str; 20] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "7",
    "65536",
    "2147483648",
    "-9223372036854775808",
    "18446744073709551616",
    "1e9",
    "1e308",
    "1e999",
    "-1e999",
    "1e-320",
    "nan",
    "inf",
    "0x10",
    "1,5",
    "",
];

/// Words of a text, and its lines with their ends.
pub struct Text {
    words: Vec<Range<usize>>,
    lines: Vec<Range<usize>>,
}

impl Text {
    /// A text whose words are apart by blanks and commas.
    pub fn new(bytes: &[u8]) -> Self {
        Self::cut(bytes, |byte| byte.is_ascii_whitespace() || byte == b',')
    }

    /// An XML text, whose words are names, and what stands in the values of attributes.
    pub fn xml(bytes: &[u8]) -> Self {
        Self::cut(bytes, |byte| {
            byte.is_ascii_whitespace() || b"\"'=<>/".contains(&byte)
        })
    }

    fn cut(bytes: &[u8], is_space: fn(u8) -> bool) -> Self {
        let ends = |cut: fn(u8) -> bool| -> Vec<usize> {
            let places = (0..bytes.len()).filter(|&at| cut(bytes[at]));
            places.chain([bytes.len()]).collect()
        };
        let between = |ends: Vec<usize>, kept: usize| -> Vec<Range<usize>> {
            let starts = std::iter::once(0).chain(ends.iter().map(|end| end + 1));
            let parts = starts.zip(&ends).map(|(start, &end)| start..end + kept);
            parts
                .map(|part| part.start..part.end.min(bytes.len()))
                .filter(|part| !part.is_empty())
                .collect()
        };
        Self {
            words: between(ends(is_space), 0),
            lines: between(ends(|byte| byte == b'\n'), 1),
        }
    }

    /// Changes words or lines, the last in the text first, so that the places of the others stay right.
    pub fn mutate(&self, bytes: &mut Vec<u8>, random: &mut Random) {
        let whole_lines = random.one_in(3);
        let parts = if whole_lines {
            &self.lines
        } else {
            &self.words
        };
        let mut chosen: Vec<usize> = (0..random.few() + random.few())
            .map(|_| random.below(parts.len()))
            .collect();
        chosen.sort_unstable();
        chosen.dedup();
        let original = bytes.clone();
        for place in chosen.into_iter().rev() {
            let part = parts[place].clone();
            let other = &original[random.of(parts).clone()];
            let new = if whole_lines {
                line(&original[part.clone()], other, random)
            } else {
                word(&original[part.clone()], other, random)
            };
            bytes.splice(part, new);
        }
    }
}

fn word(word: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    match random.below(6) {
        0 | 1 => random.of(&NUMBERS).as_bytes().to_vec(),
        2 => other.to_vec(),
        3 => [word, b" ", other].concat(),
        4 => random
            .of(&[&b"{"[..], b"}", b"\"", b";", b":", b"\0", b"\xff", b"{ {"])
            .to_vec(),
        _ => word.repeat(random.below(5)),
    }
}

fn line(line: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    match random.below(5) {
        0 => Vec::new(),
        1 => line.repeat(2 + random.below(3)),
        2 => other.to_vec(),
        3 => [other, line].concat(),
        _ => line.repeat(1 << random.below(10)),
    }
}
