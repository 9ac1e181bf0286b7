//! Stage 7, result: makes the motion of the fitted coordinates, and a report that measures it against the source.

mod source_rig;

use super::anchor::{Anchor, SourceContact};
use super::end_effector::EndEffector;
use super::frames::keep;
use super::input::Input;
use super::model::Model;
use super::report::{self, Contact};
use super::setting::Setting;
use super::source::Source;
use crate::clip::{Clip, LoopMode, Problem};
use crate::motion::{Cycle, Draft, Motion, RetargetReport, TOUCHING};

/// A trajectory with all that its motion and its report need.
pub(super) struct Outcome {
    /// Coordinates of every frame.
    pub frames: Vec<Vec<f64>>,
    /// The points that stand, by frame.
    pub anchors: Vec<Vec<Anchor>>,
    /// The feet and hands.
    pub effectors: Vec<EndEffector>,
    /// For a motion that repeats.
    pub cycle: Option<Cycle>,
    /// What the motion is measured against.
    pub source: Source,
    /// When the source's feet and hands are on the ground.
    pub contacts: Vec<SourceContact>,
    /// All that was found in the clip and changed.
    pub problems: Vec<Problem>,
}

impl Outcome {
    /// Drops the frames around the clip's own, which only helped to solve for these.
    fn own(mut self, input: &Input) -> Outcome {
        keep(&mut self.frames, &input.own);
        keep(&mut self.anchors, &input.own);
        self.source.keep(&input.own);
        let contacts = self.contacts.iter_mut();
        contacts.for_each(|contact| keep(&mut contact.touches, &input.own));
        self
    }
}

/// Makes the motion, and the report that it carries.
pub(super) fn finish(
    outcome: Outcome,
    input: &Input,
    model: &Model,
    setting: &Setting,
) -> (Motion, RetargetReport) {
    let Outcome {
        frames,
        anchors,
        effectors,
        cycle,
        source,
        contacts,
        problems,
    } = outcome.own(input);
    let contact_bodies = model.skeleton.contact_bodies();
    let contact = contact(model, &frames, &anchors, &contact_bodies);
    let draft = draft(&input.clip, cycle, frames, contact, contact_bodies);
    let mut motion = Motion::from_poses(model.skeleton, draft);
    // The report measures what was made: bodies and tracks of the motion, not the solver's own.
    let measured = measured(model, &effectors, &contacts, &source, setting);
    let map = report::mapped(&input.clip, &input.map);
    let report = report::report(model.skeleton, &source, &measured, &motion, map, problems);
    motion.report = Some(report.clone());
    motion.source = Some(source_rig::source_rig(input, model.skeleton));
    (motion, report)
}

/// The motion before its tracks are computed.
fn draft(
    clip: &Clip,
    cycle: Option<Cycle>,
    qpos: Vec<Vec<f64>>,
    contact: Vec<Vec<bool>>,
    contact_bodies: Vec<usize>,
) -> Draft {
    Draft {
        name: clip.name.clone(),
        fps: clip.fps,
        loop_mode: match cycle {
            Some(_) => LoopMode::Wrap,
            None => LoopMode::Clamp,
        },
        cycle: cycle.unwrap_or(Cycle::NONE),
        qpos,
        contact: Some(contact),
        contact_bodies,
    }
}

/// `contact[f][c]`: whether contact body `c` stands at frame `f`. Whatever was meant to stand, what is above the ground doesn't
/// touch it.
fn contact(
    model: &Model,
    frames: &[Vec<f64>],
    anchors: &[Vec<Anchor>],
    bodies: &[usize],
) -> Vec<Vec<bool>> {
    let touching = TOUCHING * model.skeleton.leg_length();
    let row = |(qpos, frame): (&Vec<f64>, &Vec<Anchor>)| {
        let poses = model.skeleton.forward(qpos);
        let stands = |body: usize| {
            let on = |a: &Anchor| model.contact_points[a.point].body == body && a.is_contact();
            frame.iter().any(on) && model.skeleton.lowest_point_of(&poses, &[body]) <= touching
        };
        bodies.iter().map(|body| stands(*body)).collect()
    };
    frames.iter().zip(anchors).map(row).collect()
}

/// The source's contacts, on the skeleton's bodies: what the report compares.
fn measured(
    model: &Model,
    effectors: &[EndEffector],
    contacts: &[SourceContact],
    source: &Source,
    setting: &Setting,
) -> Vec<Contact> {
    let on_bodies = |contact: &SourceContact| {
        let slot = contact.slot;
        let effector = effectors.iter().find(|e| e.slot == slot)?;
        let points = effector.points.iter();
        let mut bodies: Vec<usize> = points.map(|p| model.contact_points[*p].body).collect();
        bodies.dedup();
        let touches = contact.touches.iter().enumerate();
        // Skating and floating are measured where the source doesn't move, for some of its contacts roll or slide.
        let stands = touches.map(|(f, touches)| *touches && source.is_still(slot, f, setting));
        Some(Contact {
            bodies,
            stands: stands.collect(),
            touches: contact.touches.clone(),
        })
    };
    contacts.iter().filter_map(on_bodies).collect()
}
