//! Feet and hands of the skeleton, and the paths of the points with which they touch the ground.

use super::anchor::Anchor;
use super::goals::Goals;
use super::limbs::{FEET, HANDS};
use super::model::{Model, Pose};
use crate::humanoid::Slot;
use nalgebra::{Isometry3, Vector3};

/// A foot or a hand.
pub(super) struct EndEffector {
    /// Its slot.
    pub slot: Slot,
    /// Index of its keypoint among the goals.
    pub keypoint: usize,
    /// Whether it is a foot.
    pub is_foot: bool,
    /// Contact points on its body and on the bodies below, as indices in [`Model::contact_points`].
    pub points: Vec<usize>,
}

/// The feet and hands that have a keypoint. Of a foot only the sole counts.
pub(super) fn end_effectors(model: &Model, goals: &Goals) -> Vec<EndEffector> {
    let feet = FEET.into_iter().map(|slot| (slot, true));
    let hands = HANDS.into_iter().map(|slot| (slot, false));
    let end_effector = |(slot, is_foot): (Slot, bool)| {
        let keypoint = goals.keypoint(slot)?;
        let body = goals.keypoints[keypoint].body;
        let belongs = |k: &usize| {
            let point = &model.contact_points[*k];
            is_below(model, body, point.body) && (point.sole || !is_foot)
        };
        let points = (0..model.contact_points.len()).filter(belongs).collect();
        Some(EndEffector {
            slot,
            keypoint,
            is_foot,
            points,
        })
    };
    feet.chain(hands).filter_map(end_effector).collect()
}

/// Whether a body is `top` or hangs on it.
fn is_below(model: &Model, top: usize, body: usize) -> bool {
    std::iter::successors(Some(body), |b| model.skeleton.bodies[*b].parent).any(|b| b == top)
}

/// Whether the body in `slot`, or one that hangs on it, is anchored.
pub(super) fn is_anchored(model: &Model, slot: Slot, anchors: &[Anchor]) -> bool {
    let body = model.skeleton.slots.get(&slot);
    let stands = |body: &usize| {
        // What only has its height held goes along with the body.
        let held = anchors.iter().filter(|a| !a.is_level);
        let mut anchored = held.map(|a| model.contact_points[a.point].body);
        anchored.any(|point| is_below(model, *body, point))
    };
    body.is_some_and(stands)
}

/// `paths[e][p][f]`: centre of contact point `p` of end effector `e`, which is where its goals say and turned as they say;
/// world, metres. The pose around it is the guess.
pub(super) fn paths(
    model: &Model,
    goals: &Goals,
    effectors: &[EndEffector],
) -> Vec<Vec<Vec<Vector3<f64>>>> {
    let mut pose: Pose = model.empty_pose();
    let no_paths = |effector: &EndEffector| vec![Vec::new(); effector.points.len()];
    let mut paths: Vec<Vec<Vec<Vector3<f64>>>> = effectors.iter().map(no_paths).collect();
    for f in 0..goals.frames() {
        model.evaluate(&goals.guess[f], &mut pose);
        for (effector, paths) in effectors.iter().zip(&mut paths) {
            let body = goals.keypoints[effector.keypoint].body;
            let guessed = pose.bodies[body];
            // A chain of single hinges can't be guessed well, but the foot's orientation is known. With
            // the guess alone, feet of `robot` stood 5 cm above the ground.
            let wanted = goals.orientations.iter().position(|o| o.body == body);
            let wanted = wanted.map_or(guessed.rotation, |o| goals.rotations[f][o]);
            let goal = Isometry3::from_parts(goals.points[f][effector.keypoint].into(), wanted);
            // What carries the limb's end from the guess to its goal carries its points along.
            let moved = goal * guessed.inverse();
            for (point, path) in effector.points.iter().zip(paths) {
                let at = model.contact_points[*point].place(&pose.bodies);
                path.push((moved * nalgebra::Point3::from(at)).coords);
            }
        }
    }
    paths
}

/// `soles[f][p]`: lowest point of every contact point of the feet, all of the left foot's first; world, metres.
pub(super) fn soles(model: &Model, goals: &Goals) -> Vec<Vec<Vector3<f64>>> {
    let mut feet = end_effectors(model, goals);
    feet.retain(|effector| effector.is_foot);
    let mut soles: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); goals.frames()];
    for (foot, paths) in feet.iter().zip(&paths(model, goals, &feet)) {
        for (point, path) in foot.points.iter().zip(paths) {
            // A ball's lowest point is a radius below its centre.
            let down = Vector3::z() * model.contact_points[*point].radius;
            for (f, p) in path.iter().enumerate() {
                soles[f].push(p - down);
            }
        }
    }
    soles
}
