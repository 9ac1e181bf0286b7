//! One agent that follows an animated character, episode after episode.

use super::Steer;
use super::guide::Guide;
use super::observe::{AHEAD, observe};
use super::player::Player;
use super::settings::SteerSettings;
use crate::humanoid::Slot;
use crate::sim::{Diverged, LinkState, Target, World};
use crate::task::disturbance::{Disturbance, Perturbations};
use crate::task::dynamics::{Dynamics, Masses};
use crate::task::environment::{Draws, Environment};
use crate::task::error::TaskError;
use crate::task::follow::{ObservationInputs, Terms, aim, anchor, failure, terms};
use crate::task::model::CharacterModel;
use crate::task::starts::Moment;
use crate::task::step::{
    EpisodeStart, Failure, Input, Outcome, Purpose, ReferenceState, StartState, Step, Wish,
};
use nalgebra::{Isometry3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::sync::Arc;

/// Control steps that the animated character takes before the first episode of an environment, so that training begins
/// anywhere in what players ask for.
const WARM_UP: u32 = 90;

/// Distance from the origin at which an episode of training begins at most, metres. Chosen.
const FARTHEST_M: f32 = 50.0;

/// An environment of [`Steer`].
pub(super) struct Steering {
    model: Arc<CharacterModel>,
    settings: SteerSettings,
    purpose: Purpose,
    masses: Masses,
    world: World,
    guide: Guide,
    /// Who asks in training and in evaluations without a script.
    player: Player,
    /// What the player of an evaluation draws from.
    rng: ChaCha8Rng,
    /// What is asked for now.
    wish: Wish,
    /// Whether a script asks, and not the player.
    scripted: bool,
    /// The animated character now, at the next control step and further ahead.
    now: ReferenceState,
    next: ReferenceState,
    ahead: Vec<ReferenceState>,
    dynamics: Dynamics,
    targets: Vec<Target>,
    last_action: Vec<f32>,
    pressing: Vec<bool>,
    /// The numbers of the feet among the contact bodies, left and right.
    feet: [Option<usize>; 2],
    disturbance: Option<Disturbance>,
    asked_push: Option<Vector3<f32>>,
    push: Option<Vector3<f32>>,
    elapsed: f64,
    begun: bool,
}

impl Steering {
    /// An environment in which the character stands.
    pub fn new(task: &Steer, purpose: Purpose) -> Self {
        let model = task.model.clone();
        let settings = match purpose {
            Purpose::Training => task.settings,
            _ => rules_of_evaluation(&task.settings),
        };
        let blank = blank(&model);
        let foot = |slot| model.contact(*model.skeleton.slots.get(&slot)?);
        let mut environment = Steering {
            world: World::new(&model.character, settings.physics),
            masses: Masses::new(&model.character),
            guide: Guide::new(task.gaits.clone()),
            player: task.player(),
            rng: ChaCha8Rng::seed_from_u64(0),
            wish: Wish::default(),
            scripted: false,
            now: blank.clone(),
            next: blank.clone(),
            ahead: vec![blank; AHEAD.len()],
            dynamics: Dynamics::default(),
            targets: vec![Target::Free; model.character.links.len()],
            last_action: vec![0.0; model.character.dof],
            pressing: vec![false; model.contacts.len()],
            feet: [foot(Slot::LeftFoot), foot(Slot::RightFoot)],
            disturbance: None,
            asked_push: None,
            push: None,
            elapsed: 0.0,
            begun: false,
            model,
            settings,
            purpose,
        };
        environment.look_ahead();
        environment.begin();
        environment
    }

    fn dt(&self) -> f64 {
        self.settings.physics.control_dt()
    }

    /// Starts an episode in the state of the animated character, which goes on.
    fn begin(&mut self) {
        std::mem::swap(&mut self.now, &mut self.next);
        self.elapsed = 0.0;
        self.world.reset(&self.now.links);
        self.dynamics = self.masses.dynamics(self.world.states());
        // The engine finds contacts only in a step; until then the agent touches what the animated character does.
        self.pressing.clone_from(&self.now.contacts);
        self.last_action.fill(0.0);
        self.disturbance = None;
        self.asked_push = None;
        self.push = None;
        self.look_ahead();
    }

    /// Moves the animated character on, to the next control step and ahead.
    fn look_ahead(&mut self) {
        let dt = self.dt() as f32;
        self.guide.advance(&self.wish, dt, &mut self.next.links);
        self.next.dynamics = self.masses.dynamics(&self.next.links);
        let stands = self.guide.stands();
        put_down(&self.feet, stands, &mut self.next.contacts);
        self.next.anchor = anchor(&self.next.links[0].pose);
        for (seconds, sample) in AHEAD.iter().zip(&mut self.ahead) {
            let stands = self.guide.preview(&self.wish, *seconds, &mut sample.links);
            put_down(&self.feet, stands, &mut sample.contacts);
        }
    }

    /// Lets the animated character wait where it is too far ahead.
    fn hold_back(&mut self) {
        let root = |links: &[LinkState]| links[0].pose.translation.vector.xy();
        let apart = root(self.world.states()) - root(&self.next.links);
        let leash = self.settings.leash_m;
        if apart.norm() > leash {
            let by = apart * (1.0 - leash / apart.norm());
            self.guide.shift(&by);
            for link in &mut self.next.links {
                link.pose.translation.vector += by.push(0.0);
            }
        }
    }

    /// Moves the animated character back to the origin when it has gone far: single precision is for what is near.
    fn come_home(&mut self) {
        let away = self.next.links[0].pose.translation.vector.xy();
        if away.norm() > FARTHEST_M {
            self.guide.shift(&-away);
            for link in &mut self.next.links {
                link.pose.translation.vector -= away.push(0.0);
            }
        }
    }

    /// Shoves the trunk if the disturbance or a player asks for it; two shoves at once add up.
    fn push_trunk(&mut self) {
        let mass = self.model.skeleton.total_mass() as f32;
        let elapsed = self.elapsed;
        let due = self.disturbance.as_mut().and_then(|d| d.push(elapsed));
        let due = due.map(|change| change * mass);
        let asked = self.asked_push.take();
        self.push = match (due, asked) {
            (Some(due), Some(asked)) => Some(due + asked),
            (due, asked) => due.or(asked),
        };
        if let Some(impulse) = self.push {
            let link = self.model.character.bodies[self.model.trunk()].link;
            self.world.push(link, impulse);
        }
    }

    fn disturb(&mut self, ranges: Perturbations, seed: u64) {
        let disturbance = Disturbance::new(ranges, seed);
        self.world.vary(disturbance.mass, disturbance.friction);
        self.disturbance = Some(disturbance);
    }

    fn compare(&self) -> Terms {
        terms(
            self.settings.rewards.kernels,
            &self.model,
            (self.world.states(), &self.dynamics),
            (&self.next.links, &self.next.dynamics),
        )
    }

    fn outcome(&self, reward: f32) -> Outcome {
        let failed = failure(
            &self.settings.terminations,
            self.world.states(),
            &self.next.links,
            &self.pressing,
            &self.next.may_touch,
            reward,
        );
        match failed {
            Some(failure) => Outcome::Failed(failure),
            None if self.elapsed >= self.settings.episode_s - 1e-9 => Outcome::TimeLimit,
            None => Outcome::Running,
        }
    }

    fn limit(&self) -> f64 {
        match self.purpose {
            Purpose::Evaluation { seconds } => seconds,
            Purpose::Training => self.settings.episode_s,
            Purpose::Performance => f64::MAX,
        }
    }
}

/// Only a fall ends an episode that isn't training.
fn rules_of_evaluation(settings: &SteerSettings) -> SteerSettings {
    let mut settings = *settings;
    settings.terminations.distance = None;
    settings.terminations.reward = None;
    settings.terminations.fall = true;
    settings.episode_s = f64::MAX;
    settings.perturbations = Perturbations::default();
    settings
}

/// A reference in which nothing but feet may touch the ground.
fn blank(model: &CharacterModel) -> ReferenceState {
    let still = LinkState {
        pose: Isometry3::identity(),
        linear: Vector3::zeros(),
        angular: Vector3::zeros(),
    };
    ReferenceState {
        links: vec![still; model.character.links.len()],
        contacts: vec![false; model.contacts.len()],
        may_touch: model.contacts.iter().map(|c| c.is_foot).collect(),
        ..ReferenceState::default()
    }
}

/// Says of the feet, and of no other contact body, whether they stand.
fn put_down(feet: &[Option<usize>; 2], stands: [bool; 2], contacts: &mut [bool]) {
    contacts.fill(false);
    for (foot, stands) in feet.iter().zip(stands) {
        if let Some(foot) = foot {
            contacts[*foot] = stands;
        }
    }
}

impl Environment for Steering {
    fn start(&mut self, draws: &mut Draws) {
        // The animated character goes on as asked, and the agent starts anew wherever that has led.
        if !self.begun {
            self.begun = true;
            for _ in 0..WARM_UP {
                self.player.go_on(self.dt(), draws.rng);
                self.wish = self.player.wish;
                self.look_ahead();
            }
        }
        self.come_home();
        self.begin();
        if self.settings.perturbations.is_on() {
            self.disturb(self.settings.perturbations, draws.rng.next_u64());
        }
    }

    fn start_at(&mut self, start: &EpisodeStart) -> Result<(), TaskError> {
        if start.case > 0 {
            let number = start.case;
            return Err(TaskError::NoSuchCase { number, cases: 1 });
        }
        let share = match start.state {
            StartState::Reference(share) => share,
            StartState::Rest => 0.0,
        };
        self.rng = ChaCha8Rng::seed_from_u64((share * 1e6).round() as u64);
        self.settings.episode_s = self.limit();
        self.begin();
        if let Some((ranges, seed)) = start.disturbance {
            self.disturb(ranges, seed);
        }
        Ok(())
    }

    fn input(&mut self, input: Input) -> Result<(), TaskError> {
        match input {
            Input::Push(impulse) => self.asked_push = Some(impulse),
            Input::Wish(wish) => {
                self.scripted = true;
                self.wish = wish;
            }
            Input::Case(number) => {
                if number > 0 {
                    return Err(TaskError::NoSuchCase { number, cases: 1 });
                }
            }
        }
        Ok(())
    }

    fn observe(&self, out: &mut [f32]) {
        let inputs = ObservationInputs {
            links: self.world.states(),
            dynamics: &self.dynamics,
            contacts: &self.pressing,
            last_action: &self.last_action,
            next: &self.next,
            ahead: &self.ahead,
        };
        observe(&self.model, &inputs, &self.wish, out);
    }

    fn begin_step(&mut self, action: &[f32]) {
        let character = &self.model.character;
        let (actions, links) = (self.settings.actions, &self.next.links);
        aim(actions, character, links, action, &mut self.targets);
        self.world.set_targets(&self.targets);
        self.last_action.copy_from_slice(action);
        self.push_trunk();
    }

    fn end_step(&mut self, stepped: Result<(), Diverged>, draws: Option<&mut Draws>) -> Step {
        self.elapsed += self.dt();
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
        self.dynamics = self.masses.dynamics(self.world.states());
        let terms = self.compare();
        let reward = terms.total(self.settings.rewards.weights());
        let outcome = self.outcome(reward);
        // An agent that failed may have been flung anywhere.
        if !matches!(outcome, Outcome::Failed(_)) {
            self.hold_back();
        }
        std::mem::swap(&mut self.now, &mut self.next);
        if !self.scripted {
            let dt = self.dt();
            match draws {
                Some(draws) => self.player.go_on(dt, draws.rng),
                None => self.player.go_on(dt, &mut self.rng),
            }
            self.wish = self.player.wish;
        }
        self.look_ahead();
        Step {
            reward,
            terms: terms.of(kernels),
            outcome,
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
            motion: 0,
            time: 0.0,
        }
    }

    fn elapsed_s(&self) -> f64 {
        self.elapsed
    }

    fn possible_steps(&self) -> f64 {
        let left = self.settings.episode_s - self.elapsed;
        (left * self.settings.physics.control_hz - 1e-6)
            .ceil()
            .max(1.0)
    }

    fn is_changing(&self) -> bool {
        false
    }

    fn wish(&self) -> Option<Wish> {
        Some(self.wish)
    }

    fn reference(&self) -> Option<ReferenceState> {
        Some(self.now.clone())
    }

    fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    fn touching(&self) -> &[bool] {
        &self.pressing
    }

    fn targets(&self) -> &[Target] {
        &self.targets
    }

    fn push(&self) -> Option<Vector3<f32>> {
        self.push
    }
}
