//! The folder of a run: everything needed to resume, replay and reproduce it.

use super::checkpoint::{Checkpoint, PolicyFile};
use super::claim::Held;
use super::controller::Controller;
use super::error::RunError;
use super::files;
use super::plan::Plan;
use crate::clip::LoopMode;
use crate::evaluate::{Options, longest};
use crate::file::{Flaw, Format, Lock, text_at_most};
use crate::learn::{Policy, PolicySpec, Trainer, TrainerState};
use crate::motion::Motion;
use crate::skeleton::Skeleton;
use crate::task::{Block, CharacterModel, Perturbations, Task, TaskError, TaskSettings, size};
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What `config.json` says.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RunConfig {
    format: String,
    version: u64,
    skeleton: String,
    motions: Vec<String>,
    plan: Plan,
}

const FORMAT: Format = Format {
    name: "run",
    version: 1,
    remedy: "train a new run",
};

/// What a policy file says beside its network: all that it takes to act.
#[derive(Serialize, Deserialize)]
struct PolicyDetails {
    task: TaskSettings,
    /// Name of the character.
    skeleton: String,
    mjcf: String,
    slots: String,
    /// What the policy sees, for readers of the file.
    #[serde(skip_deserializing)]
    observation: Vec<Block>,
}

impl RunConfig {
    pub(super) fn new(skeleton: &str, motions: usize, plan: Plan) -> Self {
        Self {
            format: FORMAT.name.to_owned(),
            version: FORMAT.version,
            skeleton: skeleton.to_owned(),
            motions: (0..motions).map(files::reference).collect(),
            plan,
        }
    }

    /// The text of the `config.json` in the folder `dir`.
    pub(super) fn text(&self, dir: &Path) -> Result<String, RunError> {
        serde_json::to_string_pretty(self).map_err(|e| corrupt(&dir.join(files::CONFIG), e))
    }
}

/// What is read of a line of `metrics.jsonl`. Whatever else is there is passed over, and takes no memory.
#[derive(Deserialize)]
struct Line {
    iteration: u64,
    seconds: Option<f64>,
}

/// A training run on disk.
pub struct Run {
    dir: PathBuf,
    /// Held while the run is trained.
    pub(super) held: Option<Arc<Held>>,
    plan: Plan,
    skeleton: Skeleton,
    motions: Vec<Motion>,
}

/// Most bytes that are read of the run's short files, and of its metrics. Chosen: a hundred times what is written of a plan or
/// a character, and as many lines as two billion samples make by the default.
const MOST_BYTES: u64 = 1 << 20;
const MOST_METRICS: u64 = 1 << 30;

/// Tensor of the checkpoint that says where episodes begin.
const STARTS: &str = "starts";

impl Run {
    /// Opens the run in `dir`.
    ///
    /// # Errors
    /// A folder without a run, or with a broken one.
    pub fn open(dir: impl AsRef<Path>) -> Result<Self, RunError> {
        let dir = dir.as_ref();
        let path = dir.join(files::CONFIG);
        if !path.exists() {
            return Err(RunError::NoRun(dir.to_owned()));
        }
        let config = config(&path)?;
        let mjcf = read(&dir.join(files::SKELETON), MOST_BYTES)?;
        let slots = read(&dir.join(files::SLOTS), MOST_BYTES)?;
        let mut motions = Vec::new();
        for name in &config.motions {
            motions.push(Motion::load(dir.join(name))?);
        }
        Ok(Run {
            dir: dir.to_owned(),
            held: None,
            plan: config.plan,
            skeleton: Skeleton::from_mjcf(&config.skeleton, &mjcf, Some(&slots))
                .map_err(|e| e.in_files(&dir.join(files::SKELETON), &dir.join(files::SLOTS)))
                .map_err(RunError::in_file(&dir.join(files::SKELETON)))?,
            motions,
        })
    }

    /// The folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// What the run learns, and how.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The physics character.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// The motions that the run learns.
    pub fn motions(&self) -> &[Motion] {
        &self.motions
    }

