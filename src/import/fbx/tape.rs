//! Lets `fbxcel` read the records, and takes texts and arrays from the file's own bytes.
//!
//! Why it is needed: `fbxcel` 0.9 copies every text, and decodes every array, of meshes too, without a bound on what a
//! few bytes unpack to. Here it finds where each one lies, and skips it: the reader knows its place in the file, so that a
//! text or an array is borrowed and decoded when asked for (`array.rs`), within a budget.

use super::array::{Array, Kind};
use super::numbers::word;
use super::record::{Element, Value};
use super::scan::ARRAY_HEADER;
use fbxcel::low::FbxHeader;
use fbxcel::pull_parser::Result;
use fbxcel::pull_parser::v7400::attribute::LoadAttribute;
use fbxcel::pull_parser::v7400::{Event, Parser, StartNode};
use std::cell::Cell;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::iter::repeat;

/// A file, and the place up to which `fbxcel` has read it.
#[derive(Debug)]
pub(super) struct Tape<'a> {
    file: &'a [u8],
    /// What `fbxcel` reads instead of the file, byte for byte: see `scan`.
    readable: Vec<u8>,
    at: Cell<usize>,
}

impl<'a> Tape<'a> {
    /// A file from its start.
    pub fn new(file: &'a [u8], readable: Vec<u8>) -> Self {
        Self {
            file,
            readable,
            at: Cell::new(0),
        }
    }

    /// The place of the next byte.
    pub fn place(&self) -> usize {
        self.at.get()
    }

    /// The top-level records, after the file's header.
    pub fn records(&self, header: FbxHeader) -> Result<Vec<Element<'a>>> {
        let mut parser = Parser::from_seekable_reader(header, self)?;
        let (mut open, mut records) = (Vec::<Element>::new(), Vec::new());
        loop {
            match parser.next_event()? {
                // Records come as events: an open record waits on a stack until its end.
                Event::StartNode(node) => open.push(self.element(node)?),
                Event::EndNode => {
                    let Some(done) = open.pop() else { continue };
                    let siblings = open.last_mut().map(|parent| &mut parent.children);
                    siblings.unwrap_or(&mut records).push(done);
                }
                // All records have been read, so it doesn't matter whether the footer is right.
                Event::EndFbx(_) => return Ok(records),
            }
        }
    }

    /// The record that begins with `node`, without its children.
    fn element(&self, node: StartNode<'_, &Self>) -> Result<Element<'a>> {
        let name = self.behind(node.name().len())?;
        let values = node.attributes().into_iter(repeat(Loader { tape: self }));
        Ok(Element {
            name,
            values: values.collect::<Result<_>>()?,
            children: Vec::new(),
        })
    }

    /// The file's last `len` bytes that were read.
    fn behind(&self, len: usize) -> io::Result<&'a [u8]> {
        self.slice(self.place().checked_sub(len), len)
    }

    /// The file's next `len` bytes.
    fn ahead(&self, len: usize) -> io::Result<&'a [u8]> {
        self.slice(Some(self.place()), len)
    }

    fn slice(&self, start: Option<usize>, len: usize) -> io::Result<&'a [u8]> {
        let bytes = start.and_then(|start| self.file.get(start..start.checked_add(len)?));
        bytes.ok_or_else(|| ErrorKind::UnexpectedEof.into())
    }
}

impl Read for &Tape<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut rest = self.readable.get(self.place()..).unwrap_or(&[]);
        let count = rest.read(buffer)?;
        self.at.set(self.place() + count);
        Ok(count)
    }
}

impl Seek for &Tape<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let place = match to {
            SeekFrom::Start(place) => usize::try_from(place).ok(),
            SeekFrom::Current(step) => isize::try_from(step)
                .ok()
                .and_then(|step| self.place().checked_add_signed(step)),
            SeekFrom::End(_) => None,
        };
        let place = place.ok_or(ErrorKind::InvalidInput)?;
        self.at.set(place);
        Ok(place as u64)
    }
}

/// Makes a value of any attribute. It leaves texts and arrays unread, and `fbxcel` then skips them.
#[derive(Clone, Copy, Debug)]
struct Loader<'t, 'a> {
    tape: &'t Tape<'a>,
}

impl<'a> Loader<'_, 'a> {
    fn text(self, len: u64) -> Result<Value<'a>> {
        let len = usize::try_from(len).map_err(|_| io::Error::from(ErrorKind::UnexpectedEof))?;
        Ok(Value::Text(self.tape.ahead(len)?))
    }

    /// An array. Its header is read again from the file, because the encoding that `fbxcel` sees isn't the file's.
    fn array(self, kind: Kind, count: usize) -> Result<Value<'a>> {
        let header = self.tape.behind(ARRAY_HEADER)?;
        let len = word(&header[8..]) as usize;
        Ok(Value::Array(Array {
            kind,
            compressed: word(&header[4..]) != 0,
            count,
            data: self.tape.ahead(len)?,
        }))
    }
}

impl<'a> LoadAttribute for Loader<'_, 'a> {
    type Output = Value<'a>;

    fn expecting(&self) -> String {
        "any value".into()
    }

    /// The byte itself, because some exporters write letters as this type.
    fn load_bool(self, _: bool) -> Result<Value<'a>> {
        let byte = self.tape.behind(1)?;
        Ok(Value::Int(i64::from(byte[0])))
    }

    fn load_i16(self, value: i16) -> Result<Value<'a>> {
        Ok(Value::Int(i64::from(value)))
    }

    fn load_i32(self, value: i32) -> Result<Value<'a>> {
        Ok(Value::Int(i64::from(value)))
    }

    fn load_i64(self, value: i64) -> Result<Value<'a>> {
        Ok(Value::Int(value))
    }

    fn load_f32(self, value: f32) -> Result<Value<'a>> {
        Ok(Value::Real(f64::from(value)))
    }

    fn load_f64(self, value: f64) -> Result<Value<'a>> {
        Ok(Value::Real(value))
    }

    fn load_seq_bool(self, _: impl Iterator<Item = Result<bool>>, len: usize) -> Result<Value<'a>> {
        self.array(Kind::Byte, len)
    }

    fn load_seq_i32(self, _: impl Iterator<Item = Result<i32>>, len: usize) -> Result<Value<'a>> {
        self.array(Kind::I32, len)
    }

    fn load_seq_i64(self, _: impl Iterator<Item = Result<i64>>, len: usize) -> Result<Value<'a>> {
        self.array(Kind::I64, len)
    }

    fn load_seq_f32(self, _: impl Iterator<Item = Result<f32>>, len: usize) -> Result<Value<'a>> {
        self.array(Kind::F32, len)
    }

    fn load_seq_f64(self, _: impl Iterator<Item = Result<f64>>, len: usize) -> Result<Value<'a>> {
        self.array(Kind::F64, len)
    }

    fn load_binary(self, _: impl Read, len: u64) -> Result<Value<'a>> {
        self.text(len)
    }

    fn load_string(self, _: impl Read, len: u64) -> Result<Value<'a>> {
        self.text(len)
    }
}
