//! What a recording holds: who moves how, in plain numbers.

#![cfg_attr(
    not(feature = "rerun"),
    expect(dead_code, reason = "read by the writer that this build leaves out")
)]

use mimic::motion::{Motion, Tracks};
use mimic::skeleton::{Shape, Skeleton};
use nalgebra::{Isometry3, Vector3};
use serde::Serialize;

/// The side of the body that a part belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    /// The character's left.
    Left,
    /// The trunk and the head.
    Middle,
    /// The character's right.
    Right,
}

/// One body of the character as it is drawn.
pub struct Part {
    /// Name of the body.
    pub name: String,
    /// Its side, which decides its colour.
    pub side: Side,
    /// Its shapes, in the body's frame.
    pub shapes: Vec<Shape>,
}

/// What one character does, frame by frame.
pub struct Actor {
    /// `poses[f][b]`: world from body.
    pub poses: Vec<Vec<Isometry3<f64>>>,
    /// Centre of mass in the world, metres.
    pub com: Vec<Vector3<f64>>,
    /// Angular momentum about the centre of mass, kg·m²/s.
    pub angular_momentum: Vec<Vector3<f64>>,
    /// `contact[f][c]`: whether contact part `c` touches the ground.
    pub contact: Vec<Vec<bool>>,
}

impl Actor {
    /// With the poses of a motion and its tracks.
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
    /// Name in the legend.
    pub name: String,
    /// One per frame.
    pub values: Vec<f64>,
}

/// A push that the agent gets within one frame.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Shove {
    /// Seconds from the first frame.
    pub at_s: f64,
    /// Impulse in world axes, N·s.
    pub impulse: [f32; 3],
}

/// All that a recording shows.
pub struct Recording {
    /// Name of the motion.
    pub name: String,
    /// Frames per second.
    pub fps: f64,
    /// The bodies of the character, in the skeleton's order.
    pub parts: Vec<Part>,
    /// Indices of the parts that may touch the ground.
    pub contact_parts: Vec<usize>,
    /// The reference, or an agent that has none.
    pub reference: Actor,
    /// The agent beside its reference.
    pub agent: Option<Actor>,
    /// Phase of the reference in each frame, 0 to 1; empty where there is no reference.
    pub phase: Vec<f64>,
    /// Reward terms, each from 0 to 1.
    pub rewards: Vec<Curve>,
    /// How far the reference stands to the right of the agent, metres.
    pub beside: f64,
    /// When the agent fails, seconds from the first frame; `None` if it lasts.
    pub failed_s: Option<f64>,
    /// When the agent is shoved, and how.
    pub shoves: Vec<Shove>,
    /// Index of the part that is shoved.
    pub trunk: usize,
}

impl Recording {
    /// How many frames there are.
    pub fn frames(&self) -> usize {
        self.reference.poses.len()
    }

    /// The recording of a motion without an agent.
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

    /// All characters with the names of their branches; the agent, if there is one, comes first.
    pub fn actors(&self) -> impl Iterator<Item = (&'static str, &Actor)> {
        let agent = self.agent.as_ref().map(|agent| ("agent", agent));
        agent.into_iter().chain([("reference", &self.reference)])
    }

    /// Numbers of the contact parts with which some character touches the ground in some frame.
    pub fn contacts(&self) -> Vec<usize> {
        let touches = |contact: usize| {
            let down = |frame: &Vec<bool>| frame.get(contact) == Some(&true);
            self.actors()
                .any(|(_, actor)| actor.contact.iter().any(down))
        };
        let parts = 0..self.contact_parts.len();
        parts.filter(|contact| touches(*contact)).collect()
    }

    /// Name of contact part number `contact`.
    pub fn name_of_contact(&self, contact: usize) -> String {
        let part = self
            .contact_parts
            .get(contact)
            .and_then(|p| self.parts.get(*p));
        part.map_or_else(|| format!("contact {contact}"), |part| part.name.clone())
    }
}

/// The bodies of a character as they are drawn. A body without a humanoid slot is on the side of its parent.
pub fn parts(skeleton: &Skeleton) -> Vec<Part> {
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
