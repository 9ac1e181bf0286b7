//! What can be wrong with a glTF file.

/// Why a glTF file couldn't be read.
#[derive(Debug, thiserror::Error)]
pub enum GltfError {
    #[error("broken glTF JSON ({0}); export the file again")]
    Json(serde_json::Error),
    #[error("glTF version {0}; export it as glTF 2.0")]
    Version(String),
    #[error("{0}; export the GLB again")]
    Container(String),
    #[error("buffer {buffer}: {reason}{}", remedy(reason))]
    Buffer { buffer: usize, reason: String },
    #[error("accessor {accessor}: {reason}{}", remedy(reason))]
    Accessor { accessor: usize, reason: String },
    #[error("take `{take}`, node `{node}`, {path}: {reason}; export the file again")]
    Curve {
        take: String,
        node: String,
        path: &'static str,
        reason: String,
    },
    #[error("node {node}: {reason}; export the file again")]
    Tree { node: usize, reason: String },
}

/// What to do, unless the reason says it.
fn remedy(reason: &str) -> &'static str {
    if reason.contains(';') {
        ""
    } else {
        "; export the file again"
    }
}
