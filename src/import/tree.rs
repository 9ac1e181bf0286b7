//! Which nodes of a file are joints.

use super::names::first_few;
use super::scene::{Node, Scene};
use crate::clip::Problem;

/// Indices of the nodes that become joints, parents before children.
///
/// Joints are the nodes that the file marks as bones, and those that some take moves: skins leave out parts of a figure that
/// carry a whole mesh, such as a helmet. All nodes above and below them are joints too. A file with neither has all its nodes
/// as joints. A leaf that holds a mesh, camera or light is not a joint, unless it is a bone, or moves in a file without bones.
pub(crate) fn joints(scene: &dyn Scene) -> Vec<usize> {
    let nodes = scene.nodes();
    let moved = moved(scene);
    let has_bones = nodes.iter().any(|node| node.is_bone);
    let mut has_child = vec![false; nodes.len()];
    for parent in nodes.iter().filter_map(|node| node.parent) {
        has_child[parent] = true;
    }
    // What is kept even as a leaf with a mesh.
    let stays = |node: usize| nodes[node].is_bone || moved[node] && (!has_bones || has_child[node]);
    let stays: Vec<bool> = (0..nodes.len()).map(stays).collect();
    let wanted = |node: usize| stays[node] || moved[node] && nodes[node].is_plain;
    let wanted: Vec<bool> = (0..nodes.len()).map(wanted).collect();
    // The whole branch belongs to the figure: what is above places it, what is below ends it.
    let all = if wanted.contains(&true) {
        with_ancestors(nodes, with_descendants(nodes, wanted))
    } else {
        vec![true; nodes.len()]
    };
    let kept = without_loose_leaves(nodes, all, &stays);
    (0..nodes.len()).filter(|&node| kept[node]).collect()
}

/// A note about nodes that `take` moves and that aren't among the `joints`.
pub(crate) fn left_out(scene: &dyn Scene, joints: &[usize], take: usize) -> Option<Problem> {
    let nodes = scene.nodes();
    let moved = &scene.takes().get(take)?.animated;
    let lost = moved
        .iter()
        .filter(|node| joints.binary_search(node).is_err());
    let names: Vec<&str> = lost.map(|&node| nodes[node].name.as_str()).collect();
    let list = first_few(names.iter().map(|name| format!("`{name}`")));
    (!names.is_empty()).then(|| {
        Problem::note(
            "moving-nodes-left-out",
            format!(
                "the take moves {list}, which hold meshes, cameras or lights and aren't joints"
            ),
        )
    })
}

/// Whether some take moves each node.
fn moved(scene: &dyn Scene) -> Vec<bool> {
    let mut moved = vec![false; scene.nodes().len()];
    for &node in scene.takes().iter().flat_map(|take| &take.animated) {
        if let Some(mark) = moved.get_mut(node) {
            *mark = true;
        }
    }
    moved
}

fn with_ancestors(nodes: &[Node], mut kept: Vec<bool>) -> Vec<bool> {
    for (node, about) in nodes.iter().enumerate().rev() {
        if let (true, Some(parent)) = (kept[node], about.parent) {
            kept[parent] = true;
        }
    }
    kept
}

fn with_descendants(nodes: &[Node], mut kept: Vec<bool>) -> Vec<bool> {
    for (node, about) in nodes.iter().enumerate() {
        kept[node] |= about.parent.is_some_and(|parent| kept[parent]);
    }
    kept
}

fn without_loose_leaves(nodes: &[Node], mut kept: Vec<bool>, stays: &[bool]) -> Vec<bool> {
    let mut has_child = vec![false; nodes.len()];
    for (node, about) in nodes.iter().enumerate().rev() {
        kept[node] &= has_child[node] || about.is_plain || stays[node];
        if let (true, Some(parent)) = (kept[node], about.parent) {
            has_child[parent] = true;
        }
    }
    kept
}
