//! What kind of file some bytes are, by their content.

use super::fbx::is_ascii as is_ascii_fbx;
use safetensors::SafeTensors;

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

/// How far into a text the words that tell its kind are looked for, in bytes.
const HEAD: usize = 4096;

/// The format of `bytes`, or what they seem to be and what to do about it.
pub(crate) fn detect(bytes: &[u8]) -> Result<Format, String> {
    if let Some(format) = own_format(bytes) {
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

/// Which of Acclaim's two texts this is, by a section that each must have.
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

/// What one of our own files says to be.
fn own_format(bytes: &[u8]) -> Option<String> {
    #[derive(serde::Deserialize)]
    struct Stamp {
        format: String,
    }
    // Eight bytes of length, then a JSON object: before that is sure, nothing is parsed.
    if bytes.get(8) != Some(&b'{') {
        return None;
    }
    let (_, metadata) = SafeTensors::read_metadata(bytes).ok()?;
    let text = metadata.metadata().as_ref()?.get("mimic")?;
    Some(serde_json::from_str::<Stamp>(text).ok()?.format)
}

fn own_refusal(format: &str) -> String {
    let remedy = match format {
        "clip" => "name it NAME.clip, and give it to `mimic info` or `mimic retarget`",
        "motion" => "give it to `mimic tracks` or `mimic replay`",
        "policy" | "checkpoint" => "give the folder of its run to `mimic eval` or `mimic replay`",
        _ => "give an animation file",
    };
    format!("is a {format} of mimic's own, not an animation file; {remedy}")
}

fn detect_json(text: &[u8]) -> Result<Format, String> {
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
            Err("a DeepMimic character without motion; give one of its motion files".to_owned())
        }
        Ok(_) => Err(
            "JSON with neither `asset` (glTF) nor `Frames` (DeepMimic); give one of these"
                .to_owned(),
        ),
        Err(e) => Err(format!("broken JSON ({e}); write the file again")),
    }
}

fn refusal(text: &[u8]) -> String {
    let head = &text[..text.len().min(HEAD)];
    let says = |word: &[u8]| head.windows(word.len()).any(|w| w == word);
    let kind = if text.is_empty() {
        "an empty file; write it again"
    } else if head.starts_with(b"PK\x03\x04") || head.starts_with(b"\x1f\x8b") {
        "a packed archive; unpack it first"
    } else if head.starts_with(b"BLENDER") {
        "a Blender file; export it as FBX or glTF"
    } else if says(b"<COLLADA") {
        "a COLLADA file; convert it to FBX, glTF or BVH"
    } else {
        "no format that is known; give FBX, glTF, GLB, BVH, AMC or DeepMimic JSON"
    };
    kind.to_owned()
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
    fn our_own_files_are_sent_where_they_belong() {
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
        for (format, place) in [("clip", "mimic retarget"), ("motion", "mimic tracks")] {
            for bytes in file(format) {
                let refused = detect(&bytes).expect_err("refused");
                assert!(
                    refused.contains(format) && refused.contains(place),
                    "{refused}"
                );
            }
        }
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        let refused = |bytes: &[u8]| detect(bytes).expect_err("refused");
        assert!(refused(b"").contains("empty"));
        assert!(refused(b"{\"Skeleton\":{}}").contains("character"));
        assert!(refused(b"{\"a\":1}").contains("glTF"));
        assert!(refused(b"{\"a\":").contains("broken JSON"));
        assert!(refused(&[0xff; 10_000]).contains("no format"));
    }
}
