//! One animation of a glTF file: the curves that move its nodes.

use super::accessor::Accessors;
use super::curve::Curve;
use super::document::Animation;
use super::error::GltfError;
use super::rate;
use super::tree::{Placement, Tree};
use crate::clip::Problem;
use crate::explain::{Explain, Explanation};
use crate::import::scene::Take;
use gltf::json::accessor::Type;
use gltf::json::animation::{Interpolation, Property, Sampler};
use gltf::json::validation::Checked;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// What moves one node.
#[derive(Default)]
struct NodeCurves {
    translation: Option<Curve<3>>,
    rotation: Option<Curve<4>>,
    scale: Option<Curve<3>>,
}

/// What moves the nodes of a take, by their index in the tree.
#[derive(Default)]
pub(super) struct Curves {
    nodes: BTreeMap<usize, NodeCurves>,
}

impl NodeCurves {
    fn times(&self) -> impl Iterator<Item = &[f64]> {
        let vectors = [&self.translation, &self.scale]
            .into_iter()
            .flatten()
            .map(Curve::times);
        vectors.chain(self.rotation.as_ref().map(Curve::times))
    }
}

impl Curves {
    /// The transform of `node` in its parent at `time` seconds: at `rest` as far as no curve drives it. `None` if none does.
    pub fn placement(&self, node: usize, rest: &Placement, time: f64) -> Option<Placement> {
        let curves = self.nodes.get(&node)?;
        let vector = |curve: &Option<Curve<3>>, rest: Vector3<f64>| {
            curve
                .as_ref()
                .map_or(rest, |curve| Vector3::from(curve.at(time)))
        };
        Some(Placement {
            translation: vector(&curves.translation, rest.translation),
            rotation: curves
                .rotation
                .as_ref()
                .map_or(rest.rotation, |curve| curve.rotation(time)),
            scale: vector(&curves.scale, rest.scale),
        })
    }

    /// The take over the time that its keys span.
    fn take(&self, name: String) -> Take {
        let times = || self.nodes.values().flat_map(NodeCurves::times);
        // The take lasts from the first key of any curve to the last one.
        let start = times()
            .filter_map(<[f64]>::first)
            .fold(f64::INFINITY, |a, &b| a.min(b));
        let end = times()
            .filter_map(<[f64]>::last)
            .fold(f64::NEG_INFINITY, |a, &b| a.max(b));
        let (start, end) = if start <= end {
            (start, end)
        } else {
            (0.0, 0.0)
        };
        Take {
            name,
            start,
            end,
            fps: rate::rate(times()),
            animated: self.nodes.keys().copied().collect(),
            wraps: None,
            channels: self.nodes.len(),
            problems: Vec::new(),
            fault: None,
        }
    }
}

/// Reads an animation: its curves, and the take that tells about it. A broken one moves nothing and says why, so that the others
/// can be used.
pub(super) fn read(
    animation: &Animation,
    name: String,
    tree: &Tree,
    accessors: &mut Accessors<'_>,
) -> (Curves, Take) {
    let mut problems = Vec::new();
    let (curves, fault) = match curves(animation, &name, tree, accessors, &mut problems) {
        Ok(curves) => (curves, None),
        Err(e) => (Curves::default(), Some(Box::new(in_take(&e, &name)))),
    };
    let take = Take {
        problems,
        fault,
        ..curves.take(name)
    };
    (curves, take)
}

/// An error with the take in its place.
fn in_take(error: &GltfError, take: &str) -> Explanation {
    let explanation = error.explain();
    match (error, &explanation.place) {
        (GltfError::Curve { .. }, _) => explanation,
        (_, Some(place)) => {
            let place = format!("take `{take}`, {place}");
            explanation.place(place)
        }
        (_, None) => explanation.place(format!("take `{take}`")),
    }
}

