//! When an episode has failed.

use super::setting::Terminations;
use crate::sim::LinkState;
use serde::{Deserialize, Serialize};

/// Why an episode failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Failure {
    /// A link strayed too far from its reference.
    Distance,
    /// A link that has no business on the ground touched it.
    Fall,
    /// The reward fell below the threshold.
    Reward,
    /// The simulation diverged.
    Diverged,
}

/// Distance of the link that is furthest from its reference, metres.
pub fn furthest(links: &[LinkState], reference: &[LinkState]) -> f32 {
    links
        .iter()
        .zip(reference)
        .map(|(a, b)| (a.pose.translation.vector - b.pose.translation.vector).norm())
        .fold(0.0, f32::max)
}

/// `contacts` holds one flag per link, `allowed` the links that may stand on the ground.
pub fn failure(
    rules: &Terminations,
    links: &[LinkState],
    reference: &[LinkState],
    contacts: &[bool],
    allowed: &[usize],
    reward: f32,
) -> Option<Failure> {
    let lost = |most: f32| furthest(links, reference) > most;
    if rules.distance.is_some_and(lost) {
        return Some(Failure::Distance);
    }
    let fell = || {
        contacts
            .iter()
            .enumerate()
            .any(|(link, touches)| *touches && !allowed.contains(&link))
    };
    if rules.fall && fell() {
        return Some(Failure::Fall);
    }
    rules
        .reward
        .filter(|least| reward < *least)
        .map(|_| Failure::Reward)
}
