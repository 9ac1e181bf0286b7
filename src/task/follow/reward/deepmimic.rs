//! The imitation reward of Peng et al. 2018, "DeepMimic: example-guided deep reinforcement learning of physics-based
//! character skills", section 5.1.

use super::errors::{body_errors, joint_error, joint_rate};
use super::term_values::Terms;
use crate::sim::LinkState;
use crate::task::dynamics::Dynamics;
use crate::task::model::CharacterModel;

/// pose exp(−2 Σ‖q̂ ⊖ q‖²), velocity exp(−0.1 Σ‖ω̂ − ω‖²), end effectors exp(−40 Σ‖p̂ − p‖²) over hands and feet, centre
/// of mass exp(−10 ‖ĉ − c‖²). Sums run over joints; the root's rotation against the world counts as one, as in the
/// authors' program, for nothing else of the reward would see which way the character faces.
pub(super) fn terms(
    model: &CharacterModel,
    (links, dynamics): (&[LinkState], &Dynamics),
    (wanted, wanted_dynamics): (&[LinkState], &Dynamics),
) -> Terms {
    let joints = 0..links.len();
    let pose: f32 = joints
        .clone()
        .map(|i| joint_error(model, links, wanted, i))
        .sum();
    let velocity: f32 = joints
        .map(|i| (joint_rate(model, links, i) - joint_rate(model, wanted, i)).norm_squared())
        .sum();
    let (place, _) = body_errors(model, links, wanted, model.end_bodies.iter());
    let com = (dynamics.com - wanted_dynamics.com).norm_squared();
    Terms {
        pose: (-2.0 * pose).exp(),
        velocity: (-0.1 * velocity).exp(),
        end_effector: (-40.0 * place).exp(),
        com_position: (-10.0 * com).exp(),
        ..Terms::default()
    }
}
