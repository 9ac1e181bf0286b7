//! FBX. Binary files of versions 7.0 to 7.9 are read here. With the feature `ufbx`, that library reads all others.
//!
//! From bytes to motion: `scan` checks lengths, `fbxcel` and `tape` make `record`s of them, `objects` connects these to a
//! graph, `nodes` makes the tree of models, and `animation` finds the curves that drive it. A node's place is composed by
//! `transform`. Every node of every take is compared with ufbx in the tests.

mod animation;
mod array;
mod bind;
#[cfg(feature = "ufbx")]
mod by_ufbx;
mod contents;
mod curve;
mod curves;
mod document;
mod error;
mod key;
mod keys;
mod layer;
mod nodes;
mod numbers;
mod objects;
mod properties;
mod record;
mod scan;
mod settings;
mod takes;
mod tangent;
mod tape;
mod transform;

#[cfg(test)]
mod against_ufbx;
#[cfg(test)]
mod clips_against_ufbx;
#[cfg(test)]
mod hostile;
#[cfg(test)]
mod made;
#[cfg(test)]
mod rewritten;
#[cfg(test)]
mod synthetic;

pub(crate) use document::is_ascii;

use crate::clip::Problem;
use crate::explain::Explain;
use crate::import::scene::{Contents, Scene, Take};
use animation::Animation;
use contents::{bound, constraints_left_out, contents};
use curve::Curve;
use curves::Curves;
use document::Document;
use error::FbxError;
use nalgebra::Matrix4;
use nodes::{Rig, Tree};
use objects::Graph;
use properties::Templates;
use settings::Settings;
use takes::Stated;
use transform::World;

/// A parsed FBX file.
pub(crate) struct FbxScene {
    contents: Contents,
    /// What places each node.
    rigs: Vec<Rig>,
    /// The animation of every take.
    animations: Vec<Animation>,
    /// All curves.
    curves: Vec<Curve>,
    /// Ticks per second of the file's clock.
    ticks: f64,
}

/// Parses an FBX file of any kind that this build can read.
pub(crate) fn open(bytes: &[u8]) -> Result<Box<dyn Scene>, FbxError> {
    match read(bytes) {
        #[cfg(feature = "ufbx")]
        Err(FbxError::Ascii | FbxError::BigEndian | FbxError::Version { .. }) => {
            Ok(Box::new(by_ufbx::read(bytes)?))
        }
        read => Ok(Box::new(read?)),
    }
}

/// Parses a binary FBX file of version 7.
fn read(bytes: &[u8]) -> Result<FbxScene, FbxError> {
    let document = Document::parse(bytes)?;
    let settings = Settings::read(&document);
    let templates = Templates::read(&document);
    let graph = Graph::read(&document);
    let tree = Tree::read(&graph, &templates);
    let mut curves = Curves::new(settings.ticks, document.budget, graph.links());
    let problems = graph_problems(&graph, &tree);
    let spans = takes::spans(&document);
    let (mut takes, mut animations) = (Vec::new(), Vec::new());
    for stack in graph.of_class("AnimationStack") {
        let read = Animation::read(&graph, stack, &templates, &tree, &mut curves);
        let (animation, fault) = match read {
            Ok(animation) => (animation, None),
            Err(fault @ FbxError::Curve { .. }) => {
                (Animation::default(), Some(Box::new(fault.explain())))
            }
            Err(error) => return Err(error),
        };
        let object = &graph.objects[stack];
        let stated = Stated {
            properties: templates.properties(object.record),
            listed: spans.get(&object.name),
            ticks: settings.ticks,
            fps: settings.fps,
        };
        let take = takes::take(&object.name, &stated, &animation, &curves.list);
        takes.push(Take { fault, ..take });
        animations.push(animation);
    }
    let curves = curves.list;
    let binds = bind::binds(&graph, &tree, document.budget);
    let Tree { nodes, rigs, .. } = tree;
    let mut scene = FbxScene {
        ticks: settings.ticks,
        contents: contents(settings, nodes, takes, problems),
        rigs,
        animations,
        curves,
    };
    if let Some((world, problem)) = bound(&scene, binds) {
        scene.contents.bound = Some(world);
        scene.contents.problems.push(problem);
    }
    Ok(scene)
}

/// Warnings about what was cut from the graph, or isn't evaluated.
fn graph_problems(graph: &Graph, tree: &Tree) -> Vec<Problem> {
    let mut problems = Vec::new();
    if tree.circular {
        problems.push(Problem::warning(
            "circular-nodes",
            "some nodes are their own ancestors: the circle was cut",
        ));
    }
    if graph.of_class("Constraint").next().is_some() {
        problems.push(constraints_left_out());
    }
    problems
}

impl Scene for FbxScene {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    /// Times are rounded to the nearest tick of the file's clock, so that a frame falls on its keys exactly.
    fn placed(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>> {
        let moment = at.and_then(|(take, time)| {
            let animation = self.animations.get(take)?;
            let tick = (time * self.ticks).round();
            Some((animation, tick, animation.weights(&self.curves, tick)))
        });
        let mut worlds: Vec<World> = Vec::with_capacity(self.contents.nodes.len());
        for (index, (node, rig)) in self.contents.nodes.iter().zip(&self.rigs).enumerate() {
            let pose = match &moment {
                Some((animation, tick, weights)) => {
                    animation.pose(index, rig, &self.curves, weights, *tick)
                }
                None => rig.rest,
            };
            let parent = node
                .parent
                .and_then(|parent| worlds.get(parent).copied())
                .unwrap_or_else(World::root);
            worlds.push(parent.child(&pose, &rig.rules));
        }
        worlds.iter().map(World::matrix).collect()
    }
}
