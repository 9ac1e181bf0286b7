//! What the policy sees. Nothing depends on where the character is or which way it faces: directions are in the root's
//! frame, its heading, or the frame in which the reference's cycle began.

mod booth;
mod deepmimic;
mod tracking;

use super::dynamics::Dynamics;
use super::reference::Sample;
use super::setting::Observations;
use super::stage::Stage;
use crate::sim::{LinkJoint, LinkState};
use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;

/// One named part of the observation.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Block {
    pub name: &'static str,
    pub size: usize,
}

/// What there is to see.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    pub links: &'a [LinkState],
    pub dynamics: &'a Dynamics,
    /// Per contact body of the motion: whether the agent presses on the ground with it.
    pub contacts: &'a [bool],
    /// The action before, zeros at the start.
    pub last_action: &'a [f32],
    /// The reference at the next control step.
    pub next: &'a Sample,
    /// The reference at each moment of [`Observations::ahead`].
    pub ahead: &'a [Sample],
}

/// The blocks of an observation in order, for a motion with `contacts` contact bodies.
pub fn layout(kind: Observations, stage: &Stage, contacts: usize) -> Vec<Block> {
    let blocks = match kind {
        Observations::Tracking | Observations::TrackingAhead => {
            tracking::layout(stage, contacts, kind.ahead().len())
        }
        Observations::Deepmimic => deepmimic::layout(stage),
        Observations::Booth2020 => booth::layout(stage),
    };
    let block = |(name, size)| Block { name, size };
    blocks.into_iter().map(block).collect()
}

/// Length of an observation for a motion with `contacts` contact bodies.
pub fn observation_size(kind: Observations, stage: &Stage, contacts: usize) -> usize {
    let blocks = layout(kind, stage, contacts);
    blocks.iter().map(|block| block.size).sum()
}

/// Fills `out`, as long as [`layout`] says.
pub fn observe(kind: Observations, stage: &Stage, scene: &Scene, out: &mut [f32]) {
    let mut w = Writer { out, at: 0 };
    match kind {
        Observations::Tracking | Observations::TrackingAhead => {
            tracking::observe(stage, scene, &mut w);
        }
        Observations::Deepmimic => deepmimic::observe(stage, scene, &mut w),
        Observations::Booth2020 => booth::observe(stage, scene, &mut w),
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
