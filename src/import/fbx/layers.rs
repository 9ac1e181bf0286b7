//! Layers of a take: which curves drive which properties, and how layers blend.

use super::curve::Curve;
use super::error::FbxError;
use super::nodes::{Rig, Tree};
use super::objects::{Graph, Object};
use super::properties::{Properties, Templates};
use super::transform::{Order, Pose, Property, from_euler, slerp, to_euler};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// All curves that are connected to something, each read once.
pub(super) struct Curves {
    pub list: Vec<Curve>,
    of_object: BTreeMap<usize, Option<usize>>,
    /// Constants of the curve nodes that were read. Reading their properties takes time, and layers may share them.
    constants: BTreeMap<usize, [Option<f64>; 3]>,
    /// The same for layers.
    layers: BTreeMap<usize, Layer>,
    /// Ticks per second.
    ticks: f64,
    budget: usize,
    /// Connections that takes may still be followed along.
    steps: usize,
    /// Keys that channels may still have together.
    keys: usize,
}

/// Most keys that all channels of a file may have together, counting a shared curve each time.
const MOST_KEYS: usize = 64 << 20;
/// How often a connection is followed on average, at most. In real files no layer or curve has several users.
const STEPS_PER_LINK: usize = 16;
/// A curve that can't be read, by its id.
struct BadCurve {
    id: i64,
    reason: &'static str,
}

impl BadCurve {
    fn of(self, take: &str, driven: String) -> FbxError {
        FbxError::Curve {
            take: take.into(),
            driven,
            id: self.id,
            reason: self.reason,
        }
    }
}

/// More layers than this would have to be weighed at every frame.
const MOST_LAYERS: usize = 256;

impl Curves {
    /// `budget` is how many bytes may be decoded, `links` how many connections the file has.
    pub fn new(ticks: f64, budget: usize, links: usize) -> Self {
        Self {
            list: Vec::new(),
            of_object: BTreeMap::new(),
            constants: BTreeMap::new(),
            layers: BTreeMap::new(),
            ticks,
            budget,
            steps: links.saturating_mul(STEPS_PER_LINK),
            keys: MOST_KEYS,
        }
    }

    fn walk(&mut self, steps: usize) -> Result<(), FbxError> {
        spend(&mut self.steps, steps)
    }

    /// Counts the keys of curves that one more channel uses.
    fn share(&mut self, axes: [Option<usize>; 3]) -> Result<(), FbxError> {
        let curves = axes.into_iter().flatten();
        let keys = curves
            .filter_map(|curve| self.list.get(curve))
            .map(Curve::len);
        let keys = keys.sum();
        spend(&mut self.keys, keys)
    }

    fn load(&mut self, object: &Object, index: usize) -> Result<Option<usize>, BadCurve> {
        if let Some(&known) = self.of_object.get(&index) {
            return Ok(known);
        }
        let curve = Curve::read(object.record, self.ticks, &mut self.budget).map_err(|reason| {
            let id = object.record.int(0).unwrap_or(0);
            BadCurve { id, reason }
        })?;
        let place = curve.map(|curve| {
            self.list.push(curve);
            self.list.len() - 1
        });
        self.of_object.insert(index, place);
        Ok(place)
    }
}

fn spend(left: &mut usize, cost: usize) -> Result<(), FbxError> {
    let rest = left.checked_sub(cost);
    *left = rest.ok_or_else(|| implausible("layers and curves are shared implausibly often"))?;
    Ok(())
}

fn implausible(reason: &str) -> FbxError {
    FbxError::Broken {
        place: "the takes".into(),
        reason: reason.into(),
    }
}

/// How a layer joins what lies under it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Blend {
    Additive,
    Override,
    /// Override by the layer's weight.
    Passthrough,
}

#[derive(Clone, Debug)]
struct Layer {
    muted: bool,
    /// While some layer is solo, only such layers count.
    solo: bool,
    blend: Blend,
    /// Rotations join as rotations, not angle by angle.
    compose_rotation: bool,
    /// Scales join by multiplication.
    compose_scale: bool,
    /// 0 to 1.
    weight: f64,
    weight_curve: Option<usize>,
}

