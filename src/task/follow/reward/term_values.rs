//! The reward terms: their names, which kernels have them, and how they make a reward.

use crate::task::step::TermValues;
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
    /// Whether these kernels have each term, in the order of [`TERM_NAMES`].
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
/// [`Kernels::Tracking`]; the functions beside it say where the others differ.
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
    /// Squared error of the angular momentum over [`CharacterModel::momentum_scale`](crate::task::CharacterModel::momentum_scale); k = 100.
    pub angular_momentum: f32,
    /// Summed squared error of the world positions of hands and feet, m².
    pub end_effector: f32,
    /// The same of their velocities, (m/s)².
    pub end_effector_velocity: f32,
    /// Squared error of the centre of mass's world position, m².
    pub com_position: f32,
}

impl Terms {
    /// All terms, in the order of [`TERM_NAMES`].
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

    /// The sum by `weights`, in the order of [`TERM_NAMES`], divided by their sum: a reward in (0, 1].
    pub fn total(&self, weights: [f32; TERM_NAMES.len()]) -> f32 {
        let sum: f32 = weights.iter().sum();
        self.values()
            .iter()
            .zip(weights)
            .map(|(value, weight)| value * weight)
            .sum::<f32>()
            / sum
    }
}
