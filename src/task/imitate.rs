//! Phase-based imitation: one environment.

use super::aim::aim;
use super::course::Course;
use super::observe::{Scene, observation_size, observe};
use super::perturb::Disturbance;
use super::reference::{Reference, Sample};
use super::reward::{Terms, terms};
use super::setting::Setting;
use super::stage::Stage;
use super::terminate::{Failure, failure};
use crate::sim::{Diverged, LinkState, Target, World};
use crate::task::Dynamics;
use nalgebra::Vector3;
use std::sync::Arc;

/// How an episode stands after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Running,
    /// Terminal: nothing more can be earned.
    Failed(Failure),
    /// Terminal: the motion was performed to its end.
    Finished,
    /// Cut off by the time limit; the state goes on being worth something.
    TimeLimit,
}

/// What one step gave.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// In (0, 1].
    pub reward: f32,
    pub terms: Terms,
    pub outcome: Outcome,
}

/// An agent that imitates a reference.
pub struct Imitate {
    stage: Arc<Stage>,
    course: Course,
    setting: Setting,
    world: World,
    /// Seconds since the episode began.
    elapsed: f64,
    /// The reference at the next control step.
    next: Sample,
    /// The reference at each moment of [`super::Observations::ahead`].
    ahead: Vec<Sample>,
    dynamics: Dynamics,
    targets: Vec<Target>,
    last_action: Vec<f32>,
    /// Per contact link of the reference.
    touching: Vec<bool>,
    disturbance: Option<Disturbance>,
    /// Impulse of a shove in the last step, N·s.
    shove: Option<Vector3<f32>>,
}

impl Imitate {
    pub fn new(stage: Arc<Stage>, reference: Arc<Reference>, setting: &Setting) -> Self {
        let mut env = Imitate {
            world: World::new(&stage.character, setting.physics),
            next: reference.blank(),
            ahead: vec![reference.blank(); setting.observations.ahead().len()],
            targets: vec![Target::Free; stage.character.links.len()],
            last_action: vec![0.0; stage.character.dof],
            touching: Vec::new(),
            disturbance: None,
            shove: None,
            course: Course::new(stage.clone(), reference),
            stage,
            setting: *setting,
            elapsed: 0.0,
            dynamics: Dynamics::default(),
        };
        env.reset(0.0);
        env
    }

    pub fn observation_size(&self) -> usize {
        observation_size(
            self.setting.observations,
            &self.stage,
            self.course.reference().contact_links.len(),
        )
    }

    pub fn action_size(&self) -> usize {
        self.stage.character.dof
    }

    /// Starts an episode of `reference`, whose contact links are those of the one before.
    pub fn imitate(&mut self, reference: &Arc<Reference>, time: f64) {
        self.begin(reference, time);
    }

    /// Slows the present reference down for another `reference`, if that is slower, and goes over into it, as by
    /// [`Imitate::change_to`], at the control step of the next second at which the present one comes nearest to it; at once
    /// where the present one ends.
    pub fn lead_to(&mut self, reference: &Arc<Reference>) {
        self.course
            .lead_to(reference, self.setting.physics.control_dt());
        self.look_ahead();
    }

    /// Whether [`Imitate::lead_to`] hasn't led to its reference yet.
    pub fn is_leading(&self) -> bool {
        self.course.is_leading()
    }

    /// Goes on, as the agent is, with another `reference`: from the moment of it that is nearest to the present one,
    /// from where and whither the present one has brought the character, within 0.4 s from its pose to the new one's,
    /// and within a second from its speed and to its own pace: it begins at half to one and a half of it, so as to be as
    /// fast as the present one. The new one follows the agent along the ground.
    pub fn change_to(&mut self, reference: &Arc<Reference>) {
        self.course.change_to(reference);
        self.look_ahead();
    }

    /// A sample to write into.
    pub fn blank(&self) -> Sample {
        self.course.reference().blank()
    }

    /// Writes the reference at the present moment.
    pub fn wanted(&self, sample: &mut Sample) {
        self.course.sample(0.0, sample);
    }

    /// Starts an episode in the reference's own state at `time` seconds.
    pub fn reset(&mut self, time: f64) {
        self.begin(&self.course.reference().clone(), time);
    }

