//! Which nodes of a file are joints.

use super::scene::{Node, Scene};

/// Indices of the nodes that become joints, parents before children.
///
/// Where the file marks bones, these are the bones and all nodes above them, whose motion carries them. Otherwise
/// they are the nodes that some take moves, with all nodes above and below, less leaves that no take moves and
/// that hold a mesh, camera or light; and all nodes but such leaves where nothing moves.
pub(crate) fn joints(scene: &dyn Scene) -> Vec<usize> {
    let nodes = scene.nodes();
    let mut animated = vec![false; nodes.len()];
    for &node in scene.takes().iter().flat_map(|take| &take.animated) {
        if let Some(mark) = animated.get_mut(node) {
            *mark = true;
        }
    }
    let bones: Vec<bool> = nodes.iter().map(|node| node.is_bone).collect();
    let kept = if bones.contains(&true) {
        with_ancestors(nodes, bones)
    } else if !animated.contains(&true) {
        without_loose_leaves(nodes, vec![true; nodes.len()], &animated)
    } else {
        let below = with_descendants(nodes, animated.clone());
        without_loose_leaves(nodes, with_ancestors(nodes, below), &animated)
    };
    (0..nodes.len()).filter(|&node| kept[node]).collect()
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

fn without_loose_leaves(nodes: &[Node], mut kept: Vec<bool>, animated: &[bool]) -> Vec<bool> {
    let mut has_child = vec![false; nodes.len()];
    for (node, about) in nodes.iter().enumerate().rev() {
        kept[node] &= has_child[node] || about.is_plain || animated[node];
        if let (true, Some(parent)) = (kept[node], about.parent) {
            has_child[parent] = true;
        }
    }
    kept
}
