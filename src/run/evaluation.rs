//! The evaluation of a run: how well its policy performs each of its motions.

use super::error::RunError;
use super::files;
use super::folder::Run;
use crate::evaluate::{
    Agent, EvaluateError, Evaluation, Options, SteeringEvaluation, SteeringOptions, evaluate,
    evaluate_steering,
};
use crate::task::Case;
use serde::Serialize;
use serde_json::{Value, json};

/// How well a run performs one of its motions.
#[derive(Clone, Debug, Serialize)]
pub struct CaseEvaluation {
    /// Name of the motion.
    pub motion: String,
    /// Length of an episode from the first frame, seconds.
    pub seconds: f64,
    /// What was measured.
    #[serde(flatten)]
    pub evaluation: Evaluation,
}

impl Run {
    /// Evaluates the saved policy on every motion of the run.
    ///
    /// # Errors
    /// A run without a policy, or a broken one.
    pub fn evaluate(&self, options: &Options) -> Result<Vec<CaseEvaluation>, RunError> {
        let controller = self.controller()?;
        // What the agent can't do is the policy's fault; what was asked for isn't.
        let policy = self.dir().join(files::POLICY);
        let blamed = |error: EvaluateError| match error {
            EvaluateError::Learn(_) => RunError::in_file(&policy)(error),
            _ => error.into(),
        };
        let cases = controller.task().cases().iter().enumerate();
        let one = |(number, case): (usize, &Case)| {
            Ok(CaseEvaluation {
                motion: case.name.clone(),
                seconds: case.duration_s.unwrap_or(options.seconds),
                evaluation: evaluate(&controller, number, options).map_err(blamed)?,
            })
        };
        cases.map(one).collect()
    }

    /// Evaluates the saved policy of a run that is steered.
    ///
    /// # Errors
    /// A run without a policy, or a broken one.
    pub fn evaluate_steering(
        &self,
        options: &SteeringOptions,
    ) -> Result<SteeringEvaluation, RunError> {
        let controller = self.controller()?;
        let policy = self.dir().join(files::POLICY);
        evaluate_steering(&controller, options).map_err(|error| match error {
            EvaluateError::Learn(_) => RunError::in_file(&policy)(error),
            _ => error.into(),
        })
    }

    /// Keeps an evaluation of how the run is steered, in `eval.json`.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn keep_steering(&self, found: &SteeringEvaluation) -> Result<(), RunError> {
        self.write(files::EVALUATION, &format!("{:#}\n", json!(found)))
    }

    /// Keeps an evaluation as that of the run, in `eval.json`.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn keep_evaluation(&self, results: &[CaseEvaluation]) -> Result<(), RunError> {
        self.write(files::EVALUATION, &CaseEvaluation::text(results))
    }
}

impl CaseEvaluation {
    /// The evaluation of a run in JSON: the fields of its one motion, or a list of `motions`.
    pub fn json(results: &[Self]) -> Value {
        match results {
            [one] => json!(one),
            many => json!({ "motions": many }),
        }
    }

    /// The same JSON as the text of a file.
    pub fn text(results: &[Self]) -> String {
        format!("{:#}\n", Self::json(results))
    }
}
