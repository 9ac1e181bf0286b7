//! The bytes behind a glTF file's buffers.

use super::document::Document;
use super::error::Fault;
use crate::file;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// Most bytes that all external buffers of a file may have together. Chosen, as for the file itself.
const MOST_BYTES: u64 = 2 << 30;

/// One part in how many counts of the bytes that a text holds.
const TEXT_SHARE: usize = 4;

/// Buffers, each read when it is first needed: a missing buffer of a mesh doesn't keep the motion from being read.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    /// The binary chunk of a GLB.
    bin: Option<&'a [u8]>,
    /// Where external buffers are.
    folder: Option<&'a Path>,
    fetched: BTreeMap<usize, Cow<'a, [u8]>>,
    /// Bytes read so far: all, and those from other files.
    bytes: usize,
    bytes_beside: usize,
}

impl<'a> Buffers<'a> {
    pub fn new(document: &'a Document, bin: Option<&'a [u8]>, folder: Option<&'a Path>) -> Self {
        Self {
            document,
            bin,
            folder,
            fetched: BTreeMap::new(),
            bytes: 0,
            bytes_beside: 0,
        }
    }

    /// The bytes of buffer `buffer`.
    pub fn get(&mut self, buffer: usize) -> Result<&[u8], Fault> {
        if !self.fetched.contains_key(&buffer) {
            let bytes = self.fetch(buffer).map_err(|fault| Fault {
                cause: format!("buffer {buffer}: {}", fault.cause),
                ..fault
            })?;
            // A text may take less memory than a binary file of its size.
            let share = if self.is_text(buffer) { TEXT_SHARE } else { 1 };
            self.bytes = self.bytes.saturating_add(bytes.len() / share);
            self.fetched.insert(buffer, bytes);
        }
        Ok(self.fetched.get(&buffer).map_or(&[], |bytes| bytes))
    }

    /// Whether the file's text itself holds this buffer.
    fn is_text(&self, buffer: usize) -> bool {
        let about = self.document.buffers.get(buffer);
        let uri = about.and_then(|about| about.uri.as_deref());
        let scheme = uri.and_then(|uri| uri.split_once(':'));
        scheme.is_some_and(|(scheme, _)| scheme.eq_ignore_ascii_case("data"))
    }

    /// How many bytes have been read, of which those within a text count a quarter.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// How many of them came from other files.
    pub fn bytes_beside(&self) -> usize {
        self.bytes_beside
    }

    fn fetch(&mut self, buffer: usize) -> Result<Cow<'a, [u8]>, Fault> {
        let about = self.document.buffers.get(buffer);
        let about = about.ok_or("the file has no such buffer")?;
        match about.uri.as_deref() {
            None if buffer == 0 => self
                .bin
                .map(Cow::Borrowed)
                .ok_or_else(|| "it has no bytes".into()),
            None => Err("it has no address".into()),
            Some(uri) => match uri.split_once(':') {
                Some((scheme, data)) if scheme.eq_ignore_ascii_case("data") => {
                    data_uri(data).map(Cow::Owned)
                }
                _ => self.read_beside(uri).map(Cow::Owned),
            },
        }
    }

    /// Reads a file from the folder of the glTF file.
    fn read_beside(&mut self, uri: &str) -> Result<Vec<u8>, Fault> {
        let folder = self.folder.ok_or_else(|| {
            Fault::new(
                "it lies in another file, which isn't at hand",
                "put both into one folder, or save as GLB",
            )
        })?;
        let folder = if folder.as_os_str().is_empty() {
            Path::new(".")
        } else {
            folder
        };
        let path = inside(folder, uri)?;
        let most = MOST_BYTES - self.bytes_beside as u64;
        let bytes = file::read_at_most(&path, most).map_err(|e| unread(uri, &e))?;
        self.bytes_beside += bytes.len();
        Ok(bytes)
    }
}

fn missing(uri: &str, error: &std::io::Error) -> Fault {
    Fault::new(
        format!("`{uri}` can't be read ({error})"),
        "put it beside the file",
    )
}

fn unread(uri: &str, error: &std::io::Error) -> Fault {
    Fault::new(
        format!("`{uri}`: {}", file::unread(error).cause),
        "repair it, or export the file again",
    )
}

/// The path of `uri` in `folder`, unless it leads out of the folder, by its words or by a link.
fn inside(folder: &Path, uri: &str) -> Result<PathBuf, Fault> {
    let outside = || {
        Fault::new(
            format!("`{uri}` lies outside the file's folder"),
            "put it beside the file",
        )
    };
    let (name, _) = percent_decoded(uri);
    let name = String::from_utf8_lossy(&name);
    let plain = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    // Other schemes, Windows paths and control bytes never name a file beside this one.
    if name.contains([':', '\\', '\0']) || !Path::new(&*name).components().all(plain) {
        return Err(outside());
    }
    let missing = |e| missing(uri, &e);
    let folder = folder.canonicalize().map_err(missing)?;
    // A link inside the folder may point out of it: the real path decides.
    let path = folder.join(&*name).canonicalize().map_err(missing)?;
    if path.starts_with(&folder) {
        Ok(path)
    } else {
        Err(outside())
    }
}

