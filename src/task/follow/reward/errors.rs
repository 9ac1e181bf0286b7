//! Errors of an agent against its reference that several kernels are made of.

use crate::sim::LinkState;
use crate::task::model::CharacterModel;
use nalgebra::Vector3;

/// Squared angle between the rotations of link `i` relative to its parent, rad²; the root's is against the world.
pub(super) fn joint_error(
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
pub(super) fn body(
    model: &CharacterModel,
    links: &[LinkState],
    body: usize,
) -> (Vector3<f32>, Vector3<f32>) {
    let state = model.character.body_state(links, body);
    (state.pose.translation.vector, state.linear)
}

/// Squared errors of positions (m²) and velocities ((m/s)²), summed over bodies.
pub(super) fn body_errors<'a>(
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

/// Angular velocity against the parent, in the link's own frame, rad/s; the root's is against the world.
pub(super) fn joint_rate(model: &CharacterModel, links: &[LinkState], i: usize) -> Vector3<f32> {
    let against = model.character.links[i]
        .parent
        .map_or_else(Vector3::zeros, |p| links[p].angular);
    let turn = links[i].pose.rotation;
    turn.inverse_transform_vector(&(links[i].angular - against))
}
