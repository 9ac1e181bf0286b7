//! Binary FBX written anew as ASCII and as big-endian binary, as the format lays these out.

use fbxcel::low::v7400::AttributeValue as A;
use fbxcel::tree::any::AnyTree;
use fbxcel::tree::v7400::NodeHandle;
use std::fmt::Write;

pub(super) enum Value {
    Plain(A),
    /// An array: its type's letter, its count, and its bytes as a zlib stream.
    Compressed(u8, u32, Vec<u8>),
}

pub(super) struct Record {
    name: String,
    values: Vec<Value>,
    children: Vec<Record>,
}

pub(super) fn node(name: &str, values: Vec<Value>, children: Vec<Record>) -> Record {
    let name = name.to_owned();
    Record {
        name,
        values,
        children,
    }
}

/// The top-level records of a binary file.
pub(super) fn records(bytes: &[u8]) -> Vec<Record> {
    let tree = AnyTree::from_seekable_reader(std::io::Cursor::new(bytes));
    match tree.expect("a binary file") {
        AnyTree::V7400(_, tree, _) => tree.root().children().map(record).collect(),
        _ => panic!("another version"),
    }
}

fn record(node: NodeHandle<'_>) -> Record {
    let values = node.attributes().iter().cloned().map(Value::Plain);
    Record {
        name: node.name().to_owned(),
        values: values.collect(),
        children: node.children().map(record).collect(),
    }
}

pub(super) fn as_ascii(records: &[Record]) -> Vec<u8> {
    let mut text = "; FBX 7.4.0 project file\n".to_owned();
    for record in records {
        ascii(&mut text, record, 0);
    }
    text.into_bytes()
}

fn ascii(text: &mut String, record: &Record, depth: usize) {
    let indent = "\t".repeat(depth);
    let values: Vec<String> = record.values.iter().map(written).collect();
    write!(text, "{indent}{}: {}", record.name, values.join(", ")).expect("memory");
    if record.children.is_empty() && !record.values.is_empty() {
        text.push('\n');
        return;
    }
    text.push_str(" {\n");
    for child in &record.children {
        ascii(text, child, depth + 1);
    }
    writeln!(text, "{indent}}}").expect("memory");
}

fn written(value: &Value) -> String {
    let Value::Plain(value) = value else {
        panic!("ASCII has no compressed arrays")
    };
    fn array<T: ToString>(numbers: &[T]) -> String {
        let list: Vec<String> = numbers.iter().map(T::to_string).collect();
        format!("*{} {{\n a: {}\n}}", numbers.len(), list.join(","))
    }
    match value {
        A::Bool(flag) => if *flag { "T" } else { "F" }.to_owned(),
        A::I16(number) => number.to_string(),
        A::I32(number) => number.to_string(),
        A::I64(number) => number.to_string(),
        A::F32(number) => number.to_string(),
        A::F64(number) => number.to_string(),
        A::ArrBool(flags) => array(&flags.iter().map(|&flag| u8::from(flag)).collect::<Vec<_>>()),
        A::ArrI32(numbers) => array(numbers),
        A::ArrI64(numbers) => array(numbers),
        A::ArrF32(numbers) => array(numbers),
        A::ArrF64(numbers) => array(numbers),
        // Binary has the name first where ASCII has `Class::name`.
        A::String(text) => match text.split_once("\0\x01") {
            Some((name, class)) => format!("\"{class}::{name}\""),
            None => format!("\"{text}\""),
        },
        A::Binary(_) => "\"\"".to_owned(),
    }
}

pub(super) fn as_big_endian(records: &[Record]) -> Vec<u8> {
    let mut bytes = b"Kaydara FBX Binary  \0\x1a\x01".to_vec();
    bytes.extend(7400u32.to_be_bytes());
    for record in records {
        binary(&mut bytes, record);
    }
    bytes.extend([0; 13]);
    bytes
}

fn binary(bytes: &mut Vec<u8>, record: &Record) {
    let start = bytes.len();
    let values: Vec<u8> = record.values.iter().flat_map(packed).collect();
    bytes.extend([0; 4]);
    bytes.extend((record.values.len() as u32).to_be_bytes());
    bytes.extend((values.len() as u32).to_be_bytes());
    bytes.push(record.name.len() as u8);
    bytes.extend(record.name.as_bytes());
    bytes.extend(values);
    for child in &record.children {
        binary(bytes, child);
    }
    if !record.children.is_empty() {
        bytes.extend([0; 13]);
    }
    let end = (bytes.len() as u32).to_be_bytes();
    bytes[start..start + 4].copy_from_slice(&end);
}

fn packed(value: &Value) -> Vec<u8> {
    fn letter(letter: u8, rest: &[u8]) -> Vec<u8> {
        [&[letter], rest].concat()
    }
    fn sized(kind: u8, bytes: &[u8]) -> Vec<u8> {
        let len = (bytes.len() as u32).to_be_bytes();
        [&[kind], len.as_slice(), bytes].concat()
    }
    fn array(kind: u8, count: usize, encoding: u32, bytes: &[u8]) -> Vec<u8> {
        let header = [count as u32, encoding, bytes.len() as u32].map(u32::to_be_bytes);
        [&[kind], header.concat().as_slice(), bytes].concat()
    }
    let value = match value {
        Value::Plain(value) => value,
        Value::Compressed(kind, count, stream) => return array(*kind, *count as usize, 1, stream),
    };
    match value {
        A::Bool(flag) => letter(b'C', &[u8::from(*flag)]),
        A::I16(number) => letter(b'Y', &number.to_be_bytes()),
        A::I32(number) => letter(b'I', &number.to_be_bytes()),
        A::I64(number) => letter(b'L', &number.to_be_bytes()),
        A::F32(number) => letter(b'F', &number.to_be_bytes()),
        A::F64(number) => letter(b'D', &number.to_be_bytes()),
        A::ArrBool(flags) => {
            let bytes: Vec<u8> = flags.iter().map(|&flag| u8::from(flag)).collect();
            array(b'b', flags.len(), 0, &bytes)
        }
        A::ArrI32(numbers) => {
            let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_be_bytes()).collect();
            array(b'i', numbers.len(), 0, &bytes)
        }
        A::ArrI64(numbers) => {
            let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_be_bytes()).collect();
            array(b'l', numbers.len(), 0, &bytes)
        }
        A::ArrF32(numbers) => {
            let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_be_bytes()).collect();
            array(b'f', numbers.len(), 0, &bytes)
        }
        A::ArrF64(numbers) => {
            let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_be_bytes()).collect();
            array(b'd', numbers.len(), 0, &bytes)
        }
        A::String(text) => sized(b'S', text.as_bytes()),
        A::Binary(bytes) => sized(b'R', bytes),
    }
}
