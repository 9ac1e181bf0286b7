//! How far a training session is.

use crate::failure::Outcome;
use crate::printer::Printer;
use indicatif::ProgressBar;
use mimic::run::{Iteration, Session};
use serde_json::json;

/// A progress bar, or lines where nobody sees a bar.
pub struct Progress {
    bar: ProgressBar,
    folder: String,
}

impl Progress {
    /// Starts where the session does.
    pub fn new(session: &Session, printer: &Printer) -> Self {
        let bar = printer.progress(
            session.trainer().settings().samples,
            "{bar:16} {percent:>3} %  {msg}  {eta} left",
        );
        bar.set_position(session.trainer().samples());
        bar.reset_eta();
        Self {
            bar,
            folder: session.run().dir().display().to_string(),
        }
    }

    /// Shows an iteration. The line that is printed names the run; the log does not, because a run can be moved.
    pub fn show(&self, iteration: &Iteration, printer: &Printer) -> Outcome {
        let metrics = &iteration.metrics;
        let message = format!(
            "{:.1}k samples/s  normalised return {}  episode {} s",
            iteration.samples_per_second / 1e3,
            number(metrics.normalized_return, 3),
            number(metrics.episode_length, 1),
        );
        self.bar.set_position(metrics.samples);
        if printer.is_json() {
            let mut line = json!(iteration);
            line["run"] = json!(self.folder);
            printer.json_line(&line)?;
        } else if self.bar.is_hidden() {
            printer.detail(format!("{} samples  {message}", metrics.samples));
        }
        self.bar.set_message(message);
        Ok(())
    }

    /// Says what is going on.
    pub fn say(&self, text: &'static str) {
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

/// A figure of the episodes that ended; a dash if none did.
fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}
