//! The settings that a run starts from.

use super::setting;
use crate::failure::{Failure, Outcome};
use crate::locate;
use mimic::file::text_at_most;
use mimic::run::{PRESETS, Plan, RunError, files, preset};
use mimic::task::TaskSettings;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::path::{Path, PathBuf};

/// Most bytes that a file of settings may have. Chosen: a run's own has three thousand.
const MOST_BYTES: u64 = 1 << 20;

/// The settings, and where they come from.
pub struct Preset {
    /// The settings.
    pub plan: Plan,
    /// The character that the settings are made for, if any.
    pub skeleton: Option<&'static str>,
    /// The file of the settings, and the error that they would make by themselves; `None` for those that are built in.
    file: Option<(PathBuf, Option<String>)>,
}

/// Whether a plan stands in an object with other things. What it holds is passed over: read whole, it would take many times the
/// memory of the file.
#[derive(Deserialize)]
struct Nested {
    plan: Option<IgnoredAny>,
}

/// The part of a run's `config.json` that is read here.
#[derive(Deserialize)]
struct Config {
    plan: Plan,
}

impl Preset {
    /// `name` is that of a preset, or the path of a JSON file with a plan, of a run's `config.json`, or of a run.
    pub fn load(name: &str) -> Outcome<Self> {
        if let Some(preset) = preset(name) {
            return Ok(Self {
                plan: (preset.plan)(),
                skeleton: Some(preset.skeleton),
                file: None,
            });
        }
        let file = file(Path::new(name))?;
        let text = text_at_most(&file, MOST_BYTES).map_err(|e| Failure::unreadable(&file, &e))?;
        let plan = parse(&text).map_err(|e| {
            Failure::input(
                &file,
                format!("this is not a training plan: {}", setting::in_words(&e)),
            )
            .with_remedy("compare it with `plan` in the config.json of a run")
        })?;
        if plan.samples == 0 {
            return Err(Failure::input(&file, "the number of samples is 0")
                .with_remedy("set `samples` to 1 or more"));
        }
        let own = plan.check().err().map(|error| error.to_string());
        Ok(Self {
            plan,
            skeleton: None,
            file: Some((file, own)),
        })
    }

    /// Takes the default settings of the task `name`, unless the preset is for that task anyway.
    pub fn choose_task(&mut self, name: &str) -> Outcome {
        let own = self.plan.task.name();
        if own == name {
            return Ok(());
        }
        match TaskSettings::named(name) {
            Some(task) if self.plan == Plan::default() => self.plan.task = task,
            _ => {
                let cause = format!("the preset is for the task `{own}`, not `{name}`");
                return Err(Failure::user(cause).with_remedy("choose another preset"));
            }
        }
        Ok(())
    }

    /// Changes single settings, such as `task.terminations.distance=0.4`.
    pub fn change(&mut self, changes: &[String]) -> Outcome {
        for change in changes {
            self.plan = setting::change(&self.plan, change)?;
        }
        Ok(())
    }

    /// The failure of a run that cannot be made with these settings.
    pub fn failure(&self, error: RunError) -> Failure {
        // What a change of the command line made wrong isn't the file's fault.
        let said = error.to_string();
        let blamed = self
            .file
            .as_ref()
            .filter(|(_, own)| own.as_ref() == Some(&said));
        failure(blamed.map(|(file, _)| file.as_path()), error)
    }
}

/// The failure of a run that cannot be made or continued. A wrong setting is blamed on the `file` that holds it.
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
        let near = locate::meant_preset(wanted, PRESETS.map(|preset| preset.name));
        let names = PRESETS.map(|preset| format!("`{}`", preset.name));
        let choice = || {
            format!(
                "choose {}, a JSON file with a plan, or a run",
                names.join(", ")
            )
        };
        Failure::user(format!("there is no preset `{}`", wanted.display()))
            .with_remedy(near.unwrap_or_else(choice))
    })?;
    Ok(run.join(files::CONFIG))
}

/// Reads a plan, alone or in a run's configuration. Both are read from the text, so that errors say line and column.
fn parse(text: &str) -> serde_json::Result<Plan> {
    let _: IgnoredAny = serde_json::from_str(text)?;
    let nested = serde_json::from_str::<Nested>(text).is_ok_and(|nested| nested.plan.is_some());
    if nested {
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
