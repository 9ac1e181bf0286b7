//! How fast hinges may turn. A limb of hinges reaches a place in more ways than one, and each way ends at its limits: where
//! another becomes the better one, nothing but this keeps the limb from being there in the next frame.

use super::goals::{ARMS, LEGS};
use super::model::Model;
use crate::humanoid::Slot;
use crate::skeleton::JointKind;
use nalgebra::Vector3;
use std::ops::Range;

/// A hinge may turn this fast whatever the source does, rad/s.
const ALWAYS: f64 = 6.0;
/// And by this much more than the source turns the two parts of the limb.
const MORE: f64 = 1.5;

/// Where the upper and the lower parts of arms and legs go in the source, seen from its root, as far as they are known; in
/// the order of [`limbs`].
pub(super) type Ways = [[Option<Vector3<f64>>; 2]; 4];

/// Arms and legs.
pub(super) fn limbs() -> [[Slot; 3]; 4] {
    [ARMS[0], ARMS[1], LEGS[0], LEGS[1]]
}

/// Most that hinges may turn from a frame to the next.
#[derive(Clone, Default)]
pub(super) struct Paces {
    /// The degrees of freedom.
    hinges: Vec<usize>,
    /// `most[f][i]`, radians.
    most: Vec<Vec<f64>>,
}

impl Paces {
    /// For a source whose limbs go those ways, frame after frame.
    pub fn new(model: &Model, ways: &[Ways], fps: f64) -> Paces {
        let own = limbs().map(|limb| hinges(model, &limb));
        if own.iter().all(Vec::is_empty) {
            return Paces::default();
        }
        let most = |f: usize| {
            let next = ways.get(f + 1).unwrap_or(&ways[f]);
            let limbs = own.iter().zip(ways[f].iter().zip(next));
            let most = limbs.flat_map(|(hinges, (way, next))| {
                let most = ALWAYS / fps + MORE * turned(way, next);
                hinges.iter().map(move |_| most)
            });
            most.collect()
        };
        Paces {
            most: (0..ways.len()).map(most).collect(),
            hinges: own.concat(),
        }
    }

    /// Leaves the frames `own`.
    pub fn keep(&mut self, own: &Range<usize>) {
        if !self.most.is_empty() {
            super::keep(&mut self.most, own);
        }
    }

    /// Each hinge, and the most that it may turn from frame `f` to the next.
    pub fn of(&self, f: usize) -> impl Iterator<Item = (usize, f64)> {
        let most = self.most.get(f).map_or(&[][..], Vec::as_slice);
        self.hinges.iter().copied().zip(most.iter().copied())
    }
}

/// Hinges of the upper and the lower part of a limb, if there are several: one alone bends in one way.
fn hinges(model: &Model, [upper, lower, _]: &[Slot; 3]) -> Vec<usize> {
    let body = |slot: &Slot| model.skeleton.slots.get(slot).copied();
    let (Some(upper), Some(lower)) = (body(upper), body(lower)) else {
        return Vec::new();
    };
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

/// By how much the parts of a limb turn, radians.
fn turned(way: &[Option<Vector3<f64>>; 2], next: &[Option<Vector3<f64>>; 2]) -> f64 {
    let parts = way.iter().zip(next);
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
            let mut ways = Ways::default();
            ways[2] = [Some(Vector3::new(sin, 0.0, -cos)), Some(-Vector3::z())];
            ways
        };
        let ways: Vec<Ways> = (0..4).map(swung).collect();
        let paces = Paces::new(&model, &ways, 30.0);
        let name = |dof: usize| {
            let mut joints = model.joints();
            joints
                .find(|joint| joint.dof == dof)
                .expect("a joint")
                .name
                .clone()
        };
        let mut seen = 0;
        for (dof, most) in paces.of(1) {
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
        let none = Paces::new(&Model::new(&humanoid), &ways, 30.0);
        assert_eq!(none.of(1).count(), 0, "one hinge bends in one way");
    }
}
