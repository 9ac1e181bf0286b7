//! How good a retargeted motion is, from the motion and its source alone: the solver's goals and anchors have no say.

use super::reference::Reference;
use super::source::Source;
use crate::clip::{Clip, Problem, Severity};
use crate::humanoid::HumanoidMap;
use crate::motion::{MappedJoint, Motion, RetargetReport, Spread, skate::sole_speed};
use crate::skeleton::{Skeleton, limits};
use nalgebra::Isometry3;

/// A foot or hand with what hangs on it, whether the source's touches the ground, and whether it stands still there,
/// by frame.
pub(super) struct Contact {
    pub bodies: Vec<usize>,
    pub touches: Vec<bool>,
    pub stands: Vec<bool>,
}

/// Measures a motion against its source, which stands where the motion does.
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

/// Confidence below which a joint's place in the map should be looked at.
const UNCERTAIN: f64 = 0.6;

fn uncertain(map: &[MappedJoint]) -> Option<Problem> {
    let doubtful: Vec<String> = map
        .iter()
        .filter(|joint| joint.confidence < UNCERTAIN)
        .map(|joint| format!("`{}` as {}", joint.joint, joint.slot))
        .collect();
    (!doubtful.is_empty()).then(|| Problem {
        id: "map-uncertain".to_owned(),
        severity: Severity::Warning,
        message: format!(
            "names don't say which joints some of these are: {}. Check them, and give a map file where one is wrong",
            doubtful.join(", ")
        ),
    })
}

fn no_stance(contacts: &[Contact]) -> Option<Problem> {
    let stands = contacts.iter().any(|c| c.stands.contains(&true));
    (!stands).then(|| Problem {
        id: "no-stance".to_owned(),
        severity: Severity::Warning,
        message: "no foot or hand stands on the ground in any frame, so skating and floating say nothing; is the ground of the clip at z = 0?"
            .to_owned(),
    })
}

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

fn keypoint_error(skeleton: &Skeleton, source: &Source, bodies: &[Vec<Isometry3<f64>>]) -> Spread {
    let reference = Reference::new(source, skeleton);
    Spread::of(bodies.iter().enumerate().flat_map(|(f, bodies)| {
        let places = reference.places(source, f).into_iter();
        places.filter_map(|(slot, place)| {
            let body = skeleton.slots.get(&slot)?;
            Some((bodies[*body].translation.vector - place).norm())
        })
    }))
}

fn penetration(skeleton: &Skeleton, bodies: &[Vec<Isometry3<f64>>]) -> Spread {
    Spread::of(
        bodies
            .iter()
            .map(|poses| (-skeleton.lowest_point(poses)).max(0.0)),
    )
}

/// Frames in which a contact stands.
fn standing(contact: &Contact) -> impl Iterator<Item = usize> + '_ {
    let flags = contact.stands.iter().enumerate();
    flags.filter(|(_, stands)| **stands).map(|(f, _)| f)
}

fn float(skeleton: &Skeleton, contacts: &[Contact], motion: &Motion) -> f64 {
    let height = |f: usize, bodies: &[usize]| skeleton.lowest_point_of(&motion.bodies[f], bodies);
    let heights = contacts
        .iter()
        .flat_map(|c| standing(c).map(move |f| height(f, &c.bodies).max(0.0)));
    Spread::of(heights).mean
}

fn disagreement(contacts: &[Contact], motion: &Motion) -> f64 {
    let stands = |bodies: &[usize], f: usize| {
        let mut row = motion.contact_bodies.iter().zip(&motion.tracks.contact[f]);
        row.any(|(body, stands)| *stands && bodies.contains(body))
    };
    let differs = contacts.iter().flat_map(|c| {
        let touches = c.touches.iter().enumerate();
        touches.map(|(f, touches)| f64::from(*touches != stands(&c.bodies, f)))
    });
    Spread::of(differs).mean
}

/// A foot's speed from a frame to the next is that of the lowest of its bodies.
fn foot_skate(skeleton: &Skeleton, contacts: &[Contact], motion: &Motion) -> f64 {
    let qpos = &motion.qpos;
    let mut twists = vec![None; qpos.len()];
    let pairs = contacts
        .iter()
        .flat_map(|c| standing(c).map(move |f| (c, f)))
        .filter(|(_, f)| f + 1 < qpos.len());
    let speeds = pairs.filter_map(|(contact, f)| {
        let poses = &motion.bodies[f];
        let twists = twists[f].get_or_insert_with(|| {
            let onward = skeleton.differentiate(&qpos[f], &qpos[f + 1], 1.0 / motion.fps);
            skeleton.twists(&qpos[f], &onward)
        });
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
