//! How episodes start: in the state of a reference, or at rest.

use super::Imitation;
use crate::clip::LoopMode;
use crate::task::contact::ContactBody;
use crate::task::imitate::reference::Reference;
use crate::task::step::{Purpose, StartState};
use std::sync::Arc;

/// A body at most this far above the ground stands on it in the rest pose, metres. Chosen: the soles of one character differ by
/// less.
const STANDING: f32 = 0.01;

/// Seconds that an evaluation gives a motion beyond its own end, so that the motion ends the episode and not the clock.
const MARGIN_AT_END_S: f64 = 1.0;

impl Imitation {
    /// Starts an episode in the state of the present reference at `time` seconds.
    pub fn reset(&mut self, time: f64) {
        self.begin(&self.playback.reference().clone(), time);
    }

    /// Starts an episode at the first frame of the present reference, but at rest: in the rest pose, on the ground where
    /// the reference's root is, facing where it faces.
    pub fn reset_at_rest(&mut self) {
        // The lowest point of the rest pose comes to stand on the ground, and its root above the anchor of the reference.
        self.reset(0.0);
        let skeleton = &self.model.skeleton;
        let poses = skeleton.forward(&skeleton.rest_qpos());
        let raise = nalgebra::Translation3::new(0.0, 0.0, -skeleton.lowest_point(&poses) as f32);
        let root = poses[0].translation.vector;
        let center = nalgebra::Translation3::new(-root.x as f32, -root.y as f32, 0.0);
        let place = raise * self.next.anchor * center;
        let still = vec![0.0; skeleton.nv];
        let rest = skeleton.rest_qpos();
        let mut states = self.model.character.states(skeleton, &rest, &still);
        for state in &mut states {
            state.pose = place * state.pose;
        }
        let stands = |contact: &ContactBody| contact.lowest(&states) < STANDING;
        self.pressing = self.model.contacts.iter().map(stands).collect();
        self.look_at_contacts();
        let reference = self.playback.reference();
        self.world.reset(&states);
        self.dynamics = reference.masses().dynamics(&states);
    }

    /// Starts an episode in the state of `reference` at `time` seconds.
    pub(super) fn begin(&mut self, reference: &Arc<Reference>, time: f64) {
        self.playback.begin(reference, time);
        self.elapsed = 0.0;
        self.playback.sample(0.0, &mut self.next);
        self.world.reset(&self.next.links);
        self.dynamics = reference.masses().dynamics(self.world.states());
        // The engine finds contacts only in a step; until then the agent touches what its reference does.
        self.touching.clone_from(&self.next.contacts);
        self.last_action.fill(0.0);
        self.disturbance = None;
        self.asked_push = None;
        self.push = None;
        self.look_ahead();
    }

    /// Starts an episode of motion number `motion`. A start at rest stands where the first frame does.
    pub(super) fn begin_motion(&mut self, motion: usize, state: StartState) {
        (self.motion, self.upcoming) = (motion, motion);
        let reference = self.references[motion].clone();
        if let Purpose::Evaluation { seconds } = self.purpose {
            self.settings.episode_s = match reference.loop_mode() {
                LoopMode::Wrap => seconds,
                LoopMode::Clamp => reference.duration() + MARGIN_AT_END_S,
            };
        }
        let last = reference.last_start(self.settings.physics.control_dt());
        match state {
            StartState::Reference(share) => self.begin(&reference, share * last),
            StartState::Rest => {
                self.playback.begin(&reference, 0.0);
                self.reset_at_rest();
            }
        }
    }
}
