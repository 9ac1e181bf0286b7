//! Whole-body quantities of a set of link states.

use crate::sim::{Character, LinkState};
use nalgebra::{Matrix3, Vector3};

/// Centre of mass and momentum of the whole character.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dynamics {
    /// Centre of mass, metres, world axes.
    pub com: Vector3<f32>,
    /// Velocity of the centre of mass, m/s, world axes.
    pub com_velocity: Vector3<f32>,
    /// Angular momentum about the centre of mass, each link's own spin included, kg·m²/s, world axes.
    pub angular_momentum: Vector3<f32>,
}

/// Masses of a character, ready for [`Masses::dynamics`].
#[derive(Clone, Debug)]
pub(crate) struct Masses {
    links: Vec<(f32, Vector3<f32>, Matrix3<f32>)>,
    total: f32,
}

impl Masses {
    pub fn new(character: &Character) -> Self {
        let links: Vec<_> = character
            .links
            .iter()
            .map(|l| (l.mass as f32, l.com.cast(), l.inertia.cast()))
            .collect();
        let total = links.iter().map(|l| l.0).sum();
        Masses { links, total }
    }

    /// L = Σ R I Rᵀ ω + m (c − C) × (v − V), over links with centre c, velocity v and spin ω.
    pub fn dynamics(&self, states: &[LinkState]) -> Dynamics {
        let mut com = Vector3::zeros();
        let mut velocity = Vector3::zeros();
        let mut about_origin = Vector3::zeros();
        for ((mass, center, inertia), state) in self.links.iter().zip(states) {
            let turn = state.pose.rotation;
            let arm = turn * center;
            let at = state.pose.translation.vector + arm;
            let v = state.linear + state.angular.cross(&arm);
            com += at * *mass;
            velocity += v * *mass;
            about_origin += turn * (inertia * turn.inverse_transform_vector(&state.angular))
                + at.cross(&v) * *mass;
        }
        // One pass: momenta about the world's origin first, then Σ (c − C) × m (v − V) = Σ c × m v − C × M V.
        com /= self.total;
        velocity /= self.total;
        let angular_momentum = about_origin - com.cross(&velocity) * self.total;
        Dynamics {
            com,
            com_velocity: velocity,
            angular_momentum,
        }
    }
}
