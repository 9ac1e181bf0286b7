//! What observations are computed from, and how their numbers are written.

use crate::sim::{LinkJoint, LinkState};
use crate::task::dynamics::Dynamics;
use crate::task::step::ReferenceState;
use nalgebra::{UnitQuaternion, Vector3};

/// What observations are computed from.
#[derive(Clone, Copy, Debug)]
pub struct ObservationInputs<'a> {
    /// The agent, one state per link, in the world.
    pub links: &'a [LinkState],
    /// The agent's centre of mass and momenta, in the world.
    pub dynamics: &'a Dynamics,
    /// Per contact body of the motion: whether the agent presses on the ground with it.
    pub contacts: &'a [bool],
    /// The action of the step before, zeros at the start.
    pub last_action: &'a [f32],
    /// The reference at the next control step.
    pub next: &'a ReferenceState,
    /// The reference at each moment of [`Observations::ahead`](crate::task::Observations::ahead).
    pub ahead: &'a [ReferenceState],
}

/// Writes values one after the other.
pub struct Writer<'a> {
    out: &'a mut [f32],
    at: usize,
}

impl<'a> Writer<'a> {
    /// Writes from the beginning of `out` on.
    pub fn new(out: &'a mut [f32]) -> Self {
        Self { out, at: 0 }
    }

    /// One number.
    pub fn one(&mut self, value: f32) {
        self.out[self.at] = value;
        self.at += 1;
    }

    /// Three numbers.
    pub fn vector(&mut self, v: Vector3<f32>) {
        self.out[self.at..self.at + 3].copy_from_slice(v.as_slice());
        self.at += 3;
    }

    /// Scalar first. Of q and −q, which are the same rotation, the one with a positive scalar, so that equal poses look equal.
    pub fn quaternion(&mut self, q: UnitQuaternion<f32>) {
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        for value in [q.w, q.i, q.j, q.k] {
            self.one(sign * value);
        }
    }

    /// 1 for each that is set, 0 for each that is not.
    pub fn flags(&mut self, flags: &[bool]) {
        flags.iter().for_each(|f| self.one(f32::from(u8::from(*f))));
    }

    /// The components of a vector along the axes about which the joint turns.
    pub fn joint(&mut self, joint: &LinkJoint, v: Vector3<f32>) {
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