    /// Whether the run was saved at least once, so that there is something to go on from.
    pub fn is_saved(&self) -> bool {
        self.dir.join(files::CHECKPOINT).exists()
    }

    /// Makes this process the only one that may change the run, until the run is dropped.
    ///
    /// # Errors
    /// A run that another process holds, or a folder that can't be written.
    pub fn hold(&mut self) -> Result<(), RunError> {
        if self.held.is_none() {
            self.held = Some(Arc::new(Held::take(&self.dir, Vec::new())?));
        }
        Ok(())
    }

    /// Checks, before anything is written, that the run's path still leads to the folder that this process holds. Another
    /// folder in its place may be another run, which another process trains.
    ///
    /// # Errors
    /// [`RunError::Moved`] where it doesn't.
    pub fn check_place(&self) -> Result<(), RunError> {
        self.held.as_ref().map_or(Ok(()), |held| held.check())
    }

    /// Writes, if the run's path leads where it should. A folder that is moved meanwhile makes an error of its own, which says less.
    fn in_place(&self, write: impl FnOnce() -> Result<(), RunError>) -> Result<(), RunError> {
        self.check_place()?;
        write().map_err(|error| self.check_place().err().unwrap_or(error))
    }

    /// A trainer that goes on from the last checkpoint, or begins if there is none.
    ///
    /// # Errors
    /// A plan that can't be trained, or a broken checkpoint.
    pub fn trainer(&self) -> Result<Trainer, RunError> {
        check_lengths(&self.plan, &self.motions)?;
        let task = build(&self.plan.task, &self.skeleton, &self.motions)?;
        let mut trainer = Trainer::new(self.plan.trainer(), task)?;
        let path = self.dir.join(files::CHECKPOINT);
        if path.symlink_metadata().is_err() {
            self.check_unlearned(&path)?;
        } else {
            let checkpoint = Checkpoint::load(&path)?;
            self.check_progress(&checkpoint, &path)?;
            let Checkpoint {
                iteration,
                learner,
                normalizer,
                mut tensors,
                ..
            } = checkpoint;
            let state = TrainerState {
                iteration,
                learner,
                normalizer,
                starts: tensors.remove(STARTS).unwrap_or_default(),
            };
            trainer.restore(state).map_err(RunError::in_file(&path))?;
        }
        Ok(trainer)
    }

    /// Checks that a run without a checkpoint hasn't learned anything yet. It would begin anew, and replace its policy.
    fn check_unlearned(&self, checkpoint: &Path) -> Result<(), RunError> {
        if !self.dir.join(files::POLICY).exists() {
            return Ok(());
        }
        Err(RunError::Config {
            path: checkpoint.to_owned(),
            reason: "this is missing, and without it the policy can't learn on".to_owned(),
        })
    }

    /// Checks that a checkpoint is one of this run: its samples are those of its iterations.
    fn check_progress(&self, checkpoint: &Checkpoint, path: &Path) -> Result<(), RunError> {
        let (iteration, samples) = (checkpoint.iteration, checkpoint.samples);
        let each = (self.plan.environments * self.plan.horizon) as u64;
        if iteration.checked_mul(each) == Some(samples) {
            return Ok(());
        }
        Err(RunError::Config {
            path: path.to_owned(),
            reason: format!(
                "{samples} samples in {iteration} iterations don't fit the plan in {}",
                files::CONFIG
            ),
        })
    }

    /// Saves checkpoint and policy, each in one step.
    ///
    /// # Errors
    /// A folder that can't be written; the last good files stay.
    pub fn save(&self, trainer: &Trainer) -> Result<(), RunError> {
        let TrainerState {
            iteration,
            learner,
            normalizer,
            starts,
        } = trainer.state();
        let checkpoint = Checkpoint {
            iteration,
            samples: trainer.samples(),
            learner,
            normalizer,
            tensors: [(STARTS.to_owned(), starts)].into(),
        };
        self.in_place(|| Ok(checkpoint.save(self.dir.join(files::CHECKPOINT))?))?;
        self.save_policy(trainer)
    }

