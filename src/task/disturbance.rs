//! What disturbs an episode: another weight, another ground, and shoves.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f32::consts::TAU;

/// What disturbs episodes: ranges, least and most, that every one draws from, and whether its reference then follows. By
/// default nothing is disturbed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Perturbations {
    /// Size of a horizontal shove on the trunk, in any direction: by how much it changes the velocity of the whole character.
    /// The impulse is this times the character's mass.
    #[schemars(
        inner(range(min = 0.0, max = 100.0)),
        extend("x-ascending" = true, "x-unit" = "m/s")
    )]
    pub push_m_s: [f32; 2],
    /// Time from the start to the first shove, and from each shove to the next.
    #[schemars(
        inner(range(min = 0.05, max = 100.0)),
        extend("x-ascending" = true, "x-unit" = "s")
    )]
    pub push_interval_s: [f32; 2],
    /// Factor on all masses and inertias.
    #[schemars(
        inner(range(min = 0.05, max = 100.0)),
        extend("x-ascending" = true)
    )]
    pub mass: [f32; 2],
    /// Factor on the friction with the ground.
    #[schemars(
        inner(range(min = 0.0, max = 100.0)),
        extend("x-ascending" = true)
    )]
    pub friction: [f32; 2],
    /// Whether the reference follows the agent along the ground from the first shove on, so that an agent that was shoved
    /// aside isn't asked to come back. Evaluations always do so.
    pub follow: bool,
}

impl Default for Perturbations {
    fn default() -> Self {
        Self {
            push_m_s: [0.0, 0.0],
            push_interval_s: [2.0, 4.0],
            mass: [1.0, 1.0],
            friction: [1.0, 1.0],
            follow: true,
        }
    }
}

impl Perturbations {
    /// Moderate disturbances: shoves that a standing person answers with a step, a tenth of the mass, 30 % of the friction. Chosen;
    /// `docs/notebook/shoves.md` has what agents make of them and of larger ones.
    pub fn usual() -> Self {
        Self {
            push_m_s: [0.2, 0.6],
            mass: [0.9, 1.1],
            friction: [0.7, 1.3],
            ..Self::default()
        }
    }

    /// These, if they disturb anything, else the usual ones.
    pub fn or_usual(self) -> Self {
        match self.is_on() {
            true => self,
            false => Self {
                follow: self.follow,
                ..Self::usual()
            },
        }
    }

    /// Whether anything is disturbed at all.
    pub fn is_on(&self) -> bool {
        let off = Self::default();
        self.push_m_s != off.push_m_s || self.mass != off.mass || self.friction != off.friction
    }
}

/// The disturbances of one episode.
pub(super) struct Disturbance {
    ranges: Perturbations,
    rng: ChaCha8Rng,
    /// When the next shove is due, seconds from the start.
    next_push: f64,
    was_pushed: bool,
    /// Factor on all masses and inertias.
    pub mass: f32,
    /// Factor on the friction with the ground.
    pub friction: f32,
}

impl Disturbance {
    /// Draws what disturbs an episode; `seed` alone says how.
    pub fn new(ranges: Perturbations, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mass, friction) = (
            within(ranges.mass, &mut rng),
            within(ranges.friction, &mut rng),
        );
        let next_push = f64::from(within(ranges.push_interval_s, &mut rng));
        Self {
            ranges,
            rng,
            next_push,
            was_pushed: false,
            mass,
            friction,
        }
    }

    /// The shove that is due `elapsed` seconds after the start, as a change of velocity, m/s.
    pub fn push(&mut self, elapsed: f64) -> Option<Vector3<f32>> {
        if self.ranges.push_m_s[1] <= 0.0 || elapsed < self.next_push {
            return None;
        }
        self.was_pushed = true;
        self.next_push += f64::from(within(self.ranges.push_interval_s, &mut self.rng));
        let size = within(self.ranges.push_m_s, &mut self.rng);
        let way = within([0.0, TAU], &mut self.rng);
        Some(Vector3::new(way.cos(), way.sin(), 0.0) * size)
    }

    /// Whether the reference follows the agent from now on: it does once the agent was shoved.
    pub fn is_agent_followed(&self) -> bool {
        self.ranges.follow && self.was_pushed
    }
}

/// Uniform in [low, high), from the upper 24 bits: as many as an `f32` can tell apart.
fn within([low, high]: [f32; 2], rng: &mut ChaCha8Rng) -> f32 {
    let share = (rng.next_u32() >> 8) as f32 / (1u32 << 24) as f32;
    low + (high - low) * share
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema;

    #[test]
    fn shoves_come_in_their_ranges_and_from_all_sides() {
        let mut all = Disturbance::new(Perturbations::usual(), 3);
        let mut times = Vec::new();
        let mut sides = [0; 4];
        for step in 0..30 * 600 {
            let time = f64::from(step) / 30.0;
            if let Some(push) = all.push(time) {
                assert!(
                    push.z == 0.0 && (0.2..=0.6).contains(&push.norm()),
                    "{push:?}"
                );
                sides[usize::from(push.x > 0.0) + 2 * usize::from(push.y > 0.0)] += 1;
                times.push(time);
            }
        }
        // 600 s at 3 s in the mean.
        assert!((180..220).contains(&times.len()), "{}", times.len());
        let gaps = times.windows(2).map(|w| w[1] - w[0]);
        assert!(gaps.clone().all(|gap| (1.9..4.1).contains(&gap)));
        assert!(sides.iter().all(|count| *count > 25), "{sides:?}");
    }

    #[test]
    fn ranges_have_an_order_and_bounds() {
        let check = |all: &Perturbations| schema::check(all, "task.perturbations");
        assert!(check(&Perturbations::usual()).is_ok() && !Perturbations::default().is_on());
        for wrong in [[1.1, 0.9], [0.0, 1.0], [f32::NAN, 1.0], [1.0, 1e9]] {
            let all = Perturbations {
                mass: wrong,
                ..Perturbations::default()
            };
            let said = check(&all).map_err(|e| e.setting);
            assert!(
                said.as_ref()
                    .is_err_and(|e| e.starts_with("task.perturbations.mass")),
                "{said:?}"
            );
        }
    }
}
