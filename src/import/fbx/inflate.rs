//! zlib streams (RFC 1950 and 1951) whose decoded length is known beforehand.
//!
//! The decoder stops at that length, so that a hostile stream can't ask for more memory than its array claims.

/// No DEFLATE stream expands more than this: 258 bytes out of two bits.
const MAX_EXPANSION: usize = 1032;
const MAX_CODE_BITS: usize = 15;
const LENGTH_BASE: [u16; 29] = [
    3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99, 115, 131,
    163, 195, 227, 258,
];
const LENGTH_BITS: [u8; 29] = [
    0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0,
];
const DISTANCE_BASE: [u16; 30] = [
    1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513, 769, 1025, 1537,
    2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577,
];
const CODE_LENGTH_ORDER: [usize; 19] = [
    16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15,
];

type Fault = &'static str;
const ENDS_EARLY: Fault = "a compressed array ends early";
const BAD_CODE: Fault = "a compressed array holds an invalid code";

/// Decodes a zlib stream to exactly `length` bytes.
pub(super) fn inflate(stream: &[u8], length: usize) -> Result<Vec<u8>, Fault> {
    let &[method, flags, ref body @ ..] = stream else {
        return Err(ENDS_EARLY);
    };
    if method & 0x0f != 8 || flags & 0x20 != 0 || u16::from_be_bytes([method, flags]) % 31 != 0 {
        return Err("a compressed array has no zlib header");
    }
    if length > stream.len().saturating_mul(MAX_EXPANSION) {
        return Err("a compressed array claims more values than its bytes can hold");
    }
    let mut decoder = Decoder {
        bits: Bits::new(body),
        out: Vec::with_capacity(length),
        length,
    };
    while !decoder.block()? {}
    if decoder.out.len() != length {
        return Err("a compressed array holds fewer values than it claims");
    }
    match decoder.bits.trailer() {
        Some(sum) if sum != adler32(&decoder.out) => Err("a compressed array fails its checksum"),
        Some(_) => Ok(decoder.out),
        None => Err(ENDS_EARLY),
    }
}

/// Checksum of RFC 1950.
fn adler32(bytes: &[u8]) -> u32 {
    let (mut a, mut b) = (1u32, 0u32);
    // 5552 is the longest run that keeps both sums below 2³².
    for run in bytes.chunks(5552) {
        for &byte in run {
            a += u32::from(byte);
            b += a;
        }
        a %= 65521;
        b %= 65521;
    }
    b << 16 | a
}

/// Bits of a byte string, least significant first.
struct Bits<'a> {
    bytes: &'a [u8],
    buffer: u64,
    held: u32,
}

impl<'a> Bits<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            buffer: 0,
            held: 0,
        }
    }

    fn refill(&mut self) {
        while self.held <= 56 {
            let Some((&byte, rest)) = self.bytes.split_first() else {
                return;
            };
            self.buffer |= u64::from(byte) << self.held;
            self.held += 8;
            self.bytes = rest;
        }
    }

    /// At most 16 bits.
    fn take(&mut self, count: u32) -> Result<usize, Fault> {
        self.refill();
        if count > self.held {
            return Err(ENDS_EARLY);
        }
        let value = self.buffer & ((1 << count) - 1);
        self.buffer >>= count;
        self.held -= count;
        Ok(value as usize)
    }

    fn symbol(&mut self, code: &Code) -> Result<usize, Fault> {
        self.refill();
        let index = self.buffer as usize & (code.table.len() - 1);
        let entry = code.table.get(index).copied().unwrap_or(0);
        if entry == 0 {
            return Err(BAD_CODE);
        }
        self.take(u32::from(entry & 15))?;
        Ok(usize::from(entry >> 4))
    }

    fn skip_to_byte(&mut self) {
        let odd = self.held % 8;
        self.buffer >>= odd;
        self.held -= odd;
    }

    fn trailer(&mut self) -> Option<u32> {
        self.skip_to_byte();
        let mut sum = 0;
        for _ in 0..4 {
            sum = sum << 8 | self.take(8).ok()? as u32;
        }
        Some(sum)
    }
}

/// A prefix code as one lookup table; an entry is `symbol << 4 | bits`, 0 where no code leads.
struct Code {
    table: Vec<u16>,
}

impl Code {
    /// Canonical code from the lengths of its symbols' codes (RFC 1951, 3.2.2).
    fn new(lengths: &[u8]) -> Result<Self, Fault> {
        let longest = lengths
            .iter()
            .copied()
            .max()
            .unwrap_or(0)
            .min(MAX_CODE_BITS as u8);
        let mut next = first_codes(lengths)?;
        let mut table = vec![0u16; 1 << longest];
        for (symbol, &length) in lengths.iter().enumerate() {
            if length == 0 {
                continue;
            }
            let code = next[usize::from(length) & MAX_CODE_BITS];
            next[usize::from(length) & MAX_CODE_BITS] += 1;
            let first = usize::from(code.reverse_bits() >> (16 - u32::from(length)));
            for entry in table.iter_mut().skip(first).step_by(1 << length) {
                *entry = (symbol as u16) << 4 | u16::from(length);
            }
        }
        Ok(Self { table })
    }

