//! The reward of Booth & Ivanov 2020, "Realistic Physics Based Character Controller". The paper says what is compared,
//! its published program (marathon-envs, StyleTransfer002) by which formula: Σ w·exp(−D/s).

use super::errors::body_errors;
use super::term_values::Terms;
use crate::sim::LinkState;
use crate::task::dynamics::Dynamics;
use crate::task::model::CharacterModel;

/// Divisors s of the errors D, as in that program: for a character of 17 bodies and 32.5 kg.
const ROTATION: f32 = 16.0;
const ANGULAR_VELOCITY: f32 = 7000.0;
const END_EFFECTOR: f32 = 1.0;
const END_EFFECTOR_VELOCITY: f32 = 170.0;
const COM_VELOCITY: f32 = 6.0;
const COM_POSITION: f32 = 0.3;
const ANGULAR_MOMENTUM: f32 = 150.0;

/// Sums of squares: rotations of bodies in the root's frame (rad²; the root's own in the world), their angular
/// velocities there, positions and velocities of hands, feet and chest in the world, position and velocity of the
/// centre of mass, and angular momentum about it ((kg·m²/s)²).
///
/// The angular momentum is the true one; that program turns each body's spin by the wrong rotation.
pub(super) fn terms(
    model: &CharacterModel,
    (links, dynamics): (&[LinkState], &Dynamics),
    (wanted, wanted_dynamics): (&[LinkState], &Dynamics),
) -> Terms {
    let (mut rotation, mut spin) = (0.0, 0.0);
    for body in &model.character.bodies {
        let (mine, other) = (in_root(links, body.link), in_root(wanted, body.link));
        rotation += mine.0.angle_to(&other.0).powi(2);
        spin += (mine.1 - other.1).norm_squared();
    }
    let bodies = model.end_bodies.iter().chain(&model.chest_body);
    let (place, speed) = body_errors(model, links, wanted, bodies);
    let drift = (dynamics.com_velocity - wanted_dynamics.com_velocity).norm_squared();
    let shift = (dynamics.com - wanted_dynamics.com).norm_squared();
    let momentum = (dynamics.angular_momentum - wanted_dynamics.angular_momentum).norm_squared();
    Terms {
        pose: (-rotation / ROTATION).exp(),
        velocity: (-spin / ANGULAR_VELOCITY).exp(),
        end_effector: (-place / END_EFFECTOR).exp(),
        end_effector_velocity: (-speed / END_EFFECTOR_VELOCITY).exp(),
        com: (-drift / COM_VELOCITY).exp(),
        com_position: (-shift / COM_POSITION).exp(),
        angular_momentum: (-momentum / ANGULAR_MOMENTUM).exp(),
        ..Terms::default()
    }
}

/// Rotation and angular velocity (rad/s) in the root's frame; the root's own are those in the world.
fn in_root(
    links: &[LinkState],
    link: usize,
) -> (nalgebra::UnitQuaternion<f32>, nalgebra::Vector3<f32>) {
    let (root, state) = (&links[0], &links[link]);
    if link == 0 {
        return (state.pose.rotation, state.angular);
    }
    let turn = root.pose.rotation.inverse();
    (
        turn * state.pose.rotation,
        turn * (state.angular - root.angular),
    )
}
