//! A training run: rollouts, advantages, updates, in iterations that read top to bottom.

use super::random::stream;
use super::rollout::{Actor, Buffer, Episode, Group};
use super::starts::{Span, Starts};
use super::{
    Batch, LearnError, Learner, LearnerState, Normalizer, OBSERVATION_LIMIT, Plan, PolicySpec,
    TrainError, Trajectories, UpdateStats, advantages,
};
use crate::clip::LoopMode;
use crate::motion::Motion;
use crate::task::{Block, Reference, Setting, Stage, TERM_NAMES, layout};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What an iteration did.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Metrics {
    pub iteration: u64,
    pub samples: u64,
    /// Mean sum of rewards over the episodes that ended; `None` where none did.
    #[serde(rename = "return")]
    pub episode_return: Option<f64>,
    /// Mean over those episodes of return ÷ the steps that a perfect one would have had.
    pub normalized_return: Option<f64>,
    /// Mean length of those episodes, seconds.
    pub episode_length: Option<f64>,
    /// Episodes that ended.
    pub episodes: u64,
    #[serde(flatten)]
    pub update: UpdateStats,
    /// Standard deviation of the action noise.
    pub action_std: f64,
    /// Mean of each reward term over all steps.
    pub reward_terms: BTreeMap<String, f64>,
}

/// What a run is between two rounds.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainerState {
    pub iteration: u64,
    pub learner: LearnerState<f32>,
    pub normalizer: Normalizer,
    /// What was seen of each part of the motions, which decides where episodes begin.
    pub starts: Vec<f32>,
}

/// A run in memory.
pub struct Trainer {
    plan: Plan,
    learner: Learner<f32>,
    normalizer: Normalizer,
    observation: Vec<Block>,
    groups: Vec<Group>,
    starts: Starts,
    iteration: u64,
    /// The environments haven't begun yet, or stand where an earlier state left them.
    stale: bool,
    control_dt: f64,
    batch: Samples,
}

/// The iteration's samples, one group after the other.
#[derive(Default)]
struct Samples {
    observations: Vec<f32>,
    actions: Vec<f32>,
    log_probs: Vec<f32>,
    values: Vec<f32>,
    advantages: Vec<f32>,
    returns: Vec<f32>,
}

impl Trainer {
    /// # Errors
    /// A plan or a motion that can't be trained.
    pub fn new(plan: Plan, stage: Stage, motions: &[Motion]) -> Result<Self, TrainError> {
        plan.check()?;
        let references: Result<Arc<[_]>, _> = motions
            .iter()
            .map(|motion| Reference::new(motion, &stage).map(Arc::new))
            .collect();
        let references = references?;
        let contacts = contacts(&references)?;
        let observation = layout(plan.task.observations, &stage, contacts);
        let spec = PolicySpec {
            observation: observation.iter().map(|block| block.size).sum(),
            action: stage.character.dof,
            hidden: plan.hidden.clone(),
            activation: plan.activation,
        };
        let learner = Learner::new(plan.ppo.clone(), spec, &mut stream(plan.seed, 0, 0))?;
        let stage = Arc::new(stage);
        let groups = (0..plan.environments)
            .step_by(plan.group)
            .map(|first| {
                let count = plan.group.min(plan.environments - first);
                Group::new(&stage, &references, &plan.task, first, count)
            })
            .collect();
        Ok(Trainer {
            normalizer: Normalizer::new(learner.policy().spec().observation),
            starts: starts(&references, &plan.task),
            control_dt: plan.task.physics.control_dt(),
            plan,
            learner,
            observation,
            groups,
            iteration: 0,
            stale: true,
            batch: Samples::default(),
        })
    }

    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    pub fn learner(&self) -> &Learner<f32> {
        &self.learner
    }

    /// The parts of what the policy sees, in order.
    pub fn observation(&self) -> &[Block] {
        &self.observation
    }

    pub fn normalizer(&self) -> &Normalizer {
        &self.normalizer
    }

    /// Iterations done.
    pub fn iteration(&self) -> u64 {
        self.iteration
    }

