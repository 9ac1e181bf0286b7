//! When an episode has failed.

use super::settings::Terminations;
use crate::sim::LinkState;
use crate::task::model::CharacterModel;
use crate::task::step::Failure;

/// Distance of the link that is furthest from its reference, metres.
pub fn furthest(links: &[LinkState], reference: &[LinkState]) -> f32 {
    links
        .iter()
        .zip(reference)
        .map(|(a, b)| (a.pose.translation.vector - b.pose.translation.vector).norm())
        .fold(0.0, f32::max)
}

/// Which of the rules an agent has broken, if any. `touching` says of each body that can touch the ground
/// whether it does, `may_touch` whether it may, and `reward` is that of the step.
pub fn failure(
    rules: &Terminations,
    links: &[LinkState],
    reference: &[LinkState],
    touching: &[bool],
    may_touch: &[bool],
    reward: f32,
) -> Option<Failure> {
    let lost = |most: f32| furthest(links, reference) > most;
    if rules.distance.is_some_and(lost) {
        return Some(Failure::Distance);
    }
    let fell = || {
        let mut each = touching.iter().zip(may_touch);
        each.any(|(touches, may)| *touches && !may)
    };
    if rules.fall && fell() {
        return Some(Failure::Fall);
    }
    rules
        .reward
        .filter(|least| reward < *least)
        .map(|_| Failure::Reward)
}

/// Mean distance of all bodies, welded ones included, from those of the reference, metres.
pub fn mean_distance(model: &CharacterModel, links: &[LinkState], reference: &[LinkState]) -> f32 {
    let sum: f32 = model
        .positions(links)
        .zip(model.positions(reference))
        .map(|(p, q)| (p - q).norm())
        .sum();
    sum / model.character.bodies.len() as f32
}
