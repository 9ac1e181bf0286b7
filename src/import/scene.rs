//! What a reader gives to the importer: a tree of nodes, its takes, and where every node is at any time.

use crate::clip::Problem;
use nalgebra::{Matrix3, Matrix4};

/// One node of the file's tree. Parents stand before their children.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub name: String,
    pub parent: Option<usize>,
    /// The file says that this node is a bone (FBX limb or skeleton root, glTF skin joint).
    pub is_bone: bool,
    /// The file holds nothing but transforms in it (no mesh, camera or light).
    pub is_plain: bool,
}

/// One animation of the file.
#[derive(Clone, Debug)]
pub(crate) struct Take {
    pub name: String,
    /// Seconds.
    pub start: f64,
    /// Seconds; not before `start`.
    pub end: f64,
    /// Frame rate that the file states or its keys keep, in Hz, from 1 to 10,000.
    pub fps: f64,
    /// Nodes that this take moves.
    pub animated: Vec<usize>,
    /// `Some` where the format itself says whether the take loops.
    pub wraps: Option<bool>,
    /// Curves, or groups of them, that are looked at to place the nodes once.
    pub channels: usize,
    /// What the reader found wrong, or left out, in this take.
    pub problems: Vec<Problem>,
    /// Why this take can't be used, and what to do.
    pub fault: Option<String>,
}

impl Take {
    /// A take without length that moves nothing.
    pub fn still(name: String) -> Self {
        Self {
            name,
            start: 0.0,
            end: 0.0,
            fps: 30.0,
            animated: Vec::new(),
            wraps: None,
            channels: 0,
            problems: Vec::new(),
            fault: None,
        }
    }
}

/// An animation file after parsing. Nothing in it can be out of range any more.
pub(crate) trait Scene {
    /// `fbx`, `gltf`, `bvh`, `asf`, `amc` or `deepmimic`.
    fn format(&self) -> &'static str;
    fn nodes(&self) -> &[Node];
    fn takes(&self) -> &[Take];
    /// What a file without takes lacks, and what to do.
    fn no_takes(&self) -> &'static str {
        "holds no animation; export it with at least one take"
    }
    /// Up axis of the file's coordinates, e.g. `+Y`.
    fn up_axis(&self) -> &str;
    /// Metres per unit of the file's coordinates.
    fn unit_m(&self) -> f64;
    /// Rotation (or, for left-handed data, reflection) from the file's axes to Z up, X forward, Y left.
    fn canonical_from_file(&self) -> Matrix3<f64>;
    /// World matrices of all nodes, in the file's axes and units: at `time` seconds of `take`, or at rest.
    fn world(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>>;
    /// What the reader found wrong, or left out, in the file, whichever take is used.
    fn problems(&self) -> &[Problem];
    /// Bytes that were read from other files.
    fn bytes_beside(&self) -> usize {
        0
    }
}
