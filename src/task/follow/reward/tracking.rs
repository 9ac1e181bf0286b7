//! Our own kernels: errors are averaged over links, so that no scale depends on how many there are.

use super::errors::joint_error;
use super::term_values::Terms;
use crate::sim::LinkState;
use crate::task::dynamics::Dynamics;
use crate::task::model::CharacterModel;

/// See the fields of [`Terms`] for errors and scales. The scales are chosen; `docs/notebook/training-choices.md` compares these
/// kernels with those of DeepMimic's program.
pub(super) fn terms(
    model: &CharacterModel,
    agent: (&[LinkState], &Dynamics),
    reference: (&[LinkState], &Dynamics),
) -> Terms {
    let (links, dynamics) = agent;
    let (wanted, wanted_dynamics) = reference;
    // Links against the root: these three don't see where the character is, which the terms of root and centre of mass do.
    let (mut pose, mut velocity, mut position) = (0.0, 0.0, 0.0);
    let root = links[0].pose.translation.vector;
    let wanted_root = wanted[0].pose.translation.vector;
    for (i, (a, b)) in links.iter().zip(wanted).enumerate().skip(1) {
        pose += joint_error(model, links, wanted, i);
        velocity += (a.angular - b.angular).norm_squared();
        position += ((a.pose.translation.vector - root)
            - (b.pose.translation.vector - wanted_root))
            .norm_squared();
    }
    let n = (links.len().max(2) - 1) as f32;
    let (a, b) = (&links[0], &wanted[0]);
    // The root against the world. Position and rotation share a term, for either alone is worth little.
    let root_error = 10.0 * (root - wanted_root).norm_squared()
        + 2.0 * a.pose.rotation.angle_to(&b.pose.rotation).powi(2);
    let root_rate =
        (a.linear - b.linear).norm_squared() + 0.1 * (a.angular - b.angular).norm_squared();
    // In units of the character's own size and weight, so that a child and a giant have the same scale.
    let momentum =
        (dynamics.angular_momentum - wanted_dynamics.angular_momentum) / model.momentum_scale;
    Terms {
        pose: (-6.0 * pose / n).exp(),
        velocity: (-0.1 * velocity / n).exp(),
        position: (-60.0 * position / n).exp(),
        root: (-root_error).exp(),
        root_velocity: (-root_rate).exp(),
        com: (-2.0 * (dynamics.com_velocity - wanted_dynamics.com_velocity).norm_squared()).exp(),
        angular_momentum: (-100.0 * momentum.norm_squared()).exp(),
        ..Terms::default()
    }
}
