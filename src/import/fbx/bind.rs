//! The bind poses of a file: where its joints were in the world when meshes were bound to them.

use super::nodes::Tree;
use super::numbers::in_range;
use super::objects::Graph;
use super::record::Element;
use crate::import::bind::Binds;
use nalgebra::Matrix4;

/// World matrices of the bones of every bind pose. `budget` is how many bytes may be decoded.
pub(super) fn binds(graph: &Graph, tree: &Tree, budget: usize) -> Vec<Binds> {
    let mut budget = budget;
    let poses = graph
        .of_class("Pose")
        .map(|object| &graph.objects[object])
        .filter(|object| object.kind == b"BindPose");
    let mut binds = |record: &Element| -> Binds {
        let entries = record.children.iter();
        let entries = entries.filter(|entry| entry.name == b"PoseNode");
        entries
            .filter_map(|entry| bind(entry, graph, tree, &mut budget))
            .collect()
    };
    poses.map(|pose| binds(pose.record)).collect()
}

/// A bone and its matrix. A broken entry is skipped, because the motion doesn't need it.
fn bind(
    entry: &Element,
    graph: &Graph,
    tree: &Tree,
    budget: &mut usize,
) -> Option<(usize, Matrix4<f64>)> {
    let object = graph.with_id(entry.child("Node")?.int(0)?)?;
    let node = tree.of_object[object]?;
    let array = entry.array("Matrix")?;
    if !tree.nodes[node].is_bone || array.count != 16 {
        return None;
    }
    let numbers = array.reals(budget).ok()?;
    let usable = numbers.iter().all(|&x| in_range(x));
    usable.then(|| (node, Matrix4::from_column_slice(&numbers)))
}
