//! The observation of Booth & Ivanov 2020, "Realistic Physics Based Character Controller": joint rotations, positions,
//! velocities and angular velocities, the centre of mass, angular momentum and the phase. What the paper leaves open is
//! as in its published program (marathon-envs, StyleTransfer002): the targets before, and three sensors under each foot.
//! On `skeletons/marathon.xml`, 17 bodies and 21 drives, these are the paper's 258 numbers.

use crate::task::follow::{ObservationInputs, Writer};
use crate::task::model::CharacterModel;
use nalgebra::Point3;

/// A point of a sole this near the ground touches it, metres. Chosen.
const TOUCHING: f32 = 0.01;

pub(super) fn layout(model: &CharacterModel) -> Vec<(&'static str, usize)> {
    let bodies = model.character.bodies.len();
    vec![
        ("phase", 1),
        ("body_position", 3 * bodies),
        ("body_rotation", 4 * bodies),
        ("body_angular_velocity", 3 * bodies),
        ("body_velocity", 3 * bodies),
        ("last_action", model.character.dof),
        ("com", 3),
        ("com_velocity", 3),
        ("angular_momentum", 3),
        ("sole", model.soles.len()),
    ]
}

/// The root against where the reference's cycle began, the other bodies against the root, in the axes of that beginning;
/// rotations and angular velocities of the others in the root's frame.
///
/// That program's origin is where the episode began: the same in the first cycle, but later the root runs away from it.
pub(super) fn observe(model: &CharacterModel, scene: &ObservationInputs, w: &mut Writer) {
    let start = scene.next.anchor;
    let axes = start.rotation.inverse();
    w.one(scene.next.phase);
    bodies(model, scene, w);
    scene.last_action.iter().for_each(|a| w.one(*a));
    // The whole body: centre of mass, its velocity, and angular momentum about it, in the axes of the beginning.
    w.vector(
        start
            .inverse_transform_point(&Point3::from(scene.dynamics.com))
            .coords,
    );
    w.vector(axes * scene.dynamics.com_velocity);
    w.vector(axes * scene.dynamics.angular_momentum);
    // The sensors under the feet: three points of each sole, each on the ground or not.
    for point in &model.soles {
        let at = scene.links[point.link].pose * Point3::from(point.center);
        w.one(f32::from(u8::from(at.z - point.radius < TOUCHING)));
    }
}

/// Position, rotation, angular velocity and velocity of all bodies, each for all of them before the next.
fn bodies(model: &CharacterModel, scene: &ObservationInputs, w: &mut Writer) {
    let start = scene.next.anchor;
    let axes = start.rotation.inverse();
    let root = &scene.links[0];
    let bodies = || {
        (0..model.character.bodies.len()).map(|b| (b, model.character.body_state(scene.links, b)))
    };
    for (b, body) in bodies() {
        let at = body.pose.translation.vector;
        match b {
            0 => w.vector(start.inverse_transform_point(&Point3::from(at)).coords),
            _ => w.vector(axes * (at - root.pose.translation.vector)),
        }
    }
    let into_frame = |b: usize| match b {
        0 => axes,
        _ => root.pose.rotation.inverse(),
    };
    for (b, body) in bodies() {
        w.quaternion(into_frame(b) * body.pose.rotation);
    }
    for (b, body) in bodies() {
        let spin = match b {
            0 => body.angular,
            _ => body.angular - root.angular,
        };
        w.vector(into_frame(b) * spin);
    }
    for (b, body) in bodies() {
        let velocity = match b {
            0 => body.linear,
            _ => body.linear - root.linear,
        };
        w.vector(axes * velocity);
    }
}
