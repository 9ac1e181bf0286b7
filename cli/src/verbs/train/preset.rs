//! The settings that a run starts from.

use super::setting;
use crate::failure::{Failure, Outcome};
use crate::locate;
use mimic::run::{PRESETS, Plan, RunError, files, preset};
use serde::Deserialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

pub struct Preset {
    pub plan: Plan,
    /// The character that it is meant for, if any.
    pub skeleton: Option<&'static str>,
    /// `None` for what is built in.
    file: Option<PathBuf>,
}

/// What matters here of a run's `config.json`.
#[derive(Deserialize)]
struct Config {
    plan: Plan,
}

impl Preset {
    /// A preset's name, a JSON file with a plan, a run's `config.json`, or a run.
    pub fn load(name: &str) -> Outcome<Self> {
        if let Some(preset) = preset(name) {
            return Ok(Self {
                plan: (preset.plan)(),
                skeleton: Some(preset.skeleton),
                file: None,
            });
        }
        let file = file(Path::new(name))?;
        let text = std::fs::read_to_string(&file).map_err(|e| Failure::input(&file, e))?;
        let plan =
            parse(&text).map_err(|e| Failure::input(&file, format!("not a training plan: {e}")))?;
        if plan.samples == 0 {
            return Err(Failure::input(&file, "samples is 0").with_remedy("set it to 1 or more"));
        }
        Ok(Self {
            plan,
            skeleton: None,
            file: Some(file),
        })
    }

    /// Changes single values: `task.terminations.distance=0.4`.
    pub fn change(&mut self, changes: &[String]) -> Outcome {
        for change in changes {
            self.plan = setting::change(&self.plan, change)
                .map_err(|e| Failure::user(format!("`--set {change}`: {e}")))?;
        }
        Ok(())
    }

    /// Why no run can be made with these settings.
    pub fn failure(&self, error: RunError) -> Failure {
        failure(self.file.as_deref(), error)
    }
}

/// Why a run can't be made or go on; a wrong setting is that of the `file` it stands in.
pub fn failure(file: Option<&Path>, error: RunError) -> Failure {
    match file {
        Some(file) if error.is_setting() => Failure::in_file(file, error),
        _ => Failure::from(error),
    }
}

fn file(wanted: &Path) -> Outcome<PathBuf> {
    if wanted.is_file() {
        return Ok(wanted.to_path_buf());
    }
    let run = locate::existing_run(wanted).ok_or_else(|| {
        let names = PRESETS.map(|preset| format!("`{}`", preset.name));
        Failure::user(format!(
            "no preset `{}`: give {}, a JSON file with a plan, or a run",
            wanted.display(),
            names.join(", ")
        ))
    })?;
    Ok(run.join(files::CONFIG))
}

/// Reads from the text in both cases, so that errors say line and column.
fn parse(text: &str) -> serde_json::Result<Plan> {
    let value: Value = serde_json::from_str(text)?;
    if value.get("plan").is_some() {
        return serde_json::from_str(text).map(|Config { plan }| plan);
    }
    serde_json::from_str(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_may_stand_alone_or_in_a_run() {
        let alone = parse(r#"{ "horizon": 3 }"#).map(|plan| plan.horizon);
        let nested = parse(r#"{ "format": "run", "plan": { "horizon": 3 } }"#);
        assert_eq!(alone.ok(), Some(3));
        assert_eq!(nested.ok().map(|plan| plan.horizon), Some(3));
        let wrong = parse("{ \"plan\": {\n\"horizons\": 3 } }").map_err(|e| e.to_string());
        assert!(
            wrong
                .as_ref()
                .is_err_and(|e| e.contains("horizons") && e.contains("line 2")),
            "{wrong:?}"
        );
    }
}
