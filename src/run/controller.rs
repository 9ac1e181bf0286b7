//! A trained policy with all that it needs to act. It takes mean actions, without noise, and learns nothing.

use crate::evaluate::Agent;
use crate::learn::{
    ActWorkspace, FrozenNormalizer, LearnError, Normalizer, OBSERVATION_LIMIT, Policy, PolicySpec,
    check_length,
};
use crate::task::{Environment, Task, size};
use std::sync::Arc;

/// Acts by the mean of a policy.
#[derive(Clone)]
pub struct Controller {
    policy: Policy,
    parameters: Vec<f32>,
    normalizer: FrozenNormalizer<f32>,
    task: Arc<dyn Task>,
}

/// Buffers of one episode.
#[derive(Default)]
pub struct Memory {
    /// The observation.
    seen: Vec<f32>,
    /// The same, normalised.
    normal: Vec<f32>,
    workspace: ActWorkspace<f32>,
}

impl Controller {
    /// A policy that performs `task`.
    ///
    /// # Errors
    /// Parameters that don't fit the network, or a network that doesn't fit the task.
    pub fn new(
        spec: PolicySpec,
        parameters: Vec<f32>,
        normalizer: &Normalizer,
        task: Arc<dyn Task>,
    ) -> Result<Self, LearnError> {
        check_length("observation", size(task.observation()), spec.observation)?;
        check_length("action", size(task.action()), spec.action)?;
        let policy = Policy::new(spec)?;
        let count = policy.parameter_count();
        check_length("parameter vector", parameters.len(), count)?;
        Ok(Controller {
            normalizer: normalizer.frozen(OBSERVATION_LIMIT),
            policy,
            parameters,
            task,
        })
    }
}

impl Agent for Controller {
    type Memory = Memory;

    fn task(&self) -> &Arc<dyn Task> {
        &self.task
    }

    fn act<'m>(
        &self,
        environment: &dyn Environment,
        memory: &'m mut Memory,
    ) -> Result<&'m [f32], LearnError> {
        memory.seen.resize(self.policy.spec().observation, 0.0);
        memory.normal.resize(memory.seen.len(), 0.0);
        environment.observe(&mut memory.seen);
        self.normalizer.apply(&memory.seen, &mut memory.normal)?;
        let policy = &self.policy;
        let action = policy.mean(&self.parameters, &memory.normal, &mut memory.workspace)?;
        match action.iter().position(|a| !a.is_finite()) {
            Some(column) => Err(LearnError::Action { column }),
            None => Ok(action),
        }
    }
}
