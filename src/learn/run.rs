//! The folder of a run: everything needed to resume, replay and reproduce it.

use super::{
    Checkpoint, LearnError, Metrics, Performer, Plan, PolicyFile, TrainError, Trainer, TrainerState,
};
use crate::file::FileError;
use crate::motion::{Motion, MotionError};
use crate::skeleton::{Skeleton, SkeletonError};
use crate::task::{Reference, Setting, Stage, TaskError};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Why a run's folder can't be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    #[error("can't {action} `{}`: {source}", path.display())]
    Io {
        action: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("`{}` already holds a run: choose another with --out, or go on with it by --resume", .0.display())]
    Exists(PathBuf),
    #[error("`{}` is no run: it has no config.json", .0.display())]
    NoRun(PathBuf),
    #[error("`{}` has no policy yet: train it first", .0.display())]
    NoPolicy(PathBuf),
    #[error("`{}`: {reason}", path.display())]
    Config { path: PathBuf, reason: String },
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    #[error(transparent)]
    Train(#[from] TrainError),
    #[error(transparent)]
    Task(#[from] TaskError),
    #[error(transparent)]
    Learn(#[from] LearnError),
}

/// What `config.json` says.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    format: String,
    version: u32,
    skeleton: String,
    motions: Vec<String>,
    plan: Plan,
}

/// What a policy file says beside its network: all that it takes to act.
#[derive(Deserialize)]
struct Performs {
    task: Setting,
    /// Name of the character.
    skeleton: String,
    mjcf: String,
    slots: String,
}

/// A run on disk.
pub struct Run {
    dir: PathBuf,
    plan: Plan,
    skeleton: Skeleton,
    motions: Vec<Motion>,
}

const CONFIG: &str = "config.json";
const CHECKPOINT: &str = "checkpoint.safetensors";
const POLICY: &str = "policy.safetensors";
const METRICS: &str = "metrics.jsonl";
/// Tensor of the checkpoint that says where episodes begin.
const STARTS: &str = "starts";

impl Run {
    /// Starts a run in `dir`.
    ///
    /// # Errors
    /// A folder that holds a run already, or can't be written.
    pub fn create(
        dir: &Path,
        plan: Plan,
        skeleton: Skeleton,
        motions: Vec<Motion>,
    ) -> Result<Self, RunError> {
        if dir.join(CONFIG).exists() {
            return Err(RunError::Exists(dir.to_owned()));
        }
        // What can't be trained leaves no folder behind.
        Trainer::new(plan.clone(), Stage::new(skeleton.clone())?, &motions)?;
        fs::create_dir_all(dir).map_err(io("create", dir))?;
        write(&dir.join("skeleton.xml"), skeleton.mjcf.as_bytes())?;
        write(&dir.join("skeleton.json"), skeleton.slots_json().as_bytes())?;
        for (i, motion) in motions.iter().enumerate() {
            motion.save(&dir.join(reference(i)))?;
        }
        let config = Config {
            format: "run".to_owned(),
            version: 1,
            skeleton: skeleton.name.clone(),
            motions: (0..motions.len()).map(reference).collect(),
            plan: plan.clone(),
        };
        let text =
            serde_json::to_string_pretty(&config).map_err(|e| corrupt(&dir.join(CONFIG), e))?;
        write(&dir.join(CONFIG), text.as_bytes())?;
        Run::open(dir)
    }

    /// Opens the run in `dir`.
    ///
    /// # Errors
    /// A folder without a run, or with a broken one.
    pub fn open(dir: &Path) -> Result<Self, RunError> {
        let path = dir.join(CONFIG);
        if !path.exists() {
            return Err(RunError::NoRun(dir.to_owned()));
        }
        let text = read(&path)?;
        let config: Value = serde_json::from_str(&text).map_err(|e| corrupt(&path, e))?;
        // A newer version may have other fields, so this comes first.
        if (&config["format"], &config["version"]) != (&json!("run"), &json!(1)) {
            let reason = format!(
                "format {} {} is not known to this version",
                config["format"], config["version"]
            );
            return Err(RunError::Config { path, reason });
        }
        // From the text, whose lines an error names.
        let config: Config = serde_json::from_str(&text).map_err(|e| corrupt(&path, e))?;
        config.plan.check().map_err(|e| RunError::Config {
            path: path.clone(),
            reason: e.to_string(),
        })?;
        let mjcf = read(&dir.join("skeleton.xml"))?;
        let slots = read(&dir.join("skeleton.json"))?;
        let mut motions = Vec::new();
        for name in &config.motions {
            let plain = Path::new(name)
                .file_name()
                .is_some_and(|file| file == name.as_str());
            if !plain {
                return Err(RunError::Config {
                    path,
                    reason: format!("motion `{name}` is not a plain file name"),
                });
            }
            motions.push(Motion::load(&dir.join(name))?);
        }
        Ok(Run {
            dir: dir.to_owned(),
            plan: config.plan,
            skeleton: Skeleton::from_mjcf(&config.skeleton, &mjcf, Some(&slots))?,
            motions,
        })
    }

    pub fn dir(&self) -> &Path {
        &self.dir
    }

    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    pub fn motions(&self) -> &[Motion] {
        &self.motions
    }

    /// A trainer that goes on where the last checkpoint was saved, or starts.
    ///
    /// # Errors
    /// A plan that can't be trained, or a broken checkpoint.
    pub fn trainer(&self) -> Result<Trainer, RunError> {
        let mut trainer = Trainer::new(
            self.plan.clone(),
            Stage::new(self.skeleton.clone())?,
            &self.motions,
        )?;
        let path = self.dir.join(CHECKPOINT);
        if path.exists() {
            let Checkpoint {
                iteration,
                learner,
                normalizer,
                mut tensors,
                ..
            } = Checkpoint::load(&path)?;
            trainer.restore(TrainerState {
                iteration,
                learner,
                normalizer,
                starts: tensors.remove(STARTS).unwrap_or_default(),
            })?;
        }
        self.trim_metrics(trainer.iteration())?;
        Ok(trainer)
    }

    /// Saves checkpoint and policy, each replaced at once.
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
        let policy = PolicyFile {
            spec: learner.spec.clone(),
            parameters: learner.parameters.clone(),
            normalizer: normalizer.clone(),
            details: json!({
                "task": self.plan.task,
                "skeleton": self.skeleton.name,
                "mjcf": self.skeleton.mjcf,
                "slots": self.skeleton.slots_json(),
                "observation": trainer.observation(),
            }),
        };
        let checkpoint = Checkpoint {
            iteration,
            samples: trainer.samples(),
            learner,
            normalizer,
            tensors: [(STARTS.to_owned(), starts)].into(),
        };
        checkpoint.save(&self.dir.join(CHECKPOINT))?;
        Ok(policy.save(&self.dir.join(POLICY))?)
    }

    /// Appends a line to `metrics.jsonl`: the metrics with the run's clock.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn log(&self, line: &Value) -> Result<(), RunError> {
        let path = self.dir.join(METRICS);
        let mut file = fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(io("open", &path))?;
        // In one piece, so that whoever reads along never finds half a line.
        file.write_all(format!("{line}\n").as_bytes())
            .map_err(io("write", &path))
    }

    /// Writes a file of the run, such as `eval.json`, replaced at once.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn write(&self, name: &str, text: &str) -> Result<(), RunError> {
        write(&self.dir.join(name), text.as_bytes())
    }

    /// The policy, ready to act.
    ///
    /// # Errors
    /// A run without a policy, or a broken one.
    pub fn performer(&self) -> Result<Performer, RunError> {
        let path = self.dir.join(POLICY);
        if !path.exists() {
            return Err(RunError::NoPolicy(self.dir.clone()));
        }
        let file = PolicyFile::load(&path)?;
        let performs: Performs =
            serde_json::from_value(file.details).map_err(|e| corrupt(&path, e))?;
        let Performs {
            task,
            skeleton,
            mjcf,
            slots,
        } = performs;
        let skeleton = Skeleton::from_mjcf(&skeleton, &mjcf, Some(&slots))?;
        let stage = Arc::new(Stage::new(skeleton)?);
        let mut references = Vec::new();
        for motion in &self.motions {
            references.push(Arc::new(Reference::new(motion, &stage)?));
        }
        Ok(Performer::new(
            file.spec,
            file.parameters,
            &file.normalizer,
            stage,
            references,
            task,
        )?)
    }

    /// Drops the lines of iterations that the checkpoint doesn't know.
    fn trim_metrics(&self, iteration: u64) -> Result<(), RunError> {
        let path = self.dir.join(METRICS);
        if !path.exists() {
            return Ok(());
        }
        let known = |line: &&str| {
            serde_json::from_str::<Metrics>(line)
                .is_ok_and(|metrics| metrics.iteration <= iteration)
        };
        let text = read(&path)?;
        let kept: String = text
            .lines()
            .filter(known)
            .map(|line| format!("{line}\n"))
            .collect();
        write(&path, kept.as_bytes())
    }
}

fn reference(index: usize) -> String {
    format!("reference-{index}.motion")
}

fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> RunError {
    let path = path.to_owned();
    move |source| RunError::Io {
        action,
        path,
        source,
    }
}

fn corrupt(path: &Path, error: serde_json::Error) -> RunError {
    RunError::Config {
        path: path.to_owned(),
        reason: error.to_string(),
    }
}

fn read(path: &Path) -> Result<String, RunError> {
    fs::read_to_string(path).map_err(io("read", path))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    crate::file::replace(path, bytes).map_err(io("write", path))
}