    fn begin(&mut self, reference: &Arc<Reference>, time: f64) {
        self.course.begin(reference, time);
        self.elapsed = 0.0;
        self.course.sample(0.0, &mut self.next);
        self.world.reset(&self.next.links);
        self.dynamics = self
            .course
            .reference()
            .masses()
            .dynamics(self.world.states());
        // The engine finds contacts only in a step; until then the agent touches what its reference does.
        self.touching.clone_from(&self.next.contacts);
        self.last_action.fill(0.0);
        self.disturbance = None;
        self.shove = None;
        self.look_ahead();
    }

    /// Starts an episode at the reference's first frame, but at rest: in the rest pose, on the ground where the
    /// reference's root is, facing where it faces.
    pub fn reset_at_rest(&mut self) {
        self.reset(0.0);
        let skeleton = &self.stage.skeleton;
        let poses = skeleton.forward(&skeleton.rest_qpos());
        let raise = nalgebra::Translation3::new(0.0, 0.0, -skeleton.lowest_point(&poses) as f32);
        let root = poses[0].translation.vector;
        let center = nalgebra::Translation3::new(-root.x as f32, -root.y as f32, 0.0);
        let place = raise * self.next.anchor * center;
        let still = vec![0.0; skeleton.nv];
        let rest = skeleton.rest_qpos();
        let mut states = self.stage.character.states(skeleton, &rest, &still);
        for state in &mut states {
            state.pose = place * state.pose;
        }
        let lowest = skeleton.lowest_point(&poses);
        let stands = |link: &usize| {
            let body = self.stage.character.links[*link].body;
            skeleton.lowest_point_of(&poses, &[body]) < lowest + STANDING
        };
        self.touching = self
            .course
            .reference()
            .contact_links
            .iter()
            .map(stands)
            .collect();
        self.world.reset(&states);
        self.dynamics = self.course.reference().masses().dynamics(&states);
    }

    /// Whether the task has disturbances, which [`Imitate::perturb`] starts.
    pub fn is_perturbed(&self) -> bool {
        self.setting.perturbations.is_on()
    }

    /// Disturbs the episode that was just begun; `seed` alone says how.
    pub fn perturb(&mut self, seed: u64) {
        let disturbance = Disturbance::new(self.setting.perturbations, seed);
        self.world.vary(disturbance.mass, disturbance.friction);
        self.disturbance = Some(disturbance);
    }

    /// Latest start that leaves something to do, seconds.
    pub fn last_start(&self) -> f64 {
        self.course
            .reference()
            .last_start(self.setting.physics.control_dt())
    }

    /// Steps from here to the end of the motion or the time limit, whichever is nearer.
    pub fn possible_steps(&self) -> f64 {
        let limit = self.setting.episode_s - self.elapsed;
        let left = limit.min(self.course.left());
        (left * self.setting.physics.control_hz - 1e-6)
            .ceil()
            .max(1.0)
    }

    /// Steps of an episode that only the time limit ends.
    pub fn longest_steps(&self) -> f64 {
        (self.setting.episode_s * self.setting.physics.control_hz - 1e-6)
            .ceil()
            .max(1.0)
    }

    /// Writes what the policy sees.
    pub fn observe(&self, out: &mut [f32]) {
        let scene = Scene {
            links: self.world.states(),
            dynamics: &self.dynamics,
            contacts: &self.touching,
            last_action: &self.last_action,
            next: &self.next,
            ahead: &self.ahead,
        };
        observe(self.setting.observations, &self.stage, &scene, out);
    }

    /// Advances by one control step under `action`.
    pub fn step(&mut self, action: &[f32]) -> Step {
        self.act(action);
        let stepped = self.world.step();
        self.judge(stepped)
    }