/// A property that one layer drives; an axis without a curve keeps its `constant`.
#[derive(Debug)]
pub(super) struct Channel {
    layer: usize,
    property: Property,
    constant: Vector3<f64>,
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
            curves.walk(1 + graph.degree(object))?;
            let read = || layer(&templates.properties(graph.objects[object].record));
            let layer = curves.layers.entry(object).or_insert_with(read).clone();
            animation.layers.push(layer);
        }
        let take = &graph.objects[stack].name;
        for (layer, &object) in objects.iter().enumerate() {
            if animation.counts(layer) {
                animation.read_channels(graph, take, (layer, object), templates, tree, curves)?;
            }
        }
        Ok(animation)
    }

    /// Whether a layer is neither muted nor put aside for one that is solo.
    fn counts(&self, layer: usize) -> bool {
        let some_solo = self.layers.iter().any(|layer| layer.solo);
        !self.layers[layer].muted && (self.layers[layer].solo || !some_solo)
    }

    /// Number of layers that don't count.
    pub fn silent(&self) -> usize {
        let layers = 0..self.layers.len();
        layers.filter(|&layer| !self.counts(layer)).count()
    }

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
            curves.walk(1 + 2 * graph.degree(curve_node))?;
            let targets = graph.parents(curve_node, "Model").filter_map(|target| {
                let property = target.property.and_then(Property::named)?;
                Some((tree.of_object[target.parent]?, property))
            });
            let mut targets = targets.peekable();
            let weighs = graph
                .parents(curve_node, "AnimationLayer")
                .any(|link| link.parent == object && link.property == Some(b"Weight"));
            let first = targets.peek().map(|&(node, _)| node);
            if first.is_none() && !weighs {
                continue;
            }
            let axes = axes(graph, curve_node, curves).map_err(|curve| {
                let layer = || format!("weight of layer `{}`", graph.objects[object].name);
                let joint = |node: usize| format!("joint `{}`", tree.nodes[node].name);
                curve.of(take, first.map_or_else(layer, joint))
            })?;
            let read = || constants(&templates.properties(graph.objects[curve_node].record));
            let constants = *curves.constants.entry(curve_node).or_insert_with(read);
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

    /// Adds a channel to a layer above all that have some, unless that layer already drives the property.
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

    /// Nodes that have channels.
    pub fn nodes(&self) -> impl Iterator<Item = usize> {
        self.channels.keys().copied()
    }

    pub fn channels(&self, node: usize) -> &[Channel] {
        self.channels.get(&node).map_or(&[], Vec::as_slice)
    }

    /// Layers and channels.
    pub fn size(&self) -> usize {
        self.layers.len() + self.channels.values().map(Vec::len).sum::<usize>()
    }

    /// Weights of all layers at `tick`.
    pub fn weights(&self, curves: &[Curve], tick: f64) -> Vec<f64> {
        let weight = |layer: &Layer| match layer.weight_curve.and_then(|curve| curves.get(curve)) {
            Some(curve) => unit_weight(curve.value(tick)),
            None => layer.weight,
        };
        self.layers.iter().map(weight).collect()
    }

    /// The properties of `node` at `tick`. The first layer replaces the rest pose, whatever its mode.
    pub fn pose(
        &self,
        node: usize,
        rig: &Rig,
        curves: &[Curve],
        weights: &[f64],
        tick: f64,
    ) -> Pose {
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

impl Layer {
    fn join(
        &self,
        property: Property,
        under: Vector3<f64>,
        over: Vector3<f64>,
        weight: f64,
        order: Order,
    ) -> Vector3<f64> {
        let rotates = self.compose_rotation && property == Property::Rotation;
        let scales = self.compose_scale && property == Property::Scaling;
        let turned = |v| from_euler(v, order);
        match self.blend {
            Blend::Override => over,
            Blend::Additive if scales => under.component_mul(&power(over, weight)),
            Blend::Additive if rotates => to_euler(
                &(turned(under) * slerp(&Matrix3::identity(), &turned(over), weight)),
                order,
            ),
            Blend::Additive => under + over * weight,
            Blend::Passthrough if scales => {
                power(under, 1.0 - weight).component_mul(&power(over, weight))
            }
            Blend::Passthrough if rotates => {
                to_euler(&slerp(&turned(under), &turned(over), weight), order)
            }
            Blend::Passthrough => under * (1.0 - weight) + over * weight,
        }
    }
}

/// Scale to a power between 0 and 1; mirroring stays.
fn power(scale: Vector3<f64>, exponent: f64) -> Vector3<f64> {
    if exponent <= 0.0 {
        return Vector3::repeat(1.0);
    }
    scale.map(|value| value.abs().powf(exponent).copysign(value))
}

fn unit_weight(percent: f64) -> f64 {
    (percent / 100.0).clamp(0.0, 1.0)
}

fn layer(properties: &Properties) -> Layer {
    let composes = |name| properties.int(name).unwrap_or(0) == 0;
    let is = |name| properties.int(name).unwrap_or(0) != 0;
    Layer {
        muted: is("Mute"),
        solo: is("Solo"),
        blend: match properties.int("BlendMode").unwrap_or(0) {
            0 => Blend::Additive,
            2 => Blend::Passthrough,
            _ => Blend::Override,
        },
        compose_rotation: composes("RotationAccumulationMode"),
        compose_scale: composes("ScaleAccumulationMode"),
        weight: unit_weight(properties.real("Weight").unwrap_or(100.0)),
        weight_curve: None,
    }
}

/// Values of the axes that have no curve.
fn constants(properties: &Properties) -> [Option<f64>; 3] {
    let real = |name| properties.real(name);
    [["d|X", "X"], ["d|Y", "Y"], ["d|Z", "Z"]]
        .map(|names| real(names[0]).or_else(|| real(names[1])))
}

/// Curves of the three axes of an `AnimationCurveNode`.
fn axes(
    graph: &Graph,
    curve_node: usize,
    curves: &mut Curves,
) -> Result<[Option<usize>; 3], BadCurve> {
    let mut axes = [None; 3];
    for link in graph.children(curve_node, "AnimationCurve") {
        let axis = match link.property {
            Some(b"d|Y" | b"Y") => 1,
            Some(b"d|Z" | b"Z") => 2,
            Some(_) => 0,
            None => continue,
        };
        axes[axis] = curves.load(&graph.objects[link.child], link.child)?;
    }
    Ok(axes)
}
