//! The binary container: a header and records.

use super::error::{FbxError, broken};
use super::record::Element;
use super::scan::readable;
use super::tape::Tape;
use fbxcel::low::FbxHeader;

const MAGIC: &[u8] = b"Kaydara FBX Binary  \0";
/// Magic, the byte 0x1a, the byte order and the version.
const HEADER_LEN: usize = 27;
/// First version with 64-bit record headers.
const WIDE_VERSION: u32 = 7500;

/// A parsed file.
#[derive(Debug)]
pub(super) struct Document<'a> {
    /// The top-level records.
    pub records: Vec<Element<'a>>,
    /// Bytes that may still be decoded from arrays.
    pub budget: usize,
}

impl<'a> Document<'a> {
    /// Parses a binary file of version 7.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, FbxError> {
        let wide = version(bytes)? >= WIDE_VERSION;
        let tape = Tape::new(bytes, readable(bytes, HEADER_LEN, wide)?);
        let header = FbxHeader::load(&tape).map_err(|_| FbxError::NotFbx)?;
        // After the scan, only an end marker can be in the wrong place.
        let records = tape.records(header).map_err(|_| {
            let reason = "a record's end marker isn't where the record ends";
            broken(tape.place(), reason)
        })?;
        // Chosen: what real files unpack is far below, and 3 MiB let a small file have some long curves.
        let budget = bytes.len().saturating_mul(6).saturating_add(3 << 20);
        Ok(Self { records, budget })
    }

    /// The first top-level record of this name.
    pub fn record(&self, name: &str) -> Option<&Element<'a>> {
        self.records
            .iter()
            .find(|record| record.name == name.as_bytes())
    }
}

/// Checks the header and returns the version, e.g. 7400.
fn version(bytes: &[u8]) -> Result<u32, FbxError> {
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err(if is_ascii(bytes) {
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

/// Whether this is FBX as text.
pub(crate) fn is_ascii(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(4096)];
    let has = |word: &[u8]| head.windows(word.len()).any(|window| window == word);
    !head.contains(&0) && (head.starts_with(b"; FBX") || has(b"FBXHeaderExtension:"))
}

#[cfg(test)]
mod tests {
    use super::super::record::Value;
    use super::{Document, FbxError};

    /// A file of one record, as the format lays it out; `tail` stands between its values and its end.
    fn file(version: u32, name: &[u8], values: &[&[u8]], tail: &[u8]) -> Vec<u8> {
        let size = if version < 7500 { 4 } else { 8 };
        let number = |value: usize| (value as u64).to_le_bytes()[..size].to_vec();
        let body = values.concat();
        let end = 27 + 3 * size + 1 + name.len() + body.len() + tail.len();
        [
            b"Kaydara FBX Binary  \0\x1a\0".to_vec(),
            version.to_le_bytes().to_vec(),
            number(end),
            number(values.len()),
            number(body.len()),
            vec![name.len() as u8],
            name.to_vec(),
            body,
            tail.to_vec(),
            vec![0; 3 * size + 1],
        ]
        .concat()
    }

    fn array(letter: u8, count: u32, encoding: u32, data: &[u8]) -> Vec<u8> {
        let len = data.len() as u32;
        let header = [count, encoding, len].map(u32::to_le_bytes).concat();
        [&[letter], header.as_slice(), data].concat()
    }

    #[test]
    fn every_minor_version_is_read() {
        for version in (7000..8000).step_by(100) {
            let bytes = file(version, b"Kind", &[b"I\xfe\xff\xff\xff"], b"");
            let document = Document::parse(&bytes).expect("a valid file");
            let record = document.record("Kind").expect("it was written");
            assert_eq!((record.int(0), record.values.len()), (Some(-2), 1));
        }
    }

    #[test]
    fn bytes_that_are_no_booleans_and_no_utf8_are_kept() {
        let flags = array(b'c', 2, 0, b"\x01\x02");
        let values = [
            &b"CK"[..],
            b"B\x02",
            b"Z\xff",
            &flags,
            b"S\x02\0\0\0\xff\xfe",
            b"Y\xff\xff",
        ];
        let bytes = file(7400, b"N\xffme", &values, b"");
        let document = Document::parse(&bytes).expect("a valid file");
        let record = &document.records[0];
        assert_eq!(record.name, b"N\xffme");
        assert_eq!(
            [0, 1, 2, 5].map(|i| record.int(i)),
            [75, 2, 255, -1].map(Some)
        );
        assert_eq!(record.text(4), Some(&b"\xff\xfe"[..]));
        assert!(matches!(record.values[3], Value::Array(_)));
    }

    /// A decoder opened on such an array would take the bytes after it for its own.
    #[test]
    fn arrays_too_short_for_their_encoding_fail_only_when_decoded() {
        for stream in [&b""[..], b"\x78", b"\x78\x01", b"\0\0\0\0"] {
            let bad = array(b'd', 1000, 1, stream);
            let bytes = file(7500, b"Keys", &[&bad, b"CT", &bad], b"");
            let document = Document::parse(&bytes).expect("arrays aren't decoded yet");
            let values = &document.records[0].values;
            assert_eq!(values[1].int(), Some(i64::from(b'T')));
            for index in [0, 2] {
                let Value::Array(array) = values[index] else {
                    panic!("not an array: {:?}", values[index]);
                };
                assert!(array.reals(&mut 1_000_000).is_err());
            }
        }
    }

    #[test]
    fn a_misplaced_end_marker_is_an_error() {
        let marker = [0; 13];
        assert!(Document::parse(&file(7400, b"A", &[], &marker)).is_ok());
        for tail in [[0; 14].as_slice(), &[0; 26], &[0; 12]] {
            let broken = file(7400, b"A", &[], tail);
            assert!(matches!(
                Document::parse(&broken),
                Err(FbxError::Broken { .. })
            ));
        }
    }
}
