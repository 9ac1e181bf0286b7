//! glTF 2.0: `.gltf` with embedded or neighbouring buffers, and GLB.

mod accessor;
mod bind;
mod buffer;
mod container;
mod curve;
mod document;
mod error;
mod indices;
mod rate;
mod take;
mod tree;

use super::scene::{Contents, Scene, composed};
use crate::clip::Problem;
use crate::import::bind::{Stand, pose};
use accessor::Accessors;
use buffer::Buffers;
use document::Document;
use error::GltfError;
use nalgebra::Matrix4;
use std::path::Path;
use take::Curves;
use tree::{Rest, Tree};

/// Starts of the names of required extensions that change neither the nodes nor their motion.
const HARMLESS: [&str; 4] = [
    "KHR_materials_",
    "KHR_texture_",
    "KHR_mesh_quantization",
    "KHR_draco_mesh_compression",
];

/// A glTF file's nodes and animations.
pub(crate) struct GltfScene {
    contents: Contents,
    /// The transforms of the nodes in their parents.
    rest: Vec<Rest>,
    /// One per take.
    curves: Vec<Curves>,
}

/// Reads a GLB file.
pub(crate) fn read_glb(bytes: &[u8], folder: Option<&Path>) -> Result<GltfScene, GltfError> {
    let glb = container::split(bytes)?;
    scene(&document::parse(&glb.json)?, glb.bin.as_deref(), folder)
}

/// Reads a `.gltf` file. Buffers in other files are looked for in `folder` and nowhere else.
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
    // Takes don't need the bind pose, so a broken skin is no reason to refuse them.
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
    let Tree { nodes, rest, .. } = tree;
    let contents = Contents {
        bound,
        problems,
        bytes_beside: accessors.bytes_beside(),
        ..Contents::new("gltf", nodes, takes)
    };
    Ok(GltfScene {
        contents,
        rest,
        curves,
    })
}

/// Notes about required extensions that aren't known, and a VRM extension that can't be read.
fn extension_problems(document: &Document) -> Vec<Problem> {
    let unknown = |name: &&String| !HARMLESS.iter().any(|harmless| name.starts_with(harmless));
    let problem = |name: &String| {
        Problem::note(
            "extension-ignored",
            format!(
                "the file requires {name}, which isn't known: its plain nodes and animations were read"
            ),
        )
    };
    let required = document.extensions_required.iter();
    let mut problems: Vec<Problem> = required.filter(unknown).map(problem).collect();
    if document.extensions.is_none() {
        problems.push(Problem::note(
            "extension-unreadable",
            "the bones that the file's VRM extension names can't be read; skins and motion decide what a joint is",
        ));
    }
    problems
}

impl Scene for GltfScene {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn placed(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>> {
        let moment = at.and_then(|(take, time)| Some((self.curves.get(take)?, time)));
        let local = |(at, rest): (usize, &Rest)| {
            let moved =
                moment.and_then(|(curves, time)| curves.placement(at, &rest.placement, time));
            moved.map_or_else(|| rest.matrix(), |placement| placement.matrix())
        };
        composed(
            &self.contents.nodes,
            self.rest.iter().enumerate().map(local),
        )
    }
}
