//! What a learner, an evaluation, a replay and a live player need of a task.
//!
//! A [`Task`] says what an agent sees, does and is rewarded for, and makes [`Environment`]s: worlds in which one agent
//! performs the task, episode after episode.

use super::dynamics::Dynamics;
use super::episode::{Episode, Frame, Measure};
use super::error::TaskError;
use super::model::CharacterModel;
use super::starts::{Moment, StartDistribution};
use super::step::{Block, Case, EpisodeStart, Input, Purpose, ReferenceState, Step, Wish};
use super::verdict::{Performance, Verdict};
use crate::sim::{Diverged, Target, World};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// What an episode of training draws from.
#[derive(Debug)]
pub struct Draws<'a> {
    /// Where episodes start.
    pub starts: &'a StartDistribution,
    /// The environment's own random stream.
    pub rng: &'a mut ChaCha8Rng,
}

/// What is learned: for a character and a set of motions, what an agent sees, does and is rewarded for.
pub trait Task: Send + Sync {
    /// The task's name on the command line and in files.
    fn name(&self) -> &'static str;

    /// The character that performs it.
    fn model(&self) -> &Arc<CharacterModel>;

    /// Control steps per second.
    fn control_hz(&self) -> f64;

    /// The blocks of an observation, in order.
    fn observation(&self) -> &[Block];

    /// The blocks of an action, in order. There may be more numbers than joints.
    fn action(&self) -> &[Block];

    /// Names of the reward terms, at most [`super::MAX_TERMS`].
    fn reward_terms(&self) -> &[&'static str];

    /// Bodies of the skeleton whose contact with the ground the task watches.
    fn contact_bodies(&self) -> &[usize];

    /// Where episodes start before anything was learned.
    fn starts(&self) -> StartDistribution;

    /// Whether this start of a case, as a share of all its starts, is beyond reach: the ground can't give the force that is asked
    /// for from there.
    fn is_beyond_reach(&self, case: usize, share: f64) -> bool;

    /// What an agent can be asked to perform; at least one case.
    fn cases(&self) -> &[Case];

    /// A new environment in which the first case is about to begin.
    fn environment(&self, purpose: Purpose) -> Box<dyn Environment>;

    /// How well an agent performed in these episodes of one case, beyond what [`crate::evaluate`] measures of every task.
    fn measures(&self, episodes: &[Episode]) -> Vec<Measure>;

    /// Whether an agent that performed one case like this has learned it.
    fn verdict(&self, found: &Performance) -> Verdict;
}

/// A world in which one agent performs a task.
///
/// A control step has two halves, so that several characters can take their physics steps together in between (see
/// [`step_together`]).
pub trait Environment: Send {
    /// Starts an episode of training.
    fn start(&mut self, draws: &mut Draws);

    /// Starts an episode outside training.
    ///
    /// # Errors
    /// A case that the task doesn't have.
    fn start_at(&mut self, start: &EpisodeStart) -> Result<(), TaskError>;

    /// Takes what a player or a script asks for.
    ///
    /// # Errors
    /// An input that the task doesn't understand, such as a case that it doesn't have.
    fn input(&mut self, input: Input) -> Result<(), TaskError>;

    /// Writes what the policy sees; `out` is as long as [`Task::observation`] says.
    fn observe(&self, out: &mut [f32]);

    /// The first half of a control step: aims the drives as `action` says, and applies a shove if one is due.
    fn begin_step(&mut self, action: &[f32]);

    /// The second half, after the physics step: rewards it and says how the episode stands. In training, `draws` decides what
    /// the task goes on with.
    fn end_step(&mut self, stepped: Result<(), Diverged>, draws: Option<&mut Draws>) -> Step;

    /// The simulated character.
    fn world(&self) -> &World;

    /// The simulated character, to be stepped between the halves of a control step.
    fn world_mut(&mut self) -> &mut World;

    /// Where in the task's motions the episode is, for counting where episodes fail.
    fn moment(&self) -> Moment;

    /// Seconds since the episode began.
    fn elapsed_s(&self) -> f64;

    /// Control steps from here to the end of the task or the time limit, whichever is nearer.
    fn possible_steps(&self) -> f64;

    /// Whether the transition that an [`Input::Case`] asked for hasn't begun yet.
    fn is_changing(&self) -> bool;

    /// What a player asks for now, where there is one.
    fn wish(&self) -> Option<Wish>;

    /// What the agent should be like now, where the task has a reference.
    fn reference(&self) -> Option<ReferenceState>;

    /// Centre of mass and momenta of the agent.
    fn dynamics(&self) -> &Dynamics;

    /// One per [`Task::contact_bodies`]: whether the agent presses on the ground with it.
    fn touching(&self) -> &[bool];

    /// Targets of the drives, one per link.
    fn targets(&self) -> &[Target];

    /// Impulse of the shove on the trunk that the last step began with, N·s, world axes.
    fn push(&self) -> Option<Vector3<f32>>;
}

/// Takes one control step.
pub fn step(environment: &mut dyn Environment, action: &[f32]) -> Step {
    environment.begin_step(action);
    let stepped = environment.world_mut().step();
    environment.end_step(stepped, None)
}

/// An environment that steps together with others, and in training what its episode draws from.
pub type Stepping<'a> = (&'a mut dyn Environment, Option<Draws<'a>>);

/// Takes one control step in environments of one task, with `actions` `[environments, action]`. Each gets the bits that it would
/// get alone, in less time.
///
/// # Panics
/// If `actions` can't be shared evenly between the environments.
pub fn step_together(environments: &mut [Stepping], actions: &[f32]) -> Vec<Step> {
    let size = actions.len() / environments.len().max(1);
    assert_eq!(
        actions.len(),
        environments.len() * size,
        "one action for each environment"
    );
    for (i, (environment, _)) in environments.iter_mut().enumerate() {
        environment.begin_step(&actions[i * size..(i + 1) * size]);
    }
    let mut results = vec![Ok(()); environments.len()];
    let mut worlds: Vec<&mut World> = environments
        .iter_mut()
        .map(|(environment, _)| environment.world_mut())
        .collect();
    World::step_together(&mut worlds, &mut results);
    let environments = environments.iter_mut().zip(results);
    let ended = environments
        .map(|((environment, draws), stepped)| environment.end_step(stepped, draws.as_mut()));
    ended.collect()
}

/// The frame to which a `step` of an environment has led.
pub fn frame(environment: &dyn Environment, step: &Step) -> Frame {
    let world = environment.world();
    Frame {
        time: environment.moment().time,
        agent: world.states().to_vec(),
        reference: environment.reference(),
        dynamics: *environment.dynamics(),
        contacts: environment.touching().to_vec(),
        terms: step.terms.clone(),
        reward: step.reward,
        push: environment.push(),
    }
}
