//! Environments acting under the current policy, in groups that share one network call per step.
//!
//! A group is the unit of parallel work. Which environments it holds depends on the settings alone, never on the number of
//! threads, and every environment has its own random stream: so the samples are the same everywhere.

use super::error::LearnError;
use super::gae::StepEnd;
use super::normalizer::FrozenNormalizer;
use super::policy::{ActWorkspace, Policy, fill_normal};
use super::random::stream;
use crate::task::{
    Draws, Environment, Outcome, Purpose, StartDistribution, Step, Stepping, Tally, Task, size,
    step_together,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// What the environments of a group act with.
pub(super) struct Actor<'a> {
    pub policy: &'a Policy,
    pub parameters: &'a [f32],
    pub normalizer: &'a FrozenNormalizer<f32>,
    pub starts: &'a StartDistribution,
}

/// Samples of one iteration: `[steps, environments]` row-major, observations and actions with a row of numbers for each.
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
    pub episodes: Vec<EpisodeTotals>,
    /// Steps and failures in each bin of the [`StartDistribution`].
    pub tally: Tally,
    /// Sums over all steps, one per reward term of the task.
    pub terms: Vec<f64>,
}

impl Buffer {
    /// Empties the buffer for a task of so many start bins and reward terms.
    fn clear(&mut self, bins: usize, terms: usize) {
        for values in [
            &mut self.raw,
            &mut self.observations,
            &mut self.actions,
            &mut self.log_probs,
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
        self.terms.clear();
        self.terms.resize(terms, 0.0);
    }
}

/// How an episode went.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EpisodeTotals {
    /// Sum of rewards.
    pub reward: f32,
    /// Control steps taken.
    pub steps: u32,
    /// Steps that it would have had without failing.
    pub possible: f64,
}

/// One environment of a group, its random stream and its running episode.
struct Member {
    environment: Box<dyn Environment>,
    number: u64,
    rng: ChaCha8Rng,
    totals: EpisodeTotals,
}

/// Environments that step together.
pub(super) struct Group {
    members: Vec<Member>,
    terms: usize,
    /// Current raw observations, `[environments, observation]`.
    current: Vec<f32>,
    /// The same, normalised.
    normal: Vec<f32>,
    /// Standard normal deviates of the next actions, `[environments, action]`.
    noise: Vec<f32>,
    workspace: ActWorkspace<f32>,
    pub buffer: Buffer,
}

impl Group {
    /// Environments number `first` to `first + count` of a task.
    pub fn new(task: &dyn Task, first: usize, count: usize) -> Self {
        let member = |number: usize| Member {
            environment: task.environment(Purpose::Training),
            number: number as u64,
            rng: ChaCha8Rng::seed_from_u64(0),
            totals: EpisodeTotals::default(),
        };
        let width = size(task.observation());
        Group {
            members: (first..first + count).map(member).collect(),
            terms: task.reward_terms().len(),
            current: vec![0.0; count * width],
            normal: vec![0.0; count * width],
            noise: vec![0.0; count * size(task.action())],
            workspace: ActWorkspace::default(),
            buffer: Buffer::default(),
        }
    }

    /// Starts every environment anew, from a random stream that `seed`, `round` and its number determine alone.
    pub fn restart(&mut self, seed: u64, round: u64, starts: &StartDistribution) {
        let width = self.width();
        let rows = self.current.chunks_exact_mut(width);
        for (member, row) in self.members.iter_mut().zip(rows) {
            member.rng = stream(seed, member.number + 1, round);
            member.start(starts);
            member.environment.observe(row);
        }
    }

    /// Takes `steps` steps in every environment and keeps the samples.
    pub fn collect(&mut self, steps: usize, actor: &Actor) -> Result<(), LearnError> {
        self.buffer.clear(actor.starts.bins(), self.terms);
        for _ in 0..steps {
            self.act(actor)?;
            self.step(actor)?;
        }
        // The parameters don't change within an iteration, so all its values can be computed at the end, many rows at once.
        let values = actor.policy.values(
            actor.parameters,
            &self.buffer.observations,
            &mut self.workspace,
        )?;
        self.buffer.values.extend_from_slice(values);
        actor.normalizer.apply(&self.current, &mut self.normal)?;
        let values = actor
            .policy
            .values(actor.parameters, &self.normal, &mut self.workspace)?;
        self.buffer.next_values.extend_from_slice(values);
        Ok(())
    }

