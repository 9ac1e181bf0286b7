//! What kind of file some bytes are, by their content.

use super::fbx::is_ascii as is_ascii_fbx;
use crate::explain::Explanation;
use crate::file;

/// A format that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Fbx,
    Glb,
    Gltf,
    DeepMimic,
    Bvh,
    Asf,
    Amc,
}

/// How many bytes of a text are searched for the words that tell its kind. Chosen: files begin with comments.
const HEAD: usize = 4096;

/// The format of `bytes`, or what they seem to be instead and what to do about it.
pub(crate) fn detect(bytes: &[u8]) -> Result<Format, Explanation> {
    if let Some(format) = file::format_of(bytes) {
        return Err(own_refusal(&format));
    }
    if bytes.starts_with(b"Kaydara FBX Binary") || is_ascii_fbx(bytes) {
        return Ok(Format::Fbx);
    }
    if bytes.starts_with(b"glTF") {
        return Ok(Format::Glb);
    }
    let text = bytes
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(bytes)
        .trim_ascii_start();
    if text.starts_with(b"{") {
        return detect_json(text);
    }
    if text.len() >= 9 && text[..9].eq_ignore_ascii_case(b"HIERARCHY") {
        return Ok(Format::Bvh);
    }
    acclaim(text).ok_or_else(|| refusal(text))
}

/// Which of Acclaim's two texts this is, by sections that only one of them has.
fn acclaim(text: &[u8]) -> Option<Format> {
    if !text.starts_with(b"#") && !text.starts_with(b":") {
        return None;
    }
    let head = text[..text.len().min(HEAD)].to_ascii_uppercase();
    let begins = |line: &[u8], word: &[u8]| line.trim_ascii_start().starts_with(word);
    let has = |words: &[&[u8]]| {
        let mut lines = head.split(|&byte| byte == b'\n');
        lines.any(|line| words.iter().any(|word| begins(line, word)))
    };
    if has(&[b":UNITS", b":ROOT", b":BONEDATA", b":HIERARCHY"]) {
        Some(Format::Asf)
    } else if has(&[b":FULLY-SPECIFIED", b":DEGREES", b":RADIANS"]) {
        Some(Format::Amc)
    } else {
        None
    }
}

fn own_refusal(format: &str) -> Explanation {
    let remedy = match format {
        "clip" => "rename it to end in `.clip`, and use it as a clip",
        "motion" => "rename it to end in `.motion`, and use it as a motion",
        "policy" | "checkpoint" => "give the folder of its training run where a run is wanted",
        _ => "give an animation file",
    };
    Explanation::input(format!(
        "a {format} that mimic wrote, not an animation file"
    ))
    .remedy(remedy)
}

fn detect_json(text: &[u8]) -> Result<Format, Explanation> {
    #[derive(serde::Deserialize)]
    struct Keys {
        asset: Option<serde::de::IgnoredAny>,
        #[serde(rename = "Frames")]
        frames: Option<serde::de::IgnoredAny>,
        #[serde(rename = "Skeleton")]
        skeleton: Option<serde::de::IgnoredAny>,
    }
    match serde_json::from_slice::<Keys>(text) {
        Ok(keys) if keys.asset.is_some() => Ok(Format::Gltf),
        Ok(keys) if keys.frames.is_some() => Ok(Format::DeepMimic),
        Ok(keys) if keys.skeleton.is_some() => {
            Err(Explanation::input("a DeepMimic character without motion")
                .remedy("give one of its motion files"))
        }
        Ok(_) => Err(Explanation::input(
            "JSON with neither `asset` (glTF) nor `Frames` (DeepMimic)",
        )
        .remedy("give a glTF or DeepMimic file")),
        Err(e) => Err(Explanation::input(format!("broken JSON ({e})"))
            .remedy("write or download the file again")),
    }
}

fn refusal(text: &[u8]) -> Explanation {
    let head = &text[..text.len().min(HEAD)];
    let says = |word: &[u8]| head.windows(word.len()).any(|w| w == word);
    let (kind, remedy) = if text.is_empty() {
        ("an empty file", "write or download it again")
    } else if head.starts_with(b"PK\x03\x04") || head.starts_with(b"\x1f\x8b") {
        ("a packed archive", "unpack it first")
    } else if head.starts_with(b"BLENDER") {
        ("a Blender file", "export it as FBX or glTF")
    } else if says(b"<COLLADA") {
        ("a COLLADA file", "convert it to FBX, glTF or BVH")
    } else {
        let known = "give FBX, glTF, GLB, BVH, AMC or DeepMimic JSON";
        ("an unknown format", known)
    };
    Explanation::input(kind).remedy(remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides() {
        assert_eq!(detect(b"Kaydara FBX Binary  \0\x1a\0"), Ok(Format::Fbx));
        assert_eq!(detect(b"; FBX 7.4.0 project file"), Ok(Format::Fbx));
        assert_eq!(detect(b"glTF\x02\0\0\0"), Ok(Format::Glb));
        assert_eq!(detect(b"\xef\xbb\xbf {\"asset\":{}}"), Ok(Format::Gltf));
        assert_eq!(
            detect(b"{\"Loop\":\"wrap\",\"Frames\":[]}"),
            Ok(Format::DeepMimic)
        );
        assert_eq!(detect(b"hierarchy\r\nROOT Hips"), Ok(Format::Bvh));
        let asf = b"# by hand\r\n:version 1.10\r\n:units\r\n";
        assert_eq!(detect(asf), Ok(Format::Asf));
        assert_eq!(detect(b"#!OML:ASF\n:degrees\n1\n"), Ok(Format::Amc));
    }

    #[test]
    fn our_own_files_are_told_apart() {
        let file = |format: &str| {
            let mimic = serde_json::json!({ "version": 1, "format": format }).to_string();
            let head = serde_json::json!({ "__metadata__": { "mimic": mimic } }).to_string();
            // A length whose bytes read ` {`, and one that is no text.
            [0x7b20, head.len().next_multiple_of(8)].map(|length| {
                let mut bytes = (length as u64).to_le_bytes().to_vec();
                bytes.extend(head.as_bytes());
                bytes.resize(8 + length, b' ');
                bytes
            })
        };
        for format in ["clip", "motion"] {
            for bytes in file(format) {
                let refused = detect(&bytes).expect_err("refused");
                assert!(refused.cause.contains(format), "{refused}");
                let remedy = refused.remedy.expect("a remedy").advice;
                assert!(remedy.contains(&format!("`.{format}`")), "{remedy}");
            }
        }
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        let refused = |bytes: &[u8]| {
            let refused = detect(bytes).expect_err("refused");
            assert!(refused.remedy.is_some(), "{refused}");
            refused.cause
        };
        assert!(refused(b"").contains("empty"));
        assert!(refused(b"{\"Skeleton\":{}}").contains("character"));
        assert!(refused(b"{\"a\":1}").contains("glTF"));
        assert!(refused(b"{\"a\":").contains("broken JSON"));
        assert!(refused(&[0xff; 10_000]).contains("unknown format"));
    }
}
