//! A character that follows a player (Bergamin et al. 2019, "DReCon"; Booth & Ivanov 2020, section 4).
//!
//! An animated character goes where the player asks it to, and a simulated one is rewarded for being like it.

mod environment;
mod feet;
mod gait;
mod gaits;
mod guide;
mod leg;
mod mirror;
mod observe;
mod player;
mod pose;
mod role;
mod settings;
mod space;
mod spring;
#[cfg(test)]
mod tests;
mod walker;

pub use role::{Role, Traits};
pub use settings::{InputSettings, SteerSettings};

use super::environment::{Environment, Task};
use super::episode::{Episode, Measure};
use super::error::TaskError;
use super::follow::TERM_NAMES;
use super::starts::{Span, StartDistribution};
use super::step::{Block, Case, Purpose};
use super::verdict::{Performance, Verdict};
use crate::motion::Motion;
use crate::task::model::CharacterModel;
use environment::Steering;
use gaits::Gaits;
use nalgebra::Vector2;
use player::Player;
use std::sync::Arc;

/// The task's name on the command line and in files.
pub(super) const NAME: &str = "steer";

/// Following an animated character that goes where it is asked to.
pub struct Steer {
    model: Arc<CharacterModel>,
    gaits: Arc<Gaits>,
    settings: SteerSettings,
    observation: Vec<Block>,
    action: Vec<Block>,
    reward_terms: Vec<&'static str>,
    contact_bodies: Vec<usize>,
    cases: Vec<Case>,
}

impl Steer {
    /// The task of following a character that is made of `motions`.
    ///
    /// # Errors
    /// Settings out of their ranges, motions of another skeleton, none that stands or none that walks.
    pub fn new(
        model: Arc<CharacterModel>,
        motions: &[Motion],
        settings: SteerSettings,
    ) -> Result<Self, TaskError> {
        settings.check()?;
        for motion in motions {
            motion.check_skeleton(&model.skeleton)?;
        }
        let gaits = Arc::new(Gaits::new(motions, &model)?);
        let terms = TERM_NAMES.into_iter().zip(settings.rewards.kernels.has());
        let contact_bodies: Vec<usize> = model.contacts.iter().map(|c| c.body).collect();
        Ok(Steer {
            observation: observe::layout(&model, contact_bodies.len()),
            action: vec![Block {
                name: "joint_target",
                size: model.character.dof,
            }],
            reward_terms: terms
                .filter(|(_, has)| *has)
                .map(|(name, _)| name)
                .collect(),
            contact_bodies,
            cases: vec![Case {
                name: NAME.to_owned(),
                duration_s: None,
            }],
            model,
            gaits,
            settings,
        })
    }

    /// Who asks in training.
    fn player(&self) -> Player {
        let fastest = self.gaits.space.fastest(&Vector2::x());
        Player::new(self.settings.input, fastest, self.gaits.space.strafes())
    }
}

impl Task for Steer {
    fn name(&self) -> &'static str {
        NAME
    }

    fn model(&self) -> &Arc<CharacterModel> {
        &self.model
    }

    fn control_hz(&self) -> f64 {
        self.settings.physics.control_hz
    }

    fn observation(&self) -> &[Block] {
        &self.observation
    }

    fn action(&self) -> &[Block] {
        &self.action
    }

    fn reward_terms(&self) -> &[&'static str] {
        &self.reward_terms
    }

    fn contact_bodies(&self) -> &[usize] {
        &self.contact_bodies
    }

    fn starts(&self) -> StartDistribution {
        // Episodes begin wherever the animated character is: there is nothing to draw from.
        let span = Span {
            duration: 1.0,
            last_start: 0.0,
            wraps: false,
            beyond_reach: Vec::new(),
        };
        let control_dt = self.settings.physics.control_dt();
        StartDistribution::new(&[span], false, 0.0, control_dt)
    }

    fn is_beyond_reach(&self, _case: usize, _share: f64) -> bool {
        false
    }

    fn cases(&self) -> &[Case] {
        &self.cases
    }

    fn environment(&self, purpose: Purpose) -> Box<dyn Environment> {
        Box::new(Steering::new(self, purpose))
    }

    fn measures(&self, episodes: &[Episode]) -> Vec<Measure> {
        super::imitate::measures(&self.model, &self.contact_numbers(), 0.0, episodes)
    }

    fn verdict(&self, found: &Performance) -> Verdict {
        super::imitate::verdict(found)
    }
}

impl Steer {
    fn contact_numbers(&self) -> Vec<usize> {
        (0..self.contact_bodies.len()).collect()
    }
}
