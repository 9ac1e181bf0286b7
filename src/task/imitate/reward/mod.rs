//! Reward terms: each is exp(−error) in (0, 1]. Which errors, and how they are weighed in the exponent, is a choice of
//! [`Kernels`].

mod booth;
mod deepmimic;
mod program;
mod tracking;

use super::settings::Rewards;
use crate::sim::LinkState;
use crate::task::dynamics::Dynamics;
use crate::task::model::CharacterModel;
use crate::task::step::TermValues;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Names of the terms, in the order of [`Terms::values`].
pub const TERM_NAMES: [&str; 10] = [
    "pose",
    "velocity",
    "position",
    "root",
    "root_velocity",
    "com",
    "angular_momentum",
    "end_effector",
    "end_effector_velocity",
    "com_position",
];

/// Which errors the terms are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kernels {
    /// Our own: means over links, so that no scale depends on how many there are.
    #[default]
    Tracking,
    /// Peng et al. 2018, "DeepMimic", section 5.1: sums over joints.
    Deepmimic,
    /// The program published with that paper: sums over weighted joints, and a term for the root.
    DeepmimicProgram,
    /// The program published with Booth & Ivanov 2020: sums over bodies.
    Booth2020,
}

impl std::fmt::Display for Kernels {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Kernels::Tracking => "tracking",
            Kernels::Deepmimic => "deepmimic",
            Kernels::DeepmimicProgram => "deepmimic-program",
            Kernels::Booth2020 => "booth2020",
        })
    }
}

impl Kernels {
    /// In the order of [`TERM_NAMES`]: whether these kernels have that term.
    pub fn has(self) -> [bool; TERM_NAMES.len()] {
        let names: &[&str] = match self {
            Kernels::Tracking => &TERM_NAMES[..7],
            Kernels::Deepmimic => &["pose", "velocity", "end_effector", "com_position"],
            Kernels::DeepmimicProgram => &["pose", "velocity", "root", "com", "end_effector"],
            Kernels::Booth2020 => &[
                "pose",
                "velocity",
                "com",
                "angular_momentum",
                "end_effector",
                "end_effector_velocity",
                "com_position",
            ],
        };
        TERM_NAMES.map(|name| names.contains(&name))
    }
}

/// The terms of one step, each in (0, 1]; those that the kernels don't have are 0. Formulas and scales are those of
/// [`Kernels::Tracking`]; [`terms`] says where the others differ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    /// Mean squared joint rotation error, rad²; k = 6.
    pub pose: f32,
    /// Mean squared difference of the links' angular velocities, (rad/s)²; k = 0.1.
    pub velocity: f32,
    /// Mean squared error of link positions relative to the root, m²; k = 60.
    pub position: f32,
    /// Squared root position error, m² (k = 10), and squared root rotation error, rad² (k = 2).
    pub root: f32,
    /// Squared root velocity error, (m/s)² (k = 1), and (rad/s)² (k = 0.1).
    pub root_velocity: f32,
    /// Squared error of the centre of mass's velocity, (m/s)²; k = 2.
    pub com: f32,
    /// Squared error of the angular momentum over [`CharacterModel::momentum_scale`]; k = 100.
    pub angular_momentum: f32,
    /// Summed squared error of the world positions of hands and feet, m².
    pub end_effector: f32,
    /// The same of their velocities, (m/s)².
    pub end_effector_velocity: f32,
    /// Squared error of the centre of mass's world position, m².
    pub com_position: f32,
}

impl Terms {
    /// In the order of [`TERM_NAMES`].
    pub fn values(&self) -> [f32; TERM_NAMES.len()] {
        [
            self.pose,
            self.velocity,
            self.position,
            self.root,
            self.root_velocity,
            self.com,
            self.angular_momentum,
            self.end_effector,
            self.end_effector_velocity,
            self.com_position,
        ]
    }

    /// The terms that these kernels have.
    pub fn of(&self, kernels: Kernels) -> TermValues {
        let values = self.values().into_iter().zip(kernels.has());
        values
            .filter(|(_, has)| *has)
            .map(|(value, _)| value)
            .collect()
    }

    /// The weighted sum, divided by the sum of the weights: a reward in (0, 1].
    pub fn total(&self, rewards: &Rewards) -> f32 {
        let weights = rewards.weights();
        let sum: f32 = weights.iter().sum();
        self.values()
            .iter()
            .zip(weights)
            .map(|(value, weight)| value * weight)
            .sum::<f32>()
            / sum
    }
}

/// Compares an agent with its reference; link 0 is the root.
pub fn terms(
    kernels: Kernels,
    model: &CharacterModel,
    agent: (&[LinkState], &Dynamics),
    reference: (&[LinkState], &Dynamics),
) -> Terms {
    match kernels {
        Kernels::Tracking => tracking::terms(model, agent, reference),
        Kernels::Deepmimic => deepmimic::terms(model, agent, reference),
        Kernels::DeepmimicProgram => program::terms(model, agent, reference),
        Kernels::Booth2020 => booth::terms(model, agent, reference),
    }
}

/// Squared angle between the rotations of link `i` relative to its parent, rad²; the root's is against the world.
fn joint_error(
    model: &CharacterModel,
    agent: &[LinkState],
    reference: &[LinkState],
    i: usize,
) -> f32 {
    let (mine, other) = (agent[i].pose.rotation, reference[i].pose.rotation);
    match model.character.links[i].parent {
        Some(p) => {
            let mine = agent[p].pose.rotation.inverse() * mine;
            let other = reference[p].pose.rotation.inverse() * other;
            mine.angle_to(&other).powi(2)
        }
        None => mine.angle_to(&other).powi(2),
    }
}

/// World position (m) and velocity (m/s) of a body's origin.
fn body(model: &CharacterModel, links: &[LinkState], body: usize) -> (Vector3<f32>, Vector3<f32>) {
    let state = model.character.body_state(links, body);
    (state.pose.translation.vector, state.linear)
}

/// Squared errors of positions (m²) and velocities ((m/s)²), summed over bodies.
fn body_errors<'a>(
    model: &CharacterModel,
    agent: &[LinkState],
    reference: &[LinkState],
    bodies: impl Iterator<Item = &'a usize>,
) -> (f32, f32) {
    bodies.fold((0.0, 0.0), |(place, speed), &b| {
        let (mine, other) = (body(model, agent, b), body(model, reference, b));
        let place = place + (mine.0 - other.0).norm_squared();
        (place, speed + (mine.1 - other.1).norm_squared())
    })
}
