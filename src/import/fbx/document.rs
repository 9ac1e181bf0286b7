//! The binary container: nested records with typed values, borrowed from the file's bytes.
//!
//! `fbxcel` can't be bounded here: its decoder ignores an array's byte length and keeps a whole DEFLATE block in
//! memory, whatever count the array claims, and it fails on names that aren't UTF-8. So the walk is ours: every
//! length is checked against its enclosing record, and arrays are decoded only when asked for, within a budget.

use super::{FbxError, inflate::inflate};
use std::borrow::Cow;

const MAGIC: &[u8] = b"Kaydara FBX Binary  \0";
/// Magic, the byte 0x1a, the byte order and the version.
const HEADER_LEN: usize = 27;
/// Real files nest about eight records deep.
const MAX_DEPTH: usize = 64;
/// First version with 64-bit record headers.
const WIDE_VERSION: u32 = 7500;

/// A record: a name, values and nested records.
#[derive(Debug)]
pub(super) struct Element<'a> {
    pub name: &'a [u8],
    pub values: Vec<Value<'a>>,
    pub children: Vec<Element<'a>>,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Value<'a> {
    Int(i64),
    Real(f64),
    Text(&'a [u8]),
    Array(Array<'a>),
}

/// An array value, still encoded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Array<'a> {
    kind: u8,
    compressed: bool,
    count: u32,
    data: &'a [u8],
}

/// A parsed file.
#[derive(Debug)]
pub(super) struct Document<'a> {
    pub records: Vec<Element<'a>>,
    /// Bytes that may still be decoded from arrays.
    pub budget: usize,
}

impl<'a> Document<'a> {
    pub fn parse(bytes: &'a [u8]) -> Result<Self, FbxError> {
        let version = version(bytes)?;
        let walk = Walk {
            bytes,
            wide: version >= WIDE_VERSION,
        };
        let (records, _) = walk.list(HEADER_LEN, bytes.len(), 0)?;
        let budget = bytes.len().saturating_mul(16).saturating_add(16 << 20);
        Ok(Self { records, budget })
    }

    pub fn record(&self, name: &str) -> Option<&Element<'a>> {
        self.records
            .iter()
            .find(|record| record.name == name.as_bytes())
    }
}

/// Checks the header and gives the version, e.g. 7400.
fn version(bytes: &[u8]) -> Result<u32, FbxError> {
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err(if looks_like_text(bytes) {
            FbxError::Ascii
        } else {
            FbxError::NotFbx
        });
    };
    let &[0x1a, order, a, b, c, d, ..] = rest else {
        return Err(broken(MAGIC.len(), "the header ends early"));
    };
    if order != 0 {
        return Err(FbxError::BigEndian);
    }
    match u32::from_le_bytes([a, b, c, d]) {
        version @ 7000..=7999 => Ok(version),
        found => Err(FbxError::Version { found }),
    }
}

fn looks_like_text(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(4096)];
    let has = |word: &[u8]| head.windows(word.len()).any(|window| window == word);
    !head.contains(&0) && (head.starts_with(b"; FBX") || has(b"FBXHeaderExtension:"))
}

fn broken(at: usize, reason: &str) -> FbxError {
    FbxError::Broken {
        place: format!("byte {at}"),
        reason: reason.into(),
    }
}

struct Walk<'a> {
    bytes: &'a [u8],
    wide: bool,
}

struct Header {
    end: usize,
    values: u64,
    values_len: usize,
    name_len: usize,
}

