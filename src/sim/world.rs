//! One character on one ground.

use super::articulated::{Articulated, LANES, Stepped};
use super::character::Character;
use super::error::Diverged;
use super::rapier::Rapier;
use super::settings::{Engine, Settings};
use super::state::{LinkState, Target};
use nalgebra::Vector3;

/// What moves the links.
enum Mover {
    Articulated(Box<Articulated>),
    Rapier(Box<Rapier>),
}

/// A character that moves under its drives.
pub struct World {
    settings: Settings,
    mover: Mover,
    states: Vec<LinkState>,
    contacts: Vec<bool>,
}

impl World {
    pub fn new(character: &Character, settings: Settings) -> Self {
        World {
            settings,
            mover: match settings.engine {
                Engine::Articulated => {
                    Mover::Articulated(Box::new(Articulated::new(character, settings)))
                }
                Engine::Rapier => Mover::Rapier(Box::new(Rapier::new(character, settings))),
            },
            states: vec![LinkState::at_rest(); character.links.len()],
            contacts: vec![false; character.links.len()],
        }
    }

    /// Puts every link where `states` says, with nothing left of the past: the world then moves as a new one, to the bit.
    pub fn reset(&mut self, states: &[LinkState]) {
        match &mut self.mover {
            Mover::Articulated(mover) => mover.reset(states),
            Mover::Rapier(mover) => mover.reset(states),
        }
        self.states.copy_from_slice(states);
        self.contacts.fill(false);
    }

    /// Until the next reset all masses and inertias are `mass` times what they are, and friction `friction` times.
    pub fn vary(&mut self, mass: f32, friction: f32) {
        match &mut self.mover {
            Mover::Articulated(mover) => mover.vary(mass, friction),
            Mover::Rapier(mover) => mover.vary(mass, friction),
        }
    }

    /// Gives a link an impulse at its centre of mass, world axes, N·s.
    pub fn push(&mut self, link: usize, impulse: Vector3<f32>) {
        match &mut self.mover {
            Mover::Articulated(mover) => mover.push(link, impulse),
            Mover::Rapier(mover) => mover.push(link, impulse),
        }
    }

    /// Sets what the drives hold until the next call; one target per link.
    pub fn set_targets(&mut self, targets: &[Target]) {
        match &mut self.mover {
            Mover::Articulated(mover) => mover.set_targets(targets),
            Mover::Rapier(mover) => mover.set_targets(targets),
        }
    }

    /// Advances by one control step.
    ///
    /// # Errors
    /// [`Diverged`] when a body stopped being finite or left the world; it then needs a reset.
    pub fn step(&mut self) -> Result<(), Diverged> {
        let mut result = Ok(());
        World::step_together(&mut [self], std::slice::from_mut(&mut result));
        result
    }

    /// Advances worlds of one character and one setting by a control step, each as if alone; in far less time than one
    /// after the other. What [`World::step`] gives is left in `results`, one for each.
    ///
    /// # Panics
    /// If there aren't as many results as worlds, or the worlds are of different kinds.
    pub fn step_together(worlds: &mut [&mut World], results: &mut [Result<(), Diverged>]) {
        assert_eq!(worlds.len(), results.len(), "one result for each world");
        for (worlds, results) in worlds.chunks_mut(LANES).zip(results.chunks_mut(LANES)) {
            let pairs = worlds.iter_mut().zip(results.iter_mut());
            let mut stepped: Vec<Stepped> = pairs
                .filter_map(|(w, result)| w.begin_step(result))
                .collect();
            Articulated::step(&mut stepped);
            for (world, result) in worlds.iter().zip(results) {
                if !world.states.iter().all(is_near) {
                    *result = Err(Diverged);
                }
            }
        }
    }

    /// What is to step together with others. Rapier has nothing to share between worlds, so its step is taken here.
    fn begin_step<'a>(&'a mut self, result: &'a mut Result<(), Diverged>) -> Option<Stepped<'a>> {
        match &mut self.mover {
            Mover::Articulated(mover) => Some(Stepped {
                mover,
                states: &mut self.states,
                contacts: &mut self.contacts,
                result,
            }),
            Mover::Rapier(mover) => {
                *result = mover.step();
                if result.is_ok() {
                    mover.read(&mut self.states, &mut self.contacts);
                }
                None
            }
        }
    }

    /// One state per link, after the last step or reset.
    pub fn states(&self) -> &[LinkState] {
        &self.states
    }

    /// Per link: whether it pressed on the ground in the last of the control step's physics steps.
    pub fn contacts(&self) -> &[bool] {
        &self.contacts
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}

/// Metres from the origin beyond which a character is lost.
const FARTHEST: f32 = 1e4;

fn is_near(state: &LinkState) -> bool {
    state.pose.translation.vector.norm() < FARTHEST
}
