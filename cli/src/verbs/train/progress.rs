//! How far a training session is, for people and for `metrics.jsonl`.

use crate::failure::Outcome;
use crate::printer::Printer;
use crate::runs;
use indicatif::ProgressBar;
use mimic::learn::{Metrics, Run, Trainer};
use serde_json::{Value, json};
use std::time::Instant;

pub struct Progress {
    bar: ProgressBar,
    folder: String,
    /// Seconds that earlier sessions of this run took.
    before: f64,
    begun: Instant,
    last: Instant,
    last_samples: u64,
}

impl Progress {
    pub fn new(run: &Run, trainer: &Trainer, printer: &Printer) -> Self {
        let bar = printer.progress(
            trainer.plan().samples,
            "{bar:16} {percent:>3} %  {msg}  {eta} left",
        );
        bar.set_position(trainer.samples());
        bar.reset_eta();
        let now = Instant::now();
        Self {
            bar,
            folder: run.dir().display().to_string(),
            before: seconds_before(run),
            begun: now,
            last: now,
            last_samples: trainer.samples(),
        }
    }

    /// The line of `metrics.jsonl`: what the trainer says, and the clock.
    pub fn line(&mut self, metrics: &Metrics) -> Value {
        let now = Instant::now();
        let took = (now - self.last).as_secs_f64().max(1e-9);
        let rate = metrics.samples.saturating_sub(self.last_samples) as f64 / took;
        (self.last, self.last_samples) = (now, metrics.samples);
        let mut line = json!(metrics);
        line["seconds"] = json!(self.before + (now - self.begun).as_secs_f64());
        line["samples_per_second"] = json!(rate);
        line
    }

    /// A printed line says also which run it belongs to; the log doesn't, for a run can be moved.
    pub fn show(&self, metrics: &Metrics, mut line: Value, printer: &Printer) -> Outcome {
        let rate = line["samples_per_second"].as_f64().unwrap_or_default();
        let message = format!(
            "{:.1}k samples/s  normalised return {}  episode {} s",
            rate / 1e3,
            number(metrics.normalized_return, 3),
            number(metrics.episode_length, 1),
        );
        self.bar.set_position(metrics.samples);
        if printer.is_json() {
            line["run"] = json!(self.folder);
            printer.json_line(&line)?;
        } else if self.bar.is_hidden() {
            printer.detail(format!("{} samples  {message}", metrics.samples));
        }
        self.bar.set_message(message);
        Ok(())
    }

    pub fn say(&self, text: &'static str) {
        self.bar.set_message(text);
    }

    pub fn bar(&self) -> ProgressBar {
        self.bar.clone()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Time is told by the last line that earlier sessions wrote.
fn seconds_before(run: &Run) -> f64 {
    let text = std::fs::read_to_string(run.dir().join(runs::METRICS)).unwrap_or_default();
    let last = text
        .lines()
        .last()
        .and_then(|line| serde_json::from_str::<Value>(line).ok());
    last.and_then(|line| line["seconds"].as_f64())
        .unwrap_or(0.0)
}

/// A figure of the episodes that ended, if any did.
fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}
