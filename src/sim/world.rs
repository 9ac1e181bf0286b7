//! A simulated world: one character on flat ground.

use super::articulated::{Articulated, LANES, Stepped};
use super::character::Character;
use super::error::Diverged;
use super::rapier::Rapier;
use super::settings::{Engine, Settings};
use super::state::{LinkState, Target};
use nalgebra::Vector3;

/// The engine with its own state of the character.
enum Backend {
    Articulated(Box<Articulated>),
    Rapier(Box<Rapier>),
}

/// One character on flat ground (the plane Z = 0), moved by its drives, gravity and contacts.
pub struct World {
    settings: Settings,
    backend: Backend,
    /// `[links]`.
    states: Vec<LinkState>,
    /// `[links]`: whether the link presses on the ground.
    contacts: Vec<bool>,
}

impl World {
    /// A world with the character at the origin, to be [reset](World::reset) before its first step.
    pub fn new(character: &Character, settings: Settings) -> Self {
        World {
            settings,
            backend: match settings.engine {
                Engine::Articulated => {
                    Backend::Articulated(Box::new(Articulated::new(character, settings)))
                }
                Engine::Rapier => Backend::Rapier(Box::new(Rapier::new(character, settings))),
            },
            states: vec![LinkState::at_rest(); character.links.len()],
            contacts: vec![false; character.links.len()],
        }
    }

    /// Puts every link where `states` says, one per link, and forgets the past: from then on the world moves as a new one
    /// would, to the bit. It also undoes [`World::vary`].
    ///
    /// # Panics
    /// If there aren't as many states as links.
    pub fn reset(&mut self, states: &[LinkState]) {
        match &mut self.backend {
            Backend::Articulated(engine) => engine.reset(states),
            Backend::Rapier(engine) => engine.reset(states),
        }
        self.states.copy_from_slice(states);
        self.contacts.fill(false);
    }

    /// Until the next reset, multiplies all masses and inertias by `mass` and all friction coefficients by `friction`.
    pub fn vary(&mut self, mass: f32, friction: f32) {
        match &mut self.backend {
            Backend::Articulated(engine) => engine.vary(mass, friction),
            Backend::Rapier(engine) => engine.vary(mass, friction),
        }
    }

    /// Gives a link an impulse at its centre of mass, world axes, N·s.
    ///
    /// # Panics
    /// At the call or in the next step, if there is no such link.
    pub fn push(&mut self, link: usize, impulse: Vector3<f32>) {
        match &mut self.backend {
            Backend::Articulated(engine) => engine.push(link, impulse),
            Backend::Rapier(engine) => engine.push(link, impulse),
        }
    }

    /// Sets the targets that the drives hold until the next call, one per link. Before the first call they hold every joint at
    /// rest.
    pub fn set_targets(&mut self, targets: &[Target]) {
        match &mut self.backend {
            Backend::Articulated(engine) => engine.set_targets(targets),
            Backend::Rapier(engine) => engine.set_targets(targets),
        }
    }

    /// Advances by one control step.
    ///
    /// # Errors
    /// [`Diverged`] if a link's state stopped being finite, or a link is farther than 10 km from the origin. The world then
    /// needs a reset.
    pub fn step(&mut self) -> Result<(), Diverged> {
        let mut result = Ok(());
        World::step_together(&mut [self], std::slice::from_mut(&mut result));
        result
    }

    /// Advances several worlds of one character with the same settings by a control step. Each moves as if it were alone, to
    /// the bit, but together they take far less time than one after the other. `results[i]` is what [`World::step`] would
    /// return for `worlds[i]`.
    ///
    /// # Panics
    /// If there aren't as many results as worlds, or if worlds have different settings or characters of different sizes.
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

    /// What this world contributes to a step of several. Worlds of rapier have nothing to share, so each takes its step here.
    fn begin_step<'a>(&'a mut self, result: &'a mut Result<(), Diverged>) -> Option<Stepped<'a>> {
        match &mut self.backend {
            Backend::Articulated(engine) => Some(Stepped {
                engine,
                states: &mut self.states,
                contacts: &mut self.contacts,
                result,
            }),
            Backend::Rapier(engine) => {
                *result = engine.step();
                if result.is_ok() {
                    engine.read(&mut self.states, &mut self.contacts);
                }
                None
            }
        }
    }

    /// State of every link after the last step or reset, `[links]`.
    pub fn states(&self) -> &[LinkState] {
        &self.states
    }

    /// Whether each link pressed on the ground in the last physics step of the last control step, `[links]`.
    pub fn contacts(&self) -> &[bool] {
        &self.contacts
    }

    /// The settings that the world was made with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}

/// Distance from the origin beyond which a character counts as lost, metres. Chosen: at 10 km, neighbouring f32 are a
/// millimetre apart.
const FARTHEST: f32 = 1e4;

fn is_near(state: &LinkState) -> bool {
    state.pose.translation.vector.norm() < FARTHEST
}
