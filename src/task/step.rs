//! The values that pass between a task and whoever runs it: how episodes start, what a step gives, how it stands.

use super::disturbance::Perturbations;
use super::dynamics::Dynamics;
use crate::sim::LinkState;
use arrayvec::ArrayVec;
use nalgebra::{Isometry3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Most reward terms that a task can have.
pub const MAX_TERMS: usize = 16;

/// Values of a task's reward terms, in the order of [`Task::reward_terms`](super::Task::reward_terms).
pub type TermValues = ArrayVec<f32, MAX_TERMS>;

/// One named part of an observation or an action.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Block {
    /// What the numbers are.
    pub name: &'static str,
    /// How many there are.
    pub size: usize,
}

/// How many numbers these blocks hold together.
pub fn size(blocks: &[Block]) -> usize {
    blocks.iter().map(|block| block.size).sum()
}

/// Something that a task can be asked to perform and that an evaluation measures by itself, such as one of its motions.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Name of the motion.
    pub name: String,
    /// Seconds from its beginning to its end; `None` where it goes on for ever.
    pub duration_s: Option<f64>,
}

/// What environments are made for. It decides when episodes end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Purpose {
    /// Episodes end by the rules of the task's settings.
    Training,
    /// Episodes end by the same rules for every agent, however it was trained, so that agents can be compared. A case
    /// without an end is performed for so many seconds.
    Evaluation {
        /// Length of an episode of a case that goes on for ever.
        seconds: f64,
    },
    /// The same without a time limit: for replays of several cases and for live players.
    Performance,
}

/// How an episode starts outside training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EpisodeStart {
    /// Number of the [`Case`].
    pub case: usize,
    /// In which state the agent starts.
    pub state: StartState,
    /// The ranges of the disturbances, if there are any, and the seed that decides which the episode gets.
    pub disturbance: Option<(Perturbations, u64)>,
}

impl EpisodeStart {
    /// An undisturbed start of a case in this state.
    pub fn new(case: usize, state: StartState) -> Self {
        Self {
            case,
            state,
            disturbance: None,
        }
    }
}

/// In which state an agent starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartState {
    /// The state of the reference at this share of all possible starts, from 0 to 1.
    Reference(f64),
    /// Standing still in the rest pose, where the case begins.
    Rest,
}

/// What a player asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wish {
    /// Velocity over the ground, world axes, m/s.
    pub velocity: Vector2<f32>,
    /// Direction to face, radians from the world's X axis to the left; `None` to face where it goes.
    pub facing: Option<f32>,
}

/// What a player or a script asks of a character between two control steps.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Input {
    /// Begin the transition into the case of this number at the best moment of the next second.
    Case(usize),
    /// Go and face this way from now on.
    Wish(Wish),
    /// Shove the trunk at the beginning of the next control step: an impulse in world axes, N·s.
    Push(Vector3<f32>),
}

/// How an episode stands after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It goes on.
    Running,
    /// Terminal: nothing more can be earned.
    Failed(Failure),
    /// Terminal: the task was performed to its end.
    Finished,
    /// Cut off by the time limit. The state keeps its value: the episode could have gone on.
    TimeLimit,
}

/// Why an episode failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Failure {
    /// The agent strayed too far from its reference.
    Distance,
    /// A body touched the ground that the reference never puts there.
    Fall,
    /// The reward fell below the threshold.
    Reward,
    /// The simulation diverged.
    Diverged,
}

/// What one control step gave.
#[derive(Clone, Debug)]
pub struct Step {
    /// In [0, 1].
    pub reward: f32,
    /// What the reward is made of.
    pub terms: TermValues,
    /// How the episode stands.
    pub outcome: Outcome,
}

/// What the agent should be like at one moment; empty by default.
#[derive(Clone, Debug, Default)]
pub struct ReferenceState {
    /// One per link of the character.
    pub links: Vec<LinkState>,
    /// Centre of mass and momenta of the reference.
    pub dynamics: Dynamics,
    /// One per [`super::Task::contact_bodies`]: whether the reference stands on the ground with it.
    pub contacts: Vec<bool>,
    /// One per [`super::CharacterModel::contacts`]: whether the agent may touch the ground with it.
    pub may_touch: Vec<bool>,
    /// 0 at the first frame of a cycle, 1 at its last.
    pub phase: f32,
    /// World from anchor, where the anchor is on the ground below the root at the first frame of this cycle, and X points
    /// where the character faced there.
    pub anchor: Isometry3<f32>,
}
