//! The bind transforms of skins.

use super::accessor::Accessors;
use super::document::Document;
use super::tree::Tree;
use crate::import::bind::Binds;
use gltf::json::{Skin, accessor::Type};
use nalgebra::Matrix4;

/// Bind transforms of every skin's joints. A skin that can't be read has none: only its mesh needs it, the motion doesn't.
pub(super) fn binds<'a>(
    document: &'a Document,
    tree: &'a Tree,
    accessors: &'a mut Accessors<'_>,
) -> impl Iterator<Item = Binds> {
    let skins = document.skins.iter();
    skins.filter_map(|skin| of_skin(skin, tree, accessors))
}

fn of_skin(skin: &Skin, tree: &Tree, accessors: &mut Accessors<'_>) -> Option<Binds> {
    let numbers = accessors
        .read(skin.inverse_bind_matrices?, Type::Mat4)
        .ok()?;
    let bind = |(joint, numbers): (&gltf::json::Index<_>, &[f64])| {
        let place = *tree.place.get(joint.value())?;
        Some((place, Matrix4::from_column_slice(numbers).try_inverse()?))
    };
    let joints = skin.joints.iter().zip(numbers.chunks_exact(16));
    Some(joints.filter_map(bind).collect())
}
