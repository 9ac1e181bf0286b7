//! A training run: rollouts, advantages, updates, in iterations that read top to bottom.

use super::batch::Batch;
use super::error::{LearnError, check_length};
use super::gae::{Trajectories, advantages};
use super::normalizer::{Normalizer, OBSERVATION_LIMIT};
use super::policy::PolicySpec;
use super::ppo::{Learner, LearnerState};
use super::random::stream;
use super::rollout::{Actor, Buffer, EpisodeTotals, Group};
use super::settings::TrainerSettings;
use super::stats::UpdateStats;
use crate::task::{StartDistribution, Task, size};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What an iteration did.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Metrics {
    /// Iterations done, this one included.
    pub iteration: u64,
    /// Control steps taken so far by all environments together.
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
    /// How the update went.
    #[serde(flatten)]
    pub update: UpdateStats,
    /// Standard deviation of the action noise.
    pub action_std: f64,
    /// Mean of each reward term over all steps, by its name.
    pub reward_terms: BTreeMap<String, f64>,
}

/// What a run is between two rounds.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainerState {
    /// Iterations done.
    pub iteration: u64,
    /// Parameters and optimiser.
    pub learner: LearnerState<f32>,
    /// Statistics of the observations.
    pub normalizer: Normalizer,
    /// Control steps, then failures, of each bin of the [`StartDistribution`]; empty in runs that are older than it.
    pub starts: Vec<f32>,
}

/// A run in memory.
pub struct Trainer {
    settings: TrainerSettings,
    task: Arc<dyn Task>,
    learner: Learner<f32>,
    normalizer: Normalizer,
    groups: Vec<Group>,
    starts: StartDistribution,
    iteration: u64,
    /// The environments haven't begun yet, or stand where an earlier state left them.
    stale: bool,
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
    /// A trainer that hasn't learned anything yet.
    ///
    /// # Errors
    /// A setting out of its range, or a network of no size or too large.
    pub fn new(settings: TrainerSettings, task: Arc<dyn Task>) -> Result<Self, LearnError> {
        settings.check()?;
        let spec = PolicySpec {
            observation: size(task.observation()),
            action: size(task.action()),
            hidden: settings.hidden.clone(),
            activation: settings.activation,
        };
        let learner = Learner::new(settings.ppo.clone(), spec, &mut stream(settings.seed, 0, 0))?;
        let group = |first: usize| {
            let count = settings.group.min(settings.environments - first);
            Group::new(task.as_ref(), first, count)
        };
        let firsts = (0..settings.environments).step_by(settings.group);
        Ok(Trainer {
            normalizer: Normalizer::new(learner.policy().spec().observation),
            starts: task.starts(),
            groups: firsts.map(group).collect(),
            settings,
            task,
            learner,
            iteration: 0,
            stale: true,
            batch: Samples::default(),
        })
    }

    /// How it learns.
    pub fn settings(&self) -> &TrainerSettings {
        &self.settings
    }

    /// What it learns.
    pub fn task(&self) -> &Arc<dyn Task> {
        &self.task
    }

    /// The network and its optimiser.
    pub fn learner(&self) -> &Learner<f32> {
        &self.learner
    }

    /// Statistics of the observations.
    pub fn normalizer(&self) -> &Normalizer {
        &self.normalizer
    }

    /// Iterations done.
    pub fn iteration(&self) -> u64 {
        self.iteration
    }

    /// Control steps taken by all environments together.
    pub fn samples(&self) -> u64 {
        self.iteration * (self.settings.environments * self.settings.horizon) as u64
    }

    /// Whether the samples of the plan are used up.
    pub fn is_done(&self) -> bool {
        self.samples() >= self.settings.samples
    }

    /// Whether the run stands between two rounds, where it can be saved and resumed to the same bits.
    pub fn is_between_rounds(&self) -> bool {
        self.iteration.is_multiple_of(self.settings.round.max(1))
    }

