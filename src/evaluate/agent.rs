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
    /// More control steps than can be kept.
    TooLong {
        /// How many were asked for.
        steps: f64,
        /// How many can be.
        most: f64,
    },
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
            Self::TooLong { steps, most } => Explanation::input(format!(
                "the episodes have {steps:.0} control steps, and at most {most:.0} can be kept"
            ))
            .remedy("choose fewer or shorter episodes"),
        }
    }
}

explained!(EvaluateError);