    /// Numbers in an observation.
    fn width(&self) -> usize {
        self.current.len() / self.members.len()
    }

    /// Draws an action for every environment.
    fn act(&mut self, actor: &Actor) -> Result<(), LearnError> {
        let actions = self.noise.len() / self.members.len();
        let rows = self.noise.chunks_exact_mut(actions);
        for (member, noise) in self.members.iter_mut().zip(rows) {
            // From each environment's own stream, so that how environments are grouped changes no draw.
            fill_normal(noise, &mut member.rng);
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

    /// Takes a step with the actions drawn last, and keeps what it led to.
    fn step(&mut self, actor: &Actor) -> Result<(), LearnError> {
        let first = self.buffer.actions.len() - self.noise.len();
        // A failure counts where the step began.
        let bin = |member: &Member| actor.starts.bin(member.environment.moment());
        let bins: Vec<usize> = self.members.iter().map(bin).collect();
        let stepping = self.members.iter_mut().map(|member| member.stepping(actor));
        let mut stepping: Vec<Stepping> = stepping.collect();
        let steps = step_together(&mut stepping, &self.buffer.actions[first..]);
        for (i, (bin, step)) in bins.into_iter().zip(steps).enumerate() {
            self.buffer.tally.steps[bin] += 1;
            self.buffer.tally.failures[bin] +=
                u32::from(matches!(step.outcome, Outcome::Failed(_)));
            self.keep(i, &step, actor)?;
        }
        Ok(())
    }

    /// Keeps the step that environment number `i` of the group took, and starts its next episode where that is due.
    fn keep(&mut self, i: usize, step: &Step, actor: &Actor) -> Result<(), LearnError> {
        let width = self.width();
        let row = &mut self.current[i * width..(i + 1) * width];
        let (member, buffer) = (&mut self.members[i], &mut self.buffer);
        member.environment.observe(row);
        member.totals.reward += step.reward;
        member.totals.steps += 1;
        for (sum, term) in buffer.terms.iter_mut().zip(&step.terms) {
            *sum += f64::from(*term);
        }
        let (end, final_value) = match step.outcome {
            Outcome::Running => (StepEnd::Continues, 0.0),
            Outcome::Failed(_) | Outcome::Finished => (StepEnd::Terminated, 0.0),
            // The episode would have gone on: what the critic expects from here replaces the steps that were cut off (Pardo et
            // al. 2018, "Time limits in reinforcement learning").
            Outcome::TimeLimit => {
                let seen = &mut self.normal[..width];
                actor.normalizer.apply(row, seen)?;
                let value = actor
                    .policy
                    .values(actor.parameters, seen, &mut self.workspace)?[0];
                (StepEnd::Truncated, value)
            }
        };
        buffer.rewards.push(step.reward);
        buffer.ends.push(end);
        buffer.final_values.push(final_value);
        if step.outcome != Outcome::Running {
            buffer.episodes.push(member.totals);
            member.start(actor.starts);
            member.environment.observe(row);
        }
        Ok(())
    }
}

impl Member {
    fn stepping<'a>(&'a mut self, actor: &Actor<'a>) -> Stepping<'a> {
        let draws = Draws {
            starts: actor.starts,
            rng: &mut self.rng,
        };
        (self.environment.as_mut(), Some(draws))
    }

    fn start(&mut self, starts: &StartDistribution) {
        self.environment.start(&mut Draws {
            starts,
            rng: &mut self.rng,
        });
        self.totals = EpisodeTotals {
            possible: self.environment.possible_steps(),
            ..EpisodeTotals::default()
        };
    }
}
