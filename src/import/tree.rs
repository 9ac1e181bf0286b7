//! Which nodes of a file are joints.

use super::scene::{Node, Scene};
use crate::clip::{Problem, Severity};

/// Indices of the nodes that become joints, parents before children.
///
/// They are the nodes that the file marks as bones and those that some take moves (skins leave out the parts of a
/// figure that carry whole meshes), with all nodes above and below; all nodes where there are none of either. Leaves
/// that hold a mesh, camera or light are no joints, unless they are bones or all that moves in a file without bones.
pub(crate) fn joints(scene: &dyn Scene) -> Vec<usize> {
    let nodes = scene.nodes();
    let moved = moved(scene);
    let has_bones = nodes.iter().any(|node| node.is_bone);
    let mut has_child = vec![false; nodes.len()];
    for parent in nodes.iter().filter_map(|node| node.parent) {
        has_child[parent] = true;
    }
    let stays = |node: usize| nodes[node].is_bone || moved[node] && (!has_bones || has_child[node]);
    let stays: Vec<bool> = (0..nodes.len()).map(stays).collect();
    let wanted = |node: usize| stays[node] || moved[node] && nodes[node].is_plain;
    let wanted: Vec<bool> = (0..nodes.len()).map(wanted).collect();
    let all = if wanted.contains(&true) {
        with_ancestors(nodes, with_descendants(nodes, wanted))
    } else {
        vec![true; nodes.len()]
    };
    let kept = without_loose_leaves(nodes, all, &stays);
    (0..nodes.len()).filter(|&node| kept[node]).collect()
}

/// Tells of nodes that `take` moves and that aren't among the `joints`.
pub(crate) fn left_out(scene: &dyn Scene, joints: &[usize], take: usize) -> Option<Problem> {
    let nodes = scene.nodes();
    let moved = &scene.takes().get(take)?.animated;
    let lost = moved
        .iter()
        .filter(|node| joints.binary_search(node).is_err());
    let names: Vec<&str> = lost.map(|&node| nodes[node].name.as_str()).collect();
    let list = super::few(names.iter().map(|name| format!("`{name}`")));
    (!names.is_empty()).then(|| Problem {
        id: "moving-nodes-left-out".to_owned(),
        severity: Severity::Note,
        message: format!(
            "the take moves {list}, which hold meshes, cameras or lights and are no joints"
        ),
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