/// Reads the curves of an animation. What can't move a joint (morph weights, pointers) is skipped.
fn curves(
    animation: &Animation,
    take: &str,
    tree: &Tree,
    accessors: &mut Accessors<'_>,
    problems: &mut Vec<Problem>,
) -> Result<Curves, GltfError> {
    let mut curves = Curves::default();
    problems.extend(pointers(animation, take));
    for channel in &animation.channels {
        let Some(node) = channel.target.node else {
            continue;
        };
        let path = match channel.target.path {
            Checked::Valid(Property::Translation) => "translation",
            Checked::Valid(Property::Rotation) => "rotation",
            Checked::Valid(Property::Scale) => "scale",
            _ => continue,
        };
        let node = node.value();
        let place = tree.place.get(node).copied().ok_or(GltfError::Tree {
            node,
            reason: "it is moved, but it isn't in the file",
        })?;
        let name = &tree.nodes[place].name;
        let broken = |reason: String| GltfError::Curve {
            take: take.to_owned(),
            node: name.clone(),
            path,
            reason,
        };
        let sampler = animation.samplers.get(channel.sampler.value());
        let sampler = sampler.ok_or_else(|| broken(format!("no sampler {}", channel.sampler)))?;
        if accessors.is_empty(sampler.input) {
            problems.push(problem("curve-without-keys", take, name, path));
            continue;
        }
        let of_node = curves.nodes.entry(place).or_default();
        let first = match path {
            "translation" => fill(
                &mut of_node.translation,
                vectors(sampler, accessors, &broken)?,
            ),
            "scale" => fill(&mut of_node.scale, vectors(sampler, accessors, &broken)?),
            _ => fill(
                &mut of_node.rotation,
                rotations(sampler, accessors, &broken)?,
            ),
        };
        if !first {
            problems.push(problem("curve-given-twice", take, name, path));
        }
    }
    Ok(curves)
}

/// Fills an empty slot; false if it was full.
fn fill<T>(place: &mut Option<T>, value: T) -> bool {
    let empty = place.is_none();
    place.get_or_insert(value);
    empty
}

fn vectors(
    sampler: &Sampler,
    accessors: &mut Accessors<'_>,
    broken: &dyn Fn(String) -> GltfError,
) -> Result<Curve<3>, GltfError> {
    let times = accessors.read(sampler.input, Type::Scalar)?;
    let values = accessors.read(sampler.output, Type::Vec3)?;
    Curve::new(times, values, interpolation(sampler).map_err(broken)?).map_err(broken)
}

fn rotations(
    sampler: &Sampler,
    accessors: &mut Accessors<'_>,
    broken: &dyn Fn(String) -> GltfError,
) -> Result<Curve<4>, GltfError> {
    let times = accessors.read(sampler.input, Type::Scalar)?;
    let values = accessors.read(sampler.output, Type::Vec4)?;
    let curve =
        Curve::<4>::new(times, values, interpolation(sampler).map_err(broken)?).map_err(broken)?;
    match curve.zero_key() {
        Some(key) => Err(broken(format!("the rotation of key {key} is zero"))),
        None => Ok(curve),
    }
}

fn interpolation(sampler: &Sampler) -> Result<Interpolation, String> {
    match sampler.interpolation {
        Checked::Valid(interpolation) => Ok(interpolation),
        Checked::Invalid => Err("an unknown interpolation".to_owned()),
    }
}

/// A note about curves of `KHR_animation_pointer`, whose targets aren't nodes.
fn pointers(animation: &Animation, take: &str) -> Option<Problem> {
    let channels = animation.channels.iter();
    let count = channels
        .filter(|channel| channel.target.node.is_none())
        .count();
    (count > 0).then(|| {
        Problem::note(
            "pointer-curves-left-out",
            format!(
                "take `{take}` has {count} curves that drive something else than a node and were left out; bake them to nodes if the motion looks wrong"
            ),
        )
    })
}

/// A warning about a curve that isn't used.
fn problem(id: &str, take: &str, node: &str, path: &str) -> Problem {
    let message = format!("take `{take}` has a curve for the {path} of `{node}` that isn't used");
    Problem::warning(id, message)
}
