//! Joint trees and transforms as the tensors of a file hold them: f32, metres, quaternions w, x, y, z.

use super::Joint;
use crate::file::{Flaw, Reader, Writer};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::collections::BTreeMap;

/// Adds the tensors of a joint tree, with `prefix` before their names: `parent` i32 \[J\] (−1 for a root),
/// `rest_translation` f32 \[J, 3\], `rest_rotation` f32 \[J, 4\].
pub(crate) fn push_tree(writer: &mut Writer, prefix: &str, joints: &[Joint]) {
    // A tree of 2³¹ joints doesn't fit into any memory.
    let parent = |p: usize| i32::try_from(p).unwrap_or(i32::MAX);
    let parents = joints.iter().map(|joint| joint.parent.map_or(-1, parent));
    let j = joints.len();
    let rest = || joints.iter().map(|joint| &joint.rest);
    writer.push(format!("{prefix}parent"), &[j], parents);
    let places = format!("{prefix}rest_translation");
    writer.push(places, &[j, 3], translations(rest()));
    let turns = format!("{prefix}rest_rotation");
    writer.push(turns, &[j, 4], rotations(rest()));
}

/// The joint tree that [`push_tree`] wrote, of joints with these names. None has a bone yet.
pub(crate) fn tree(reader: &Reader, prefix: &str, names: Vec<String>) -> Result<Vec<Joint>, Flaw> {
    let j = Some(names.len());
    let of_parents = format!("{prefix}parent");
    let parents = reader.tensor::<i32>(&of_parents, &[j])?;
    let translation = floats(reader, &format!("{prefix}rest_translation"), &[j, Some(3)])?;
    let of_turns = format!("{prefix}rest_rotation");
    let rotation = floats(reader, &of_turns, &[j, Some(4)])?;
    let rest = isometries(&of_turns, &translation, &rotation)?;
    let joint = |(j, ((name, &parent), rest)): (usize, ((String, &i32), Isometry3<f64>))| {
        let wrong = || {
            let cause = format!("joint {j} `{name}` has parent {parent}, which isn't before it");
            Flaw::in_tensor(&of_parents, cause)
        };
        Ok(Joint {
            parent: parent_of(j, parent).ok_or_else(wrong)?,
            name,
            rest,
            bone: None,
        })
    };
    let joints = names.into_iter().zip(&parents).zip(rest).enumerate();
    joints.map(joint).collect()
}

/// The parent of joint `j`, which has to stand before it; `None` where it doesn't.
fn parent_of(j: usize, parent: i32) -> Option<Option<usize>> {
    if parent == -1 {
        return Some(None);
    }
    let parent = usize::try_from(parent).ok()?;
    (parent < j).then_some(Some(parent))
}

/// Joints by the bone that each is said to be.
pub(crate) fn bones(joints: &[Joint]) -> BTreeMap<String, usize> {
    let bones = joints.iter().enumerate();
    bones
        .filter_map(|(j, joint)| Some((joint.bone.clone()?, j)))
        .collect()
}

/// Tells the joints which bones they are.
pub(crate) fn name_bones(joints: &mut [Joint], bones: BTreeMap<String, usize>) -> Result<(), Flaw> {
    for (bone, j) in bones {
        let Some(joint) = joints.get_mut(j) else {
            let cause = format!("bone `{bone}` is joint {j}, which isn't there");
            return Err(Flaw::content("humanoid", cause));
        };
        joint.bone = Some(bone);
    }
    Ok(())
}

/// The numbers of these transforms' translations.
pub(crate) fn translations<'a>(
    transforms: impl Iterator<Item = &'a Isometry3<f64>>,
) -> impl Iterator<Item = f32> {
    transforms.flat_map(|t| [t.translation.x, t.translation.y, t.translation.z].map(|x| x as f32))
}

/// The numbers of these transforms' rotations.
pub(crate) fn rotations<'a>(
    transforms: impl Iterator<Item = &'a Isometry3<f64>>,
) -> impl Iterator<Item = f32> {
    let numbers = |t: &Isometry3<f64>| [t.rotation.w, t.rotation.i, t.rotation.j, t.rotation.k];
    transforms.flat_map(move |t| numbers(t).map(|x| x as f32))
}

/// The numbers of a tensor, all finite.
pub(crate) fn floats(
    reader: &Reader,
    name: &str,
    shape: &[Option<usize>],
) -> Result<Vec<f64>, Flaw> {
    let numbers = reader.tensor::<f32>(name, shape)?;
    match numbers.iter().position(|x| !x.is_finite()) {
        Some(at) => {
            let cause = format!("element {at} is not a finite number");
            Err(Flaw::in_tensor(name, cause))
        }
        None => Ok(numbers.into_iter().map(f64::from).collect()),
    }
}

/// Transforms of these translations and rotations, the latter from the tensor `name`.
pub(crate) fn isometries(
    name: &str,
    translation: &[f64],
    rotation: &[f64],
) -> Result<Vec<Isometry3<f64>>, Flaw> {
    let places = translation.as_chunks::<3>().0;
    let turns = rotation.as_chunks::<4>().0;
    let isometry = |(i, (t, q)): (usize, (&[f64; 3], &[f64; 4]))| {
        let place = Translation3::new(t[0], t[1], t[2]);
        Ok(Isometry3::from_parts(place, turn(name, i, q)?))
    };
    places.iter().zip(turns).enumerate().map(isometry).collect()
}

/// Rotation number `i` of the tensor `name`.
pub(crate) fn turn(name: &str, i: usize, q: &[f64; 4]) -> Result<UnitQuaternion<f64>, Flaw> {
    let turn = stored_rotation(Quaternion::new(q[0], q[1], q[2], q[3]));
    turn.ok_or_else(|| Flaw::in_tensor(name, format!("rotation {i} is zero")))
}

/// A stored quaternion that is a rotation but for single precision is taken as it stands: what was saved and what is
/// loaded are the same, to the bit.
pub(crate) fn stored_rotation(q: Quaternion<f64>) -> Option<UnitQuaternion<f64>> {
    // The norm of a unit quaternion in single precision is off by some 1e-7.
    if (q.norm_squared() - 1.0).abs() < 1e-6 {
        return Some(UnitQuaternion::new_unchecked(q));
    }
    UnitQuaternion::try_new(q, 1e-3)
}

/// A transform as a file gives it back.
pub(crate) fn rounded(at: &Isometry3<f64>) -> Isometry3<f64> {
    let single = |x: f64| f64::from(x as f32);
    let q = at.rotation.coords.map(single);
    Isometry3::from_parts(
        Translation3::from(at.translation.vector.map(single)),
        UnitQuaternion::new_unchecked(Quaternion::from(q)),
    )
}
