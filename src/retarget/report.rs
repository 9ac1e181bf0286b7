//! How good a retargeted motion is: measured on the motion and its source alone, without the solver's goals and anchors.

use super::proportions::Proportions;
use super::source::Source;
use crate::clip::{Clip, Problem};
use crate::humanoid::HumanoidMap;
use crate::motion::{MappedJoint, Motion, RetargetReport, Spread, skate::sole_speed};
use crate::skeleton::{Skeleton, limits};
use nalgebra::Isometry3;

/// A foot or hand.
pub(super) struct Contact {
    /// Its body and the bodies that hang on it.
    pub bodies: Vec<usize>,
    /// Whether the source's touches the ground, by frame.
    pub touches: Vec<bool>,
    /// Whether it also stands still there, by frame.
    pub stands: Vec<bool>,
}

/// Measures a motion against its source, which is in the motion's frame: same ground, same place over it.
pub(super) fn report(
    skeleton: &Skeleton,
    source: &Source,
    contacts: &[Contact],
    motion: &Motion,
    map: Vec<MappedJoint>,
    mut problems: Vec<Problem>,
) -> RetargetReport {
    problems.extend(uncertain(&map));
    problems.extend(no_stance(contacts));
    RetargetReport {
        frames: motion.qpos.len(),
        keypoint_error_m: keypoint_error(skeleton, source, &motion.bodies),
        foot_skate_m_s: foot_skate(skeleton, contacts, motion),
        penetration_m: penetration(skeleton, &motion.bodies),
        float_m: float(skeleton, contacts, motion),
        contact_disagreement: Some(disagreement(contacts, motion)),
        joint_limit_violations: motion
            .qpos
            .iter()
            .map(|q| limits::violations(skeleton, q))
            .sum(),
        map,
        problems,
    }
}

/// Confidence below which a joint of the map should be checked. Chosen between that of joints found by the shape of the
/// rest pose (0.5) and of those found by their names (0.8 and more).
const UNCERTAIN: f64 = 0.6;

/// The warning `map-uncertain` of joints that may be the wrong ones.
fn uncertain(map: &[MappedJoint]) -> Option<Problem> {
    let doubtful: Vec<String> = map
        .iter()
        .filter(|joint| joint.confidence < UNCERTAIN)
        .map(|joint| format!("`{}` as {}", joint.joint, joint.slot))
        .collect();
    let message = format!(
        "these joints of the map are uncertain: {}; check them, and correct the joint map where one is wrong",
        doubtful.join(", ")
    );
    (!doubtful.is_empty()).then(|| Problem::warning("map-uncertain", message))
}

/// The warning `no-stance` of a clip in which nothing stands.
fn no_stance(contacts: &[Contact]) -> Option<Problem> {
    let stands = contacts.iter().any(|c| c.stands.contains(&true));
    let message = "no foot or hand stands still on the ground in any frame, so skating and floating could not be \
                   measured; check that the clip's ground is at z = 0";
    (!stands).then(|| Problem::warning("no-stance", message))
}

/// The joint map by names.
pub(super) fn mapped(clip: &Clip, map: &HumanoidMap) -> Vec<MappedJoint> {
    let named = map.matches.iter().filter_map(|(slot, found)| {
        Some(MappedJoint {
            slot: *slot,
            joint: clip.joints.get(found.joint)?.name.clone(),
            confidence: found.confidence,
            reason: found.reason.clone(),
        })
    });
    named.collect()
}

/// Distance of hips, shoulders, elbows, wrists, knees and ankles from the source's, over all frames, metres.
fn keypoint_error(skeleton: &Skeleton, source: &Source, bodies: &[Vec<Isometry3<f64>>]) -> Spread {
    let proportions = Proportions::new(source, skeleton);
    Spread::of(bodies.iter().enumerate().flat_map(|(f, bodies)| {
        let places = proportions.places(source, f).into_iter();
        places.filter_map(|(slot, place)| {
            let body = skeleton.slots.get(&slot)?;
            Some((bodies[*body].translation.vector - place).norm())
        })
    }))
}

/// Depth of the lowest point below the ground, over all frames, metres.
fn penetration(skeleton: &Skeleton, bodies: &[Vec<Isometry3<f64>>]) -> Spread {
    Spread::of(
        bodies
            .iter()
            .map(|poses| (-skeleton.lowest_point(poses)).max(0.0)),
    )
}

/// Frames in which the source's foot or hand stands still.
fn standing(contact: &Contact) -> impl Iterator<Item = usize> + '_ {
    let flags = contact.stands.iter().enumerate();
    flags.filter(|(_, stands)| **stands).map(|(f, _)| f)
}

/// Mean height above the ground of what the source has standing there, metres.
fn float(skeleton: &Skeleton, contacts: &[Contact], motion: &Motion) -> f64 {
    let height = |f: usize, bodies: &[usize]| skeleton.lowest_point_of(&motion.bodies[f], bodies);
    // Bodies without shapes touch nothing. Depth is measured by itself; here it counts as no height.
    let solid = contacts.iter().filter(|contact| !contact.bodies.is_empty());
    let heights = solid.flat_map(|c| standing(c).map(move |f| height(f, &c.bodies).max(0.0)));
    Spread::of(heights).mean
}

/// Share of frames in which a foot or hand stands and the source's doesn't, or the other way round; over all of them.
fn disagreement(contacts: &[Contact], motion: &Motion) -> f64 {
    let stands = |bodies: &[usize], f: usize| {
        let mut row = motion.contact_bodies.iter().zip(&motion.tracks.contact[f]);
        row.any(|(body, stands)| *stands && bodies.contains(body))
    };
    // Every frame of every foot and hand counts once.
    let differs = contacts.iter().flat_map(|c| {
        let touches = c.touches.iter().enumerate();
        touches.map(|(f, touches)| f64::from(*touches != stands(&c.bodies, f)))
    });
    Spread::of(differs).mean
}

/// Mean horizontal speed of what the source has standing still, m/s. A foot's speed is that of its lowest body, at that
/// body's point on the ground that moves least: a foot may roll.
fn foot_skate(skeleton: &Skeleton, contacts: &[Contact], motion: &Motion) -> f64 {
    let qpos = &motion.qpos;
    let mut twists = vec![None; qpos.len()];
    let pairs = contacts
        .iter()
        .flat_map(|c| standing(c).map(move |f| (c, f)))
        .filter(|(_, f)| f + 1 < qpos.len());
    let speeds = pairs.filter_map(|(contact, f)| {
        let poses = &motion.bodies[f];
        // Forward differences, once for all contacts of a frame.
        let twists = twists[f].get_or_insert_with(|| {
            let onward = skeleton.differentiate(&qpos[f], &qpos[f + 1], 1.0 / motion.fps);
            skeleton.twists(&qpos[f], &onward)
        });
        // A foot rolls from heel to toes: the body on the ground counts.
        let height = |b: &usize| skeleton.lowest_point_of(poses, &[*b]);
        let lowest = contact
            .bodies
            .iter()
            .min_by(|a, b| height(a).total_cmp(&height(b)))?;
        let shapes = &skeleton.bodies[*lowest].shapes;
        Some(sole_speed(shapes, &poses[*lowest], &twists[*lowest]))
    });
    Spread::of(speeds).mean
}
