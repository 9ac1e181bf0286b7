//! The tree of models: the nodes of an FBX file.

use super::objects::Graph;
use super::properties::{Properties, Templates};
use super::transform::{Inherit, Pose, Property, Rules, rotation_order};
use crate::import::scene::Node;

const BONES: [&[u8]; 3] = [b"LimbNode", b"Limb", b"Root"];
/// Kinds of models, and of what is attached to them, that hold more than a transform.
const SOLID: [&[u8]; 12] = [
    b"Mesh",
    b"Camera",
    b"CameraStereo",
    b"CameraSwitcher",
    b"Light",
    b"Nurbs",
    b"NurbsCurve",
    b"NurbsSurface",
    b"TrimNurbsSurface",
    b"Patch",
    b"Line",
    b"Boundary",
];

/// What places a node in its parent.
pub(super) struct Rig {
    /// Its properties without animation.
    pub rest: Pose,
    /// How they become a transform.
    pub rules: Rules,
}

/// All models, parents first.
pub(super) struct Tree {
    /// The nodes.
    pub nodes: Vec<Node>,
    /// What places each node.
    pub rigs: Vec<Rig>,
    /// Index of the node of every object; `None` of those that aren't models.
    pub of_object: Vec<Option<usize>>,
    /// Whether some connections made a circle, which was cut.
    pub circular: bool,
}

impl Tree {
    /// The models of a graph.
    pub fn read(graph: &Graph, templates: &Templates) -> Self {
        let parents: Vec<Option<usize>> = (0..graph.objects.len())
            .map(|object| {
                graph
                    .parents(object, "Model")
                    .find(|link| link.property.is_none())
                    .map(|link| link.parent)
            })
            .collect();
        let mut children = vec![Vec::new(); graph.objects.len()];
        for object in graph.of_class("Model") {
            if let Some(parent) = parents[object] {
                children[parent].push(object);
            }
        }
        let mut tree = Self {
            nodes: Vec::new(),
            rigs: Vec::new(),
            of_object: vec![None; graph.objects.len()],
            circular: false,
        };
        for root in graph
            .of_class("Model")
            .filter(|&object| parents[object].is_none())
        {
            tree.grow(root, &children, graph, templates);
        }
        // What no root reaches is in a circle, or below one: the first of them becomes a root.
        for object in graph.of_class("Model") {
            if tree.of_object[object].is_none() {
                tree.circular = true;
                tree.grow(object, &children, graph, templates);
            }
        }
        tree
    }

    /// Adds `root` and all below it, depth first.
    fn grow(&mut self, root: usize, children: &[Vec<usize>], graph: &Graph, templates: &Templates) {
        let mut open = vec![(root, None)];
        while let Some((object, parent)) = open.pop() {
            if self.of_object[object].is_some() {
                continue;
            }
            let index = self.nodes.len();
            self.of_object[object] = Some(index);
            self.nodes.push(node(graph, object, parent));
            self.rigs
                .push(rig(&templates.properties(graph.objects[object].record)));
            open.extend(
                children[object]
                    .iter()
                    .rev()
                    .map(|&child| (child, Some(index))),
            );
        }
    }
}

fn node(graph: &Graph, object: usize, parent: Option<usize>) -> Node {
    let model = &graph.objects[object];
    let attached: Vec<&[u8]> = graph
        .children(object, "NodeAttribute")
        .map(|link| graph.objects[link.child].kind)
        .collect();
    let has = |kinds: &[&[u8]]| {
        kinds.contains(&model.kind) || attached.iter().any(|kind| kinds.contains(kind))
    };
    Node {
        name: model.name.clone(),
        parent,
        is_bone: has(&BONES),
        is_plain: !has(&SOLID) && graph.children(object, "Geometry").next().is_none(),
        bone: None,
    }
}

fn rig(properties: &Properties) -> Rig {
    let mut rest = Pose::identity();
    for (name, property) in Property::ALL {
        if let Some(value) = properties.vector(name) {
            *rest.at_mut(property) = value;
        }
    }
    let switch = |name, default| properties.int(name).map_or(default, |value| value != 0);
    let rules = Rules {
        order: rotation_order(properties.int("RotationOrder").unwrap_or(0)),
        // These switches turn off pre- and post-rotation; files that leave them out mean them to count.
        rotation_space: switch("RotationActive", true)
            && !switch("RotationSpaceForLimitOnly", false),
        inherit: match properties.int("InheritType") {
            Some(0) => Inherit::RrSs,
            Some(2) => Inherit::Rrs,
            _ => Inherit::RSrs,
        },
    };
    Rig { rest, rules }
}
