//! glTF 2.0: `.gltf` with embedded or neighbouring buffers, and GLB.

mod accessor;
mod bind;
mod buffer;
mod container;
mod curve;
mod document;
mod error;
mod rate;
mod take;
mod tree;

pub use error::GltfError;

use super::scene::{Node, Scene, Take};
use crate::clip::{Problem, Severity};
use crate::import::axes::UpAxis;
use crate::import::bind::{Stand, pose};
use accessor::Accessors;
use buffer::Buffers;
use document::Document;
use nalgebra::{Matrix3, Matrix4};
use std::path::Path;
use take::Curves;
use tree::Tree;

/// Required extensions that change neither the nodes nor their motion.
const HARMLESS: [&str; 4] = [
    "KHR_materials_",
    "KHR_texture_",
    "KHR_mesh_quantization",
    "KHR_draco_mesh_compression",
];

/// A glTF file's nodes and animations.
pub(crate) struct GltfScene {
    tree: Tree,
    /// World matrices at rest, where that isn't how the nodes stand.
    bound: Option<Vec<Matrix4<f64>>>,
    takes: Vec<Take>,
    curves: Vec<Curves>,
    problems: Vec<Problem>,
    bytes_beside: usize,
}

/// Reads a GLB file.
pub(crate) fn read_glb(bytes: &[u8], folder: Option<&Path>) -> Result<GltfScene, GltfError> {
    let glb = container::split(bytes)?;
    scene(&document::parse(&glb.json)?, glb.bin.as_deref(), folder)
}

/// Reads a `.gltf` file. Buffers in other files are looked for in `folder`, and nowhere else.
pub(crate) fn read_json(bytes: &[u8], folder: Option<&Path>) -> Result<GltfScene, GltfError> {
    scene(&document::parse(bytes)?, None, folder)
}

fn scene(
    document: &Document,
    bin: Option<&[u8]>,
    folder: Option<&Path>,
) -> Result<GltfScene, GltfError> {
    let tree = tree::tree(document)?;
    let mut accessors = Accessors::new(document, Buffers::new(document, bin, folder));
    let mut problems = extension_problems(document);
    let (mut takes, mut curves) = (Vec::new(), Vec::new());
    for (number, animation) in document.animations.iter().enumerate() {
        let name = animation
            .name
            .clone()
            .unwrap_or_else(|| format!("take {}", number + 1));
        let (found, take) = take::read(animation, name, &tree, &mut accessors);
        takes.push(take);
        curves.push(found);
    }
    let stand = Stand {
        nodes: &tree.nodes,
        world: &tree.rest_world(),
        up: None,
    };
    let bound = pose(&stand, bind::binds(document, &tree, &mut accessors));
    let bound = bound.map(|(world, problem)| {
        problems.push(problem);
        world
    });
    Ok(GltfScene {
        bytes_beside: accessors.bytes_beside(),
        bound,
        tree,
        takes,
        curves,
        problems,
    })
}

fn extension_problems(document: &Document) -> Vec<Problem> {
    let unknown = |name: &&String| !HARMLESS.iter().any(|harmless| name.starts_with(harmless));
    let problem = |name: &String| Problem {
        id: "extension-ignored".to_owned(),
        severity: Severity::Note,
        message: format!(
            "the file requires {name}, of which only plain nodes and animations are used"
        ),
    };
    let required = document.extensions_required.iter();
    let mut problems: Vec<Problem> = required.filter(unknown).map(problem).collect();
    if document.extensions.is_none() {
        problems.push(Problem {
            id: "extension-unreadable".to_owned(),
            severity: Severity::Note,
            message: "the bones that the file's VRM extension names can't be read; the joints are told from skins and motion"
                .to_owned(),
        });
    }
    problems
}

impl Scene for GltfScene {
    fn format(&self) -> &'static str {
        "gltf"
    }

    fn nodes(&self) -> &[Node] {
        &self.tree.nodes
    }

    fn takes(&self) -> &[Take] {
        &self.takes
    }

    fn up_axis(&self) -> &str {
        "+Y"
    }

    fn unit_m(&self) -> f64 {
        1.0
    }

    fn canonical_from_file(&self) -> Matrix3<f64> {
        UpAxis::PlusY.canonical_from_file()
    }

    fn world(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>> {
        let Some((curves, time)) = at.and_then(|(take, time)| Some((self.curves.get(take)?, time)))
        else {
            let stand = || self.tree.rest_world();
            return self.bound.clone().unwrap_or_else(stand);
        };
        let mut world: Vec<Matrix4<f64>> = Vec::with_capacity(self.tree.nodes.len());
        for (at, (node, rest)) in self.tree.nodes.iter().zip(&self.tree.rest).enumerate() {
            let placement = curves.placement(at, &rest.placement, time);
            let local = placement.map_or_else(|| rest.matrix(), |placement| placement.matrix());
            world.push(node.parent.map_or(local, |parent| world[parent] * local));
        }
        world
    }

    fn problems(&self) -> &[Problem] {
        &self.problems
    }

    fn bytes_beside(&self) -> usize {
        self.bytes_beside
    }
}