    /// Control steps taken by all environments together.
    pub fn samples(&self) -> u64 {
        self.iteration * (self.plan.environments * self.plan.horizon) as u64
    }

    /// Whether the samples of the plan are used up.
    pub fn is_done(&self) -> bool {
        self.samples() >= self.plan.samples
    }

    /// Whether the run stands between two rounds, where it can be saved and resumed to the same bits.
    pub fn is_between_rounds(&self) -> bool {
        self.iteration.is_multiple_of(self.plan.round.max(1))
    }

    pub fn state(&self) -> TrainerState {
        TrainerState {
            iteration: self.iteration,
            learner: self.learner.state().clone(),
            normalizer: self.normalizer.clone(),
            starts: self.starts.state(),
        }
    }

    /// Goes on from a saved state of the same plan.
    ///
    /// # Errors
    /// A state of another network.
    pub fn restore(&mut self, state: TrainerState) -> Result<(), LearnError> {
        // Runs from before starts were counted have none.
        if !state.starts.is_empty() {
            super::check_length("saved starts", state.starts.len(), 2 * self.starts.bins())?;
            self.starts.restore(&state.starts);
        }
        self.learner.restore(state.learner)?;
        self.normalizer = state.normalizer;
        self.iteration = state.iteration;
        self.stale = true;
        Ok(())
    }

    /// Plays, learns, and says how it went. Runs on the current rayon pool, with the same bits at any size of it.
    ///
    /// # Errors
    /// A quantity that stopped being finite.
    pub fn iterate(&mut self) -> Result<Metrics, LearnError> {
        self.schedule_rate();
        let std = self.schedule_noise();
        if self.normalizer.count == 0.0 {
            self.meet_observations()?;
        }
        self.play()?;
        self.gather()?;
        // Before anything is learned from them: this is where a number that isn't finite is named.
        for group in &self.groups {
            self.normalizer.update(&group.buffer.raw)?;
        }
        self.starts
            .learn(self.groups.iter().map(|group| &group.buffer.tally));
        let batch = Batch {
            observations: &self.batch.observations,
            actions: &self.batch.actions,
            log_probs: &self.batch.log_probs,
            values: &self.batch.values,
            advantages: &self.batch.advantages,
            returns: &self.batch.returns,
        };
        let update = self
            .learner
            .update(&batch, &mut stream(self.plan.seed, 0, self.iteration + 1))?;
        self.iteration += 1;
        Ok(self.metrics(update, std))
    }

    /// Share of the plan's samples that are used up.
    fn done(&self) -> f64 {
        (self.samples() as f64 / self.plan.samples.max(1) as f64).min(1.0)
    }

    fn schedule_rate(&mut self) {
        if self.plan.ppo.target_kl.is_some() {
            return;
        }
        let share = 1.0 + (self.plan.final_learning_rate - 1.0) * self.done();
        self.learner
            .set_learning_rate(self.plan.ppo.learning_rate * share);
    }

    fn schedule_noise(&mut self) -> f64 {
        let done = self.done();
        let std = self.plan.ppo.initial_std * (1.0 + (self.plan.final_std - 1.0) * done);
        if self.plan.ppo.learn_std {
            return self.learner.mean_std();
        }
        self.learner.set_std(std);
        std
    }

    /// Plays once without learning, so that the first samples are normalised like all later ones.
    fn meet_observations(&mut self) -> Result<(), LearnError> {
        self.play()?;
        for group in &self.groups {
            self.normalizer.update(&group.buffer.raw)?;
        }
        self.stale = true;
        Ok(())
    }

    fn play(&mut self) -> Result<(), LearnError> {
        if self.is_between_rounds() || self.stale {
            // A state from within a round is played on from streams that no round has.
            let (seed, part) = match self.is_between_rounds() {
                true => (self.plan.seed, self.iteration / self.plan.round.max(1)),
                false => (!self.plan.seed, self.iteration),
            };
            self.stale = false;
            self.groups
                .par_iter_mut()
                .for_each(|group| group.restart(seed, part, &self.starts));
        }
        let normalizer = self.normalizer.frozen(OBSERVATION_LIMIT);
        let actor = Actor {
            policy: self.learner.policy(),
            parameters: self.learner.parameters(),
            normalizer: &normalizer,
            starts: &self.starts,
        };
        let steps = self.plan.horizon;
        self.groups
            .par_iter_mut()
            .try_for_each(|group| group.collect(steps, &actor))
    }

