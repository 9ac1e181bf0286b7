//! A player who asks for something new every few seconds.

use super::settings::InputSettings;
use crate::task::starts::uniform;
use crate::task::step::Wish;
use nalgebra::Vector2;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// How much longer stops are held than other wishes. Chosen: standing has to be learned as well as walking.
const STOPS_LAST: f64 = 1.5;

/// What a player asks for, over time.
#[derive(Clone, Debug)]
pub(super) struct Player {
    input: InputSettings,
    /// Most speed that is asked for, m/s.
    fastest: f64,
    /// Whether the character can go sideways.
    strafes: bool,
    /// What is asked for.
    pub wish: Wish,
    /// Seconds until something else is.
    left: f64,
}

impl Player {
    /// A player who asks for speeds up to `fastest`, m/s, unless the settings say otherwise.
    pub fn new(input: InputSettings, fastest: f32, strafes: bool) -> Player {
        Player {
            fastest: f64::from(input.fastest_m_s.unwrap_or(fastest)),
            input,
            strafes,
            wish: Wish::default(),
            left: 0.0,
        }
    }

    /// Lets `dt` seconds pass, and asks for something new when it is time. Every new wish draws as many numbers.
    pub fn go_on(&mut self, dt: f64, rng: &mut ChaCha8Rng) {
        self.left -= dt;
        if self.left > 0.0 {
            return;
        }
        let [shortest, longest] = self.input.held_s;
        let [held, kind, way, power, faces, facing] = std::array::from_fn(|_| uniform(rng));
        self.left = shortest + held * (longest - shortest);
        let stops = kind < self.input.stops;
        if stops {
            self.left *= STOPS_LAST;
        }
        let speed = if stops { 0.0 } else { power * self.fastest };
        let way = way * TAU;
        let velocity = Vector2::new(way.cos(), way.sin()) * speed;
        let own = self.strafes && faces < self.input.facings;
        self.wish = Wish {
            velocity: velocity.cast(),
            facing: own.then_some((facing * TAU) as f32),
        };
    }
}
