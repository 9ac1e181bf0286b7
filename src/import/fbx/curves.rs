//! The curves of a file, each read once, and a bound on what reading them costs.
//!
//! Takes may share layers, layers curve nodes, and curve nodes curves. A small file can thus name the same curve in a product
//! of ways; what is read is kept, and every step along a connection is counted.

use super::curve::Curve;
use super::error::FbxError;
use super::layer::Layer;
use super::objects::{Graph, Object};
use super::properties::{Properties, Templates};
use std::collections::BTreeMap;

/// Most keys that all channels of a file may have together, counting a shared curve each time. Chosen, as a bound on time.
const MOST_KEYS: usize = 64 << 20;
/// How often a connection may be followed, on average. Chosen: in real files no layer or curve has several users.
const STEPS_PER_LINK: usize = 16;

/// All curves that drive something.
pub(super) struct Curves {
    /// The curves that have keys.
    pub list: Vec<Curve>,
    /// Index in `list` of every object that was read; `None` of those without keys.
    of_object: BTreeMap<usize, Option<usize>>,
    /// Constants of the curve nodes that were read.
    constants: BTreeMap<usize, [Option<f64>; 3]>,
    /// The layers that were read.
    layers: BTreeMap<usize, Layer>,
    /// Ticks per second.
    ticks: f64,
    /// Bytes that may still be decoded.
    budget: usize,
    /// Connections that may still be followed.
    steps: usize,
    /// Keys that channels may still have together.
    keys: usize,
}

/// A curve that can't be read, by its number in the file.
pub(super) struct BadCurve {
    id: i64,
    reason: &'static str,
}

impl BadCurve {
    /// The error of a take in which the curve drives `driven`.
    pub fn of(self, take: &str, driven: String) -> FbxError {
        FbxError::Curve {
            take: take.into(),
            driven,
            id: self.id,
            reason: self.reason,
        }
    }
}

impl Curves {
    /// No curves yet. `budget` is how many bytes may be decoded, `links` how many connections the file has.
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

    /// Counts connections that are about to be followed.
    pub fn follow(&mut self, links: usize) -> Result<(), FbxError> {
        spend(&mut self.steps, links)
    }

    /// Counts the keys of curves that one more channel uses.
    pub fn share(&mut self, axes: [Option<usize>; 3]) -> Result<(), FbxError> {
        let curves = axes.into_iter().flatten();
        let keys = curves
            .filter_map(|curve| self.list.get(curve))
            .map(Curve::len);
        let keys = keys.sum();
        spend(&mut self.keys, keys)
    }

    /// The layer that is object number `object`.
    pub fn layer(&mut self, graph: &Graph, object: usize, templates: &Templates) -> Layer {
        let read = || Layer::read(&templates.properties(graph.objects[object].record));
        self.layers.entry(object).or_insert_with(read).clone()
    }

    /// Values of the axes that have no curve, of the curve node that is object number `curve_node`.
    pub fn constants(
        &mut self,
        graph: &Graph,
        curve_node: usize,
        templates: &Templates,
    ) -> [Option<f64>; 3] {
        let read = || constants(&templates.properties(graph.objects[curve_node].record));
        *self.constants.entry(curve_node).or_insert_with(read)
    }

    /// Indices in `list` of the curves of the three axes of an `AnimationCurveNode`.
    pub fn axes(
        &mut self,
        graph: &Graph,
        curve_node: usize,
    ) -> Result<[Option<usize>; 3], BadCurve> {
        let mut axes = [None; 3];
        for link in graph.children(curve_node, "AnimationCurve") {
            let axis = match link.property {
                Some(b"d|Y" | b"Y") => 1,
                Some(b"d|Z" | b"Z") => 2,
                Some(_) => 0,
                None => continue,
            };
            axes[axis] = self.load(&graph.objects[link.child], link.child)?;
        }
        Ok(axes)
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

/// Takes that no real file has.
pub(super) fn implausible(reason: &str) -> FbxError {
    FbxError::Broken {
        place: "the takes".into(),
        reason: reason.into(),
    }
}

fn constants(properties: &Properties) -> [Option<f64>; 3] {
    let real = |name| properties.real(name);
    [["d|X", "X"], ["d|Y", "Y"], ["d|Z", "Z"]]
        .map(|names| real(names[0]).or_else(|| real(names[1])))
}
