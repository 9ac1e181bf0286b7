//! One agent that imitates a reference, episode after episode.

mod start;

use super::observe::observe;
use super::playback::Playback;
use super::reference::Reference;
use super::settings::ImitationSettings;
use crate::sim::{Diverged, Target, World};
use crate::task::disturbance::{Disturbance, Perturbations};
use crate::task::dynamics::Dynamics;
use crate::task::environment::{Draws, Environment};
use crate::task::error::TaskError;
use crate::task::follow::{
    ObservationInputs, Terminations, Terms, aim, failure, mean_distance, terms,
};
use crate::task::model::CharacterModel;
use crate::task::starts::{Moment, uniform};
use crate::task::step::{
    EpisodeStart, Failure, Input, Outcome, Purpose, ReferenceState, Step, Wish,
};
use nalgebra::Vector3;
use rand_chacha::rand_core::Rng;
use std::sync::Arc;

/// Mean distance of the bodies from their reference beyond which an episode of an evaluation has failed, metres: the
/// criterion of PHC (Luo et al. 2023, "Perpetual humanoid control for real-time simulated avatars").
const LOST_M: f32 = 0.5;

/// An environment of [`super::Imitate`].
pub(super) struct Imitation {
    model: Arc<CharacterModel>,
    references: Arc<[Arc<Reference>]>,
    playback: Playback,
    settings: ImitationSettings,
    purpose: Purpose,
    world: World,
    /// Seconds since the episode began.
    elapsed: f64,
    /// The reference at the next control step.
    next: ReferenceState,
    /// The reference at each moment of [`super::Observations::ahead`].
    ahead: Vec<ReferenceState>,
    dynamics: Dynamics,
    targets: Vec<Target>,
    last_action: Vec<f32>,
    /// Per contact body of the character: whether the agent presses on the ground with it.
    pressing: Vec<bool>,
    /// The same per contact body of the reference.
    touching: Vec<bool>,
    disturbance: Option<Disturbance>,
    /// Impulse that a player asked for, N·s.
    asked_push: Option<Vector3<f32>>,
    /// Impulse of the shove in the last step, N·s.
    push: Option<Vector3<f32>>,
    /// Number of the motion that is imitated.
    motion: usize,
    /// Number of the motion that a transition is planned into; the same where none is.
    upcoming: usize,
    /// Seconds since the episode began at which training plans its next transition.
    next_transition: f64,
}

impl Imitation {
    /// An environment at the first frame of the first of `references`.
    pub fn new(
        model: Arc<CharacterModel>,
        references: Arc<[Arc<Reference>]>,
        settings: &ImitationSettings,
        purpose: Purpose,
    ) -> Self {
        let settings = match purpose {
            Purpose::Training => *settings,
            _ => rules_of_evaluation(settings),
        };
        let first = references[0].clone();
        let mut environment = Imitation {
            world: World::new(&model.character, settings.physics),
            next: first.blank(),
            ahead: vec![first.blank(); settings.observations.ahead().len()],
            targets: vec![Target::Free; model.character.links.len()],
            last_action: vec![0.0; model.character.dof],
            pressing: Vec::new(),
            touching: Vec::new(),
            disturbance: None,
            asked_push: None,
            push: None,
            playback: Playback::new(model.clone(), first),
            model,
            references,
            settings,
            purpose,
            elapsed: 0.0,
            dynamics: Dynamics::default(),
            motion: 0,
            upcoming: 0,
            next_transition: f64::INFINITY,
        };
        environment.reset(0.0);
        environment
    }

    fn reference_of(&self, number: usize) -> Result<Arc<Reference>, TaskError> {
        let reference = self.references.get(number).cloned();
        reference.ok_or(TaskError::NoSuchCase {
            number,
            cases: self.references.len(),
        })
    }

    /// Disturbs the episode that was just begun; `seed` alone says how.
    pub fn disturb(&mut self, ranges: Perturbations, seed: u64) {
        let disturbance = Disturbance::new(ranges, seed);
        self.world.vary(disturbance.mass, disturbance.friction);
        self.disturbance = Some(disturbance);
    }

    /// Plans the transition into another `reference`; see [`Playback::lead_to`].
    pub fn lead_to(&mut self, reference: &Arc<Reference>) {
        self.playback
            .lead_to(reference, self.settings.physics.control_dt());
        self.look_ahead();
    }

    /// Begins the transition into another `reference` now; see [`Playback::change_to`].
    #[cfg(test)]
    pub fn change_to(&mut self, reference: &Arc<Reference>) {
        self.playback.change_to(reference);
        self.look_ahead();
    }

    /// Steps of an episode that only the time limit ends.
    fn longest_steps(&self) -> f64 {
        self.steps_in(self.settings.episode_s)
    }

    /// Control steps within so many seconds, at least one; the last may be cut short. 1e-6 of a step is rounding error.
    fn steps_in(&self, seconds: f64) -> f64 {
        (seconds * self.settings.physics.control_hz - 1e-6)
            .ceil()
            .max(1.0)
    }

