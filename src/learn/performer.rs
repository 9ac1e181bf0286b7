//! A trained policy with all that it needs to act: no exploration, no learning.

use super::{
    ActWorkspace, FrozenNormalizer, LearnError, Normalizer, OBSERVATION_LIMIT, Policy, PolicySpec,
};
use crate::task::{Imitate, Reference, Setting, Stage};
use std::sync::Arc;

/// Acts by the mean of a policy.
#[derive(Clone)]
pub struct Performer {
    policy: Policy,
    parameters: Vec<f32>,
    normalizer: FrozenNormalizer<f32>,
    stage: Arc<Stage>,
    references: Vec<Arc<Reference>>,
    setting: Setting,
}

/// Buffers of one acting performer.
#[derive(Default)]
pub struct Memory {
    seen: Vec<f32>,
    normal: Vec<f32>,
    workspace: ActWorkspace<f32>,
}

impl Performer {
    /// # Errors
    /// Parameters that don't fit the network, or a network that doesn't fit the task.
    pub fn new(
        spec: PolicySpec,
        parameters: Vec<f32>,
        normalizer: &Normalizer,
        stage: Arc<Stage>,
        references: Vec<Arc<Reference>>,
        setting: Setting,
    ) -> Result<Self, LearnError> {
        let policy = Policy::new(spec)?;
        super::check_length(
            "parameter vector",
            parameters.len(),
            policy.parameter_count(),
        )?;
        let performer = Performer {
            normalizer: normalizer.frozen(OBSERVATION_LIMIT),
            policy,
            parameters,
            stage,
            references,
            setting,
        };
        for which in 0..performer.references.len() {
            let env = performer.environment(which, &performer.setting);
            super::check_length(
                "observation",
                env.observation_size(),
                performer.policy.spec().observation,
            )?;
            super::check_length("action", env.action_size(), performer.policy.spec().action)?;
        }
        Ok(performer)
    }

    pub fn stage(&self) -> &Arc<Stage> {
        &self.stage
    }

    pub fn references(&self) -> &[Arc<Reference>] {
        &self.references
    }

    /// The task that the policy was trained on.
    pub fn setting(&self) -> &Setting {
        &self.setting
    }

    /// An environment for reference number `which`.
    pub fn environment(&self, which: usize, setting: &Setting) -> Imitate {
        Imitate::new(self.stage.clone(), self.references[which].clone(), setting)
    }

    /// The action in the present state of `env`.
    ///
    /// # Errors
    /// An environment of another shape than the performer's own.
    pub fn act<'m>(&self, env: &Imitate, memory: &'m mut Memory) -> Result<&'m [f32], LearnError> {
        memory.seen.resize(env.observation_size(), 0.0);
        memory.normal.resize(memory.seen.len(), 0.0);
        env.observe(&mut memory.seen);
        self.normalizer.apply(&memory.seen, &mut memory.normal)?;
        self.policy
            .mean(&self.parameters, &memory.normal, &mut memory.workspace)
    }
}