    /// Everything that must be saved to go on later.
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
            check_length("saved starts", state.starts.len(), 2 * self.starts.bins())?;
            self.starts.restore(&state.starts);
        }
        self.learner.restore(state.learner)?;
        self.normalizer = state.normalizer;
        self.iteration = state.iteration;
        self.stale = true;
        Ok(())
    }

    /// Collects samples, learns from them, and says how it went. Runs on the current rayon pool, with the same bits at any size of it.
    ///
    /// # Errors
    /// A quantity that stopped being finite.
    pub fn iterate(&mut self) -> Result<Metrics, LearnError> {
        self.schedule_rate();
        let std = self.schedule_noise();
        if self.normalizer.count == 0.0 {
            self.warm_up_normalizer()?;
        }
        self.collect()?;
        self.assemble_batch()?;
        // Before anything is learned from them: this is where a number that isn't finite is named.
        for group in &self.groups {
            self.normalizer.update(&group.buffer.raw)?;
        }
        self.starts
            .update(self.groups.iter().map(|group| &group.buffer.tally));
        let batch = Batch {
            observations: &self.batch.observations,
            actions: &self.batch.actions,
            log_probs: &self.batch.log_probs,
            values: &self.batch.values,
            advantages: &self.batch.advantages,
            returns: &self.batch.returns,
        };
        let update = self.learner.update(
            &batch,
            &mut stream(self.settings.seed, 0, self.iteration + 1),
        )?;
        self.iteration += 1;
        Ok(self.metrics(update, std))
    }

    /// Share of the plan's samples that are used up.
    fn done(&self) -> f64 {
        (self.samples() as f64 / self.settings.samples.max(1) as f64).min(1.0)
    }

    /// Learning rates come down evenly over the samples.
    fn schedule_rate(&mut self) {
        let share = 1.0 + (self.settings.final_learning_rate - 1.0) * self.done();
        self.learner.anneal(share);
    }

    /// Standard deviation of the action noise in this iteration. Where it isn't learned, it changes evenly over the samples.
    fn schedule_noise(&mut self) -> f64 {
        let done = self.done();
        let std = self.settings.ppo.initial_std * (1.0 + (self.settings.final_std - 1.0) * done);
        if self.settings.ppo.learn_std {
            return self.learner.mean_std();
        }
        self.learner.set_std(std);
        std
    }

    /// Collects samples once without learning, so that the first samples are normalised like all later ones.
    fn warm_up_normalizer(&mut self) -> Result<(), LearnError> {
        self.collect()?;
        for group in &self.groups {
            self.normalizer.update(&group.buffer.raw)?;
        }
        self.stale = true;
        Ok(())
    }

    /// Takes the iteration's steps in all environments, a group per piece of parallel work.
    fn collect(&mut self) -> Result<(), LearnError> {
        if self.is_between_rounds() || self.stale {
            // A run that was saved within a round (when its samples were used up) begins episodes from streams that no round
            // has: those of the inverted seed.
            let (seed, part) = match self.is_between_rounds() {
                true => (
                    self.settings.seed,
                    self.iteration / self.settings.round.max(1),
                ),
                false => (!self.settings.seed, self.iteration),
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
        let steps = self.settings.horizon;
        self.groups
            .par_iter_mut()
            .try_for_each(|group| group.collect(steps, &actor))
    }

    /// Joins the groups' samples, always in the order of the groups, and computes advantages and returns.
    fn assemble_batch(&mut self) -> Result<(), LearnError> {
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
            let ppo = &self.settings.ppo;
            let advantage = &mut batch.advantages[start..];
            let returns = &mut batch.returns[start..];
            advantages(&rollout, ppo.gamma, ppo.lambda, advantage, returns)?;
        }
        Ok(())
    }

    fn metrics(&self, update: UpdateStats, action_std: f64) -> Metrics {
        let buffers = || self.groups.iter().map(|group| &group.buffer);
        let episodes: Vec<_> = buffers().flat_map(|b: &Buffer| &b.episodes).collect();
        let mean = |value: &dyn Fn(&EpisodeTotals) -> f64| {
            let sum: f64 = episodes.iter().map(|episode| value(episode)).sum();
            (!episodes.is_empty()).then(|| sum / episodes.len() as f64)
        };
        let steps = buffers().map(|b| b.ends.len()).sum::<usize>().max(1) as f64;
        let control_dt = 1.0 / self.task.control_hz();
        let terms = self.task.reward_terms().iter().enumerate();
        let reward_terms = terms.map(|(i, name)| {
            let sum: f64 = buffers().map(|b| b.terms[i]).sum();
            ((*name).to_owned(), sum / steps)
        });
        Metrics {
            iteration: self.iteration,
            samples: self.samples(),
            episode_return: mean(&|e| f64::from(e.reward)),
            normalized_return: mean(&|e| f64::from(e.reward) / e.possible),
            episode_length: mean(&|e| f64::from(e.steps) * control_dt),
            episodes: episodes.len() as u64,
            update,
            action_std,
            reward_terms: reward_terms.collect(),
        }
    }
}
