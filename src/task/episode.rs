//! An episode, kept step by step for measures and replays.

use super::dynamics::Dynamics;
use super::step::{EpisodeStart, Failure, Outcome, ReferenceState, TermValues};
use crate::sim::LinkState;
use nalgebra::Vector3;

/// Agent and reference at the end of one control step.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Time in the task's motion, seconds.
    pub time: f64,
    /// The agent, one state per link.
    pub agent: Vec<LinkState>,
    /// What the agent should be like, where the task has a reference.
    pub reference: Option<ReferenceState>,
    /// Centre of mass and momenta of the agent.
    pub dynamics: Dynamics,
    /// One per [`super::Task::contact_bodies`]: whether the agent presses on the ground with it.
    pub contacts: Vec<bool>,
    /// What the reward is made of, in the order of [`super::Task::reward_terms`].
    pub terms: TermValues,
    /// In [0, 1].
    pub reward: f32,
    /// Impulse of the shove on the trunk that the step began with, N·s, world axes.
    pub push: Option<Vector3<f32>>,
}

/// An episode.
#[derive(Clone, Debug)]
pub struct Episode {
    /// How it started.
    pub start: EpisodeStart,
    /// Frames per second.
    pub control_hz: f64,
    /// The end of every control step.
    pub frames: Vec<Frame>,
    /// Steps that the episode would have without a failure; in a sequence, those of the cases that were begun.
    pub possible: usize,
    /// Frames before a failure; if there is one, the last frame shows it.
    pub survived: usize,
    /// Why it failed, if it did.
    pub failure: Option<Failure>,
}

impl Episode {
    /// An episode of so many `possible` steps that hasn't taken one yet.
    pub fn new(start: EpisodeStart, control_hz: f64, possible: usize) -> Self {
        Self {
            start,
            control_hz,
            frames: Vec::new(),
            possible,
            survived: 0,
            failure: None,
        }
    }

    /// Keeps the frame at the end of a step, and how the episode stands after it.
    pub fn keep(&mut self, frame: Frame, outcome: Outcome) {
        self.frames.push(frame);
        match outcome {
            Outcome::Failed(failure) => self.failure = Some(failure),
            _ => self.survived += 1,
        }
    }

    /// Share of the possible steps that were taken before a failure, from 0 to 1.
    pub fn survival(&self) -> f64 {
        (self.survived as f64 / self.possible.max(1) as f64).min(1.0)
    }

    /// Sum of the rewards, divided by the steps that the episode would have without a failure: from 0 to 1.
    pub fn normalized_return(&self) -> f64 {
        let sum: f64 = self.frames.iter().map(|f| f64::from(f.reward)).sum();
        sum / self.possible.max(1) as f64
    }
}

/// A number that says how well an agent performs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// Its field in JSON; ends with the unit where there is one.
    pub name: &'static str,
    /// What it is, in words.
    pub label: &'static str,
    /// The unit of `value`.
    pub unit: Unit,
    /// How much it is; not a number where it isn't defined, which is `null` in JSON.
    pub value: f64,
    /// Which values are good.
    pub good: Good,
    /// From which value on it is good enough, where one is known. It stands beside where it comes from.
    pub enough: Option<f64>,
    /// Whether it also means something for an agent that is disturbed or starts from rest, which has more to do than to
    /// perform its task.
    pub holds_disturbed: bool,
}

impl Measure {
    /// A number that only undisturbed agents are measured by, a score of which none is better than another.
    pub fn new(name: &'static str, label: &'static str, value: f64) -> Self {
        Self {
            name,
            label,
            unit: Unit::Score,
            value,
            good: Good::Neither,
            enough: None,
            holds_disturbed: false,
        }
    }

    /// The same measure with its unit, and with which values are good.
    #[must_use]
    pub fn good(self, good: Good, unit: Unit) -> Self {
        Self { unit, good, ..self }
    }

    /// The same measure, good enough from this value on.
    #[must_use]
    pub fn enough(self, value: f64) -> Self {
        Self {
            enough: Some(value),
            ..self
        }
    }

    /// Whether it is good enough; what has no such value, or is no number, is not.
    pub fn is_enough(&self) -> bool {
        let Some(enough) = self.enough else {
            return false;
        };
        match self.good {
            Good::High => self.value >= enough,
            Good::Low => self.value <= enough,
            Good::Near(_) | Good::Neither => false,
        }
    }

    /// The same measure, which also means something for disturbed agents.
    #[must_use]
    pub fn holding_disturbed(self) -> Self {
        Self {
            holds_disturbed: true,
            ..self
        }
    }
}

/// The unit of a [`Measure`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// From 0 to 1, to be shown in per cent.
    Share,
    /// A score without a unit.
    Score,
    /// Millimetres.
    Millimeters,
    /// Metres.
    Meters,
    /// Metres per second.
    MetersPerSecond,
    /// Radians.
    Radians,
    /// Degrees.
    Degrees,
    /// Seconds.
    Seconds,
}

/// Which values of a [`Measure`] are good.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Good {
    /// The larger the better.
    High,
    /// The smaller the better.
    Low,
    /// Near this value.
    Near(f64),
    /// None is better than another.
    Neither,
}

/// The mean, 0 of nothing.
pub(crate) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| {
        (sum + value, count + 1)
    });
    if count == 0 { 0.0 } else { sum / count as f64 }
}