impl<'a> Walk<'a> {
    /// Records from `at` up to `end`, or up to an empty record, and the byte after them.
    fn list(
        &self,
        mut at: usize,
        end: usize,
        depth: usize,
    ) -> Result<(Vec<Element<'a>>, usize), FbxError> {
        if depth > MAX_DEPTH {
            return Err(broken(at, "records are nested too deep"));
        }
        let mut records = Vec::new();
        while depth == 0 || at < end {
            let start = at;
            let (header, after) = self.header(at, end)?;
            if header.end == 0
                && header.values == 0
                && header.values_len == 0
                && header.name_len == 0
            {
                return Ok((records, after));
            }
            if header.end <= start || header.end > end {
                return Err(broken(
                    start,
                    "a record ends outside the record that holds it",
                ));
            }
            let name = self.slice(after, header.name_len, header.end)?;
            let values_at = after + header.name_len;
            self.slice(values_at, header.values_len, header.end)?;
            at = values_at + header.values_len;
            let values = self.values(values_at, at, header.values)?;
            let (children, _) = self.list(at, header.end, depth + 1)?;
            records.push(Element {
                name,
                values,
                children,
            });
            at = header.end;
        }
        Ok((records, at))
    }

    fn header(&self, at: usize, end: usize) -> Result<(Header, usize), FbxError> {
        let size = if self.wide { 8 } else { 4 };
        let bytes = self.slice(at, 3 * size + 1, end)?;
        let number = |i: usize| {
            bytes[i * size..(i + 1) * size]
                .iter()
                .rev()
                .fold(0u64, |n, &byte| n << 8 | u64::from(byte))
        };
        let length =
            |n: u64| usize::try_from(n).map_err(|_| broken(at, "a length is out of range"));
        let header = Header {
            end: length(number(0))?,
            values: number(1),
            values_len: length(number(2))?,
            name_len: usize::from(bytes[3 * size]),
        };
        Ok((header, at + bytes.len()))
    }

    fn slice(&self, at: usize, len: usize, end: usize) -> Result<&'a [u8], FbxError> {
        let stop = at.checked_add(len).filter(|&stop| stop <= end);
        stop.and_then(|stop| self.bytes.get(at..stop))
            .ok_or_else(|| broken(at, "the data ends early"))
    }

    fn values(&self, mut at: usize, end: usize, count: u64) -> Result<Vec<Value<'a>>, FbxError> {
        let mut values = Vec::new();
        for _ in 0..count {
            let (value, next) = self.value(at, end)?;
            values.push(value);
            at = next;
        }
        if at != end {
            return Err(broken(at, "a record's values don't fill their length"));
        }
        Ok(values)
    }

    fn value(&self, at: usize, end: usize) -> Result<(Value<'a>, usize), FbxError> {
        let kind = self.slice(at, 1, end)?[0];
        let at = at + 1;
        let fixed = |len: usize| self.slice(at, len, end).map(|bytes| (bytes, at + len));
        Ok(match kind {
            b'B' | b'C' | b'Z' => fixed(1).map(|(b, next)| (Value::Int(i64::from(b[0])), next))?,
            b'Y' => fixed(2).map(|(b, next)| {
                (
                    Value::Int(i64::from(i16::from_le_bytes([b[0], b[1]]))),
                    next,
                )
            })?,
            b'I' => fixed(4).map(|(b, next)| (Value::Int(i64::from(word(b) as i32)), next))?,
            b'F' => {
                fixed(4).map(|(b, next)| (Value::Real(f64::from(f32::from_bits(word(b)))), next))?
            }
            b'L' => fixed(8).map(|(b, next)| (Value::Int(double_word(b) as i64), next))?,
            b'D' => {
                fixed(8).map(|(b, next)| (Value::Real(f64::from_bits(double_word(b))), next))?
            }
            b'S' | b'R' => {
                let len = word(fixed(4)?.0) as usize;
                (Value::Text(self.slice(at + 4, len, end)?), at + 4 + len)
            }
            b'b' | b'c' | b'f' | b'd' | b'i' | b'l' => {
                let head = fixed(12)?.0;
                let (count, encoding, len) =
                    (word(head), word(&head[4..]), word(&head[8..]) as usize);
                if encoding > 1 {
                    return Err(broken(at, "an array has an unknown encoding"));
                }
                let data = self.slice(at + 12, len, end)?;
                (
                    Value::Array(Array {
                        kind,
                        compressed: encoding == 1,
                        count,
                        data,
                    }),
                    at + 12 + len,
                )
            }
            _ => return Err(broken(at - 1, "a value has an unknown type")),
        })
    }
}