    /// Saves the policy alone, in one step.
    ///
    /// # Errors
    /// A folder that can't be written; the last good policy stays.
    pub fn save_policy(&self, trainer: &Trainer) -> Result<(), RunError> {
        let TrainerState {
            learner,
            normalizer,
            ..
        } = trainer.state();
        let policy = PolicyFile {
            spec: learner.spec,
            parameters: learner.parameters,
            normalizer,
            details: json!(PolicyDetails {
                task: self.plan.task.clone(),
                skeleton: self.skeleton.name.clone(),
                mjcf: self.skeleton.mjcf.clone(),
                slots: self.skeleton.slots_json(),
                observation: trainer.task().observation().to_vec(),
            }),
        };
        self.in_place(|| Ok(policy.save(self.dir.join(files::POLICY))?))
    }

    /// Appends a line to `metrics.jsonl`: the metrics with the run's clock.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn log(&self, line: &Value) -> Result<(), RunError> {
        let path = self.dir.join(files::METRICS);
        let mut options = fs::OpenOptions::new();
        options.create(true).append(true);
        self.in_place(|| {
            let mut file = options.open(&path).map_err(unwritten(&path))?;
            // In one piece, so that whoever reads along never finds half a line.
            file.write_all(format!("{line}\n").as_bytes())
                .map_err(unwritten(&path))
        })
    }

    /// Seconds of training so far, from the last line of `metrics.jsonl`; 0 before there is one.
    pub fn seconds(&self) -> f64 {
        let text = read(&self.dir.join(files::METRICS), MOST_METRICS).unwrap_or_default();
        let last = text.lines().last();
        let line = last.and_then(|line| serde_json::from_str::<Line>(line).ok());
        line.and_then(|line| line.seconds).unwrap_or(0.0)
    }

    /// Writes a file of the run, such as `eval.json`, in one step.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn write(&self, name: &str, text: &str) -> Result<(), RunError> {
        self.in_place(|| write(&self.dir.join(name), text))
    }

    /// The policy, ready to act.
    ///
    /// # Errors
    /// A run without a policy, or a broken one.
    pub fn controller(&self) -> Result<Controller, RunError> {
        let path = self.dir.join(files::POLICY);
        if !path.exists() {
            let dir = self.dir.clone();
            let is_trained = self.held.is_none() && Lock::holder(&dir).is_some();
            return Err(match is_trained {
                true => RunError::NoPolicyYet(dir),
                false => RunError::NoPolicy(dir),
            });
        }
        let file = PolicyFile::load(&path)?;
        let details: PolicyDetails =
            serde_json::from_value(file.details).map_err(|e| corrupt(&path, e))?;
        let skeleton = Skeleton::from_mjcf(&details.skeleton, &details.mjcf, Some(&details.slots))
            .map_err(RunError::in_file(&path))?;
        let task =
            build(&details.task, &skeleton, &self.motions).map_err(RunError::in_file(&path))?;
        let (spec, parameters) = (file.spec, file.parameters);
        Controller::new(spec, parameters, &file.normalizer, task).map_err(RunError::in_file(&path))
    }

    /// Drops the metrics of iterations after the checkpoint, which will be done again.
    pub(super) fn trim_metrics(&self, iteration: u64) -> Result<(), RunError> {
        let path = self.dir.join(files::METRICS);
        // A link that leads nowhere is there: lines would be added where it leads.
        if path.symlink_metadata().is_err() {
            return Ok(());
        }
        let known = |line: &&str| {
            serde_json::from_str::<Line>(line).is_ok_and(|line| line.iteration <= iteration)
        };
        let text = read(&path, MOST_METRICS)?;
        let kept: String = text
            .lines()
            .filter(known)
            .map(|line| format!("{line}\n"))
            .collect();
        write(&path, &kept)
    }
}

