//! How fast hinges may turn.
//!
//! A limb whose joints are several hinges reaches most places in more than one way, and each way ends at the hinges' limits.
//! Where another way becomes the better one, nothing but a limit on the speed keeps the limb from changing over between two
//! frames, by up to 2.6 rad (measured on `marathon`). A ball joint has no such second way, so a skeleton of ball joints has
//! no limits here.

use super::limbs::arms_and_legs;
use super::model::Model;
use crate::humanoid::Slot;
use crate::skeleton::JointKind;
use nalgebra::Vector3;

/// Speed that a hinge may always have, rad/s. Chosen; with [`FASTER`] and the weight of the penalty, the longest steps
/// beyond the source's fell from 387 to 268 cm, summed over 55 clips on `marathon`.
const ALWAYS: f64 = 6.0;
/// Multiple of the limb's own speed in the source that a hinge may have on top, chosen with it: one and a half, because a
/// hinge's axis isn't the axis about which the limb turns.
const FASTER: f64 = 1.5;

/// Directions of the upper and the lower part of each limb in the source, in the root's frame, in the order of
/// [`arms_and_legs`]; `None` where the source lacks a joint.
pub(super) type LimbDirections = [[Option<Vector3<f64>>; 2]; 4];

/// The most that hinges may turn from each frame to the next.
#[derive(Clone, Default)]
pub(super) struct HingeSpeeds {
    /// The hinges' degrees of freedom.
    hinges: Vec<usize>,
    /// `most[f][i]`: for hinge `i` after frame `f`, radians.
    most: Vec<Vec<f64>>,
}

impl HingeSpeeds {
    /// The limits for a source whose limbs have these directions, frame by frame, at `fps` Hz.
    pub fn new(model: &Model, directions: &[LimbDirections], fps: f64) -> HingeSpeeds {
        let own = arms_and_legs().map(|limb| hinges(model, &limb));
        // Nothing to limit, and no memory for it, on a skeleton of ball joints.
        if own.iter().all(Vec::is_empty) {
            return HingeSpeeds::default();
        }
        let most = |f: usize| {
            let next = directions.get(f + 1).unwrap_or(&directions[f]);
            let limbs = own.iter().zip(directions[f].iter().zip(next));
            let most = limbs.flat_map(|(hinges, (now, next))| {
                // Radians from frame to frame.
                let most = ALWAYS / fps + FASTER * turned(now, next);
                hinges.iter().map(move |_| most)
            });
            most.collect()
        };
        HingeSpeeds {
            most: (0..directions.len()).map(most).collect(),
            hinges: own.concat(),
        }
    }

    /// The degree of freedom of each hinge, and the most that it may turn from frame `f` to the next, radians.
    pub fn after(&self, f: usize) -> impl Iterator<Item = (usize, f64)> {
        let most = self.most.get(f).map_or(&[][..], Vec::as_slice);
        self.hinges.iter().copied().zip(most.iter().copied())
    }
}

/// The hinges of the upper and lower part of a limb if there are several; a single one bends in one way only.
fn hinges(model: &Model, [upper, lower, _]: &[Slot; 3]) -> Vec<usize> {
    let body = |slot: &Slot| model.skeleton.slots.get(slot).copied();
    let (Some(upper), Some(lower)) = (body(upper), body(lower)) else {
        return Vec::new();
    };
    // What moves the limb as a whole doesn't belong to it.
    let above = model.skeleton.bodies[upper].parent;
    let fixed = above.map_or(&[][..], |body| &model.chains[body]);
    let own = model.chains[lower]
        .iter()
        .filter(|dof| !fixed.contains(dof));
    let is_hinge = |dof: &usize| {
        let joint = model.joints().find(|joint| joint.dof == *dof);
        joint.is_some_and(|joint| matches!(joint.kind, JointKind::Hinge(_)))
    };
    let hinges: Vec<usize> = own.copied().filter(is_hinge).collect();
    if hinges.len() > 1 { hinges } else { Vec::new() }
}

/// By how much the two parts of a limb turn, added up, radians.
fn turned(now: &[Option<Vector3<f64>>; 2], next: &[Option<Vector3<f64>>; 2]) -> f64 {
    let parts = now.iter().zip(next);
    let angle = |(a, b): (&Option<Vector3<f64>>, &Option<Vector3<f64>>)| {
        Some(a.as_ref()?.angle(b.as_ref()?))
    };
    parts.filter_map(angle).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::Skeleton;

    /// A left thigh that swings by 0.2 rad a frame, and a shin that doesn't turn.
    #[test]
    fn hinges_may_turn_as_their_limb_does_and_more() {
        let skeleton = Skeleton::load("marathon").expect("a built-in character");
        let model = Model::new(&skeleton);
        let swung = |f: usize| {
            let (sin, cos) = (0.2 * f as f64).sin_cos();
            let mut directions = LimbDirections::default();
            directions[2] = [Some(Vector3::new(sin, 0.0, -cos)), Some(-Vector3::z())];
            directions
        };
        let directions: Vec<LimbDirections> = (0..4).map(swung).collect();
        let speeds = HingeSpeeds::new(&model, &directions, 30.0);
        let name = |dof: usize| {
            let mut joints = model.joints();
            joints
                .find(|joint| joint.dof == dof)
                .expect("a joint")
                .name
                .clone()
        };
        let mut seen = 0;
        for (dof, most) in speeds.after(1) {
            let leg = ["left_hip", "left_knee"]
                .iter()
                .any(|n| name(dof).starts_with(n));
            let expected = if leg {
                6.0 / 30.0 + 1.5 * 0.2
            } else {
                6.0 / 30.0
            };
            assert!((most - expected).abs() < 1e-9, "{}: {most}", name(dof));
            seen += usize::from(leg);
        }
        assert!(seen > 1, "a hip of hinges and a knee");
        let humanoid = Skeleton::load("humanoid").expect("a built-in character");
        let none = HingeSpeeds::new(&Model::new(&humanoid), &directions, 30.0);
        assert_eq!(none.after(1).count(), 0, "one hinge bends in one way");
    }
}
