//! The pose that a skin was bound in, which is the rest pose where a file's nodes stand in another one.
//!
//! Exporters often leave the nodes in some frame of an animation. The skin's inverse bind matrices B⁻¹ keep the
//! pose that the character was modelled in: a joint stands in its parent by B⁻¹(parent) · B(joint).

use super::accessor::Accessors;
use super::document::Document;
use super::tree::Tree;
use crate::import::rigid::rotation_of;
use gltf::json::{Skin, accessor::Type};
use nalgebra::{Matrix3, Matrix4};

/// Nodes within this angle of their bind pose stand in it, in radians.
const SAME: f64 = 0.02;
/// A skin's topmost joint may be posed this far, in radians, from where its bind pose has it. Farther off, the bind
/// pose is given in axes that aren't known.
const POSED: f64 = 1.0;
/// The same for the ratio of sizes.
const SCALED: f64 = 1.02;

/// Transforms of the nodes in their parents in the bind pose, for those that a skin tells; none if the nodes stand
/// in their bind pose anyway. A skin that can't be read is passed over: the mesh needs it, the motion doesn't.
pub(super) fn pose(
    document: &Document,
    tree: &Tree,
    accessors: &mut Accessors<'_>,
) -> Option<Vec<Option<Matrix4<f64>>>> {
    let mut bound: Vec<Option<Matrix4<f64>>> = vec![None; tree.nodes.len()];
    for skin in &document.skins {
        for (node, local) in skin_pose(skin, tree, accessors).unwrap_or_default() {
            if let Some(slot) = bound.get_mut(node) {
                slot.get_or_insert(local);
            }
        }
    }
    let posed = bound.iter().zip(&tree.rest).any(|(bound, rest)| {
        bound.is_some_and(|bound| {
            Turn::between(&bound, &rest.matrix()).is_some_and(|turn| turn.angle > SAME)
        })
    });
    posed.then_some(bound)
}

/// Bind transforms of a skin's joints in their parents, by their place in the tree.
fn skin_pose(
    skin: &Skin,
    tree: &Tree,
    accessors: &mut Accessors<'_>,
) -> Option<Vec<(usize, Matrix4<f64>)>> {
    let numbers = accessors
        .read(skin.inverse_bind_matrices?, Type::Mat4)
        .ok()?;
    let mut bind: Vec<Option<Matrix4<f64>>> = vec![None; tree.nodes.len()];
    for (joint, numbers) in skin.joints.iter().zip(numbers.chunks_exact(16)) {
        let slot = bind.get_mut(*tree.place.get(joint.value())?)?;
        *slot = Matrix4::from_column_slice(numbers).try_inverse();
    }
    let world = tree.rest_world();
    let mut locals = Vec::new();
    for (node, about) in tree.nodes.iter().enumerate() {
        let rest = tree.rest[node].matrix();
        let above = about.parent.and_then(|parent| bind[parent]);
        let Some(placed) = bind[node] else {
            // Between joints of the skin, other nodes stand as they do.
            bind[node] = above.map(|above| above * rest);
            continue;
        };
        let local = match above {
            Some(above) => above.try_inverse().map(|above| above * placed),
            None => topmost(&placed, &rest, about.parent.map(|parent| world[parent])),
        };
        locals.extend(local.filter(finite).map(|local| (node, local)));
    }
    Some(locals)
}

fn finite(matrix: &Matrix4<f64>) -> bool {
    matrix.iter().all(|x| x.is_finite())
}

/// Bind transform of a joint with no other of the skin above it. Bind matrices are in the mesh's space, which files put
/// at the parent or at the scene's origin: whichever agrees better with the node, if one does.
fn topmost(
    bind: &Matrix4<f64>,
    rest: &Matrix4<f64>,
    parent: Option<Matrix4<f64>>,
) -> Option<Matrix4<f64>> {
    let from_scene = parent.and_then(|parent| Some(parent.try_inverse()? * bind));
    let agrees = |local: Matrix4<f64>| {
        let turn = Turn::between(&local, rest)?;
        let sized = turn.ratio < SCALED && turn.ratio > 1.0 / SCALED;
        (sized && turn.angle < POSED).then_some((turn.angle, local))
    };
    let found = [Some(*bind), from_scene]
        .into_iter()
        .flatten()
        .filter_map(agrees);
    found
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, local)| local)
}

/// How two transforms differ in rotation and size.
struct Turn {
    angle: f64,
    ratio: f64,
}

impl Turn {
    fn between(a: &Matrix4<f64>, b: &Matrix4<f64>) -> Option<Self> {
        let linear = |m: &Matrix4<f64>| -> Matrix3<f64> { m.fixed_view::<3, 3>(0, 0).into_owned() };
        let (a, b) = (linear(a), linear(b));
        let angle = rotation_of(&a)?.angle_to(&rotation_of(&b)?);
        Some(Self {
            angle,
            ratio: a.norm() / b.norm(),
        })
    }
}
