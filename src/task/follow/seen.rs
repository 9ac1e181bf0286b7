//! What a policy sees of an agent, of what it lacks against its reference, and of where the reference is going; all in the root's
//! frame.

use super::inputs::{ObservationInputs, Writer};
use crate::sim::LinkState;
use crate::task::model::CharacterModel;
use crate::task::step::ReferenceState;
use nalgebra::{UnitQuaternion, Vector3};

/// A name and how many numbers it stands for.
pub type Named = (&'static str, usize);

/// The blocks that [`agent`] writes.
pub fn agent_layout(model: &CharacterModel, contacts: usize) -> Vec<Named> {
    let dof = model.character.dof;
    vec![
        ("root_height", 1),
        ("up", 3),
        ("root_velocity", 3),
        ("root_angular_velocity", 3),
        ("joint_rotation", dof),
        ("joint_velocity", dof),
        ("key_position", 3 * model.key_bodies.len()),
        ("com", 3),
        ("com_velocity", 3),
        ("angular_momentum", 3),
        ("contact", contacts),
    ]
}

/// The blocks that [`errors`] writes.
pub fn error_layout(model: &CharacterModel, contacts: usize) -> Vec<Named> {
    let dof = model.character.dof;
    vec![
        ("joint_rotation_error", dof),
        ("joint_velocity_error", dof),
        ("root_position_error", 3),
        ("root_rotation_error", 3),
        ("root_velocity_error", 3),
        ("root_angular_velocity_error", 3),
        ("reference_contact", contacts),
    ]
}

/// The blocks that [`further_ahead`] writes.
pub fn ahead_layout(model: &CharacterModel, contacts: usize) -> Vec<Named> {
    vec![
        ("ahead_root_position", 3),
        ("ahead_root_rotation", 3),
        ("ahead_joint_rotation", model.character.dof),
        ("ahead_contact", contacts),
    ]
}

/// The agent as it is: height and tilt of the root, speeds, joints, head, hands and feet, the whole body, and contacts.
pub fn agent(model: &CharacterModel, scene: &ObservationInputs, w: &mut Writer) {
    let (links, dynamics) = (scene.links, scene.dynamics);
    let root = &links[0];
    let into_root = |v: Vector3<f32>| root.pose.rotation.inverse_transform_vector(&v);
    let center = root.pose.translation.vector;
    w.one(center.z);
    w.vector(into_root(Vector3::z()));
    w.vector(into_root(root.linear));
    w.vector(into_root(root.angular));
    joints(model, w, |i, p| relative(model, links, i, p).scaled_axis());
    joints(model, w, |i, p| rate(links, i, p));
    for &body in &model.key_bodies {
        let at = model.character.body_pose(links, body).translation;
        w.vector(into_root(at.vector - center));
    }
    w.vector(into_root(dynamics.com - center));
    w.vector(into_root(dynamics.com_velocity));
    w.vector(into_root(dynamics.angular_momentum) / model.momentum_scale);
    w.flags(scene.contacts);
}

/// Reference minus agent: what the action, which is added to the reference, has to make up for.
pub fn errors(model: &CharacterModel, scene: &ObservationInputs, w: &mut Writer) {
    let (links, next) = (scene.links, scene.next);
    let root = &links[0];
    let into_root = |v: Vector3<f32>| root.pose.rotation.inverse_transform_vector(&v);
    let center = root.pose.translation.vector;
    joints(model, w, |i, p| {
        (relative(model, links, i, p).inverse() * relative(model, &next.links, i, p)).scaled_axis()
    });
    joints(model, w, |i, p| rate(&next.links, i, p) - rate(links, i, p));
    let wanted = &next.links[0];
    w.vector(into_root(wanted.pose.translation.vector - center));
    w.vector((root.pose.rotation.inverse() * wanted.pose.rotation).scaled_axis());
    w.vector(into_root(wanted.linear - root.linear));
    w.vector(into_root(wanted.angular - root.angular));
    w.flags(&next.contacts);
}

/// A later moment of the reference: its root against the agent's, its joints and contacts.
pub fn further_ahead(
    model: &CharacterModel,
    root: &LinkState,
    sample: &ReferenceState,
    w: &mut Writer,
) {
    let turn = root.pose.rotation.inverse();
    let coming = &sample.links[0].pose;
    let shift = coming.translation.vector - root.pose.translation.vector;
    w.vector(root.pose.rotation.inverse_transform_vector(&shift));
    w.vector((turn * coming.rotation).scaled_axis());
    joints(model, w, |i, p| {
        relative(model, &sample.links, i, p).scaled_axis()
    });
    w.flags(&sample.contacts);
}

/// Writes a vector of each joint along its axes; `value` takes the numbers of a link and its parent.
fn joints(model: &CharacterModel, w: &mut Writer, value: impl Fn(usize, usize) -> Vector3<f32>) {
    for (i, link) in model.character.links.iter().enumerate() {
        if let Some(parent) = link.parent {
            w.joint(&link.joint, value(i, parent));
        }
    }
}

/// Rotation of a link's joint.
fn relative(
    model: &CharacterModel,
    links: &[LinkState],
    link: usize,
    parent: usize,
) -> UnitQuaternion<f32> {
    model
        .character
        .joint_rotation(link, links[parent].pose.rotation, links[link].pose.rotation)
}

/// Angular velocity of a link against its parent, rad/s, in the link's frame.
fn rate(links: &[LinkState], link: usize, parent: usize) -> Vector3<f32> {
    links[link]
        .pose
        .rotation
        .inverse_transform_vector(&(links[link].angular - links[parent].angular))
}
