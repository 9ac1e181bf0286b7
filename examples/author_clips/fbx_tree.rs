//! FBX nodes and values as plain data, and their bytes.

use fbxcel::low::FbxVersion;
use fbxcel::writer::v7400::binary::{FbxFooter, Result, Writer};
use std::io::Cursor;

pub enum Value {
    Flag(bool),
    Int(i32),
    Long(i64),
    Double(f64),
    Text(String),
    Bytes(Vec<u8>),
    Ints(Vec<i32>),
    Longs(Vec<i64>),
    Floats(Vec<f32>),
}

pub struct Node {
    name: &'static str,
    values: Vec<Value>,
    children: Vec<Node>,
}

pub fn text(s: &str) -> Value {
    Value::Text(s.to_owned())
}

pub fn leaf(name: &'static str, value: Value) -> Node {
    node(name, vec![value], Vec::new())
}

pub fn group(name: &'static str, children: Vec<Node>) -> Node {
    node(name, Vec::new(), children)
}

pub fn node(name: &'static str, values: Vec<Value>, children: Vec<Node>) -> Node {
    Node {
        name,
        values,
        children,
    }
}

/// An entry of `Properties70`: name, type, label, flags, values.
pub fn property(words: [&str; 4], values: Vec<Value>) -> Node {
    let mut all: Vec<Value> = words.iter().map(|w| text(w)).collect();
    all.extend(values);
    node("P", all, Vec::new())
}

/// The identity, time and footer that Autodesk's readers accept for third-party files: the footer is a code of the
/// creation time, so all three are fixed.
pub const FILE_ID: [u8; 16] = [
    0x28, 0xb3, 0x2a, 0xeb, 0xb6, 0x24, 0xcc, 0xc2, 0xbf, 0xc8, 0xb0, 0x2a, 0xa9, 0x2b, 0xfc, 0xf1,
];
pub const CREATION_TIME: &str = "1970-01-01 10:00:00:000";
const FOOTER_CODE: [u8; 16] = [
    0xfa, 0xbc, 0xab, 0x09, 0xd0, 0xc8, 0xd4, 0x66, 0xb1, 0x76, 0xfb, 0x83, 0x1c, 0xf7, 0x26, 0x7e,
];

/// The file with these top-level nodes.
pub fn bytes(nodes: &[Node]) -> Result<Vec<u8>> {
    let mut writer = Writer::new(Cursor::new(Vec::new()), FbxVersion::V7_4)?;
    for node in nodes {
        write(&mut writer, node)?;
    }
    let footer = FbxFooter {
        unknown1: Some(&FOOTER_CODE),
        ..FbxFooter::default()
    };
    Ok(writer.finalize_and_flush(&footer)?.into_inner())
}

fn write(writer: &mut Writer<Cursor<Vec<u8>>>, node: &Node) -> Result<()> {
    let mut out = writer.new_node(node.name)?;
    for value in &node.values {
        match value {
            Value::Flag(v) => out.append_bool(*v)?,
            Value::Int(v) => out.append_i32(*v)?,
            Value::Long(v) => out.append_i64(*v)?,
            Value::Double(v) => out.append_f64(*v)?,
            Value::Text(v) => out.append_string_direct(v)?,
            Value::Bytes(v) => out.append_binary_direct(v)?,
            Value::Ints(v) => out.append_arr_i32_from_iter(None, v.iter().copied())?,
            Value::Longs(v) => out.append_arr_i64_from_iter(None, v.iter().copied())?,
            Value::Floats(v) => out.append_arr_f32_from_iter(None, v.iter().copied())?,
        }
    }
    for child in &node.children {
        write(writer, child)?;
    }
    writer.close_node()
}
