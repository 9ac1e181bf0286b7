//! The node tree, parents before children, and the transform of each node in its parent.

use super::curve::unit;
use super::document::{Document, Extensions};
use super::error::GltfError;
use crate::import::rigid::rotation_of;
use crate::import::scene;
use gltf::json::{Index, Node};
use nalgebra::{Matrix4, Rotation3, UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};

/// Translation, rotation and scale of a node in its parent.
#[derive(Clone, Copy)]
pub(super) struct Placement {
    pub translation: Vector3<f64>,
    pub rotation: UnitQuaternion<f64>,
    pub scale: Vector3<f64>,
}

/// A node's own transform. A matrix may hold shear, which the three parts can't.
pub(super) struct Rest {
    pub placement: Placement,
    /// Boxed, because it is rare and large.
    matrix: Option<Box<Matrix4<f64>>>,
}

/// The nodes of a file in an order in which parents come first.
pub(super) struct Tree {
    pub nodes: Vec<scene::Node>,
    pub rest: Vec<Rest>,
    /// Index in `nodes` of every node of the file.
    pub place: Vec<usize>,
}

impl Tree {
    /// World matrices of all nodes by their own transforms.
    pub fn rest_world(&self) -> Vec<Matrix4<f64>> {
        scene::composed(&self.nodes, self.rest.iter().map(Rest::matrix))
    }
}

impl Placement {
    pub fn matrix(&self) -> Matrix4<f64> {
        let mut matrix = self.rotation.to_homogeneous();
        for (axis, &scale) in self.scale.iter().enumerate() {
            matrix.column_mut(axis).scale_mut(scale);
        }
        matrix
            .fixed_view_mut::<3, 1>(0, 3)
            .copy_from(&self.translation);
        matrix
    }
}

impl Rest {
    pub fn matrix(&self) -> Matrix4<f64> {
        let own = self.matrix.as_deref().copied();
        own.unwrap_or_else(|| self.placement.matrix())
    }

    fn new(node: &Node) -> Self {
        let matrix = node
            .matrix
            .map(|m| Box::new(Matrix4::from_column_slice(&m.map(f64::from))));
        let placement = match &matrix {
            Some(matrix) => parts(matrix),
            None => Placement {
                translation: Vector3::from(node.translation.unwrap_or_default().map(f64::from)),
                rotation: unit(node.rotation.unwrap_or_default().0.map(f64::from))
                    .unwrap_or_default(),
                scale: Vector3::from(node.scale.unwrap_or([1.0; 3]).map(f64::from)),
            },
        };
        Self { placement, matrix }
    }
}

/// Translation, rotation and scale of a matrix. The specification forbids to animate nodes with a matrix, but files do.
fn parts(matrix: &Matrix4<f64>) -> Placement {
    let linear = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    // Shear, which three parts can't have, is dropped.
    let turn = rotation_of(&linear).unwrap_or_else(Rotation3::identity);
    let scale = (turn.matrix().transpose() * linear).diagonal();
    Placement {
        translation: matrix.fixed_view::<3, 1>(0, 3).into_owned(),
        rotation: UnitQuaternion::from_rotation_matrix(&turn),
        scale,
    }
}

/// Orders the nodes, and checks that they form trees.
pub(super) fn tree(document: &Document) -> Result<Tree, GltfError> {
    let parents = parents(document)?;
    let order = order(document, &parents)?;
    let mut place = vec![0; order.len()];
    for (at, &node) in order.iter().enumerate() {
        place[node] = at;
    }
    let mut bone = vec![false; order.len()];
    let skinned = document
        .skins
        .iter()
        .flat_map(|skin| skin.joints.iter().map(Index::value));
    for node in skinned {
        let mark = bone.get_mut(node).ok_or_else(|| missing(node))?;
        *mark = true;
    }
    let named = named(document);
    let bone_of = |node| named.get(&node).copied().filter(|bone| !bone.is_empty());
    let about = |&node: &usize| {
        let source = &document.nodes[node];
        let holds = source.mesh.is_some() || source.camera.is_some() || document.is_light(node);
        scene::Node {
            name: source
                .name
                .clone()
                .unwrap_or_else(|| format!("node {node}")),
            parent: parents[node].map(|parent| place[parent]),
            is_bone: bone[node] || named.contains_key(&node),
            is_plain: !holds,
            bone: bone_of(node).map(str::to_owned),
        }
    };
    let nodes = order.iter().map(about).collect();
    let rest = order
        .iter()
        .map(|&node| Rest::new(&document.nodes[node]))
        .collect();
    Ok(Tree { nodes, rest, place })
}

/// Nodes that an extension calls bones, and which bone each is, or nothing if the extension doesn't say. Each node and each bone
/// counts once.
fn named(document: &Document) -> BTreeMap<usize, &str> {
    let (mut named, mut names) = (BTreeMap::new(), BTreeSet::new());
    let bones = document.extensions.iter().flat_map(Extensions::bones);
    for (node, bone) in bones {
        if !named.contains_key(&node) && (bone.is_empty() || names.insert(bone)) {
            named.insert(node, bone);
        }
    }
    named
}

fn missing(node: usize) -> GltfError {
    GltfError::Tree {
        node,
        reason: "it is named but isn't in the file",
    }
}

fn children(node: &Node) -> impl DoubleEndedIterator<Item = usize> {
    node.children.iter().flatten().map(Index::value)
}

fn parents(document: &Document) -> Result<Vec<Option<usize>>, GltfError> {
    let mut parents = vec![None; document.nodes.len()];
    for (parent, node) in document.nodes.iter().enumerate() {
        for child in children(node) {
            let slot = parents.get_mut(child).ok_or_else(|| missing(child))?;
            if slot.replace(parent).is_some() {
                let reason = "it has several parents";
                return Err(GltfError::Tree {
                    node: child,
                    reason,
                });
            }
        }
    }
    Ok(parents)
}

/// Nodes from the roots downward, each root's tree in the file's order. Nodes that no root reaches form a cycle.
fn order(document: &Document, parents: &[Option<usize>]) -> Result<Vec<usize>, GltfError> {
    let roots = (0..parents.len())
        .rev()
        .filter(|&node| parents[node].is_none());
    let mut waiting: Vec<usize> = roots.collect();
    let mut order = Vec::with_capacity(parents.len());
    while let Some(node) = waiting.pop() {
        order.push(node);
        waiting.extend(children(&document.nodes[node]).rev());
    }
    if order.len() == parents.len() {
        return Ok(order);
    }
    // Name one node of the cycle.
    let mut reached = vec![false; parents.len()];
    order.iter().for_each(|&node| reached[node] = true);
    let node = reached
        .iter()
        .position(|&reached| !reached)
        .unwrap_or_default();
    Err(GltfError::Tree {
        node,
        reason: "it is its own ancestor",
    })
}
