//! The bind pose, in which meshes were bound to their joints. It is the rest pose where a file's nodes are in another pose.
//!
//! Exporters often leave the nodes in some frame of an animation. The transforms B of the joints at the time the mesh was
//! bound keep the pose that the character was modelled in: the transform of a joint in its parent is
//! B(parent)⁻¹ · B(joint).

use super::rigid::rotation_of;
use super::scene::Node;
use crate::clip::Problem;
use nalgebra::{Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// A node within this angle of its bind pose is in it, radians (about 1°). Chosen.
const SAME: f64 = 0.02;
/// A skin's topmost joint may be posed this far from its bind pose, in radians (57°). Farther away, the bind pose is taken to be
/// in other axes, which nobody knows. Chosen: a change of axes is a quarter turn or more.
const POSED: f64 = 1.0;
/// The same for the ratio of sizes: poses don't scale. Chosen.
const SCALED: f64 = 1.02;
/// Joints whose positions are this near to their bind pose, up to its heading and as a fraction of their distances from each
/// other, are in it. If rotations differ all the same, the joints' axes were changed after binding. Chosen.
const SAME_PLACE: f64 = 0.02;

/// Transforms of joints at the time a mesh was bound, by node.
pub(crate) type Binds = Vec<(usize, Matrix4<f64>)>;

/// The nodes as the file places them, depth first.
pub(crate) struct Stand<'a> {
    /// The nodes.
    pub nodes: &'a [Node],
    /// Their world matrices, in the file's axes and units.
    pub world: &'a [Matrix4<f64>],
    /// The up axis, where bind transforms are in world space except for their heading, which the node's own replaces. `None`
    /// where nothing is known about their space.
    pub up: Option<Vector3<f64>>,
}

/// World matrices of all nodes in the bind pose, with a note; `None` if the nodes are in it already. Of several bind transforms
/// of a node the first counts.
pub(crate) fn pose(
    stand: &Stand<'_>,
    skins: impl Iterator<Item = Binds>,
) -> Option<(Vec<Matrix4<f64>>, Problem)> {
    // Bind transforms in the parents, of all skins: where skins share a joint, the first one counts.
    let ends = ends(stand.nodes);
    let mut bound: Vec<Option<Matrix4<f64>>> = vec![None; stand.nodes.len()];
    for (node, local) in skins.flat_map(|binds| locals(stand, &ends, binds)) {
        if let Some(slot) = bound.get_mut(node) {
            slot.get_or_insert(local);
        }
    }
    let posed = |(node, bound): (usize, &Option<Matrix4<f64>>)| {
        let turn = Turn::between(bound.as_ref()?, &stand.local(node)?)?;
        Some(turn.angle > SAME)
    };
    // If no bone is turned away from its bind pose, the nodes are in the rest pose already.
    let mut posed = bound.iter().enumerate().map(posed);
    let problem = posed.any(|posed| posed == Some(true)).then(note)?;
    Some((composed(stand, &bound), problem))
}

fn note() -> Problem {
    Problem::note(
        "rest-from-bind-pose",
        "the nodes were saved in some pose of the motion; the mesh's bind pose is used as the rest pose",
    )
}

/// World matrices of the nodes, composed of the `bound` transforms in their parents. A node without one at or above it keeps
/// its own, bit for bit.
fn composed(stand: &Stand<'_>, bound: &[Option<Matrix4<f64>>]) -> Vec<Matrix4<f64>> {
    let mut world: Vec<Matrix4<f64>> = Vec::with_capacity(bound.len());
    let mut changed = vec![false; bound.len()];
    for (node, local) in bound.iter().enumerate() {
        let parent = stand.nodes[node].parent;
        changed[node] = local.is_some() || parent.is_some_and(|parent| changed[parent]);
        world.push(if changed[node] {
            let local = local.or_else(|| stand.local(node));
            let local = local.unwrap_or_else(Matrix4::identity);
            parent.map_or(local, |parent| world[parent] * local)
        } else {
            stand.world[node]
        });
    }
    world
}

/// For every node, the one after the last below it.
fn ends(nodes: &[Node]) -> Vec<usize> {
    let mut ends: Vec<usize> = (1..=nodes.len()).collect();
    for (node, about) in nodes.iter().enumerate().rev() {
        if let Some(parent) = about.parent {
            ends[parent] = ends[parent].max(ends[node]);
        }
    }
    ends
}

/// Bind transforms of one mesh's joints in their parents. Nodes between the joints stay as they are.
fn locals(stand: &Stand<'_>, ends: &[usize], mut binds: Binds) -> Binds {
    binds.retain(|(node, bind)| *node < ends.len() && bind.iter().all(|x| x.is_finite()));
    binds.sort_by_key(|&(node, _)| node);
    binds.dedup_by_key(|&mut (node, _)| node);
    // Positions agree, so different rotations are only different joint axes.
    if stand.is_in(&binds) {
        return Vec::new();
    }
    let mut above: Binds = Vec::new();
    let mut locals = Vec::new();
    for (node, bind) in binds {
        // The nearest bound joint above this node: nodes are depth first, so a joint whose subtree has ended is done.
        while above.pop_if(|(joint, _)| ends[*joint] <= node).is_some() {}
        let local = match above.last() {
            Some(joint) => stand.parent_by(joint, node).map(|parent| parent * bind),
            None => stand.topmost(node, &bind),
        };
        let finite = local.filter(|local| local.iter().all(|x| x.is_finite()));
        locals.extend(finite.map(|local| (node, local)));
        above.push((node, bind));
    }
    locals
}

