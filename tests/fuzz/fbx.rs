//! Damage inside binary FBX files: records, values and arrays are changed and written again, and then perhaps one of the numbers
//! that state their lengths.

use super::random::Random;
use miniz_oxide::inflate::decompress_to_vec_zlib;

const HEADER: usize = 27;
const WIDE_VERSION: u32 = 7500;

#[derive(Clone)]
struct Record {
    name: Vec<u8>,
    values: Vec<Value>,
    children: Vec<Record>,
}

#[derive(Clone)]
enum Value {
    /// Letter and bytes of a single value; texts have their length before them.
    One(u8, Vec<u8>),
    /// Letter, encoding, count and bytes as they stand in the file.
    Array(u8, u32, u32, Vec<u8>),
}

/// A file's records.
pub struct Fbx {
    header: Vec<u8>,
    version: u32,
    records: Vec<Record>,
}

/// Bytes that were written, and where the numbers are that tell lengths and counts: place and width.
struct Written {
    bytes: Vec<u8>,
    lengths: Vec<(usize, usize)>,
    wide: bool,
}

impl Fbx {
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        if !bytes.starts_with(b"Kaydara FBX Binary") || bytes.get(22) != Some(&0) {
            return None;
        }
        let version = u32::from_le_bytes(*bytes.get(23..)?.first_chunk()?);
        let wide = version >= WIDE_VERSION;
        let mut at = HEADER;
        let mut records = Vec::new();
        while let Some(record) = record(bytes, &mut at, wide)? {
            records.push(record);
        }
        let header = bytes[..HEADER].to_vec();
        Some(Self {
            header,
            version,
            records,
        })
    }

    pub fn mutated(&self, random: &mut Random) -> Vec<u8> {
        let mut records = self.records.clone();
        for _ in 0..random.few() {
            change(&mut records, random);
        }
        let mut written = Written {
            bytes: self.header.clone(),
            lengths: Vec::new(),
            wide: self.version >= WIDE_VERSION,
        };
        for record in &records {
            written.record(record);
        }
        written.end();
        if random.one_in(3) {
            written.damage(random);
        }
        written.bytes
    }
}

/// Reads a size of 4 or 8 bytes.
fn size(bytes: &[u8], at: &mut usize, wide: bool) -> Option<usize> {
    let width = if wide { 8 } else { 4 };
    let mut word = [0; 8];
    word[..width].copy_from_slice(bytes.get(*at..*at + width)?);
    *at += width;
    usize::try_from(u64::from_le_bytes(word)).ok()
}

/// The record at `at`; none at the end marker of a list.
fn record(bytes: &[u8], at: &mut usize, wide: bool) -> Option<Option<Record>> {
    let end = size(bytes, at, wide)?;
    let (count, length) = (size(bytes, at, wide)?, size(bytes, at, wide)?);
    let name = usize::from(*bytes.get(*at)?);
    *at += 1;
    if end == 0 {
        return Some(None);
    }
    let name = bytes.get(*at..*at + name)?.to_vec();
    *at += name.len();
    let after = *at + length;
    let values: Option<Vec<Value>> = (0..count).map(|_| value(bytes, at)).collect();
    *at = after;
    let mut children = Vec::new();
    while *at < end {
        match record(bytes, at, wide)? {
            Some(child) => children.push(child),
            None => break,
        }
    }
    *at = end;
    Some(Some(Record {
        name,
        values: values?,
        children,
    }))
}

fn value(bytes: &[u8], at: &mut usize) -> Option<Value> {
    let letter = *bytes.get(*at)?;
    *at += 1;
    let width = match letter {
        b'C' | b'B' | b'Z' => 1,
        b'Y' => 2,
        b'I' | b'F' => 4,
        b'L' | b'D' => 8,
        b'S' | b'R' => size(bytes, at, false)?,
        _ => {
            let (count, encoding) = (size(bytes, at, false)?, size(bytes, at, false)?);
            let length = size(bytes, at, false)?;
            let content = bytes.get(*at..*at + length)?.to_vec();
            *at += length;
            return Some(Value::Array(letter, encoding as u32, count as u32, content));
        }
    };
    let content = bytes.get(*at..*at + width)?.to_vec();
    *at += width;
    Some(Value::One(letter, content))
}

/// Changes a record somewhere below.
fn change(records: &mut Vec<Record>, random: &mut Random) {
    let at = random.below(records.len());
    let Some(record) = records.get_mut(at) else {
        return;
    };
    if !record.children.is_empty() && !random.one_in(8) {
        return change(&mut record.children, random);
    }
    if !record.values.is_empty() && !random.one_in(4) {
        let other = random.below(record.values.len());
        let other = record.values[other].clone();
        let place = random.below(record.values.len());
        return record.values[place].change(other, random);
    }
    match random.below(6) {
        0 => drop(records.remove(at)),
        1 => records.insert(at, records[at].clone()),
        2 => {
            let other = random.below(records.len());
            records.swap(at, other);
        }
        3 => drop(record.values.pop()),
        4 => {
            let inner = record.clone();
            record.children.push(inner);
        }
        _ => {
            let copy = records[at].clone();
            records.extend(vec![copy; 1 << random.below(9)]);
        }
    }
}