/// Little-endian; missing bytes count as zero.
fn word(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .take(4)
        .rev()
        .fold(0, |n, &byte| n << 8 | u32::from(byte))
}

fn double_word(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .take(8)
        .rev()
        .fold(0, |n, &byte| n << 8 | u64::from(byte))
}

impl<'a> Array<'a> {
    fn width(&self) -> usize {
        match self.kind {
            b'l' | b'd' => 8,
            b'i' | b'f' => 4,
            _ => 1,
        }
    }

    fn bytes(&self, budget: &mut usize) -> Result<Cow<'a, [u8]>, &'static str> {
        let len = self.width().saturating_mul(self.count as usize);
        *budget = budget
            .checked_sub(len)
            .ok_or("the arrays of the file are implausibly large")?;
        if self.compressed {
            inflate(self.data, len).map(Cow::Owned)
        } else if self.data.len() == len {
            Ok(Cow::Borrowed(self.data))
        } else {
            Err("an array doesn't fill its length")
        }
    }

    /// The array's values as reals.
    pub fn reals(&self, budget: &mut usize) -> Result<Vec<f64>, &'static str> {
        let bytes = self.bytes(budget)?;
        let chunks = bytes.chunks_exact(self.width());
        Ok(match self.kind {
            b'f' => chunks.map(|b| f64::from(f32::from_bits(word(b)))).collect(),
            b'd' => chunks.map(|b| f64::from_bits(double_word(b))).collect(),
            _ => return Err("an array that should hold reals holds integers"),
        })
    }

    /// The array's values as integers.
    pub fn integers(&self, budget: &mut usize) -> Result<Vec<i64>, &'static str> {
        let bytes = self.bytes(budget)?;
        let chunks = bytes.chunks_exact(self.width());
        Ok(match self.kind {
            b'i' => chunks.map(|b| i64::from(word(b) as i32)).collect(),
            b'l' => chunks.map(|b| double_word(b) as i64).collect(),
            _ => return Err("an array that should hold integers holds something else"),
        })
    }

    /// The bits of 32-bit values: key attributes pack integers into reals.
    pub fn words(&self, budget: &mut usize) -> Result<Vec<u32>, &'static str> {
        if self.width() != 4 {
            return Err("an array that should hold 32-bit values doesn't");
        }
        Ok(self.bytes(budget)?.chunks_exact(4).map(word).collect())
    }
}

impl<'a> Element<'a> {
    pub fn child(&self, name: &str) -> Option<&Element<'a>> {
        self.children
            .iter()
            .find(|child| child.name == name.as_bytes())
    }

    pub fn int(&self, index: usize) -> Option<i64> {
        self.values.get(index).and_then(Value::int)
    }

    pub fn text(&self, index: usize) -> Option<&'a [u8]> {
        match self.values.get(index) {
            Some(&Value::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// The array that is the first value of the child `name`.
    pub fn array(&self, name: &str) -> Option<Array<'a>> {
        match self.child(name)?.values.first() {
            Some(&Value::Array(array)) => Some(array),
            _ => None,
        }
    }
}

impl Value<'_> {
    /// Reals are cut off towards zero, as exporters write some enumerations as reals.
    pub fn int(&self) -> Option<i64> {
        match *self {
            Value::Int(value) => Some(value),
            Value::Real(value) if value.is_finite() => Some(value as i64),
            _ => None,
        }
    }

    /// Only values that later arithmetic can't overflow.
    pub fn real(&self) -> Option<f64> {
        match *self {
            Value::Int(value) => Some(value as f64),
            Value::Real(value) if super::in_range(value) => Some(value),
            _ => None,
        }
    }
}