/// The task with these settings, for a character and its motions.
fn build(
    settings: &TaskSettings,
    skeleton: &Skeleton,
    motions: &[Motion],
) -> Result<Arc<dyn Task>, RunError> {
    let model = Arc::new(CharacterModel::new(skeleton.clone())?);
    Ok(settings.build(model, motions)?)
}

/// Checks that a plan can be trained: builds everything that training needs except the environments, which take longest.
pub(super) fn check(plan: &Plan, skeleton: &Skeleton, motions: &[Motion]) -> Result<(), RunError> {
    plan.check()?;
    check_lengths(plan, motions)?;
    let task = build(&plan.task, skeleton, motions)?;
    let spec = PolicySpec {
        observation: size(task.observation()),
        action: size(task.action()),
        hidden: plan.hidden.clone(),
        activation: plan.activation,
    };
    Policy::new(spec)?;
    Ok(())
}

/// Checks that what is learned can also be evaluated, by the default options: a run is finished by its evaluation. Motions that
/// repeat are evaluated for a while.
fn check_lengths(plan: &Plan, motions: &[Motion]) -> Result<(), RunError> {
    let perturbations = Some(*plan.task.perturbations()).filter(Perturbations::is_on);
    let options = Options {
        perturbations,
        ..Options::default()
    };
    let most = longest(options.performed(), plan.task.physics().control_hz);
    let ends = |motion: &&Motion| motion.loop_mode == LoopMode::Clamp;
    let mut ending = motions.iter().filter(ends);
    match ending.find(|motion| motion.duration() > most) {
        Some(motion) => Err(RunError::Task(TaskError::TooLong {
            motion: motion.name.clone(),
            seconds: motion.duration(),
            most,
        })),
        None => Ok(()),
    }
}

/// Reads and checks the `config.json` at `path`.
fn config(path: &Path) -> Result<RunConfig, RunError> {
    let wrong = |reason: String| RunError::Config {
        path: path.to_owned(),
        reason,
    };
    let text = read(path, MOST_BYTES)?;
    let _: IgnoredAny = serde_json::from_str(&text).map_err(|e| corrupt(path, e))?;
    // A newer version may have other fields, so this comes first.
    FORMAT.check(&text).map_err(|flaw| match flaw {
        Flaw::Newer { .. } => RunError::File(flaw.of(path, FORMAT)),
        _ => wrong("this is not the configuration of a run".to_owned()),
    })?;
    let config: RunConfig = serde_json::from_str(&text).map_err(|e| corrupt(path, e))?;
    config.plan.check().map_err(|e| wrong(e.to_string()))?;
    // A run can be moved, and must not read files outside its folder.
    let mut seen = BTreeSet::new();
    for name in &config.motions {
        let file = Path::new(name).file_name();
        if file.is_none_or(|file| file != name.as_str()) {
            return Err(wrong(format!("motion `{name}` is not a plain file name")));
        }
        // A short list could ask for one large file again and again.
        if !seen.insert(name) {
            return Err(wrong(format!("motion `{name}` is listed twice")));
        }
    }
    Ok(config)
}

/// The error of a file that can't be written.
fn unwritten(path: &Path) -> impl FnOnce(std::io::Error) -> RunError {
    let path = path.to_owned();
    move |source| RunError::Write { path, source }
}

/// The error of a file that isn't the JSON that it should be.
fn corrupt(path: &Path, error: serde_json::Error) -> RunError {
    RunError::Config {
        path: path.to_owned(),
        reason: error.to_string(),
    }
}

fn read(path: &Path, most: u64) -> Result<String, RunError> {
    text_at_most(path, most).map_err(|source| RunError::Read {
        path: path.to_owned(),
        source,
    })
}

pub(super) fn write(path: &Path, text: &str) -> Result<(), RunError> {
    crate::file::replace(path, text.as_bytes()).map_err(unwritten(path))
}