    fn fixed() -> Result<(Self, Self), Fault> {
        let mut lengths = [8u8; 288];
        lengths[144..256].fill(9);
        lengths[256..280].fill(7);
        Ok((Self::new(&lengths)?, Self::new(&[5; 30])?))
    }
}

/// First code of every length; lengths are at most 15.
fn first_codes(lengths: &[u8]) -> Result<[u16; MAX_CODE_BITS + 1], Fault> {
    let mut counts = [0u32; MAX_CODE_BITS + 1];
    for &length in lengths.iter().filter(|&&length| length > 0) {
        counts[usize::from(length) & MAX_CODE_BITS] += 1;
    }
    let mut next = [0u16; MAX_CODE_BITS + 1];
    let mut code = 0u32;
    for length in 1..=MAX_CODE_BITS {
        code = (code + counts[length - 1]) << 1;
        if code + counts[length] > 1 << length {
            return Err(BAD_CODE);
        }
        next[length] = code as u16;
    }
    Ok(next)
}

struct Decoder<'a> {
    bits: Bits<'a>,
    out: Vec<u8>,
    length: usize,
}

impl Decoder<'_> {
    /// Decodes one block; `true` after the last.
    fn block(&mut self) -> Result<bool, Fault> {
        let last = self.bits.take(1)? == 1;
        match self.bits.take(2)? {
            0 => self.stored()?,
            1 => {
                let (literals, distances) = Code::fixed()?;
                self.compressed(&literals, &distances)?;
            }
            2 => {
                let (literals, distances) = self.dynamic_codes()?;
                self.compressed(&literals, &distances)?;
            }
            _ => return Err(BAD_CODE),
        }
        Ok(last)
    }

    fn room(&self, count: usize) -> Result<(), Fault> {
        if count > self.length - self.out.len() {
            return Err("a compressed array holds more values than it claims");
        }
        Ok(())
    }

    fn stored(&mut self) -> Result<(), Fault> {
        self.bits.skip_to_byte();
        let count = self.bits.take(16)?;
        if self.bits.take(16)? != count ^ 0xffff {
            return Err(BAD_CODE);
        }
        self.room(count)?;
        for _ in 0..count {
            let byte = self.bits.take(8)? as u8;
            self.out.push(byte);
        }
        Ok(())
    }

    fn dynamic_codes(&mut self) -> Result<(Code, Code), Fault> {
        let literals = self.bits.take(5)? + 257;
        let distances = self.bits.take(5)? + 1;
        let count = self.bits.take(4)? + 4;
        let mut lengths = [0u8; 19];
        for &place in CODE_LENGTH_ORDER.iter().take(count) {
            lengths[place] = self.bits.take(3)? as u8;
        }
        let lengths = self.code_lengths(&Code::new(&lengths)?, literals + distances)?;
        let (literals, distances) = lengths.split_at(literals);
        Ok((Code::new(literals)?, Code::new(distances)?))
    }

    /// Run-length coded code lengths (RFC 1951, 3.2.7).
    fn code_lengths(&mut self, code: &Code, count: usize) -> Result<Vec<u8>, Fault> {
        let mut lengths = Vec::with_capacity(count);
        while lengths.len() < count {
            let symbol = self.bits.symbol(code)?;
            let (value, repeat) = match symbol {
                0..=15 => (symbol as u8, 1),
                16 => (*lengths.last().ok_or(BAD_CODE)?, 3 + self.bits.take(2)?),
                17 => (0, 3 + self.bits.take(3)?),
                _ => (0, 11 + self.bits.take(7)?),
            };
            if lengths.len() + repeat > count {
                return Err(BAD_CODE);
            }
            lengths.resize(lengths.len() + repeat, value);
        }
        Ok(lengths)
    }

    fn compressed(&mut self, literals: &Code, distances: &Code) -> Result<(), Fault> {
        loop {
            match self.bits.symbol(literals)? {
                symbol @ 0..=255 => {
                    self.room(1)?;
                    self.out.push(symbol as u8);
                }
                256 => return Ok(()),
                symbol => self.copy(symbol - 257, distances)?,
            }
        }
    }

    fn copy(&mut self, length_symbol: usize, distances: &Code) -> Result<(), Fault> {
        let base = LENGTH_BASE.get(length_symbol).ok_or(BAD_CODE)?;
        let extra = LENGTH_BITS.get(length_symbol).ok_or(BAD_CODE)?;
        let count = usize::from(*base) + self.bits.take(u32::from(*extra))?;
        let symbol = self.bits.symbol(distances)?;
        let base = DISTANCE_BASE.get(symbol).ok_or(BAD_CODE)?;
        let distance =
            usize::from(*base) + self.bits.take((symbol as u32 / 2).saturating_sub(1))?;
        self.room(count)?;
        let from = self.out.len().checked_sub(distance).ok_or(BAD_CODE)?;
        // Source and destination overlap when the distance is short: byte by byte is the definition.
        for i in from..from + count {
            self.out.push(self.out[i]);
        }
        Ok(())
    }
}
