//! Our own observation: agent, errors and phase, in the root's frame.

use super::{ObservationInputs, Writer};
use crate::sim::LinkState;
use crate::task::model::CharacterModel;
use nalgebra::{UnitQuaternion, Vector3};

/// With `ahead` moments of the reference to come.
pub(super) fn layout(
    model: &CharacterModel,
    contacts: usize,
    ahead: usize,
) -> Vec<(&'static str, usize)> {
    let dof = model.character.dof;
    let mut blocks = vec![
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
        ("joint_rotation_error", dof),
        ("joint_velocity_error", dof),
        ("root_position_error", 3),
        ("root_rotation_error", 3),
        ("root_velocity_error", 3),
        ("root_angular_velocity_error", 3),
        ("reference_contact", contacts),
        ("phase", 5),
    ];
    for _ in 0..ahead {
        blocks.extend([
            ("ahead_root_position", 3),
            ("ahead_root_rotation", 3),
            ("ahead_joint_rotation", dof),
            ("ahead_contact", contacts),
        ]);
    }
    blocks
}

pub(super) fn observe(model: &CharacterModel, scene: &ObservationInputs, w: &mut Writer) {
    let ObservationInputs {
        links,
        dynamics,
        contacts,
        next,
        ahead,
        ..
    } = *scene;
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
    w.flags(contacts);
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
    let turn = std::f32::consts::TAU * next.phase;
    for value in [
        next.phase,
        turn.sin(),
        turn.cos(),
        (2.0 * turn).sin(),
        (2.0 * turn).cos(),
    ] {
        w.one(value);
    }
    for sample in ahead {
        let coming = &sample.links[0].pose;
        w.vector(into_root(coming.translation.vector - center));
        w.vector((root.pose.rotation.inverse() * coming.rotation).scaled_axis());
        joints(model, w, |i, p| {
            relative(model, &sample.links, i, p).scaled_axis()
        });
        w.flags(&sample.contacts);
    }
}

fn joints(model: &CharacterModel, w: &mut Writer, value: impl Fn(usize, usize) -> Vector3<f32>) {
    for (i, link) in model.character.links.iter().enumerate() {
        if let Some(parent) = link.parent {
            w.joint(&link.joint, value(i, parent));
        }
    }
}

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

/// Angular velocity of a link against its parent, in the link's frame.
fn rate(links: &[LinkState], link: usize, parent: usize) -> Vector3<f32> {
    links[link]
        .pose
        .rotation
        .inverse_transform_vector(&(links[link].angular - links[parent].angular))
}
