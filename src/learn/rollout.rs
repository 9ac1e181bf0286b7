//! Environments acting under the current policy, in groups that share one network call per step.
//!
//! A group is the unit of parallel work. Which environments it holds depends on the configuration alone, never on
//! the number of threads, and every environment has its own random stream: so the samples are the same everywhere.

use super::random::{stream, uniform};
use super::starts::{Place, Starts, Tally};
use super::{ActWorkspace, FrozenNormalizer, LearnError, Policy, StepEnd, fill_normal};
use crate::task::{Imitate, Outcome, Reference, Setting, Stage, TERM_NAMES};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::sync::Arc;

/// What the environments of a group act with.
pub(super) struct Actor<'a> {
    pub policy: &'a Policy,
    pub parameters: &'a [f32],
    pub normalizer: &'a FrozenNormalizer<f32>,
    pub starts: &'a Starts,
}

/// Samples of one iteration; `[steps, environments]` row-major, observations and actions a row more.
#[derive(Default)]
pub(super) struct Buffer {
    /// As the environments gave them.
    pub raw: Vec<f32>,
    /// As the network saw them.
    pub observations: Vec<f32>,
    pub actions: Vec<f32>,
    pub log_probs: Vec<f32>,
    pub values: Vec<f32>,
    pub rewards: Vec<f32>,
    pub ends: Vec<StepEnd>,
    pub final_values: Vec<f32>,
    /// `[environments]`.
    pub next_values: Vec<f32>,
    /// Every episode that ended.
    pub episodes: Vec<Episode>,
    /// By the bins of [`Starts`].
    pub tally: Tally,
    /// Sums over all steps, in the order of [`TERM_NAMES`].
    pub terms: [f64; TERM_NAMES.len()],
}

impl Buffer {
    fn clear(&mut self, bins: usize) {
        for values in [
            &mut self.raw,
            &mut self.observations,
            &mut self.actions,
            &mut self.log_probs,
        ] {
            values.clear();
        }
        for values in [
            &mut self.values,
            &mut self.rewards,
            &mut self.final_values,
            &mut self.next_values,
        ] {
            values.clear();
        }
        self.ends.clear();
        self.episodes.clear();
        self.tally.clear(bins);
        self.terms = [0.0; TERM_NAMES.len()];
    }
}

/// How an episode went.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Episode {
    /// Sum of rewards.
    pub reward: f32,
    pub steps: u32,
    /// Steps that it would have had without failing.
    pub possible: f64,
}

/// One environment, its random stream and its running episode.
struct Player {
    env: Imitate,
    /// Which reference it imitates, and which one it is led to.
    motion: usize,
    upcoming: usize,
    number: u64,
    rng: ChaCha8Rng,
    episode: Episode,
    /// Seconds of the episode at which another motion follows.
    next_change: f64,
}

/// Environments that step together.
pub(super) struct Group {
    players: Vec<Player>,
    references: Arc<[Arc<Reference>]>,
    transitions_s: Option<[f64; 2]>,
    /// Current raw observations, `[environments, observation]`.
    current: Vec<f32>,
    normal: Vec<f32>,
    noise: Vec<f32>,
    workspace: ActWorkspace<f32>,
    pub buffer: Buffer,
}

impl Group {
    /// Environments number `first` to `first + count`.
    pub fn new(
        stage: &Arc<Stage>,
        references: &Arc<[Arc<Reference>]>,
        setting: &Setting,
        first: usize,
        count: usize,
    ) -> Self {
        let players: Vec<Player> = (first..first + count)
            .map(|number| Player {
                env: Imitate::new(stage.clone(), references[0].clone(), setting),
                motion: 0,
                upcoming: 0,
                number: number as u64,
                rng: ChaCha8Rng::seed_from_u64(0),
                episode: Episode::default(),
                next_change: f64::INFINITY,
            })
            .collect();
        let width = players[0].env.observation_size();
        Group {
            current: vec![0.0; count * width],
            normal: vec![0.0; count * width],
            noise: vec![0.0; count * players[0].env.action_size()],
            players,
            references: references.clone(),
            transitions_s: setting.transitions_s.filter(|_| references.len() > 1),
            workspace: ActWorkspace::default(),
            buffer: Buffer::default(),
        }
    }

    /// Starts every environment anew, from a random stream that `seed`, `round` and its number determine alone.
    pub fn restart(&mut self, seed: u64, round: u64, starts: &Starts) {
        let width = self.width();
        for (player, row) in self
            .players
            .iter_mut()
            .zip(self.current.chunks_exact_mut(width))
        {
            player.rng = stream(seed, player.number + 1, round);
            player.begin(starts, &self.references, self.transitions_s);
            player.env.observe(row);
        }
    }

    /// Plays `steps` steps in every environment and keeps the samples.
    pub fn collect(&mut self, steps: usize, actor: &Actor) -> Result<(), LearnError> {
        self.buffer.clear(actor.starts.bins());
        for _ in 0..steps {
            self.act(actor)?;
            self.step(actor)?;
        }
        let judged = actor.policy.values(
            actor.parameters,
            &self.buffer.observations,
            &mut self.workspace,
        )?;
        self.buffer.values.extend_from_slice(judged);
        actor.normalizer.apply(&self.current, &mut self.normal)?;
        let values = actor
            .policy
            .values(actor.parameters, &self.normal, &mut self.workspace)?;
        self.buffer.next_values.extend_from_slice(values);
        Ok(())
    }

