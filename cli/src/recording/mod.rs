//! A performance as a rerun recording: who moves how, in plain numbers, and what the viewer shows of it.

mod blueprint;
mod look;
mod performance;
mod scene;
mod series;
mod write;

pub use write::{Sink, write};

use mimic::motion::{Motion, Tracks};
use mimic::skeleton::{Shape, Skeleton};
use nalgebra::{Isometry3, Vector3};
use serde::Serialize;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    Left,
    Middle,
    Right,
}

/// One body of the character as it is drawn.
pub struct Part {
    pub name: String,
    pub side: Side,
    pub shapes: Vec<Shape>,
}

/// What one character does, frame by frame.
pub struct Actor {
    /// `poses[f][b]`: world from body.
    pub poses: Vec<Vec<Isometry3<f64>>>,
    /// Metres.
    pub com: Vec<Vector3<f64>>,
    /// About the centre of mass, kg·m²/s.
    pub angular_momentum: Vec<Vector3<f64>>,
    /// `contact[f][c]` of the contact parts.
    pub contact: Vec<Vec<bool>>,
}

impl Actor {
    pub fn new(poses: Vec<Vec<Isometry3<f64>>>, tracks: &Tracks) -> Self {
        Self {
            poses,
            com: tracks.com.clone(),
            angular_momentum: tracks.angular_momentum.clone(),
            contact: tracks.contact.clone(),
        }
    }
}

/// A named number per frame.
pub struct Curve {
    pub name: String,
    pub values: Vec<f64>,
}

/// What pushed the agent at once.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Shove {
    /// From the first frame.
    pub at_s: f64,
    /// N·s.
    pub impulse: [f32; 3],
}

/// All that is shown.
pub struct Recording {
    pub name: String,
    pub fps: f64,
    pub parts: Vec<Part>,
    /// Indices of the parts that may touch the ground.
    pub contact_parts: Vec<usize>,
    pub reference: Actor,
    pub agent: Option<Actor>,
    pub phase: Vec<f64>,
    /// Reward terms, each from 0 to 1.
    pub rewards: Vec<Curve>,
    /// Metres by which the reference stands to the right of the agent.
    pub beside: f64,
    /// When the agent fails, seconds from the first frame.
    pub failed_s: Option<f64>,
    pub shoves: Vec<Shove>,
    /// Which part is shoved.
    pub trunk: usize,
}

impl Recording {
    /// The reference alone.
    pub fn of_motion(motion: &Motion, skeleton: &Skeleton) -> Self {
        Self {
            name: motion.name.clone(),
            fps: motion.fps,
            parts: parts(skeleton),
            contact_parts: motion.contact_bodies.clone(),
            reference: Actor::new(motion.bodies.clone(), &motion.tracks),
            agent: None,
            phase: motion.tracks.phase.clone(),
            rewards: Vec::new(),
            beside: 0.0,
            failed_s: None,
            shoves: Vec::new(),
            trunk: 0,
        }
    }

    /// All characters with the name of their branch, the one that matters first.
    fn actors(&self) -> impl Iterator<Item = (&'static str, &Actor)> {
        let agent = self.agent.as_ref().map(|agent| ("agent", agent));
        agent.into_iter().chain([("reference", &self.reference)])
    }

    fn name_of_contact(&self, contact: usize) -> String {
        let part = self
            .contact_parts
            .get(contact)
            .and_then(|p| self.parts.get(*p));
        part.map_or_else(|| format!("contact {contact}"), |part| part.name.clone())
    }
}

fn parts(skeleton: &Skeleton) -> Vec<Part> {
    let mut sides: Vec<Side> = Vec::with_capacity(skeleton.bodies.len());
    for (index, body) in skeleton.bodies.iter().enumerate() {
        let slot = skeleton.slots.iter().find(|(_, b)| **b == index);
        let inherited = || body.parent.and_then(|p| sides.get(p).copied());
        let side = match slot {
            Some((slot, _)) => side_of(slot.name()),
            None => inherited().unwrap_or(Side::Middle),
        };
        sides.push(side);
    }
    let part = |(body, side): (&mimic::skeleton::Body, Side)| Part {
        name: body.name.clone(),
        side,
        shapes: body.shapes.clone(),
    };
    skeleton.bodies.iter().zip(sides).map(part).collect()
}

fn side_of(slot: &str) -> Side {
    if slot.starts_with("left-") {
        Side::Left
    } else if slot.starts_with("right-") {
        Side::Right
    } else {
        Side::Middle
    }
}

#[cfg(test)]
mod tests;