impl Stand<'_> {
    /// Transform of a node in its parent.
    fn local(&self, node: usize) -> Option<Matrix4<f64>> {
        match self.nodes[node].parent {
            Some(parent) => Some(self.world[parent].try_inverse()? * self.world[node]),
            None => Some(self.world[node]),
        }
    }

    /// Whether the joints are where their bind transforms have them, up to a turn about the up axis. The best turn φ has
    /// tan φ = Σ up·(a × b) / Σ (a·b, horizontal parts), with both sets centred (planar Procrustes).
    fn is_in(&self, binds: &Binds) -> bool {
        let Some(up) = self.up else { return false };
        let place = |m: &Matrix4<f64>| Vector3::new(m[(0, 3)], m[(1, 3)], m[(2, 3)]);
        let stands = centred(binds.iter().map(|(node, _)| place(&self.world[*node])));
        let bound = centred(binds.iter().map(|(_, bind)| place(bind)));
        let (mut cross, mut dot) = (0.0, 0.0);
        for (a, b) in stands.iter().zip(&bound) {
            cross += up.dot(&a.cross(b));
            dot += a.dot(b) - a.dot(&up) * b.dot(&up);
        }
        // Rotate the nodes to the heading of the bind pose, and compare what is left with the size of the figure.
        let turn = Rotation3::from_scaled_axis(up * cross.atan2(dot));
        let off = stands
            .iter()
            .zip(&bound)
            .map(|(a, b)| (turn * a - b).norm_squared());
        let size = stands.iter().map(Vector3::norm_squared);
        off.sum::<f64>() <= SAME_PLACE * SAME_PLACE * size.sum::<f64>()
    }

    /// Inverse bind transform of `node`'s parent, given the bind matrix of the joint above it.
    fn parent_by(&self, joint: &(usize, Matrix4<f64>), node: usize) -> Option<Matrix4<f64>> {
        let (joint, bind) = *joint;
        match self.nodes[node].parent? {
            parent if parent == joint => bind.try_inverse(),
            parent => {
                let between = self.world[joint].try_inverse()? * self.world[parent];
                (bind * between).try_inverse()
            }
        }
    }

    /// Bind transform, in its parent, of a joint with no bound joint above it. Bind matrices are in the mesh's space, which is
    /// at the parent in some files and at the scene's origin in others: the one that agrees better with the node is used, if
    /// either does.
    fn topmost(&self, node: usize, bind: &Matrix4<f64>) -> Option<Matrix4<f64>> {
        let parent = self.nodes[node].parent.map(|parent| self.world[parent]);
        let parent = parent.unwrap_or_else(Matrix4::identity);
        let (from_parent, rest) = (parent.try_inverse()?, self.local(node)?);
        let agrees = |world: Matrix4<f64>| {
            let local = from_parent * self.with_heading(node, world);
            let turn = Turn::between(&local, &rest)?;
            // A bind pose in other units or axes than the node's says nothing about its pose.
            let sized = turn.ratio < SCALED && turn.ratio > 1.0 / SCALED;
            (sized && turn.angle < POSED).then_some((turn.angle, local))
        };
        let found = [parent * bind, *bind].into_iter().filter_map(agrees);
        found
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, local)| local)
    }

    /// `world` turned about the up axis to the heading of `node`, where there is an up axis. The rotation between both splits
    /// into a swing and a twist about the up axis (the part of its quaternion along the axis); the twist is undone.
    fn with_heading(&self, node: usize, world: Matrix4<f64>) -> Matrix4<f64> {
        let untwist = || {
            let (up, from) = (self.up?, rotation_of(&linear(&self.world[node]))?);
            let turn = rotation_of(&linear(&world))? * from.inverse();
            let turn = UnitQuaternion::from_rotation_matrix(&turn);
            let twist = Quaternion::from_parts(turn.w, up * turn.imag().dot(&up));
            Some(
                UnitQuaternion::try_new(twist, 1e-6)?
                    .inverse()
                    .to_homogeneous(),
            )
        };
        untwist().map_or(world, |untwist| untwist * world)
    }
}

/// Positions relative to their centre.
fn centred(places: impl ExactSizeIterator<Item = Vector3<f64>>) -> Vec<Vector3<f64>> {
    let count = places.len().max(1) as f64;
    let places: Vec<Vector3<f64>> = places.collect();
    let centre = places.iter().sum::<Vector3<f64>>() / count;
    places.iter().map(|place| place - centre).collect()
}

fn linear(matrix: &Matrix4<f64>) -> Matrix3<f64> {
    matrix.fixed_view::<3, 3>(0, 0).into_owned()
}

/// How two transforms differ in rotation and size.
struct Turn {
    /// Radians.
    angle: f64,
    /// Size of the first, as a multiple of the second's.
    ratio: f64,
}

impl Turn {
    fn between(a: &Matrix4<f64>, b: &Matrix4<f64>) -> Option<Self> {
        let (a, b) = (linear(a), linear(b));
        let angle = rotation_of(&a)?.angle_to(&rotation_of(&b)?);
        Some(Self {
            angle,
            ratio: a.norm() / b.norm(),
        })
    }
}