impl Value {
    fn change(&mut self, other: Value, random: &mut Random) {
        if random.one_in(6) {
            *self = other;
            return;
        }
        match self {
            Self::One(letter, bytes) => match (*letter, random.below(8)) {
                (_, 0) => *letter = *random.of(b"CYIFLDSRifldbcx"),
                (b'F', _) => *bytes = (random.real() as f32).to_le_bytes().to_vec(),
                (b'D', _) => *bytes = random.real().to_le_bytes().to_vec(),
                // Ids near each other are often of objects that belong together.
                (b'L', 1..4) => {
                    if let Some(byte) = bytes.get_mut(random.below(2)) {
                        *byte = byte.wrapping_add(random.below(5) as u8);
                    }
                }
                (b'S' | b'R', _) => super::plain::mutate(bytes, random),
                _ => {
                    let width = bytes.len().min(8);
                    bytes[..width].copy_from_slice(&random.edge().to_le_bytes()[..width]);
                }
            },
            Self::Array(letter, encoding, count, bytes) => match random.below(8) {
                0 => *count = random.edge() as u32,
                1 => *encoding = random.edge() as u32,
                2 => *letter = *random.of(b"ifldbcx"),
                3 => super::plain::mutate(bytes, random),
                _ => numbers(*letter, encoding, count, bytes, random),
            },
        }
    }
}

/// Changes the numbers in an array, which is unpacked for it.
fn numbers(
    letter: u8,
    encoding: &mut u32,
    count: &mut u32,
    bytes: &mut Vec<u8>,
    random: &mut Random,
) {
    if *encoding == 1 {
        let Ok(unpacked) = decompress_to_vec_zlib(bytes) else {
            return;
        };
        (*bytes, *encoding) = (unpacked, 0);
    }
    let width = if b"ld".contains(&letter) { 8 } else { 4 };
    for _ in 0..random.few() {
        let at = random.below(bytes.len() / width) * width;
        let number = match letter {
            b'd' => random.real().to_bits(),
            b'f' => u64::from((random.real() as f32).to_bits()),
            _ => random.edge(),
        };
        if let Some(place) = bytes.get_mut(at..at + width) {
            place.copy_from_slice(&number.to_le_bytes()[..width]);
        }
    }
    if random.one_in(4) {
        bytes.truncate(random.below(bytes.len() / width) * width);
        *count = (bytes.len() / width) as u32;
    }
}

impl Written {
    fn size(&mut self, size: usize) -> usize {
        let width = if self.wide { 8 } else { 4 };
        let at = self.bytes.len();
        self.lengths.push((at, width));
        self.bytes.extend(&(size as u64).to_le_bytes()[..width]);
        at
    }

    fn record(&mut self, record: &Record) {
        let start = self.size(0);
        self.size(record.values.len());
        let length = self.size(0);
        self.lengths.push((self.bytes.len(), 1));
        self.bytes.push(record.name.len() as u8);
        self.bytes.extend(&record.name);
        let before = self.bytes.len();
        record.values.iter().for_each(|value| self.value(value));
        self.fill(length, self.bytes.len() - before);
        if !record.children.is_empty() {
            record.children.iter().for_each(|child| self.record(child));
            self.end();
        }
        self.fill(start, self.bytes.len());
    }

    fn end(&mut self) {
        let width = if self.wide { 25 } else { 13 };
        self.bytes.resize(self.bytes.len() + width, 0);
    }

    fn fill(&mut self, at: usize, size: usize) {
        let width = if self.wide { 8 } else { 4 };
        self.bytes[at..at + width].copy_from_slice(&(size as u64).to_le_bytes()[..width]);
    }

    fn word(&mut self, word: u32) {
        self.lengths.push((self.bytes.len(), 4));
        self.bytes.extend(word.to_le_bytes());
    }

    fn value(&mut self, value: &Value) {
        match value {
            Value::One(letter, content) => {
                self.bytes.push(*letter);
                if b"SR".contains(letter) {
                    self.word(content.len() as u32);
                }
                self.bytes.extend(content);
            }
            Value::Array(letter, encoding, count, content) => {
                self.bytes.push(*letter);
                self.word(*count);
                self.word(*encoding);
                self.word(content.len() as u32);
                self.bytes.extend(content);
            }
        }
    }

    /// Puts a wrong number in place of a length or a count.
    fn damage(&mut self, random: &mut Random) {
        let (at, width) = *random.of(&self.lengths);
        let near = self.bytes[at].wrapping_add(random.below(5) as u8);
        match random.below(2) {
            0 => self.bytes[at] = near,
            _ => self.bytes[at..at + width].copy_from_slice(&random.edge().to_le_bytes()[..width]),
        }
    }
}
