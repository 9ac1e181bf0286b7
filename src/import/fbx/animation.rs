//! The animation of a take: which curves drive which properties, layer by layer.

use super::curve::Curve;
use super::curves::{Curves, implausible};
use super::error::FbxError;
use super::layer::{Blend, Layer, unit_weight};
use super::nodes::{Rig, Tree};
use super::objects::Graph;
use super::properties::Templates;
use super::transform::{Pose, Property};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Most layers of a take: all of them are weighed at every frame. Chosen.
const MOST_LAYERS: usize = 256;

/// A property that one layer drives. An axis without a curve has the value `constant`.
#[derive(Debug)]
pub(super) struct Channel {
    layer: usize,
    property: Property,
    constant: Vector3<f64>,
    /// Indices of the curves of the three axes.
    pub curves: [Option<usize>; 3],
}

impl Channel {
    fn value(&self, curves: &[Curve], tick: f64) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| {
            let curve = self.curves[axis].and_then(|curve| curves.get(curve));
            curve.map_or(self.constant[axis], |curve| curve.value(tick))
        })
    }
}

/// One take's layers and channels.
#[derive(Debug, Default)]
pub(super) struct Animation {
    layers: Vec<Layer>,
    /// Channels of the nodes that have any, lower layers first.
    channels: BTreeMap<usize, Vec<Channel>>,
}

impl Animation {
    /// Reads the layers of the `AnimationStack` at `stack`.
    pub fn read(
        graph: &Graph,
        stack: usize,
        templates: &Templates,
        tree: &Tree,
        curves: &mut Curves,
    ) -> Result<Self, FbxError> {
        let mut animation = Self::default();
        let objects: Vec<usize> = graph
            .children(stack, "AnimationLayer")
            .map(|link| link.child)
            .collect();
        if objects.len() > MOST_LAYERS {
            return Err(implausible("a take has too many layers"));
        }
        for &object in &objects {
            curves.follow(1 + graph.degree(object))?;
            animation
                .layers
                .push(curves.layer(graph, object, templates));
        }
        let take = &graph.objects[stack].name;
        for (layer, &object) in objects.iter().enumerate() {
            if animation.counts(layer) {
                animation.read_channels(graph, take, (layer, object), templates, tree, curves)?;
            }
        }
        Ok(animation)
    }

    /// Whether a layer is neither muted nor silenced by one that is solo.
    fn counts(&self, layer: usize) -> bool {
        let some_solo = self.layers.iter().any(|layer| layer.solo);
        !self.layers[layer].muted && (self.layers[layer].solo || !some_solo)
    }

    /// Number of layers that don't count.
    pub fn silent(&self) -> usize {
        let layers = 0..self.layers.len();
        layers.filter(|&layer| !self.counts(layer)).count()
    }

    /// Reads the channels of the layer that is `layer` in the take and `object` in the file.
    fn read_channels(
        &mut self,
        graph: &Graph,
        take: &str,
        (layer, object): (usize, usize),
        templates: &Templates,
        tree: &Tree,
        curves: &mut Curves,
    ) -> Result<(), FbxError> {
        for link in graph.children(object, "AnimationCurveNode") {
            let curve_node = link.child;
            curves.follow(1 + 2 * graph.degree(curve_node))?;
            // A curve node may drive several models, or the weight of its layer.
            let targets = graph.parents(curve_node, "Model").filter_map(|target| {
                let property = target.property.and_then(Property::named)?;
                Some((tree.of_object[target.parent]?, property))
            });
            let mut targets = targets.peekable();
            let weighs = graph
                .parents(curve_node, "AnimationLayer")
                .any(|link| link.parent == object && link.property == Some(b"Weight"));
            let first = targets.peek().map(|&(node, _)| node);
            // Curve nodes that drive something else (visibility, materials) aren't read.
            if first.is_none() && !weighs {
                continue;
            }
            let axes = curves.axes(graph, curve_node).map_err(|curve| {
                let layer = || format!("weight of layer `{}`", graph.objects[object].name);
                let joint = |node: usize| format!("joint `{}`", tree.nodes[node].name);
                curve.of(take, first.map_or_else(layer, joint))
            })?;
            let constants = curves.constants(graph, curve_node, templates);
            for (node, property) in targets {
                curves.share(axes)?;
                self.add(layer, node, property, constants, axes, &tree.rigs[node]);
            }
            if weighs {
                self.layers[layer].weight_curve = axes[0];
            }
        }
        Ok(())
    }

    /// Adds a channel to a layer above all layers with channels so far, unless that layer already drives the property.
    fn add(
        &mut self,
        layer: usize,
        node: usize,
        property: Property,
        constants: [Option<f64>; 3],
        curves: [Option<usize>; 3],
        rig: &Rig,
    ) {
        let channels = self.channels.entry(node).or_default();
        let mut own = channels
            .iter()
            .rev()
            .take_while(|channel| channel.layer == layer);
        if own.any(|channel| channel.property == property) {
            return;
        }
        // An axis without curve and constant adds nothing in an additive layer, and is at rest in the others.
        let adds = layer > 0 && self.layers[layer].blend == Blend::Additive;
        let otherwise = if adds { Pose::identity() } else { rig.rest };
        let constant =
            Vector3::from_fn(|axis, _| constants[axis].unwrap_or(otherwise.at(property)[axis]));
        channels.push(Channel {
            layer,
            property,
            constant,
            curves,
        });
    }

    /// Indices of the nodes that have channels.
    pub fn nodes(&self) -> impl Iterator<Item = usize> {
        self.channels.keys().copied()
    }

    /// The channels of a node, lower layers first.
    pub fn channels(&self, node: usize) -> &[Channel] {
        self.channels.get(&node).map_or(&[], Vec::as_slice)
    }

    /// Number of layers and channels.
    pub fn size(&self) -> usize {
        self.layers.len() + self.channels.values().map(Vec::len).sum::<usize>()
    }

    /// Weights of all layers at `tick`, 0 to 1.
    pub fn weights(&self, curves: &[Curve], tick: f64) -> Vec<f64> {
        let weight = |layer: &Layer| match layer.weight_curve.and_then(|curve| curves.get(curve)) {
            Some(curve) => unit_weight(curve.value(tick)),
            None => layer.weight,
        };
        self.layers.iter().map(weight).collect()
    }

    /// The properties of `node` at `tick`, given the layers' weights. The first layer replaces the rest pose, whatever its mode.
    pub fn pose(
        &self,
        node: usize,
        rig: &Rig,
        curves: &[Curve],
        weights: &[f64],
        tick: f64,
    ) -> Pose {
        // Channels are in the order of their layers, so that each joins what the layers below have made.
        let mut pose = rig.rest;
        for channel in self.channels(node) {
            let over = channel.value(curves, tick);
            let slot = pose.at_mut(channel.property);
            *slot = match self.layers.get(channel.layer) {
                Some(layer) if channel.layer > 0 => layer.join(
                    channel.property,
                    *slot,
                    over,
                    weights[channel.layer],
                    rig.rules.order,
                ),
                _ => over,
            };
        }
        pose
    }
}
