//! An agent's episode as a recording.

use super::content::{Actor, Curve, Recording, Shove, parts};
use mimic::evaluate::{Frame, Trace};
use mimic::motion::Motion;
use mimic::sim::LinkState;
use mimic::skeleton::Skeleton;
use mimic::task::{Dynamics, Stage, TERM_NAMES};
use nalgebra::{Isometry3, Vector3};

impl Recording {
    /// The recording of one episode: the agent, its reference, and what the agent earned.
    pub fn of_trace(name: &str, trace: &Trace, motion: &Motion, stage: &Stage) -> Self {
        let skeleton: &Skeleton = &stage.skeleton;
        let frames = &trace.frames;
        let bodies = |links: &[LinkState]| stage.character.body_poses(links);
        let agent = |f: &Frame| (bodies(&f.agent), f.dynamics, f.contacts.clone());
        let reference = |f: &Frame| {
            let sample = &f.reference;
            (
                bodies(&sample.links),
                sample.dynamics,
                sample.contacts.clone(),
            )
        };
        Self {
            name: name.to_string(),
            fps: trace.control_hz,
            parts: parts(skeleton),
            contact_parts: motion.contact_bodies.clone(),
            reference: Actor::of_frames(frames.iter().map(reference)),
            agent: Some(Actor::of_frames(frames.iter().map(agent))),
            phase: frames
                .iter()
                .map(|f| f64::from(f.reference.phase))
                .collect(),
            rewards: rewards(frames),
            beside: 0.0,
            failed_s: trace
                .failure
                .map(|_| trace.survived as f64 / trace.control_hz),
            shoves: shoves(trace),
            trunk: stage.trunk(),
        }
    }
}

impl Actor {
    fn of_frames(frames: impl Iterator<Item = (Vec<Isometry3<f64>>, Dynamics, Vec<bool>)>) -> Self {
        let mut actor = Self {
            poses: Vec::new(),
            com: Vec::new(),
            angular_momentum: Vec::new(),
            contact: Vec::new(),
        };
        for (poses, dynamics, contact) in frames {
            actor.poses.push(poses);
            actor.com.push(wide(&dynamics.com));
            actor
                .angular_momentum
                .push(wide(&dynamics.angular_momentum));
            actor.contact.push(contact);
        }
        actor
    }
}

fn shoves(trace: &Trace) -> Vec<Shove> {
    let frames = trace.frames.iter().enumerate();
    let shove = |(number, frame): (usize, &Frame)| {
        Some(Shove {
            at_s: number as f64 / trace.control_hz,
            impulse: frame.shove?.into(),
        })
    };
    frames.filter_map(shove).collect()
}

fn rewards(frames: &[Frame]) -> Vec<Curve> {
    // A term that stays at zero belongs to another reward.
    let earned =
        |(index, _): &(usize, &&str)| frames.iter().any(|f| f.terms.values()[*index] > 0.0);
    let term = |(index, name): (usize, &&str)| Curve {
        name: name.replace('_', " "),
        values: frames
            .iter()
            .map(|f| f64::from(f.terms.values()[index]))
            .collect(),
    };
    TERM_NAMES
        .iter()
        .enumerate()
        .filter(earned)
        .map(term)
        .collect()
}

fn wide(v: &Vector3<f32>) -> Vector3<f64> {
    v.cast()
}
