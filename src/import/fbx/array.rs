//! Arrays of the file, decoded only when needed and within a budget.

use super::numbers::{double_word, word};
use miniz_oxide::inflate::{TINFLStatus, decompress_slice_iter_to_slice};
use std::borrow::Cow;
use std::iter::once;

/// No DEFLATE stream expands by more than this factor: at best two bits stand for 258 bytes (RFC 1951).
const MAX_EXPANSION: usize = 1032;

/// Type of an array's values.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    Byte,
    I32,
    I64,
    F32,
    F64,
}

/// An array value, still encoded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Array<'a> {
    /// Type of its values.
    pub kind: Kind,
    /// Whether `data` is a zlib stream.
    pub compressed: bool,
    /// How many values it claims to have.
    pub count: usize,
    /// Its bytes in the file.
    pub data: &'a [u8],
}

impl<'a> Array<'a> {
    /// Bytes per value.
    fn width(&self) -> usize {
        match self.kind {
            Kind::I64 | Kind::F64 => 8,
            Kind::I32 | Kind::F32 => 4,
            Kind::Byte => 1,
        }
    }

    /// The decoded bytes, of which `budget` has enough.
    fn bytes(&self, budget: &mut usize) -> Result<Cow<'a, [u8]>, &'static str> {
        // The budget is spent before anything is allocated.
        let len = self.width().saturating_mul(self.count);
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

    /// The values of an array of reals.
    pub fn reals(&self, budget: &mut usize) -> Result<Vec<f64>, &'static str> {
        let bytes = self.bytes(budget)?;
        let chunks = bytes.chunks_exact(self.width());
        Ok(match self.kind {
            Kind::F32 => chunks.map(|b| f64::from(f32::from_bits(word(b)))).collect(),
            Kind::F64 => chunks.map(|b| f64::from_bits(double_word(b))).collect(),
            _ => return Err("an array that should hold reals holds integers"),
        })
    }

    /// The values of an array of integers.
    pub fn integers(&self, budget: &mut usize) -> Result<Vec<i64>, &'static str> {
        let bytes = self.bytes(budget)?;
        let chunks = bytes.chunks_exact(self.width());
        Ok(match self.kind {
            Kind::I32 => chunks.map(|b| i64::from(word(b) as i32)).collect(),
            Kind::I64 => chunks.map(|b| double_word(b) as i64).collect(),
            _ => return Err("an array that should hold integers holds something else"),
        })
    }

    /// The bits of an array of 32-bit values: key attributes have integers in an array of reals.
    pub fn words(&self, budget: &mut usize) -> Result<Vec<u32>, &'static str> {
        if self.width() != 4 {
            return Err("an array that should hold 32-bit values doesn't");
        }
        Ok(self.bytes(budget)?.chunks_exact(4).map(word).collect())
    }
}

/// Decodes a zlib stream (RFC 1950) that holds exactly `len` bytes.
fn inflate(stream: &[u8], len: usize) -> Result<Vec<u8>, &'static str> {
    if len > stream.len().saturating_mul(MAX_EXPANSION) {
        return Err("a compressed array claims more values than its bytes can hold");
    }
    let mut out = vec![0; len];
    match decompress_slice_iter_to_slice(&mut out, once(stream), true, false) {
        Ok(held) if held == len => Ok(out),
        Ok(_) => Err("a compressed array holds fewer values than it claims"),
        Err(TINFLStatus::HasMoreOutput) => {
            Err("a compressed array holds more values than it claims")
        }
        Err(TINFLStatus::Adler32Mismatch) => Err("a compressed array fails its checksum"),
        Err(TINFLStatus::FailedCannotMakeProgress) => Err("a compressed array ends early"),
        Err(_) => Err("a compressed array isn't a valid zlib stream"),
    }
}

#[cfg(test)]
mod tests {
    use super::inflate;

    /// A stored block (RFC 1951, 3.2.4) of the letters that RFC 1950's checksum is known for: adler32("Wikipedia").
    const STREAM: [u8; 20] = *b"\x78\x01\x01\x09\x00\xf6\xffWikipedia\x11\xe6\x03\x98";

    #[test]
    fn a_stream_holds_exactly_its_length() {
        assert_eq!(inflate(&STREAM, 9).as_deref(), Ok(b"Wikipedia".as_slice()));
        // The empty stream, with one stored block.
        let empty = b"\x78\x01\x01\x00\x00\xff\xff\x00\x00\x00\x01";
        assert_eq!(inflate(empty, 0).as_deref(), Ok(b"".as_slice()));
        assert!(inflate(empty, 1).is_err_and(|fault| fault.contains("fewer")));
        assert!(inflate(&STREAM, 10).is_err_and(|fault| fault.contains("fewer")));
        for short in 0..9 {
            assert!(inflate(&STREAM, short).is_err_and(|fault| fault.contains("more")));
        }
        assert!(inflate(&STREAM, usize::MAX).is_err_and(|fault| fault.contains("can hold")));
    }

    #[test]
    fn a_damaged_stream_is_an_error() {
        for len in 0..STREAM.len() {
            assert!(inflate(&STREAM[..len], 9).is_err(), "cut to {len} bytes");
        }
        // Bits 19 to 23 pad the block's header and mean nothing.
        for bit in (0..8 * STREAM.len()).filter(|bit| !(19..24).contains(bit)) {
            let mut stream = STREAM;
            stream[bit / 8] ^= 1 << (bit % 8);
            assert!(inflate(&stream, 9).is_err(), "bit {bit} flipped");
        }
    }
}
