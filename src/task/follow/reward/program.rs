//! The imitation reward of the program that Peng et al. published with "DeepMimic" (2018). It isn't that of their paper:
//! joints are weighted to a sum of one, and the root has a term of its own.

use super::errors::{body, joint_error, joint_rate};
use super::term_values::Terms;
use crate::sim::LinkState;
use crate::task::dynamics::Dynamics;
use crate::task::follow::heading;
use crate::task::model::CharacterModel;
use nalgebra::Vector3;

/// pose exp(−2 Σ wⱼ‖q̂ ⊖ q‖²) and velocity exp(−0.1 Σ wⱼ‖ω̂ − ω‖²) over joints with [`CharacterModel::joint_weights`], the root's rotation
/// among them, its rate along the world's axes; end effectors exp(−40 mean‖p̂ − p‖²) over hands and feet as seen from the
/// root, but for their height; root exp(−5 (‖Δp‖² + 0.1 Δθ² + 0.01 ‖Δv‖² + 0.001 ‖Δω‖²)); centre of mass exp(−‖Δv‖²).
pub(super) fn terms(
    model: &CharacterModel,
    (links, dynamics): (&[LinkState], &Dynamics),
    (wanted, wanted_dynamics): (&[LinkState], &Dynamics),
) -> Terms {
    let (mut pose, mut velocity) = (0.0, 0.0);
    for (i, weight) in model.joint_weights.iter().enumerate() {
        let rate = match i {
            0 => links[0].angular - wanted[0].angular,
            _ => joint_rate(model, links, i) - joint_rate(model, wanted, i),
        };
        pose += weight * joint_error(model, links, wanted, i);
        velocity += weight * rate.norm_squared();
    }
    let (a, b) = (&links[0], &wanted[0]);
    let root = (a.pose.translation.vector - b.pose.translation.vector).norm_squared()
        + 0.1 * joint_error(model, links, wanted, 0)
        + 0.01 * (a.linear - b.linear).norm_squared()
        + 0.001 * (a.angular - b.angular).norm_squared();
    let ends = model.end_bodies.iter();
    let apart =
        ends.map(|&end| (seen(model, links, end) - seen(model, wanted, end)).norm_squared());
    let ends = apart.sum::<f32>() / model.end_bodies.len().max(1) as f32;
    Terms {
        pose: (-2.0 * pose).exp(),
        velocity: (-0.1 * velocity).exp(),
        end_effector: (-40.0 * ends).exp(),
        root: (-5.0 * root).exp(),
        com: (-(dynamics.com_velocity - wanted_dynamics.com_velocity).norm_squared()).exp(),
        ..Terms::default()
    }
}

/// Position of a body, metres: along the ground from the root in axes along its heading, and its height above the ground.
fn seen(model: &CharacterModel, links: &[LinkState], end: usize) -> Vector3<f32> {
    let root = &links[0].pose;
    let (at, _) = body(model, links, end);
    let below = Vector3::new(root.translation.x, root.translation.y, 0.0);
    heading(&root.rotation).inverse() * (at - below)
}
