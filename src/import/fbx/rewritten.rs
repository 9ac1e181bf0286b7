//! Rewrites ASCII files of version 7 as binary ones, with compressed arrays, so that they can be compared with ufbx too. `fbxcel`
//! writes them.

use fbxcel::low::FbxVersion;
use fbxcel::low::v7400::ArrayAttributeEncoding;
use fbxcel::writer::v7400::binary::Writer;
use std::io::Cursor;

#[derive(Debug)]
enum Token {
    Text(String),
    Int(i64),
    Real(f64),
}

/// The binary form of an ASCII file.
pub(super) fn as_binary(text: &[u8]) -> Vec<u8> {
    let mut writer =
        Writer::new(Cursor::new(Vec::new()), FbxVersion::V7_5).expect("a known version");
    let mut source = Source { text, at: 0 };
    while source.node(&mut writer, false) {}
    assert_eq!(source.peek(), None, "text after the last record");
    writer
        .finalize(&Default::default())
        .expect("memory takes all")
        .into_inner()
}

struct Source<'a> {
    text: &'a [u8],
    at: usize,
}

impl Source<'_> {
    /// Next byte after blanks and, if `lines`, line ends and comments.
    fn skip(&mut self, lines: bool) -> Option<u8> {
        loop {
            match self.text.get(self.at).copied() {
                Some(b' ' | b'\t' | b'\r') => self.at += 1,
                Some(b'\n') if lines => self.at += 1,
                Some(b';') if lines => {
                    while self.text.get(self.at).is_some_and(|&byte| byte != b'\n') {
                        self.at += 1;
                    }
                }
                next => return next,
            }
        }
    }

    fn peek(&mut self) -> Option<u8> {
        self.skip(true)
    }

    fn word(&mut self) -> String {
        let start = self.at;
        let ends = |byte: &u8| b",:{} \t\r\n".contains(byte);
        while self.text.get(self.at).is_some_and(|byte| !ends(byte)) {
            self.at += 1;
        }
        String::from_utf8_lossy(&self.text[start..self.at]).into_owned()
    }

    fn token(&mut self) -> Token {
        if self.text.get(self.at) == Some(&b'"') {
            let start = self.at + 1;
            let len = self.text[start..]
                .iter()
                .position(|&byte| byte == b'"')
                .expect("a closing quote");
            self.at = start + len + 1;
            return Token::Text(
                String::from_utf8_lossy(&self.text[start..start + len]).into_owned(),
            );
        }
        let word = self.word();
        if let Ok(int) = word.parse() {
            Token::Int(int)
        } else if let Ok(real) = word.parse() {
            Token::Real(real)
        } else if let &[letter] = word.as_bytes() {
            Token::Int(i64::from(letter))
        } else {
            Token::Text(word)
        }
    }

    fn tokens(&mut self) -> Vec<Token> {
        let mut tokens = Vec::new();
        while !matches!(self.skip(false), None | Some(b'\n' | b'{' | b'}')) {
            tokens.push(self.token());
            if self.skip(false) != Some(b',') {
                break;
            }
            self.at += 1;
            self.peek();
        }
        tokens
    }

    /// Rewrites one record; `false` if there is none.
    fn node(&mut self, writer: &mut Writer<Cursor<Vec<u8>>>, is_object: bool) -> bool {
        if matches!(self.peek(), None | Some(b'}')) {
            return false;
        }
        let name = self.word();
        assert_eq!(self.peek(), Some(b':'), "after {name}");
        self.at += 1;
        let mut attributes = writer.new_node(&name).expect("memory takes all");
        if self.skip(false) == Some(b'*') {
            let values = self.array();
            let zlib = Some(ArrayAttributeEncoding::Zlib);
            let written = match name.as_str() {
                "KeyTime" => attributes.append_arr_i64_from_iter(zlib, values.iter().map(int)),
                "KeyAttrDataFloat" => {
                    attributes.append_arr_f32_from_iter(zlib, values.iter().map(packed))
                }
                "KeyAttrFlags" | "KeyAttrRefCount" => attributes
                    .append_arr_i32_from_iter(zlib, values.iter().map(|token| int(token) as i32)),
                _ => attributes.append_arr_f64_from_iter(zlib, values.iter().map(real)),
            };
            written.expect("memory takes all");
        } else {
            for token in self.tokens() {
                match token {
                    Token::Int(value) => attributes.append_i64(value),
                    Token::Real(value) => attributes.append_f64(value),
                    Token::Text(text) => {
                        attributes.append_string_direct(&binary_name(&text, is_object))
                    }
                }
                .expect("memory takes all");
            }
            if self.skip(false) == Some(b'{') {
                self.at += 1;
                while self.node(writer, name == "Objects") {}
                assert_eq!(self.peek(), Some(b'}'), "the end of {name}");
                self.at += 1;
            }
        }
        writer.close_node().expect("a node is open");
        true
    }

    /// `*4 { a: 1,2,3,4 }`
    fn array(&mut self) -> Vec<Token> {
        self.word();
        assert_eq!(self.peek(), Some(b'{'));
        self.at += 1;
        assert_eq!(self.peek(), Some(b'a'));
        self.at += 2;
        self.peek();
        let values = self.tokens();
        assert_eq!(self.peek(), Some(b'}'));
        self.at += 1;
        values
    }
}

/// ASCII has `Class::name` where binary has the name first.
fn binary_name(text: &str, is_object: bool) -> String {
    match text.split_once("::") {
        Some((class, name)) if is_object => format!("{name}\0\x01{class}"),
        _ => text.to_owned(),
    }
}

fn int(token: &Token) -> i64 {
    match token {
        Token::Int(value) => *value,
        other => panic!("not an integer: {other:?}"),
    }
}

fn real(token: &Token) -> f64 {
    match token {
        Token::Int(value) => *value as f64,
        Token::Real(value) => *value,
        other => panic!("not a number: {other:?}"),
    }
}

/// Key attributes are reals, or whole numbers that stand for a real's bits.
fn packed(token: &Token) -> f32 {
    match token {
        Token::Int(bits) => f32::from_bits(*bits as u32),
        other => real(other) as f32,
    }
}