    fn gather(&mut self) -> Result<(), LearnError> {
        let batch = &mut self.batch;
        for values in [
            &mut batch.observations,
            &mut batch.actions,
            &mut batch.log_probs,
            &mut batch.values,
        ] {
            values.clear();
        }
        batch.advantages.clear();
        batch.returns.clear();
        for group in &self.groups {
            let from = &group.buffer;
            batch.observations.extend_from_slice(&from.observations);
            batch.actions.extend_from_slice(&from.actions);
            batch.log_probs.extend_from_slice(&from.log_probs);
            batch.values.extend_from_slice(&from.values);
            let start = batch.advantages.len();
            batch.advantages.resize(start + from.rewards.len(), 0.0);
            batch.returns.resize(start + from.rewards.len(), 0.0);
            let rollout = Trajectories {
                environments: from.next_values.len(),
                rewards: &from.rewards,
                values: &from.values,
                ends: &from.ends,
                final_values: &from.final_values,
                next_values: &from.next_values,
            };
            let (advantage, value) = (&mut batch.advantages[start..], &mut batch.returns[start..]);
            advantages(
                &rollout,
                self.plan.ppo.gamma,
                self.plan.ppo.lambda,
                advantage,
                value,
            )?;
        }
        Ok(())
    }

    fn metrics(&self, update: UpdateStats, action_std: f64) -> Metrics {
        let buffers = || self.groups.iter().map(|group| &group.buffer);
        let episodes: Vec<_> = buffers().flat_map(|b: &Buffer| &b.episodes).collect();
        let mean = |value: &dyn Fn(&Episode) -> f64| {
            let sum: f64 = episodes.iter().map(|episode| value(episode)).sum();
            (!episodes.is_empty()).then(|| sum / episodes.len() as f64)
        };
        let steps = buffers().map(|b| b.ends.len()).sum::<usize>().max(1) as f64;
        let has = self.plan.task.rewards.kernels.has();
        let terms = TERM_NAMES.iter().enumerate().filter(|(i, _)| has[*i]);
        let reward_terms = terms.map(|(i, name)| {
            let sum: f64 = buffers().map(|b| b.terms[i]).sum();
            ((*name).to_owned(), sum / steps)
        });
        Metrics {
            iteration: self.iteration,
            samples: self.samples(),
            episode_return: mean(&|e| f64::from(e.reward)),
            normalized_return: mean(&|e| f64::from(e.reward) / e.possible),
            episode_length: mean(&|e| f64::from(e.steps) * self.control_dt),
            episodes: episodes.len() as u64,
            update,
            action_std,
            reward_terms: reward_terms.collect(),
        }
    }
}

/// Where episodes of these references begin.
fn starts(references: &[Arc<Reference>], task: &Setting) -> Starts {
    let control_dt = task.physics.control_dt();
    let span = |reference: &Arc<Reference>| Span {
        duration: reference.duration(),
        last_start: reference.last_start(control_dt),
        wraps: reference.loop_mode() == LoopMode::Wrap,
    };
    let spans: Vec<Span> = references.iter().map(span).collect();
    Starts::new(
        &spans,
        task.start_anywhere,
        task.adaptive_starts,
        control_dt,
    )
}

/// Contact links of the motions, which must be the same for all.
fn contacts(references: &[Arc<Reference>]) -> Result<usize, TrainError> {
    let first = references.first().ok_or(TrainError::NoMotion)?;
    match references
        .iter()
        .find(|r| r.contact_links != first.contact_links)
    {
        Some(other) => Err(TrainError::OtherContacts {
            first: first.name.clone(),
            other: other.name.clone(),
        }),
        None => Ok(first.contact_links.len()),
    }
}
