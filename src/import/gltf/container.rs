//! The GLB container: a header, a JSON chunk and perhaps a binary chunk.

use super::GltfError;
use gltf::Glb;
use gltf::binary::Error;

/// Bytes of a GLB header, which its length counts too.
const HEADER: u32 = 12;

/// Takes a GLB file apart.
pub(super) fn split(bytes: &[u8]) -> Result<Glb<'_>, GltfError> {
    let length = bytes.get(8..).and_then(<[u8]>::first_chunk);
    let length = length.map(|word| u32::from_le_bytes(*word));
    // `Glb` subtracts the header from the length unchecked.
    if length.is_none_or(|length| length < HEADER) {
        return Err(GltfError::Container("the GLB header is cut off".to_owned()));
    }
    Glb::from_slice(bytes).map_err(|e| match e {
        gltf::Error::Binary(Error::Version(version)) => GltfError::Version(version.to_string()),
        gltf::Error::Binary(
            Error::Length {
                length,
                length_read,
            }
            | Error::ChunkLength {
                length,
                length_read,
                ..
            },
        ) => GltfError::Container(format!(
            "the GLB announces {length} bytes, but {length_read} are left"
        )),
        other => GltfError::Container(format!("broken GLB ({other})")),
    })
}
