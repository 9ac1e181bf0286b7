//! The GLB container: a header, a JSON chunk and perhaps a binary chunk.

use super::GltfError;

const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;

/// The two chunks of a GLB file.
pub(super) struct Glb<'a> {
    pub json: &'a [u8],
    pub bin: Option<&'a [u8]>,
}

/// Takes a GLB file apart. Chunks of other kinds are passed over, as the specification wants.
pub(super) fn split(bytes: &[u8]) -> Result<Glb<'_>, GltfError> {
    let broken = |reason: &str| GltfError::Container(reason.to_owned());
    match word(bytes, 4) {
        Some(2) => {}
        Some(version) => return Err(GltfError::Version(version.to_string())),
        None => return Err(broken("the GLB header is cut off")),
    }
    let (mut json, mut bin) = (None, None);
    let mut at = 12;
    while json.is_none() || at < bytes.len() {
        let (Some(length), Some(kind)) = (word(bytes, at), word(bytes, at + 4)) else {
            break;
        };
        let rest = bytes.get(at + 8..).unwrap_or_default();
        let length = length as usize;
        let chunk = rest.get(..length).ok_or_else(|| {
            let left = rest.len();
            GltfError::Container(format!(
                "a GLB chunk says {length} bytes, but {left} are left"
            ))
        })?;
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            BIN if bin.is_none() => bin = Some(chunk),
            _ => {}
        }
        at += 8 + length;
    }
    let json = json.ok_or_else(|| broken("the GLB holds no JSON chunk"))?;
    Ok(Glb { json, bin })
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at.checked_add(4)?)?;
    word.try_into().ok().map(u32::from_le_bytes)
}
