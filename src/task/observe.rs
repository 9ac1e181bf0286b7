//! What the policy sees. All directions are in the root's own frame, so that nothing depends on where the character
//! is or which way it faces.

use super::dynamics::Dynamics;
use super::reference::Sample;
use super::setting::Stage;
use crate::sim::{LinkJoint, LinkState};
use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;

/// One named part of the observation.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Block {
    pub name: &'static str,
    pub size: usize,
}

/// The blocks of an observation in order, for a motion with `contacts` contact bodies.
pub fn layout(stage: &Stage, contacts: usize) -> Vec<Block> {
    let dof = stage.character.dof;
    let block = |name, size| Block { name, size };
    vec![
        block("root_height", 1),
        block("up", 3),
        block("root_velocity", 3),
        block("root_angular_velocity", 3),
        block("joint_rotation", dof),
        block("joint_velocity", dof),
        block("key_position", 3 * stage.key_bodies.len()),
        block("com", 3),
        block("com_velocity", 3),
        block("angular_momentum", 3),
        block("contact", contacts),
        block("joint_rotation_error", dof),
        block("joint_velocity_error", dof),
        block("root_position_error", 3),
        block("root_rotation_error", 3),
        block("root_velocity_error", 3),
        block("root_angular_velocity_error", 3),
        block("reference_contact", contacts),
        block("phase", 5),
    ]
}

/// Length of an observation for a motion with `contacts` contact bodies.
pub fn observation_size(stage: &Stage, contacts: usize) -> usize {
    layout(stage, contacts).iter().map(|block| block.size).sum()
}

/// Writes values one after the other.
struct Writer<'a> {
    out: &'a mut [f32],
    at: usize,
}

impl Writer<'_> {
    fn one(&mut self, value: f32) {
        self.out[self.at] = value;
        self.at += 1;
    }

    fn vector(&mut self, v: Vector3<f32>) {
        self.out[self.at..self.at + 3].copy_from_slice(v.as_slice());
        self.at += 3;
    }

    fn flags(&mut self, flags: &[bool]) {
        flags.iter().for_each(|f| self.one(f32::from(u8::from(*f))));
    }

    /// The part of a joint-space vector that the joint can have.
    fn joint(&mut self, joint: &LinkJoint, v: Vector3<f32>) {
        match joint {
            LinkJoint::Free => {}
            LinkJoint::Ball { .. } => self.vector(v),
            LinkJoint::Hinges { hinges, .. } => {
                for hinge in hinges {
                    self.one(v.dot(&hinge.direction.cast()));
                }
            }
            LinkJoint::Hinge { axis, .. } => self.one(v.dot(&axis.direction.cast())),
        }
    }
}

/// Fills `out` (as long as [`layout`] says) with what is seen of an agent whose next reference is `next`.
pub fn observe(
    stage: &Stage,
    links: &[LinkState],
    dynamics: &Dynamics,
    contacts: &[bool],
    next: &Sample,
    out: &mut [f32],
) {
    let mut w = Writer { out, at: 0 };
    let root = &links[0];
    let into_root = |v: Vector3<f32>| root.pose.rotation.inverse_transform_vector(&v);
    let center = root.pose.translation.vector;
    w.one(center.z);
    w.vector(into_root(Vector3::z()));
    w.vector(into_root(root.linear));
    w.vector(into_root(root.angular));
    joints(stage, &mut w, |i, p| {
        relative(stage, links, i, p).scaled_axis()
    });
    joints(stage, &mut w, |i, p| rate(links, i, p));
    for &body in &stage.key_bodies {
        let (link, offset) = &stage.character.bodies[body];
        let at =
            links[*link].pose * nalgebra::Point3::from(offset.translation.vector.cast::<f32>());
        w.vector(into_root(at.coords - center));
    }
    w.vector(into_root(dynamics.com - center));
    w.vector(into_root(dynamics.com_velocity));
    w.vector(into_root(dynamics.angular_momentum) / stage.momentum_scale);
    w.flags(contacts);
    joints(stage, &mut w, |i, p| {
        (relative(stage, links, i, p).inverse() * relative(stage, &next.links, i, p)).scaled_axis()
    });
    joints(stage, &mut w, |i, p| {
        rate(&next.links, i, p) - rate(links, i, p)
    });
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
}

fn joints(stage: &Stage, w: &mut Writer, value: impl Fn(usize, usize) -> Vector3<f32>) {
    for (i, link) in stage.character.links.iter().enumerate() {
        if let Some(parent) = link.parent {
            w.joint(&link.joint, value(i, parent));
        }
    }
}

fn relative(stage: &Stage, links: &[LinkState], link: usize, parent: usize) -> UnitQuaternion<f32> {
    stage
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
