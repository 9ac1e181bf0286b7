//! Phase-based imitation of reference motions (Peng et al. 2018, "DeepMimic"; Booth & Ivanov 2020).
//!
//! An agent is rewarded for being like its reference: a motion that goes on in time whatever the agent does, and whose phase
//! the policy sees. Every observation block, reward term and termination rule is a pure function that training, evaluation,
//! plots and tests all call.

mod blend;
mod clock;
mod environment;
mod measures;
mod observe;
mod placement;
mod playback;
mod reference;
mod settings;
#[cfg(test)]
mod tests;
mod touch;
mod transition;
mod verdict;

pub(super) use measures::measures;
pub use observe::{layout, observation_size, observe};
pub use placement::Placement;
pub use reference::Reference;
pub use settings::{ImitationSettings, Observations};
pub(super) use verdict::verdict;

use super::environment::{Environment, Task};
use super::episode::{Episode, Measure};
use super::error::TaskError;
use super::follow::TERM_NAMES;
use super::starts::{Span, StartDistribution};
use super::step::{Block, Case, Purpose};
use super::verdict::{Performance, Verdict};
use crate::clip::LoopMode;
use crate::motion::Motion;
use crate::task::model::CharacterModel;
use environment::Imitation;
use std::sync::Arc;

/// The task's name on the command line and in files.
pub(super) const NAME: &str = "imitate";

/// Imitation of one or several motions by one policy.
pub struct Imitate {
    model: Arc<CharacterModel>,
    references: Arc<[Arc<Reference>]>,
    settings: ImitationSettings,
    observation: Vec<Block>,
    action: Vec<Block>,
    reward_terms: Vec<&'static str>,
    cases: Vec<Case>,
}

impl Imitate {
    /// The task of performing `motions`.
    ///
    /// # Errors
    /// Settings out of their ranges, no motion, a motion of another skeleton or of a single frame, or motions that put
    /// different bodies on the ground.
    pub fn new(
        model: Arc<CharacterModel>,
        motions: &[Motion],
        settings: ImitationSettings,
    ) -> Result<Self, TaskError> {
        settings.check()?;
        let references: Result<Arc<[_]>, _> = motions
            .iter()
            .map(|motion| Reference::new(motion, &model).map(Arc::new))
            .collect();
        let references = references?;
        let contacts = contacts(&references)?;
        let terms = TERM_NAMES.into_iter().zip(settings.rewards.kernels.has());
        Ok(Imitate {
            observation: layout(settings.observations, &model, contacts),
            action: vec![Block {
                name: "joint_target",
                size: model.character.dof,
            }],
            reward_terms: terms
                .filter(|(_, has)| *has)
                .map(|(name, _)| name)
                .collect(),
            cases: references.iter().map(|r| case(r)).collect(),
            model,
            references,
            settings,
        })
    }
}

/// Contact links of the motions, which must be the same for all.
fn contacts(references: &[Arc<Reference>]) -> Result<usize, TaskError> {
    let first = references.first().ok_or(TaskError::NoMotion)?;
    let other = references
        .iter()
        .find(|r| r.contact_bodies != first.contact_bodies);
    match other {
        Some(other) => Err(TaskError::OtherContacts {
            first: first.name.clone(),
            other: other.name.clone(),
        }),
        None => Ok(first.contact_bodies.len()),
    }
}

fn case(reference: &Reference) -> Case {
    Case {
        name: reference.name.clone(),
        duration_s: match reference.loop_mode() {
            LoopMode::Wrap => None,
            LoopMode::Clamp => Some(reference.duration()),
        },
    }
}

impl Task for Imitate {
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
        &self.references[0].contact_bodies
    }

    fn starts(&self) -> StartDistribution {
        let control_dt = self.settings.physics.control_dt();
        let span = |reference: &Arc<Reference>| Span {
            duration: reference.duration(),
            last_start: reference.last_start(control_dt),
            wraps: reference.loop_mode() == LoopMode::Wrap,
            beyond_reach: reference.beyond_reach.clone(),
        };
        let spans: Vec<Span> = self.references.iter().map(span).collect();
        StartDistribution::new(
            &spans,
            self.settings.start_anywhere,
            self.settings.adaptive_starts,
            control_dt,
        )
    }

    fn is_beyond_reach(&self, case: usize, share: f64) -> bool {
        let control_dt = self.settings.physics.control_dt();
        let reference = self.references.get(case);
        reference.is_some_and(|r| r.is_beyond_reach(share, control_dt))
    }

    fn cases(&self) -> &[Case] {
        &self.cases
    }

    fn environment(&self, purpose: Purpose) -> Box<dyn Environment> {
        Box::new(Imitation::new(
            self.model.clone(),
            self.references.clone(),
            &self.settings,
            purpose,
        ))
    }

    fn measures(&self, episodes: &[Episode]) -> Vec<Measure> {
        let largest = |e: &Episode| self.references[e.start.case].largest_momentum();
        let largest_momentum = episodes.iter().map(largest).fold(0.0, f32::max);
        let contacts = &self.references[0].contacts_of_motion;
        measures(&self.model, contacts, largest_momentum, episodes)
    }

    fn verdict(&self, found: &Performance) -> Verdict {
        verdict(found)
    }
}
