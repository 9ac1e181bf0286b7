//! What kind of file some bytes are, by their content.

/// A format that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Fbx,
    Glb,
    Gltf,
    DeepMimic,
}

/// How far into a text the words that tell its kind are looked for, in bytes.
const HEAD: usize = 4096;

/// The format of `bytes`, or what they seem to be and what to do about it.
pub(crate) fn detect(bytes: &[u8]) -> Result<Format, String> {
    if bytes.starts_with(b"Kaydara FBX Binary") {
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
    Err(refusal(text))
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
    } else if head.starts_with(b"HIERARCHY") {
        "a BVH file; convert it to FBX or glTF, in Blender for example"
    } else if head.starts_with(b"; FBX") || says(b"FBXHeaderExtension") {
        "an ASCII FBX file; save it as binary FBX"
    } else if head.starts_with(b"#") && says(b":root") || says(b":bonedata") {
        "an ASF/AMC file; convert it to FBX or glTF"
    } else if head.starts_with(b"PK\x03\x04") || head.starts_with(b"\x1f\x8b") {
        "a packed archive; unpack it first"
    } else if head.starts_with(b"BLENDER") {
        "a Blender file; export it as FBX or glTF"
    } else if says(b"<COLLADA") {
        "a COLLADA file; convert it to FBX or glTF"
    } else {
        "no format that is known; give binary FBX, glTF, GLB or DeepMimic JSON"
    };
    kind.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides() {
        assert_eq!(detect(b"Kaydara FBX Binary  \0\x1a\0"), Ok(Format::Fbx));
        assert_eq!(detect(b"glTF\x02\0\0\0"), Ok(Format::Glb));
        assert_eq!(detect(b"\xef\xbb\xbf {\"asset\":{}}"), Ok(Format::Gltf));
        assert_eq!(
            detect(b"{\"Loop\":\"wrap\",\"Frames\":[]}"),
            Ok(Format::DeepMimic)
        );
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        let refused = |bytes: &[u8]| detect(bytes).expect_err("refused");
        assert!(refused(b"; FBX 7.4.0 project file").contains("ASCII FBX"));
        assert!(refused(b"HIERARCHY\nROOT Hips").contains("BVH"));
        assert!(refused(b"").contains("empty"));
        assert!(refused(b"{\"Skeleton\":{}}").contains("character"));
        assert!(refused(b"{\"a\":1}").contains("glTF"));
        assert!(refused(b"{\"a\":").contains("broken JSON"));
        assert!(refused(&[0xff; 10_000]).contains("no format"));
    }
}
