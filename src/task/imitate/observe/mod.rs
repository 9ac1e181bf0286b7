//! What the policy sees. Nothing depends on where the character is or which way it faces: directions are in the root's
//! frame, its heading, or the frame in which the reference's cycle began.

mod booth;
mod deepmimic;
mod tracking;

use super::settings::Observations;
use crate::sim::{LinkJoint, LinkState};
use crate::task::dynamics::Dynamics;
use crate::task::model::CharacterModel;
use crate::task::step::{Block, ReferenceState};
use nalgebra::{UnitQuaternion, Vector3};

/// What there is to see.
#[derive(Clone, Copy, Debug)]
pub struct ObservationInputs<'a> {
    pub links: &'a [LinkState],
    pub dynamics: &'a Dynamics,
    /// Per contact body of the motion: whether the agent presses on the ground with it.
    pub contacts: &'a [bool],
    /// The action before, zeros at the start.
    pub last_action: &'a [f32],
    /// The reference at the next control step.
    pub next: &'a ReferenceState,
    /// The reference at each moment of [`Observations::ahead`].
    pub ahead: &'a [ReferenceState],
}

/// The blocks of an observation in order, for a motion with `contacts` contact bodies.
pub fn layout(kind: Observations, model: &CharacterModel, contacts: usize) -> Vec<Block> {
    let blocks = match kind {
        Observations::Tracking | Observations::TrackingAhead => {
            tracking::layout(model, contacts, kind.ahead().len())
        }
        Observations::Deepmimic => deepmimic::layout(model),
        Observations::Booth2020 => booth::layout(model),
    };
    let block = |(name, size)| Block { name, size };
    blocks.into_iter().map(block).collect()
}

/// Length of an observation for a motion with `contacts` contact bodies.
pub fn observation_size(kind: Observations, model: &CharacterModel, contacts: usize) -> usize {
    let blocks = layout(kind, model, contacts);
    blocks.iter().map(|block| block.size).sum()
}

/// Fills `out`, as long as [`layout`] says.
pub fn observe(
    kind: Observations,
    model: &CharacterModel,
    scene: &ObservationInputs,
    out: &mut [f32],
) {
    let mut w = Writer { out, at: 0 };
    match kind {
        Observations::Tracking | Observations::TrackingAhead => {
            tracking::observe(model, scene, &mut w);
        }
        Observations::Deepmimic => deepmimic::observe(model, scene, &mut w),
        Observations::Booth2020 => booth::observe(model, scene, &mut w),
    }
}

/// Writes values one after the other.
struct Writer<'a> {
    out: &'a mut [f32],
    at: usize,
}

impl Writer<'_> {
    fn one(&mut self, value: f32) {
        self.out[self.at] = value;
        self.at += 1;
    }

    fn vector(&mut self, v: Vector3<f32>) {
        self.out[self.at..self.at + 3].copy_from_slice(v.as_slice());
        self.at += 3;
    }

    /// Scalar first, of the two that mean the same the one with a positive scalar.
    fn quaternion(&mut self, q: UnitQuaternion<f32>) {
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        for value in [q.w, q.i, q.j, q.k] {
            self.one(sign * value);
        }
    }

    fn flags(&mut self, flags: &[bool]) {
        flags.iter().for_each(|f| self.one(f32::from(u8::from(*f))));
    }

    /// The part of a joint-space vector that the joint can have.
    fn joint(&mut self, joint: &LinkJoint, v: Vector3<f32>) {
        match joint {
            LinkJoint::Free => {}
            LinkJoint::Ball { .. } => self.vector(v),
            LinkJoint::Hinges { hinges, .. } => {
                for hinge in hinges {
                    self.one(v.dot(&hinge.direction.cast()));
                }
            }
            LinkJoint::Hinge { axis, .. } => self.one(v.dot(&axis.direction.cast())),
        }
    }
}
