//! The bytes behind a glTF file's buffers.

use super::GltfError;
use super::document::Document;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// Most bytes that all external buffers of a file may have together.
const MOST_BYTES: u64 = 2 << 30;

/// Buffers, each fetched when it is first needed: a mesh's missing buffer doesn't keep the motion from being read.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    bin: Option<&'a [u8]>,
    folder: Option<&'a Path>,
    fetched: BTreeMap<usize, Cow<'a, [u8]>>,
    external_bytes: u64,
    /// Bytes fetched: all, and those from other files.
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
            external_bytes: 0,
            bytes: 0,
            bytes_beside: 0,
        }
    }

    /// The bytes of buffer `buffer`.
    pub fn get(&mut self, buffer: usize) -> Result<&[u8], GltfError> {
        if !self.fetched.contains_key(&buffer) {
            let bytes = self
                .fetch(buffer)
                .map_err(|reason| GltfError::Buffer { buffer, reason })?;
            self.bytes = self.bytes.saturating_add(bytes.len());
            self.fetched.insert(buffer, bytes);
        }
        Ok(self.fetched.get(&buffer).map_or(&[], |bytes| bytes))
    }

    /// How many bytes have been fetched.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// How many of them came from other files.
    pub fn bytes_beside(&self) -> usize {
        self.bytes_beside
    }

    fn fetch(&mut self, buffer: usize) -> Result<Cow<'a, [u8]>, String> {
        let about = self.document.buffers.get(buffer);
        let about = about.ok_or("the file has no such buffer; export it again")?;
        match about.uri.as_deref() {
            None if buffer == 0 => self
                .bin
                .map(Cow::Borrowed)
                .ok_or("it has no bytes; export the file again".to_owned()),
            None => Err("it has no address; export the file again".to_owned()),
            Some(uri) => match uri.strip_prefix("data:") {
                Some(data) => data_uri(data).map(Cow::Owned),
                None => self.read_beside(uri).map(Cow::Owned),
            },
        }
    }

    /// Reads a file from the folder of the glTF file.
    fn read_beside(&mut self, uri: &str) -> Result<Vec<u8>, String> {
        let folder = self
            .folder
            .ok_or("it lies in another file, which isn't at hand; put both into one folder, or save as GLB")?;
        let folder = if folder.as_os_str().is_empty() {
            Path::new(".")
        } else {
            folder
        };
        let path = inside(folder, uri)?;
        let missing =
            |e: std::io::Error| format!("`{uri}` can't be read ({e}); put it beside the file");
        let about = std::fs::metadata(&path).map_err(missing)?;
        if !about.is_file() {
            return Err(format!("`{uri}` isn't a file"));
        }
        self.external_bytes = self.external_bytes.saturating_add(about.len());
        if self.external_bytes > MOST_BYTES {
            return Err(format!(
                "the file's buffers are larger than {MOST_BYTES} bytes; split the file"
            ));
        }
        let bytes = std::fs::read(&path).map_err(missing)?;
        self.bytes_beside = self.bytes_beside.saturating_add(bytes.len());
        Ok(bytes)
    }
}

/// The path of `uri` in `folder`, unless it leads out of it, by its words or by a link.
fn inside(folder: &Path, uri: &str) -> Result<PathBuf, String> {
    let outside = || format!("`{uri}` lies outside the file's folder; put it beside the file");
    let name = percent_decoded(uri);
    let plain = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if name.contains([':', '\\', '\0']) || !Path::new(&name).components().all(plain) {
        return Err(outside());
    }
    let missing =
        |e: std::io::Error| format!("`{uri}` can't be read ({e}); put it beside the file");
    let folder = folder.canonicalize().map_err(missing)?;
    let path = folder.join(name).canonicalize().map_err(missing)?;
    if path.starts_with(&folder) {
        Ok(path)
    } else {
        Err(outside())
    }
}

fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        let code = tail.get(..2).and_then(|hex| std::str::from_utf8(hex).ok());
        let code = code
            .filter(|_| first == b'%')
            .and_then(|hex| u8::from_str_radix(hex, 16).ok());
        bytes.push(code.unwrap_or(first));
        rest = if code.is_some() {
            tail.get(2..).unwrap_or_default()
        } else {
            tail
        };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The bytes of a data URI, given what follows `data:`.
fn data_uri(data: &str) -> Result<Vec<u8>, String> {
    let (kind, body) = data
        .split_once(',')
        .ok_or("its data URI has no data; export the file again")?;
    if !kind.ends_with(";base64") {
        return Err("its data URI isn't base64; export the file again".to_owned());
    }
    base64(body.as_bytes()).ok_or_else(|| "its base64 is broken; export the file again".to_owned())
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
            let reason = inside(&folder, uri).expect_err("refused");
            assert!(reason.contains("outside"), "{uri}: {reason}");
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
                .contains("outside")
        );
    }
}
