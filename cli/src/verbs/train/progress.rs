//! How far a training session is.

use super::clock::Clock;
use crate::amount;
use crate::failure::Outcome;
use crate::printer::Printer;
use crate::progress::Pace;
use indicatif::ProgressBar;
use mimic::run::{Iteration, Session};
use serde_json::json;
use std::cell::{Cell, RefCell};
use std::time::Instant;

/// A progress bar, or lines where nobody sees a bar.
pub struct Progress {
    bar: ProgressBar,
    pace: RefCell<Pace>,
    folder: String,
    begun: Instant,
    /// Whether training was asked to stop, which is then all that the bar says.
    is_stopping: Cell<bool>,
    /// Samples at the start, and those of the plan.
    first: u64,
    planned: u64,
}

impl Progress {
    /// Starts where the session does.
    pub fn new(session: &Session, printer: &Printer) -> Self {
        let (first, planned) = (
            session.trainer().samples(),
            session.trainer().settings().samples,
        );
        // Bar, message and time left fill 80 columns at most.
        let bar = printer.progress(planned, "{bar:8} {percent:>3} %  {msg}");
        bar.set_position(first);
        Self {
            bar,
            pace: RefCell::new(Pace::new()),
            folder: session.run().dir().display().to_string(),
            begun: Instant::now(),
            is_stopping: Cell::new(false),
            first,
            planned,
        }
    }

    /// Shows an iteration. The line that is printed names the run; the log does not, because a run can be moved.
    pub fn show(&self, iteration: &Iteration, clock: &Clock, printer: &Printer) -> Outcome {
        let samples = iteration.metrics.samples;
        let left = self.left(samples, clock);
        let message = message(iteration, left);
        let share = samples as f64 / self.planned.max(1) as f64;
        let share = share.max(clock.share()).min(1.0);
        self.bar.set_position((share * self.planned as f64) as u64);
        if printer.is_json() {
            let mut line = json!(iteration);
            line["run"] = json!(self.folder);
            printer.json_line(&line)?;
        } else if self.bar.is_hidden() {
            let percent = (100.0 * share).floor();
            let line = format!("training: {percent} %  {message}");
            match self.pace.borrow_mut().is_due() {
                true => printer.say(line),
                false => printer.detail(line),
            }
        }
        if !self.is_stopping.get() {
            self.bar.set_message(message);
        }
        Ok(())
    }

    /// Seconds to the end: of the samples or of the time, whichever comes first.
    fn left(&self, samples: u64, clock: &Clock) -> f64 {
        let learned = samples.saturating_sub(self.first).max(1) as f64;
        let rest = self.planned.saturating_sub(samples) as f64;
        let rest = self.begun.elapsed().as_secs_f64() * rest / learned;
        let limit = clock.left();
        limit.map_or(rest, |limit| limit.as_secs_f64().min(rest))
    }

    /// Says that training was asked to stop, and for what it doesn't yet.
    pub fn stopping(&self) {
        self.is_stopping.set(true);
        let text = "finishing this round, then saving; Ctrl-C again loses the round";
        self.bar.set_message(text);
    }

    /// The bar itself.
    pub fn bar(&self) -> ProgressBar {
        self.bar.clone()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// What an iteration did: how fast it learned, which share of the largest possible reward an episode got, and how long an
/// episode lasted before it failed or ended.
fn message(iteration: &Iteration, left: f64) -> String {
    let metrics = &iteration.metrics;
    format!(
        "{:.0}k samples/s  reward {} of 1  episodes {} s  {} left",
        iteration.samples_per_second / 1e3,
        number(metrics.normalized_return, 2),
        number(metrics.episode_length, 1),
        amount::duration(left),
    )
}

/// A figure of the episodes that ended; a dash if none did.
fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mimic::learn::Metrics;

    #[test]
    fn a_line_fits_eighty_columns() {
        let iteration = Iteration {
            metrics: Metrics {
                normalized_return: Some(0.812),
                episode_length: Some(25.04),
                ..Metrics::default()
            },
            seconds: 1.0,
            samples_per_second: 123_456.0,
        };
        let line = message(&iteration, 5000.0);
        assert_eq!(
            line,
            "123k samples/s  reward 0.81 of 1  episodes 25.0 s  83 min left"
        );
        let bar = "━━━━━━━━ 100 %  ";
        assert!(bar.chars().count() + line.chars().count() < 80);
    }
}
