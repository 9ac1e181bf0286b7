//! What a format's reader gives to the importer: a tree of nodes, takes, and where every node is at any time.

use super::axes::UpAxis;
use super::error::NoTakes;
use crate::clip::Problem;
use crate::explain::Explanation;
use nalgebra::{Matrix3, Matrix4};

/// One node of the file's tree. Parents come before their children.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Its name in the file.
    pub name: String,
    /// Index of the parent; `None` for a root.
    pub parent: Option<usize>,
    /// Whether the file says that this node is a bone (FBX limb or skeleton root, glTF skin joint).
    pub is_bone: bool,
    /// Whether it holds nothing but a transform: no mesh, camera or light.
    pub is_plain: bool,
    /// The bone of a humanoid that the file says this is; see [`Joint::bone`](crate::clip::Joint::bone).
    pub bone: Option<String>,
}

impl Node {
    /// A node of a format in which every node is a bone.
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
    /// Its name in the file; of a format without names, the file's.
    pub name: String,
    /// Start of the take, seconds of the file's clock.
    pub start: f64,
    /// End of the take, seconds of the file's clock; not before `start`.
    pub end: f64,
    /// Frame rate that the file states or its keys keep, Hz, from 1 to 10,000.
    pub fps: f64,
    /// Indices of the nodes that this take moves.
    pub animated: Vec<usize>,
    /// `Some` where the format itself says whether the take loops.
    pub wraps: Option<bool>,
    /// How many curves, or groups of curves, are evaluated to place the nodes once.
    pub channels: usize,
    /// What the reader found wrong in this take, or left out.
    pub problems: Vec<Problem>,
    /// Why this take can't be used, and what to do; its place names the take.
    pub fault: Option<Box<Explanation>>,
}

impl Take {
    /// A take without length that moves nothing, to be filled in.
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

/// What a file holds, except for its motion. Its reader has checked that everything is in range.
#[derive(Debug)]
pub(crate) struct Contents {
    /// `fbx`, `gltf`, `bvh`, `asf`, `amc` or `deepmimic`.
    pub format: &'static str,
    /// The nodes, parents first.
    pub nodes: Vec<Node>,
    /// The takes, in the file's order.
    pub takes: Vec<Take>,
    /// What the file holds instead of takes, and what to do, if it has none.
    pub no_takes: NoTakes,
    /// Up axis of the file's coordinates, e.g. `+Y`.
    pub up_axis: String,
    /// Metres per unit of the file's coordinates.
    pub unit_m: f64,
    /// Rotation (or, for left-handed data, reflection) from the file's axes to Z up, X forward, Y left.
    pub canonical_from_file: Matrix3<f64>,
    /// World matrices of the nodes at rest, where the file's nodes are in another pose.
    pub bound: Option<Vec<Matrix4<f64>>>,
    /// What the reader found wrong in the file, or left out, whichever take is used.
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
    /// What it holds, except for its motion.
    fn contents(&self) -> &Contents;
    /// World matrices of all nodes in the file's axes and units, at a take and seconds of the file's clock. Without `at`, as
    /// the file's nodes are placed.
    fn placed(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>>;

    /// The same; without `at`, in the rest pose.
    fn world(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>> {
        match (at, &self.contents().bound) {
            (None, Some(bound)) => bound.clone(),
            _ => self.placed(at),
        }
    }

    /// The nodes, parents first.
    fn nodes(&self) -> &[Node] {
        &self.contents().nodes
    }

    /// The takes, in the file's order.
    fn takes(&self) -> &[Take] {
        &self.contents().takes
    }
}

/// World matrices of the nodes from their matrices in their parents.
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