    /// Least and most seconds between transitions, where training has them.
    fn transitions_s(&self) -> Option<[f64; 2]> {
        let training = self.purpose == Purpose::Training && self.references.len() > 1;
        self.settings.transitions_s.filter(|_| training)
    }

    /// Draws when the next transition of training is planned.
    fn schedule_transition(&mut self, draws: &mut Draws) {
        if let Some([least, most]) = self.transitions_s() {
            self.next_transition = self.elapsed + (least + uniform(draws.rng) * (most - least));
        }
    }

    /// In training, plans the transition into another motion when one is due, or where this motion ends. The episode then goes
    /// on.
    fn plan_transition(&mut self, outcome: Outcome, draws: &mut Draws) -> Outcome {
        let due = outcome == Outcome::Running && self.elapsed >= self.next_transition;
        if self.transitions_s().is_none() || !(due || outcome == Outcome::Finished) {
            return outcome;
        }
        self.upcoming = draws.starts.draw(draws.rng).motion;
        self.lead_to(&self.references[self.upcoming].clone());
        self.note_arrival();
        self.schedule_transition(draws);
        Outcome::Running
    }

    /// Counts the next motion as the present one from the moment its transition begins.
    fn note_arrival(&mut self) {
        if !self.playback.is_leading() {
            self.motion = self.upcoming;
        }
    }

    /// Shoves the trunk if the disturbance or a player asks for it; two shoves at once add up.
    fn push_trunk(&mut self) {
        let elapsed = self.elapsed;
        let mass = self.model.skeleton.total_mass() as f32;
        let due = self.disturbance.as_mut().and_then(|d| d.push(elapsed));
        let asked = self.asked_push.take();
        self.push = match (due.map(|change| change * mass), asked) {
            (Some(due), Some(asked)) => Some(due + asked),
            (due, asked) => due.or(asked),
        };
        if let Some(impulse) = self.push {
            let link = self.model.character.bodies[self.model.trunk()].link;
            self.world.push(link, impulse);
        }
    }

    /// Moves the reference to the agent along the ground: where a cycle begins, if cycles follow; from the first shove on, if
    /// the disturbance says so (`docs/notebook/shoves.md` has what that gains); and always after a transition, for nobody can say
    /// beforehand how fast a character gathers speed (`docs/notebook/transitions.md`).
    fn follow(&mut self) {
        let dt = self.settings.physics.control_dt();
        let begins = self.settings.cycles_follow && self.playback.begins_cycle(dt);
        let disturbance = self.disturbance.as_ref();
        let pushed = disturbance.is_some_and(Disturbance::is_agent_followed);
        if begins || pushed || self.playback.was_led_into() {
            let (mine, wanted) = (&self.world.states()[0], &self.next.links[0]);
            let apart = mine.pose.translation.vector - wanted.pose.translation.vector;
            self.playback.shift(apart);
        }
    }

    /// Samples the reference at the next control step and at the moments that the policy sees beyond it.
    fn look_ahead(&mut self) {
        let dt = self.settings.physics.control_dt();
        self.playback.sample(dt, &mut self.next);
        let ahead = self.settings.observations.ahead();
        for (seconds, sample) in ahead.iter().zip(&mut self.ahead) {
            self.playback.sample(dt + seconds, sample);
        }
    }

    /// Picks the contact bodies of the reference among those of the character.
    fn look_at_contacts(&mut self) {
        let of_motion = self.playback.reference().contacts_of_motion.iter();
        self.touching.clear();
        self.touching.extend(of_motion.map(|&c| self.pressing[c]));
    }

    /// How the episode stands after a step with this `reward`: failures first, for they hold at the end of a motion too.
    fn outcome(&self, reward: f32) -> Outcome {
        let states = self.world.states();
        let reference = self.playback.reference();
        match failure(
            &self.settings.terminations,
            states,
            &self.next.links,
            &self.pressing,
            &self.next.may_touch,
            reward,
        ) {
            Some(failure) => Outcome::Failed(failure),
            None if reference.is_over(self.playback.time()) => Outcome::Finished,
            None if self.elapsed >= self.settings.episode_s - 1e-9 => Outcome::TimeLimit,
            None => Outcome::Running,
        }
    }

    /// The outcome by the rules of evaluation: whatever rules an agent was trained under, it has failed when its bodies are too
    /// far from the reference.
    fn or_lost(&self, outcome: Outcome) -> Outcome {
        if self.purpose == Purpose::Training || matches!(outcome, Outcome::Failed(_)) {
            return outcome;
        }
        let wanted = self.wanted();
        match mean_distance(&self.model, self.world.states(), &wanted.links) > LOST_M {
            true => Outcome::Failed(Failure::Distance),
            false => outcome,
        }
    }

    /// The reference now.
    pub fn wanted(&self) -> ReferenceState {
        let mut state = self.playback.reference().blank();
        self.playback.sample(0.0, &mut state);
        state
    }

