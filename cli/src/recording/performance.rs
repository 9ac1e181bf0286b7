//! An agent's episode as a recording.

use super::content::{Actor, Curve, Recording, Shove, parts};
use mimic::sim::LinkState;
use mimic::task::{Dynamics, Episode, Frame, ReferenceState, Task};
use nalgebra::{Isometry3, Vector3};

impl Recording {
    /// Agent and reference of one episode; the agent alone where the task has no reference.
    pub fn of_episode(name: &str, episode: &Episode, task: &dyn Task) -> Self {
        let model = task.model();
        let frames = &episode.frames;
        let bodies = |links: &[LinkState]| model.character.body_poses(links);
        let agent = |f: &Frame| (bodies(&f.agent), f.dynamics, f.contacts.clone());
        let reference = |state: &ReferenceState| {
            let contacts = state.contacts.clone();
            (bodies(&state.links), state.dynamics, contacts)
        };
        let references: Vec<_> = frames.iter().filter_map(|f| f.reference.as_ref()).collect();
        let agent = Actor::of_frames(frames.iter().map(agent));
        let (reference, agent) = match references.is_empty() {
            true => (agent, None),
            false => (
                Actor::of_frames(references.iter().copied().map(reference)),
                Some(agent),
            ),
        };
        Self {
            name: name.to_string(),
            fps: episode.control_hz,
            parts: parts(&model.skeleton),
            contact_parts: task.contact_bodies().to_vec(),
            reference,
            agent,
            phase: references.iter().map(|r| f64::from(r.phase)).collect(),
            rewards: rewards(task.reward_terms(), frames),
            beside: 0.0,
            failed_s: episode
                .failure
                .map(|_| episode.survived as f64 / episode.control_hz),
            shoves: shoves(episode),
            trunk: model.trunk(),
        }
    }
}

impl Actor {
    /// From body poses, dynamics and contacts of every frame.
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

/// The frames in which the agent was pushed.
fn shoves(episode: &Episode) -> Vec<Shove> {
    let frames = episode.frames.iter().enumerate();
    let shove = |(number, frame): (usize, &Frame)| {
        Some(Shove {
            at_s: number as f64 / episode.control_hz,
            impulse: frame.push?.into(),
        })
    };
    frames.filter_map(shove).collect()
}

/// A curve for every reward term.
fn rewards(names: &[&str], frames: &[Frame]) -> Vec<Curve> {
    let term = |(index, name): (usize, &&str)| Curve {
        name: name.replace('_', " "),
        values: frames.iter().map(|f| f64::from(f.terms[index])).collect(),
    };
    names.iter().enumerate().map(term).collect()
}

fn wide(v: &Vector3<f32>) -> Vector3<f64> {
    v.cast()
}
