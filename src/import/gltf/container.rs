//! The GLB container: a header, a JSON chunk and perhaps a binary chunk.

use super::error::GltfError;
use gltf::Glb;
use gltf::binary::Error;

/// Bytes of a GLB's header; the length that it states includes them.
const HEADER: u32 = 12;

/// Takes a GLB file apart.
pub(super) fn split(bytes: &[u8]) -> Result<Glb<'_>, GltfError> {
    let length = bytes.get(8..).and_then(<[u8]>::first_chunk);
    let length = length.map(|word| u32::from_le_bytes(*word));
    // `Glb` subtracts the header from the stated length unchecked, and would panic.
    if length.is_none_or(|length| length < HEADER) {
        return Err(broken("the GLB header is cut off".to_owned()));
    }
    Glb::from_slice(bytes).map_err(|e| match e {
        gltf::Error::Binary(Error::Version(version)) => GltfError::Version {
            found: version.to_string(),
        },
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
        ) => broken(format!(
            "the GLB announces {length} bytes, but {length_read} are left"
        )),
        other => broken(format!("broken GLB ({other})")),
    })
}

fn broken(reason: String) -> GltfError {
    GltfError::Container { reason }
}
