//! Checks every length of a file, and makes the copy of its bytes that `fbxcel` reads.
//!
//! Why it is needed: `fbxcel` 0.9 trusts the file. It adds a record's lengths unchecked; it reads as many values as the record
//! announces, also beyond the record's end, and then panics ("Attempt to skip backward"); and it nests as deep as the file
//! says. It hands every compressed array to a zlib decoder, which takes its header from the bytes behind an array that is
//! shorter than that. And it refuses a whole file for one name that isn't UTF-8, or one value of the types `B`, `Z` and
//! `c`, all of which exporters write.

use super::error::{FbxError, broken};
use super::numbers::word;

/// Deepest nesting of records. Chosen: real files nest about eight deep, and dropping the records is recursive.
const MAX_DEPTH: usize = 64;
/// Count, encoding and byte length of an array.
pub(super) const ARRAY_HEADER: usize = 12;

/// A copy of `bytes` that `fbxcel` reads without fail, if end markers are where records end. Every byte keeps its place. `start`
/// is that of the first record, and `wide` says whether record headers are 64-bit.
///
/// The copy differs in three ways. Names have `?` for bytes outside ASCII. Types that `fbxcel` doesn't know are replaced by types
/// of the same layout. And no array is compressed, so that `fbxcel` skips it without a decoder.
pub(super) fn readable(bytes: &[u8], start: usize, wide: bool) -> Result<Vec<u8>, FbxError> {
    let mut scan = Scan {
        bytes,
        wide,
        copy: bytes.to_vec(),
    };
    scan.list(start, bytes.len(), 0)?;
    Ok(scan.copy)
}

struct Scan<'a> {
    bytes: &'a [u8],
    wide: bool,
    copy: Vec<u8>,
}

/// Header of a record.
struct Header {
    /// Place of the byte after the record.
    end: usize,
    /// Number of values.
    values: u64,
    /// Bytes of all values.
    values_len: usize,
    /// Bytes of the name.
    name_len: usize,
}

impl Header {
    fn is_end_marker(&self) -> bool {
        self.end == 0 && self.values == 0 && self.values_len == 0 && self.name_len == 0
    }
}

impl<'a> Scan<'a> {
    /// Records from `at` up to `end`, or up to an end marker; `fbxcel` refuses a file where that isn't the same.
    fn list(&mut self, mut at: usize, end: usize, depth: usize) -> Result<(), FbxError> {
        if depth > MAX_DEPTH {
            return Err(broken(at, "records are nested too deep"));
        }
        // The list of top-level records has no length: only its end marker ends it.
        while depth == 0 || at < end {
            let (header, name_at) = self.header(at, end)?;
            if header.is_end_marker() {
                return Ok(());
            }
            // A record must go forward and stay within its parent, or reading it would never end.
            if header.end <= at || header.end > end {
                let reason = "a record ends outside the record that holds it";
                return Err(broken(at, reason));
            }
            let values_at = self.name(name_at, header.name_len, header.end)?;
            self.slice(values_at, header.values_len, header.end)?;
            let children_at = values_at + header.values_len;
            self.values(values_at, children_at, header.values)?;
            self.list(children_at, header.end, depth + 1)?;
            at = header.end;
        }
        Ok(())
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

    /// `len` bytes at `at`, which must end within `end`.
    fn slice(&self, at: usize, len: usize, end: usize) -> Result<&'a [u8], FbxError> {
        let stop = at.checked_add(len).filter(|&stop| stop <= end);
        stop.and_then(|stop| self.bytes.get(at..stop))
            .ok_or_else(|| broken(at, "the data ends early"))
    }

    /// Checks a name, and returns the place after it.
    fn name(&mut self, at: usize, len: usize, end: usize) -> Result<usize, FbxError> {
        let name = self.slice(at, len, end)?;
        for (place, byte) in (at..).zip(name) {
            if !byte.is_ascii() {
                self.patch(place, b'?');
            }
        }
        Ok(at + len)
    }

    /// Checks that `count` values fill the bytes from `at` to `end`.
    fn values(&mut self, mut at: usize, end: usize, count: u64) -> Result<(), FbxError> {
        for _ in 0..count {
            at = self.value(at, end)?;
        }
        if at == end {
            Ok(())
        } else {
            Err(broken(at, "a record's values don't fill their length"))
        }
    }

    /// Checks a value, and returns the place after it.
    fn value(&mut self, at: usize, end: usize) -> Result<usize, FbxError> {
        let kind = self.slice(at, 1, end)?[0];
        let body = at + 1;
        // Bytes of a value by its type's letter.
        let len = match kind {
            b'C' | b'B' | b'Z' => {
                self.patch(at, b'C');
                1
            }
            b'Y' => 2,
            b'I' | b'F' => 4,
            b'L' | b'D' => 8,
            b'S' | b'R' => 4 + self.length(body, end)?,
            b'b' | b'c' => {
                self.patch(at, b'b');
                self.array(body, end)?
            }
            b'f' | b'd' | b'i' | b'l' => self.array(body, end)?,
            _ => return Err(broken(at, "a value has an unknown type")),
        };
        self.slice(body, len, end)?;
        Ok(body + len)
    }

    fn length(&self, at: usize, end: usize) -> Result<usize, FbxError> {
        self.slice(at, 4, end).map(|bytes| word(bytes) as usize)
    }

    /// Checks an array, and returns its length with its header.
    fn array(&mut self, at: usize, end: usize) -> Result<usize, FbxError> {
        let encoding = at + 4;
        if self.length(encoding, end)? > 1 {
            return Err(broken(at, "an array has an unknown encoding"));
        }
        self.patch(encoding, 0);
        Ok(ARRAY_HEADER + self.length(at + 8, end)?)
    }

    fn patch(&mut self, at: usize, byte: u8) {
        if let Some(place) = self.copy.get_mut(at) {
            *place = byte;
        }
    }
}