    fn width(&self) -> usize {
        self.current.len() / self.players.len()
    }

    fn act(&mut self, actor: &Actor) -> Result<(), LearnError> {
        let actions = self.noise.len() / self.players.len();
        for (player, noise) in self
            .players
            .iter_mut()
            .zip(self.noise.chunks_exact_mut(actions))
        {
            fill_normal(noise, &mut player.rng);
        }
        actor.normalizer.apply(&self.current, &mut self.normal)?;
        let acted = actor.policy.act(
            actor.parameters,
            &self.normal,
            &self.noise,
            &mut self.workspace,
        )?;
        let buffer = &mut self.buffer;
        buffer.raw.extend_from_slice(&self.current);
        buffer.observations.extend_from_slice(&self.normal);
        buffer.actions.extend_from_slice(acted.actions);
        buffer.log_probs.extend_from_slice(acted.log_probs);
        Ok(())
    }

    fn step(&mut self, actor: &Actor) -> Result<(), LearnError> {
        let width = self.width();
        let first = self.buffer.actions.len() - self.noise.len();
        let bins = self.players.iter().map(|p| actor.starts.bin(p.place()));
        let bins: Vec<usize> = bins.collect();
        let agents = self.players.iter_mut().map(|player| &mut player.env);
        let steps = Imitate::step_together(agents, &self.buffer.actions[first..]);
        let players = self.players.iter_mut().zip(bins).zip(steps);
        for (i, ((player, bin), step)) in players.enumerate() {
            self.buffer.tally.steps[bin] += 1;
            self.buffer.tally.failures[bin] +=
                u32::from(matches!(step.outcome, Outcome::Failed(_)));
            let row = &mut self.current[i * width..(i + 1) * width];
            let outcome =
                player.change_in_time(step.outcome, self.transitions_s, actor, &self.references);
            player.env.observe(row);
            player.episode.reward += step.reward;
            player.episode.steps += 1;
            for (sum, term) in self.buffer.terms.iter_mut().zip(step.terms.values()) {
                *sum += f64::from(term);
            }
            let (end, final_value) = match outcome {
                Outcome::Running => (StepEnd::Continues, 0.0),
                Outcome::Failed(_) | Outcome::Finished => (StepEnd::Terminated, 0.0),
                Outcome::TimeLimit => {
                    let seen = &mut self.normal[..width];
                    actor.normalizer.apply(row, seen)?;
                    let value = actor
                        .policy
                        .values(actor.parameters, seen, &mut self.workspace)?[0];
                    (StepEnd::Truncated, value)
                }
            };
            self.buffer.rewards.push(step.reward);
            self.buffer.ends.push(end);
            self.buffer.final_values.push(final_value);
            if outcome != Outcome::Running {
                self.buffer.episodes.push(player.episode);
                player.begin(actor.starts, &self.references, self.transitions_s);
                player.env.observe(row);
            }
        }
        Ok(())
    }
}

impl Player {
    fn place(&self) -> Place {
        Place {
            motion: self.motion,
            time: self.env.time(),
        }
    }

    /// Goes over into another motion when it is time for that, or where this one ends.
    fn change_in_time(
        &mut self,
        outcome: Outcome,
        transitions_s: Option<[f64; 2]>,
        actor: &Actor,
        references: &[Arc<Reference>],
    ) -> Outcome {
        self.note_arrival();
        let due = outcome == Outcome::Running && self.env.elapsed() >= self.next_change;
        if transitions_s.is_none() || !(due || outcome == Outcome::Finished) {
            return outcome;
        }
        self.upcoming = actor.starts.draw(&mut self.rng).motion;
        let elapsed = self.env.elapsed();
        self.env.lead_to(&references[self.upcoming]);
        self.note_arrival();
        self.plan_change(transitions_s);
        self.next_change += elapsed;
        Outcome::Running
    }

    fn note_arrival(&mut self) {
        if !self.env.is_leading() {
            self.motion = self.upcoming;
        }
    }

    fn plan_change(&mut self, transitions_s: Option<[f64; 2]>) {
        if let Some([least, most]) = transitions_s {
            self.next_change = least + uniform(&mut self.rng) * (most - least);
            self.episode.possible = self.env.longest_steps();
        }
    }

    fn begin(
        &mut self,
        starts: &Starts,
        references: &[Arc<Reference>],
        transitions_s: Option<[f64; 2]>,
    ) {
        let Place { motion, time } = starts.draw(&mut self.rng);
        (self.motion, self.upcoming) = (motion, motion);
        self.env.imitate(&references[motion], time);
        if self.env.is_perturbed() {
            self.env.perturb(self.rng.next_u64());
        }
        self.episode = Episode {
            possible: self.env.possible_steps(),
            ..Episode::default()
        };
        self.plan_change(transitions_s);
    }
}
