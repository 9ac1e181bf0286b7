//! Reward terms: each is exp(−k · error) in (0, 1], with errors averaged over links so that no scale depends on how
//! many there are.

use super::dynamics::Dynamics;
use super::setting::{Rewards, Stage};
use crate::sim::LinkState;

/// Names of the terms, in the order of [`Terms::values`].
pub const TERM_NAMES: [&str; 7] = [
    "pose",
    "velocity",
    "position",
    "root",
    "root_velocity",
    "com",
    "angular_momentum",
];

/// The terms of one step, each in (0, 1].
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
    /// Squared error of the angular momentum over [`Stage::momentum_scale`]; k = 100.
    pub angular_momentum: f32,
}

impl Terms {
    /// In the order of [`TERM_NAMES`].
    pub fn values(&self) -> [f32; 7] {
        [
            self.pose,
            self.velocity,
            self.position,
            self.root,
            self.root_velocity,
            self.com,
            self.angular_momentum,
        ]
    }

    /// The weighted sum, divided by the sum of the weights: a reward in (0, 1].
    pub fn total(&self, weights: &Rewards) -> f32 {
        let w = [
            weights.pose,
            weights.velocity,
            weights.position,
            weights.root,
            weights.root_velocity,
            weights.com,
            weights.angular_momentum,
        ];
        let sum: f32 = w.iter().sum();
        self.values()
            .iter()
            .zip(w)
            .map(|(value, weight)| value * weight)
            .sum::<f32>()
            / sum
    }
}

/// Compares an agent with its reference; link 0 is the root.
pub fn terms(
    stage: &Stage,
    agent: (&[LinkState], &Dynamics),
    reference: (&[LinkState], &Dynamics),
) -> Terms {
    let (links, dynamics) = agent;
    let (wanted, wanted_dynamics) = reference;
    let (mut pose, mut velocity, mut position) = (0.0, 0.0, 0.0);
    let root = links[0].pose.translation.vector;
    let wanted_root = wanted[0].pose.translation.vector;
    for (i, (a, b)) in links.iter().zip(wanted).enumerate().skip(1) {
        if let Some(p) = stage.character.links[i].parent {
            let mine = links[p].pose.rotation.inverse() * a.pose.rotation;
            let other = wanted[p].pose.rotation.inverse() * b.pose.rotation;
            pose += mine.angle_to(&other).powi(2);
        }
        velocity += (a.angular - b.angular).norm_squared();
        position += ((a.pose.translation.vector - root)
            - (b.pose.translation.vector - wanted_root))
            .norm_squared();
    }
    let n = (links.len().max(2) - 1) as f32;
    let (a, b) = (&links[0], &wanted[0]);
    let root_error = 10.0 * (root - wanted_root).norm_squared()
        + 2.0 * a.pose.rotation.angle_to(&b.pose.rotation).powi(2);
    let root_rate =
        (a.linear - b.linear).norm_squared() + 0.1 * (a.angular - b.angular).norm_squared();
    let momentum =
        (dynamics.angular_momentum - wanted_dynamics.angular_momentum) / stage.momentum_scale;
    Terms {
        pose: (-6.0 * pose / n).exp(),
        velocity: (-0.1 * velocity / n).exp(),
        position: (-60.0 * position / n).exp(),
        root: (-root_error).exp(),
        root_velocity: (-root_rate).exp(),
        com: (-2.0 * (dynamics.com_velocity - wanted_dynamics.com_velocity).norm_squared()).exp(),
        angular_momentum: (-100.0 * momentum.norm_squared()).exp(),
    }
}
