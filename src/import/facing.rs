//! Which way a character faces at rest, and the turn about Z that makes it face +X.

use super::figure;
use crate::clip::Joint;
use crate::humanoid::{HumanoidMap, Slot};
use nalgebra::{Isometry3, Matrix3, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

/// A heading this near to a quarter turn is meant to be one, radians. Chosen: rest poses are a few degrees askew, and in those
/// taken from a stride the hips turn more.
const SNAP: f64 = 15.0 * PI / 180.0;

/// Left and right places of paired joints (hips, shoulders), in canonical axes.
pub(crate) type Pair = (Vector3<f64>, Vector3<f64>);

/// Positions at rest of a humanoid's hips and shoulders; in other figures, of all joints whose names differ only in the side.
///
/// `world` has the world transform of every joint in `joints`.
pub(crate) fn pairs(joints: &[Joint], world: &[Isometry3<f64>]) -> Vec<Pair> {
    match figure::humanoid(joints) {
        Some(map) => limbs(&map, world),
        None => named_pairs(joints, world),
    }
}

fn limbs(map: &HumanoidMap, world: &[Isometry3<f64>]) -> Vec<Pair> {
    let place = |slot| Some(world.get(map.joint(slot)?)?.translation.vector);
    let sides = [
        (Slot::LeftUpperLeg, Slot::RightUpperLeg),
        (Slot::LeftUpperArm, Slot::RightUpperArm),
    ];
    sides
        .into_iter()
        .filter_map(|(left, right)| Some((place(left)?, place(right)?)))
        .collect()
}

fn named_pairs(joints: &[Joint], world: &[Isometry3<f64>]) -> Vec<Pair> {
    let place = |at: &Isometry3<f64>| at.translation.vector;
    let lefts: BTreeMap<String, Vector3<f64>> = joints
        .iter()
        .zip(world)
        .filter_map(|(joint, at)| Some((sideless(&joint.name, "left", "l")?, place(at))))
        .collect();
    let rights = joints.iter().zip(world);
    rights
        .filter_map(|(joint, at)| {
            let left = lefts.get(&sideless(&joint.name, "right", "r")?)?;
            Some((*left, place(at)))
        })
        .collect()
}

/// A name in lower case with `*` in place of its side, which is a word within it or a letter on its own; `None` without one.
fn sideless(name: &str, word: &str, letter: &str) -> Option<String> {
    let name = name.to_lowercase();
    if name.contains(word) {
        return Some(name.replacen(word, "*", 1));
    }
    let mut found = false;
    let mut mark = |part: &str| {
        let side = part == letter && !found;
        found |= side;
        if side {
            "*".to_owned()
        } else {
            part.to_owned()
        }
    };
    let parts: Vec<String> = name
        .split(|c: char| !c.is_alphanumeric())
        .map(&mut mark)
        .collect();
    found.then(|| parts.join("_"))
}

/// Angle about +Z, in (−π, π] radians, that turns a character with these pairs to face +X: a quarter turn or none where the
/// angle is within [`SNAP`] of one, and `None` where the pairs don't tell.
///
/// Forward is (left − right) × up: with left along +Y and up along +Z it is +X. Pairs tell if they are less than 60° from
/// the horizontal on the whole (its cosine is 0.5). Chosen.
pub(crate) fn turn_to_forward(pairs: &[Pair]) -> Option<f64> {
    // The sum over all pairs lets hips and shoulders outvote a twisted trunk.
    let across: Vector3<f64> = pairs.iter().map(|(left, right)| left - right).sum();
    let forward = across.cross(&Vector3::z());
    // A figure that lies on its side has left above right, which says nothing about its heading.
    let tells = forward.norm() > 0.5 * across.norm();
    let turn = -forward.y.atan2(forward.x);
    // Within the tolerance, a quarter turn exactly: the file's axes then stay aligned with ours, to the bit.
    let snapped = (turn / FRAC_PI_2).round() * FRAC_PI_2;
    let turn = if (turn - snapped).abs() < SNAP {
        snapped
    } else {
        turn
    };
    tells.then_some(if turn <= -PI { PI } else { turn })
}

/// Rotation about +Z by `turn` radians, exact for quarter turns: sin and cos of multiples of π/2 have rounding errors.
pub(crate) fn about_z(turn: f64) -> Matrix3<f64> {
    let quarters = turn / FRAC_PI_2;
    // Quarter turns by whole numbers, everything else by sine and cosine.
    let (sin, cos) = match quarters.round() as i64 {
        _ if (quarters - quarters.round()).abs() > 1e-9 => turn.sin_cos(),
        1 => (1.0, 0.0),
        -1 => (-1.0, 0.0),
        2 | -2 => (0.0, -1.0),
        _ => (0.0, 1.0),
    };
    Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Hips of a character that faces `heading` radians from +X.
    fn facing(heading: f64) -> [Pair; 1] {
        let left = Vector3::new(-heading.sin(), heading.cos(), 0.0) * 0.1;
        [(left + Vector3::z(), Vector3::z() - left)]
    }

    #[test]
    fn a_turned_character_is_turned_back() {
        for heading in [0.6_f64, -0.6, 2.3, -2.3] {
            let turn = turn_to_forward(&facing(heading)).expect("a turn");
            assert_relative_eq!(turn, -heading, epsilon = 1e-12);
        }
    }

    #[test]
    fn headings_near_a_quarter_snap() {
        for (heading, turn) in [
            (0.1, 0.0),
            (1.5, -FRAC_PI_2),
            (-1.7, FRAC_PI_2),
            (3.1, PI),
            (-3.1, PI),
        ] {
            assert_eq!(turn_to_forward(&facing(heading)), Some(turn), "{heading}");
        }
    }

    #[test]
    fn sides_are_told_from_names() {
        assert_eq!(
            sideless("mixamorig:LeftUpLeg", "left", "l"),
            Some("mixamorig:*upleg".to_owned())
        );
        assert_eq!(
            sideless("thigh.R", "right", "r"),
            Some("thigh_*".to_owned())
        );
        assert_eq!(
            sideless("Bip01 L Thigh", "left", "l"),
            sideless("Bip01 R Thigh", "right", "r")
        );
        assert_eq!(sideless("Clavicle", "left", "l"), None);
        assert_eq!(sideless("hips", "right", "r"), None);
    }

    #[test]
    fn pairs_without_a_side_do_not_tell() {
        assert_eq!(turn_to_forward(&[]), None);
        assert_eq!(turn_to_forward(&[(Vector3::z(), -Vector3::z())]), None);
    }

    #[test]
    fn the_turn_brings_left_to_plus_y() {
        for quarter in -2..=2 {
            let heading = f64::from(quarter) * FRAC_PI_2;
            let pairs = facing(heading);
            let turn = about_z(turn_to_forward(&pairs).expect("a turn"));
            let across = turn * (pairs[0].0 - pairs[0].1);
            assert_relative_eq!(across, Vector3::new(0.0, 0.2, 0.0), epsilon = 1e-12);
        }
    }
}
