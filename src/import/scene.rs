//! What a reader gives to the importer: a tree of nodes, its takes, and where every node is at any time.

use super::axes::UpAxis;
use super::error::NoTakes;
use crate::clip::Problem;
use crate::explain::Explanation;
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
    /// The bone of a humanoid that the file says this is, as in [`Joint::bone`](crate::clip::Joint::bone).
    pub bone: Option<String>,
}

impl Node {
    /// A bone of a format that has nothing else.
    pub fn bone(name: String, parent: Option<usize>) -> Self {
        Self {
            name,
            parent,
            is_bone: true,
            is_plain: true,
            bone: None,
        }
    }
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
    pub fault: Option<Box<Explanation>>,
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

/// What a file holds, but for its motion. Nothing in it can be out of range any more.
#[derive(Debug)]
pub(crate) struct Contents {
    /// `fbx`, `gltf`, `bvh`, `asf`, `amc` or `deepmimic`.
    pub format: &'static str,
    pub nodes: Vec<Node>,
    pub takes: Vec<Take>,
    /// What the file lacks if it has no takes, and what to do.
    pub no_takes: NoTakes,
    /// Up axis of the file's coordinates, e.g. `+Y`.
    pub up_axis: String,
    /// Metres per unit of the file's coordinates.
    pub unit_m: f64,
    /// Rotation (or, for left-handed data, reflection) from the file's axes to Z up, X forward, Y left.
    pub canonical_from_file: Matrix3<f64>,
    /// World matrices at rest, where that isn't how the nodes stand.
    pub bound: Option<Vec<Matrix4<f64>>>,
    /// What the reader found wrong, or left out, in the file, whichever take is used.
    pub problems: Vec<Problem>,
    /// Bytes that were read from other files.
    pub bytes_beside: usize,
}

impl Contents {
    /// Contents in metres with Y up, without a problem.
    pub fn new(format: &'static str, nodes: Vec<Node>, takes: Vec<Take>) -> Self {
        let up = UpAxis::PlusY;
        Self {
            format,
            nodes,
            takes,
            no_takes: NoTakes {
                cause: "holds no animation",
                remedy: "export it with at least one take",
            },
            up_axis: up.to_string(),
            unit_m: 1.0,
            canonical_from_file: up.canonical_from_file(),
            bound: None,
            problems: Vec::new(),
            bytes_beside: 0,
        }
    }
}

/// An animation file after parsing.
pub(crate) trait Scene {
    fn contents(&self) -> &Contents;
    /// World matrices of all nodes, in the file's axes and units: at `time` seconds of `take`, or as they stand.
    fn placed(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>>;

    /// The same, at rest where there is no `at`.
    fn world(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>> {
        match (at, &self.contents().bound) {
            (None, Some(bound)) => bound.clone(),
            _ => self.placed(at),
        }
    }

    fn nodes(&self) -> &[Node] {
        &self.contents().nodes
    }

    fn takes(&self) -> &[Take] {
        &self.contents().takes
    }
}

/// World matrices of nodes from those in their parents.
pub(crate) fn composed(
    nodes: &[Node],
    locals: impl Iterator<Item = Matrix4<f64>>,
) -> Vec<Matrix4<f64>> {
    let mut world: Vec<Matrix4<f64>> = Vec::with_capacity(nodes.len());
    for (node, local) in nodes.iter().zip(locals) {
        world.push(node.parent.map_or(local, |parent| world[parent] * local));
    }
    world
}
