//! The state of Peng et al. 2018, "DeepMimic", section 4, with rotations as two axes as in the authors' program: of 15
//! bodies 227 numbers.

use crate::task::follow::heading;
use crate::task::follow::{ObservationInputs, Writer};
use crate::task::model::CharacterModel;
use nalgebra::Vector3;

pub(super) fn layout(model: &CharacterModel) -> Vec<(&'static str, usize)> {
    let bodies = model.character.bodies.len();
    vec![
        ("phase", 1),
        ("root_height", 1),
        ("body_position", 3 * bodies),
        ("body_rotation", 6 * bodies),
        ("body_velocity", 3 * bodies),
        ("body_angular_velocity", 3 * bodies),
    ]
}

/// Positions from the root, rotations as the directions of their x and z axes, velocities against the world; all in axes along
/// the root's heading.
pub(super) fn observe(model: &CharacterModel, scene: &ObservationInputs, w: &mut Writer) {
    let root = &scene.links[0].pose;
    let turn = heading(&root.rotation).inverse();
    let bodies =
        || (0..model.character.bodies.len()).map(|b| model.character.body_state(scene.links, b));
    // From −1 to 1, about as large as the normalised observations beside it.
    w.one(2.0 * scene.next.phase - 1.0);
    w.one(root.translation.z);
    for body in bodies() {
        w.vector(turn * (body.pose.translation.vector - root.translation.vector));
    }
    for body in bodies() {
        w.vector(turn * (body.pose.rotation * Vector3::x()));
        w.vector(turn * (body.pose.rotation * Vector3::z()));
    }
    bodies().for_each(|body| w.vector(turn * body.linear));
    bodies().for_each(|body| w.vector(turn * body.angular));
}