    /// Compares the agent with the state in which its reference wanted it after this step.
    fn compare(&self) -> Terms {
        terms(
            self.settings.rewards.kernels,
            &self.model,
            (self.world.states(), &self.dynamics),
            (&self.next.links, &self.next.dynamics),
        )
    }
}

/// The rules under which agents are compared: a fall ends an episode, and nothing else that training may have asked for.
fn rules_of_evaluation(settings: &ImitationSettings) -> ImitationSettings {
    ImitationSettings {
        terminations: Terminations {
            distance: None,
            fall: true,
            reward: None,
        },
        episode_s: f64::MAX,
        perturbations: Perturbations::default(),
        ..*settings
    }
}

impl Environment for Imitation {
    fn start(&mut self, draws: &mut Draws) {
        let Moment { motion, time } = draws.starts.draw(draws.rng);
        (self.motion, self.upcoming) = (motion, motion);
        self.begin(&self.references[motion].clone(), time);
        if self.settings.perturbations.is_on() {
            self.disturb(self.settings.perturbations, draws.rng.next_u64());
        }
        self.schedule_transition(draws);
    }

    fn start_at(&mut self, start: &EpisodeStart) -> Result<(), TaskError> {
        self.reference_of(start.case)?;
        self.begin_motion(start.case, start.state);
        if let Some((ranges, seed)) = start.disturbance {
            self.disturb(ranges, seed);
        }
        Ok(())
    }

    fn input(&mut self, input: Input) -> Result<(), TaskError> {
        match input {
            Input::Case(number) => {
                let reference = self.reference_of(number)?;
                self.upcoming = number;
                self.lead_to(&reference);
                self.note_arrival();
            }
            Input::Push(impulse) => self.asked_push = Some(impulse),
            Input::Wish(_) => return Err(TaskError::NotSteered),
        }
        Ok(())
    }

    fn observe(&self, out: &mut [f32]) {
        let inputs = ObservationInputs {
            links: self.world.states(),
            dynamics: &self.dynamics,
            contacts: &self.touching,
            last_action: &self.last_action,
            next: &self.next,
            ahead: &self.ahead,
        };
        observe(self.settings.observations, &self.model, &inputs, out);
    }

    fn begin_step(&mut self, action: &[f32]) {
        aim(
            self.settings.actions,
            &self.model.character,
            &self.next.links,
            action,
            &mut self.targets,
        );
        self.world.set_targets(&self.targets);
        self.last_action.copy_from_slice(action);
        self.push_trunk();
    }

    fn end_step(&mut self, stepped: Result<(), Diverged>, draws: Option<&mut Draws>) -> Step {
        let dt = self.settings.physics.control_dt();
        self.elapsed += dt;
        self.playback.advance(dt);
        let kernels = self.settings.rewards.kernels;
        if stepped.is_err() {
            return Step {
                reward: 0.0,
                terms: Terms::default().of(kernels),
                outcome: Outcome::Failed(Failure::Diverged),
            };
        }
        let (states, pressed) = (self.world.states(), self.world.contacts());
        let contacts = self.model.contacts.iter();
        self.pressing.clear();
        self.pressing
            .extend(contacts.map(|contact| contact.touches(states, pressed)));
        self.look_at_contacts();
        self.dynamics = self
            .playback
            .reference()
            .masses()
            .dynamics(self.world.states());
        let terms = self.compare();
        let reward = terms.total(self.settings.rewards.weights());
        let mut outcome = self.outcome(reward);
        // The reward compared the agent with the reference that it was asked to follow in this step; only now may that move.
        self.follow();
        self.playback.change_in_time();
        self.note_arrival();
        self.look_ahead();
        if let Some(draws) = draws {
            outcome = self.plan_transition(outcome, draws);
        }
        Step {
            reward,
            terms: terms.of(kernels),
            outcome: self.or_lost(outcome),
        }
    }

    fn world(&self) -> &World {
        &self.world
    }

    fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    fn moment(&self) -> Moment {
        Moment {
            motion: self.motion,
            time: self.playback.time(),
        }
    }

    fn elapsed_s(&self) -> f64 {
        self.elapsed
    }

    fn possible_steps(&self) -> f64 {
        if self.transitions_s().is_some() {
            return self.longest_steps();
        }
        let limit = self.settings.episode_s - self.elapsed;
        self.steps_in(limit.min(self.playback.left()))
    }

    fn is_changing(&self) -> bool {
        self.playback.is_leading()
    }

    fn wish(&self) -> Option<Wish> {
        None
    }

    fn reference(&self) -> Option<ReferenceState> {
        Some(self.wanted())
    }

    fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    fn touching(&self) -> &[bool] {
        &self.touching
    }

    fn targets(&self) -> &[Target] {
        &self.targets
    }

    fn push(&self) -> Option<Vector3<f32>> {
        self.push
    }
}