/// The bytes that a part of a URI stands for (RFC 3986 §2.1), and whether every `%` began the code of one.
fn percent_decoded(text: &str) -> (Vec<u8>, bool) {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    let mut whole = true;
    let digit = |byte: u8| Some(char::from(byte).to_digit(16)? as u8);
    while let Some((&first, tail)) = rest.split_first() {
        rest = tail;
        let code = match tail {
            [high, low, ..] if first == b'%' => digit(*high).zip(digit(*low)),
            _ => None,
        };
        match code {
            Some((high, low)) => {
                bytes.push(high << 4 | low);
                rest = &tail[2..];
            }
            None => {
                whole &= first != b'%';
                bytes.push(first);
            }
        }
    }
    (bytes, whole)
}

/// The bytes of a data URI (RFC 2397), given what follows `data:`.
fn data_uri(data: &str) -> Result<Vec<u8>, Fault> {
    const BASE64: &str = ";base64";
    let broken = |reason: &str| Fault::from(format!("its data URI {reason}"));
    let (kind, body) = data
        .split_once(',')
        .ok_or_else(|| broken("has no comma, and so no data"))?;
    let (bytes, whole) = percent_decoded(body);
    if !whole {
        return Err(broken("has a `%` without two hexadecimal digits after it"));
    }
    let start = kind.len().saturating_sub(BASE64.len());
    let end = kind.get(start..).unwrap_or_default();
    if end.eq_ignore_ascii_case(BASE64) {
        return base64(&bytes).ok_or_else(|| broken("has broken base64"));
    }
    match body.is_ascii() {
        true => Ok(bytes),
        false => Err(broken("has a character that must be written with `%`")),
    }
}

/// Decodes base64 (RFC 4648), with or without padding, in either alphabet.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let text = text.trim_ascii();
    let end = text
        .iter()
        .rposition(|&c| c != b'=')
        .map_or(0, |last| last + 1);
    let mut bytes = Vec::with_capacity(end / 4 * 3 + 3);
    for group in text.get(..end)?.chunks(4) {
        let mut bits = 0u32;
        for &letter in group {
            bits = bits << 6 | u32::from(sextet(letter)?);
        }
        bits <<= 6 * (4 - group.len());
        // Four letters are three bytes; a shorter last group has as many whole bytes as its bits fill.
        let whole = group.len() * 6 / 8;
        if whole == 0 {
            return None;
        }
        bytes.extend(bits.to_be_bytes().get(1..1 + whole)?);
    }
    Some(bytes)
}

fn sextet(letter: u8) -> Option<u8> {
    match letter {
        b'A'..=b'Z' => Some(letter - b'A'),
        b'a'..=b'z' => Some(letter - b'a' + 26),
        b'0'..=b'9' => Some(letter - b'0' + 52),
        b'+' | b'-' => Some(62),
        b'/' | b'_' => Some(63),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_vectors_of_rfc_4648() {
        let vectors = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ];
        for (plain, coded) in vectors {
            assert_eq!(base64(coded.as_bytes()).as_deref(), Some(plain.as_bytes()));
            let bare = coded.trim_end_matches('=');
            assert_eq!(base64(bare.as_bytes()).as_deref(), Some(plain.as_bytes()));
        }
        assert_eq!(base64(b"Zm9v!"), None);
        assert_eq!(base64(b"Zm9vY"), None);
    }

    #[test]
    fn data_uris_hold_base64_or_percent_codes() {
        let bytes = |data: &str| data_uri(data).unwrap_or_else(|e| panic!("{data}: {e:?}"));
        assert_eq!(bytes(",A%20brief%20note"), b"A brief note");
        assert_eq!(bytes("application/octet-stream,%00%fF+a"), b"\0\xff+a");
        assert_eq!(bytes(";BASE64,Zm9v"), b"foo");
        assert_eq!(bytes("text/plain;base64,Zg%3D%3d"), b"f");
        assert_eq!(bytes(","), b"");
        for (data, reason) in [
            ("AAAA", "no comma"),
            (",%0", "without two"),
            (",%+1", "without two"),
            (",%", "without two"),
            (";base64,%4", "without two"),
            (";base64,!", "broken base64"),
            (",ä", "must be written"),
        ] {
            let found = data_uri(data).expect_err(data).cause;
            assert!(found.contains(reason), "{data}: {found}");
        }
    }

    #[test]
    fn buffers_stay_in_their_folder() {
        let home = tempfile::tempdir().expect("a folder");
        let folder = home.path().join("in");
        std::fs::create_dir(&folder).expect("a folder");
        std::fs::write(folder.join("a b.bin"), b"1").expect("a file");
        std::fs::write(home.path().join("secret.bin"), b"2").expect("a file");
        assert!(inside(&folder, "a%20b.bin").is_ok());
        assert!(inside(&folder, "./a b.bin").is_ok());
        let secret = home.path().join("secret.bin");
        let secret = secret.to_str().expect("a text");
        for uri in [
            "../secret.bin",
            "%2e%2e/secret.bin",
            "file:///etc/hostname",
            "..\\secret.bin",
            secret,
        ] {
            let fault = inside(&folder, uri).expect_err("refused");
            assert!(fault.cause.contains("outside"), "{uri}: {fault:?}");
        }
        assert!(inside(&folder, "none.bin").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_do_not_lead_out() {
        let home = tempfile::tempdir().expect("a folder");
        let folder = home.path().join("in");
        std::fs::create_dir(&folder).expect("a folder");
        std::fs::write(home.path().join("secret.bin"), b"2").expect("a file");
        std::os::unix::fs::symlink(home.path().join("secret.bin"), folder.join("link.bin"))
            .expect("a link");
        assert!(
            inside(&folder, "link.bin")
                .expect_err("refused")
                .cause
                .contains("outside")
        );
    }
}
