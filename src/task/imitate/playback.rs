//! What an agent is to follow: a motion, the transition by which it was entered, and the motion that comes next.

use super::reference::Reference;
use super::transition::Transition;
use crate::clip::LoopMode;
use crate::task::model::CharacterModel;
use crate::task::step::ReferenceState;
use nalgebra::Vector3;
use std::sync::Arc;

/// Seconds in which [`Playback::lead_to`] looks for the best moment of a transition. Chosen.
const SEARCH_S: f64 = 1.0;

/// A motion at a moment of it.
pub(super) struct Playback {
    model: Arc<CharacterModel>,
    reference: Arc<Reference>,
    /// How the reference was entered.
    transition: Transition,
    /// The next reference, and how many seconds after this one began it takes over.
    upcoming: Option<(f64, Arc<Reference>)>,
    /// Seconds since this reference began.
    passed: f64,
}

impl Playback {
    /// Plays `reference` from its first frame.
    pub fn new(model: Arc<CharacterModel>, reference: Arc<Reference>) -> Self {
        Playback {
            model,
            reference,
            transition: Transition::none(0.0),
            upcoming: None,
            passed: 0.0,
        }
    }

    /// Begins anew, at `time` seconds of `reference`.
    pub fn begin(&mut self, reference: &Arc<Reference>, time: f64) {
        self.reference = reference.clone();
        self.transition = Transition::none(time);
        self.upcoming = None;
        self.passed = 0.0;
    }

    /// The motion that is played.
    pub fn reference(&self) -> &Arc<Reference> {
        &self.reference
    }

    /// Time in the reference, seconds.
    pub fn time(&self) -> f64 {
        self.transition.clock().time(self.passed)
    }

    /// Seconds until the reference ends, if it does.
    pub fn left(&self) -> f64 {
        match self.reference.loop_mode() {
            LoopMode::Wrap => f64::INFINITY,
            LoopMode::Clamp => {
                let end = self.reference.duration();
                self.transition.clock().until(end, self.passed)
            }
        }
    }

    /// Writes what is wanted of the agent `ahead` seconds from now.
    pub fn sample(&self, ahead: f64, sample: &mut ReferenceState) {
        let passed = self.passed + ahead;
        let (place, time) = (
            self.transition.at(passed),
            self.transition.clock().time(passed),
        );
        self.reference.sample_at(&place, time, sample);
        let character = &self.model.character;
        // Blended links have momenta of their own.
        if self.transition.blend(character, passed, &mut sample.links) {
            sample.dynamics = self.reference.masses().dynamics(&sample.links);
            self.transition.allow(&mut sample.may_touch);
        }
    }

    /// Plans the transition into another `reference`: at the step (of `dt` seconds) of the next second at which the present one
    /// comes nearest to it, or at once where the present one ends. Until then it slows down if the other one is slower.
    pub fn lead_to(&mut self, reference: &Arc<Reference>, dt: f64) {
        let mut sample = self.reference.blank();
        self.sample(0.0, &mut sample);
        let speed = ground_speed(&sample);
        let mut entry = reference.blank();
        reference.sample(reference.nearest(&sample), &mut entry);
        // The speed of the new motion is that at its entry nearest to the present pose.
        self.transition
            .slow(self.passed, speed, ground_speed(&entry));
        // Tries every step of the second, on the slowed clock; never past the end, where a motion only holds its last frame.
        let mut best = (f32::INFINITY, self.passed);
        for step in 0..(SEARCH_S / dt).round() as u32 {
            let passed = self.passed + f64::from(step) * dt;
            let time = self.transition.clock().time(passed);
            if step > 0 && self.reference.is_over(time) {
                break;
            }
            self.sample(passed - self.passed, &mut sample);
            let distance = reference.distance(&sample);
            if distance < best.0 {
                best = (distance, passed);
            }
        }
        self.upcoming = Some((best.1, reference.clone()));
        self.change_in_time();
    }

    /// Whether a planned transition hasn't begun yet.
    pub fn is_leading(&self) -> bool {
        self.upcoming.is_some()
    }

    /// Lets `dt` seconds pass.
    pub fn advance(&mut self, dt: f64) {
        self.passed += dt;
    }

    /// Whether a cycle of a motion that repeats began within the last `dt` seconds.
    pub fn begins_cycle(&self, dt: f64) -> bool {
        let before = self.transition.clock().time(self.passed - dt);
        self.reference.begins_cycle([before, self.time()])
    }

    /// Whether the present motion was entered from another one.
    pub fn was_led_into(&self) -> bool {
        self.transition.was_led_into()
    }

    /// Moves the motion along the ground, metres.
    pub fn shift(&mut self, by: Vector3<f32>) {
        self.transition.shift(by);
    }

    /// Begins the transition that [`Playback::lead_to`] has planned, once it is due.
    pub fn change_in_time(&mut self) {
        if let Some((passed, _)) = self.upcoming
            && self.passed >= passed - 1e-9
            && let Some((_, reference)) = self.upcoming.take()
        {
            self.change_to(&reference);
        }
    }

    /// Begins a transition into another `reference`, at the moment of it that is nearest to the present one.
    pub fn change_to(&mut self, reference: &Arc<Reference>) {
        let mut present = self.reference.blank();
        self.sample(0.0, &mut present);
        let time = reference.nearest(&present);
        let mut begun = reference.blank();
        reference.sample(time, &mut begun);
        let character = &self.model.character;
        self.transition = Transition::between(character, &present, &begun, time);
        self.upcoming = None;
        self.passed = 0.0;
        self.reference = reference.clone();
    }
}

/// Speed of the centre of mass along the ground, m/s.
fn ground_speed(sample: &ReferenceState) -> f32 {
    sample.dynamics.com_velocity.xy().norm()
}
