//! What acts in the episodes of an evaluation.

use crate::explain::{Explain, Explanation, explained};
use crate::learn::LearnError;
use crate::task::{Environment, Task, TaskError};
use std::sync::Arc;

/// Something that performs a task: a trained policy, or a controller written by hand to compare it with.
pub trait Agent: Sync {
    /// Buffers of one episode, so that steps allocate nothing.
    type Memory: Default;

    /// The task that the agent performs.
    fn task(&self) -> &Arc<dyn Task>;

    /// The action in the present state of `environment`, as long as [`Task::action`] says.
    ///
    /// # Errors
    /// An environment of another shape than the agent's own.
    fn act<'m>(
        &self,
        environment: &dyn Environment,
        memory: &'m mut Self::Memory,
    ) -> Result<&'m [f32], LearnError>;
}

/// Why an evaluation couldn't go on.
#[derive(Debug)]
pub enum EvaluateError {
    /// The agent couldn't act.
    Learn(LearnError),
    /// The task couldn't do what it was asked for.
    Task(TaskError),
}

impl From<LearnError> for EvaluateError {
    fn from(error: LearnError) -> Self {
        Self::Learn(error)
    }
}

impl From<TaskError> for EvaluateError {
    fn from(error: TaskError) -> Self {
        Self::Task(error)
    }
}

impl Explain for EvaluateError {
    fn explain(&self) -> Explanation {
        match self {
            Self::Learn(error) => error.explain(),
            Self::Task(error) => error.explain(),
        }
    }
}

explained!(EvaluateError);