    /// Advances agents of one stage and one setting, each by its own of `actions`, `[agents, actions]`: each as if alone,
    /// in less time.
    ///
    /// # Panics
    /// If there aren't as many actions.
    pub fn step_together<'a>(
        agents: impl Iterator<Item = &'a mut Imitate>,
        actions: &[f32],
    ) -> Vec<Step> {
        let mut agents: Vec<&mut Imitate> = agents.collect();
        let size = agents.first().map_or(0, |agent| agent.action_size());
        assert_eq!(actions.len(), agents.len() * size, "actions of all agents");
        for (i, agent) in agents.iter_mut().enumerate() {
            agent.act(&actions[i * size..(i + 1) * size]);
        }
        let mut results = vec![Ok(()); agents.len()];
        let mut worlds: Vec<&mut World> = agents.iter_mut().map(|a| &mut a.world).collect();
        World::step_together(&mut worlds, &mut results);
        let agents = agents.into_iter().zip(results);
        agents.map(|(agent, result)| agent.judge(result)).collect()
    }

    /// Aims the drives, and shoves when it is time for that.
    fn act(&mut self, action: &[f32]) {
        aim(
            self.setting.actions,
            &self.stage.character,
            &self.next.links,
            action,
            &mut self.targets,
        );
        self.world.set_targets(&self.targets);
        self.last_action.copy_from_slice(action);
        self.push();
    }

    /// What the control step that was taken has led to.
    fn judge(&mut self, stepped: Result<(), Diverged>) -> Step {
        let dt = self.setting.physics.control_dt();
        self.elapsed += dt;
        self.course.advance(dt);
        if stepped.is_err() {
            return Step {
                reward: 0.0,
                terms: Terms::default(),
                outcome: Outcome::Failed(Failure::Diverged),
            };
        }
        let states = self.world.states();
        let pressed = self.world.contacts();
        let links = self.course.reference().contact_links.iter();
        self.touching.clear();
        self.touching.extend(links.map(|&link| pressed[link]));
        self.dynamics = self.course.reference().masses().dynamics(states);
        let terms = terms(
            self.setting.rewards.kernels,
            &self.stage,
            (states, &self.dynamics),
            (&self.next.links, &self.next.dynamics),
        );
        let reward = terms.total(&self.setting.rewards);
        let outcome = self.outcome(reward);
        self.follow();
        self.course.change_in_time();
        self.look_ahead();
        Step {
            reward,
            terms,
            outcome,
        }
    }

    /// Link states of the agent.
    pub fn states(&self) -> &[LinkState] {
        self.world.states()
    }

    /// Per link: whether the agent presses on the ground with it.
    pub fn contacts(&self) -> &[bool] {
        self.world.contacts()
    }

    pub fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    /// Per contact link of the reference: whether the agent presses on the ground with it.
    pub fn touching(&self) -> &[bool] {
        &self.touching
    }

    /// What the drives are aimed at, one per link.
    pub fn targets(&self) -> &[Target] {
        &self.targets
    }

    /// Impulse of the shove on the trunk that the last step began with, N·s, world axes.
    pub fn shove(&self) -> Option<Vector3<f32>> {
        self.shove
    }

    /// Seconds since the episode began.
    pub fn elapsed(&self) -> f64 {
        self.elapsed
    }

    /// Time in the reference, seconds.
    pub fn time(&self) -> f64 {
        self.course.time()
    }

    fn push(&mut self) {
        let elapsed = self.elapsed;
        let push = self.disturbance.as_mut().and_then(|d| d.push(elapsed));
        let mass = self.stage.skeleton.total_mass() as f32;
        self.shove = push.map(|change| change * mass);
        if let Some(impulse) = self.shove {
            let link = self.stage.character.bodies[self.stage.trunk()].link;
            self.world.push(link, impulse);
        }
    }

    /// Moves the reference to the agent along the ground: where a cycle begins, if cycles follow; from the first shove on, if
    /// the disturbance says so; and always once another motion has led into this one, for nobody can say beforehand how fast
    /// a character gathers speed.
    fn follow(&mut self) {
        let dt = self.setting.physics.control_dt();
        let begins = self.setting.cycles_follow && self.course.begins_cycle(dt);
        let shoved = self
            .disturbance
            .as_ref()
            .is_some_and(Disturbance::is_followed);
        if begins || shoved || self.course.was_led_into() {
            let (mine, wanted) = (&self.world.states()[0], &self.next.links[0]);
            let apart = mine.pose.translation.vector - wanted.pose.translation.vector;
            self.course.shift(apart);
        }
    }

    fn look_ahead(&mut self) {
        let dt = self.setting.physics.control_dt();
        self.course.sample(dt, &mut self.next);
        let ahead = self.setting.observations.ahead();
        for (seconds, sample) in ahead.iter().zip(&mut self.ahead) {
            self.course.sample(dt + seconds, sample);
        }
    }

    fn outcome(&self, reward: f32) -> Outcome {
        let (states, contacts) = (self.world.states(), self.world.contacts());
        let allowed = &self.course.reference().contact_links;
        match failure(
            &self.setting.terminations,
            states,
            &self.next.links,
            contacts,
            allowed,
            reward,
        ) {
            Some(failure) => Outcome::Failed(failure),
            None if self.course.reference().is_over(self.time()) => Outcome::Finished,
            None if self.elapsed >= self.setting.episode_s - 1e-9 => Outcome::TimeLimit,
            None => Outcome::Running,
        }
    }
}

/// A body this little above the lowest one stands with it, metres.
const STANDING: f64 = 0.01;
