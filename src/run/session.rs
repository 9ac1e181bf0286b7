//! The training of a run, round after round: each is saved at its end, and an evaluation follows the last.

use super::checkpoint::PolicyFile;
use super::error::RunError;
use super::evaluation::CaseEvaluation;
use super::files;
use super::folder::Run;
use crate::evaluate::Options;
use crate::learn::{Metrics, Trainer};
use serde::Serialize;
use serde_json::json;
use std::time::Instant;

/// Trains a run from where its last checkpoint stands.
///
/// Between two rounds no episode is under way: that is where a run is saved, can be stopped, and goes on to the same bits.
///
/// ```no_run
/// # fn main() -> Result<(), mimic::run::RunError> {
/// use mimic::run::{Run, Session};
///
/// let mut session = Session::open(Run::open("runs/kick")?)?;
/// while !session.is_done() {
///     session.train_round()?;
/// }
/// for case in session.finish(&Default::default())? {
///     println!("{}: {:?}", case.motion, case.evaluation.measure("survival"));
/// }
/// # Ok(())
/// # }
/// ```
pub struct Session {
    run: Run,
    trainer: Trainer,
    clock: Clock,
}

/// What an iteration did, and when: a line of `metrics.jsonl`.
#[derive(Clone, Debug, Serialize)]
pub struct Iteration {
    /// What the trainer reports.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Seconds of training up to here, all sessions of the run together.
    pub seconds: f64,
    /// How fast this iteration was.
    pub samples_per_second: f64,
}

/// When iterations end.
struct Clock {
    /// Seconds that earlier sessions of this run took.
    before: f64,
    begun: Instant,
    last: Instant,
    last_samples: u64,
}

impl Session {
    /// Goes on with a run from its last checkpoint, or begins it if there is none. Until the session ends, no other process
    /// can train the run.
    ///
    /// # Errors
    /// A run that another process trains, a plan that can't be trained, or a broken checkpoint.
    pub fn open(mut run: Run) -> Result<Self, RunError> {
        run.hold()?;
        let trainer = run.trainer()?;
        run.trim_metrics(trainer.iteration())?;
        let now = Instant::now();
        let clock = Clock {
            before: run.seconds(),
            begun: now,
            last: now,
            last_samples: trainer.samples(),
        };
        Ok(Self {
            run,
            trainer,
            clock,
        })
    }

    /// The run that is trained.
    pub fn run(&self) -> &Run {
        &self.run
    }

    /// What the run has learned so far, in memory.
    pub fn trainer(&self) -> &Trainer {
        &self.trainer
    }

    /// Whether the samples of the plan are used up.
    pub fn is_done(&self) -> bool {
        self.trainer.is_done()
    }

    /// Whether the run can be saved now and go on from here to the same bits.
    pub fn can_be_saved(&self) -> bool {
        self.trainer.is_done() || self.trainer.is_between_rounds()
    }

    /// Trains for one iteration and adds its line to `metrics.jsonl`.
    ///
    /// # Errors
    /// A quantity that stopped being finite, or a file that can't be written.
    pub fn iterate(&mut self) -> Result<Iteration, RunError> {
        let metrics = self.trainer.iterate()?;
        let iteration = self.clock.time(metrics);
        self.run.log(&json!(iteration))?;
        Ok(iteration)
    }

    /// Trains to the end of the round and saves. Returns what its iterations did.
    ///
    /// # Errors
    /// As [`Session::iterate`] and [`Session::save`].
    pub fn train_round(&mut self) -> Result<Vec<Iteration>, RunError> {
        let mut round = vec![self.iterate()?];
        while !self.can_be_saved() {
            round.push(self.iterate()?);
        }
        self.save()?;
        Ok(round)
    }

    /// Saves checkpoint and policy, each in one step. The evaluation and the recording of an older policy are removed,
    /// so that finding them means that the run was finished.
    ///
    /// # Errors
    /// A folder that can't be written; the last good files stay.
    pub fn save(&self) -> Result<(), RunError> {
        self.remove_results()?;
        self.run.save(&self.trainer)
    }

    /// Saves the policy alone, for a session that has no time to finish its round. It can be evaluated and replayed. The run
    /// goes on from its last checkpoint, or from its beginning, and does the round again, to the same bits.
    ///
    /// # Errors
    /// A folder that can't be written; the last good policy stays.
    pub fn save_policy(&self) -> Result<(), RunError> {
        self.remove_results()?;
        if !self.run.is_saved() {
            let (settings, task) = (self.trainer.settings().clone(), self.trainer.task().clone());
            self.run.save(&Trainer::new(settings, task)?)?;
        }
        self.run.save_policy(&self.trainer)
    }

    fn remove_results(&self) -> Result<(), RunError> {
        self.run.check_place()?;
        for outdated in [files::EVALUATION, files::RECORDING] {
            std::fs::remove_file(self.run.dir().join(outdated)).ok();
        }
        Ok(())
    }

    /// Whether the run's policy file is whole and holds what was learned last. It can be lost, damaged, or older than the
    /// checkpoint where a process was killed between the two.
    pub fn has_policy(&self) -> bool {
        let state = self.trainer.state();
        let path = self.run.dir().join(files::POLICY);
        PolicyFile::load(path).is_ok_and(|policy| {
            (policy.spec, policy.parameters) == (state.learner.spec, state.learner.parameters)
                && policy.normalizer == state.normalizer
                && self.run.controller().is_ok()
        })
    }

    /// Evaluates what was saved last and keeps the result in `eval.json`.
    ///
    /// # Errors
    /// A run without a policy, or a file that can't be written.
    pub fn finish(&self, options: &Options) -> Result<Vec<CaseEvaluation>, RunError> {
        let results = self.run.evaluate(options)?;
        self.run.keep_evaluation(&results)?;
        Ok(results)
    }
}

impl Clock {
    fn time(&mut self, metrics: Metrics) -> Iteration {
        let now = Instant::now();
        let took = (now - self.last).as_secs_f64().max(1e-9);
        let samples = metrics.samples.saturating_sub(self.last_samples);
        (self.last, self.last_samples) = (now, metrics.samples);
        Iteration {
            metrics,
            seconds: self.before + (now - self.begun).as_secs_f64(),
            samples_per_second: samples as f64 / took,
        }
    }
}
