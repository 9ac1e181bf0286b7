//! The only place that prints: results on standard output, talk on standard error.

use crate::args::Talk;
use crate::failure::{Failure, Outcome};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use mimic::clip::{Problem, Severity};
use serde::Serialize;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::process::ExitCode;

#[derive(Clone, Copy)]
pub struct Printer {
    json: bool,
    quiet: bool,
    verbose: bool,
    /// Results go to a person at a terminal.
    shown: bool,
    /// Talk does.
    heard: bool,
    color: bool,
}

impl Printer {
    pub fn new(talk: &Talk) -> Self {
        let heard = stderr().is_terminal();
        let no_color = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
        Self {
            json: talk.json,
            quiet: talk.quiet,
            verbose: talk.verbose,
            shown: stdout().is_terminal(),
            heard,
            color: heard && !no_color,
        }
    }

    pub fn is_json(&self) -> bool {
        self.json
    }

    /// One result: a JSON object with `--json`, else text for people.
    pub fn result(&self, json: &impl Serialize, text: impl FnOnce() -> String) -> Outcome {
        if self.json {
            self.json_line(json)
        } else {
            self.text(&text())
        }
    }

    pub fn json_line(&self, json: &impl Serialize) -> Outcome {
        let line = serde_json::to_string(json)
            .map_err(|e| Failure::work(format!("cannot write the result as JSON: {e}")))?;
        self.text(&line)
    }

    /// Text on standard output, ended by a line break.
    pub fn text(&self, text: &str) -> Outcome {
        let mut out = stdout().lock();
        out.write_all(text.as_bytes())?;
        if !text.ends_with('\n') {
            out.write_all(b"\n")?;
        }
        Ok(out.flush()?)
    }

    /// What is going on; for people at a terminal, or whoever asks for it.
    pub fn note(&self, text: impl AsRef<str>) {
        if !self.quiet && (self.heard || self.verbose) {
            self.talk(text.as_ref());
        }
    }

    /// What has to be known also where nobody watches.
    pub fn say(&self, text: impl AsRef<str>) {
        if !self.quiet {
            self.talk(text.as_ref());
        }
    }

    /// What only the curious want to know.
    pub fn detail(&self, text: impl AsRef<str>) {
        if self.verbose && !self.quiet {
            self.talk(text.as_ref());
        }
    }

    pub fn warn(&self, text: impl AsRef<str>) {
        if !self.quiet {
            self.talk(&format!(
                "{} {}",
                self.paint("warning:", "33"),
                text.as_ref()
            ));
        }
    }

    /// Problems of a file: warnings and errors always, notes for the curious.
    pub fn problems(&self, problems: &[Problem]) {
        for problem in problems {
            let line = format!("{} [{}]", problem.message, problem.id);
            match problem.severity {
                Severity::Note => self.detail(format!("note: {line}")),
                Severity::Warning | Severity::Error => self.warn(line),
            }
        }
    }

    /// A progress bar on a terminal, an invisible one elsewhere.
    pub fn progress(&self, length: u64, template: &str) -> ProgressBar {
        let target = if self.shows_progress() {
            ProgressDrawTarget::stderr_with_hz(8)
        } else {
            ProgressDrawTarget::hidden()
        };
        let style = ProgressStyle::with_template(template)
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .progress_chars("━╸─");
        ProgressBar::with_draw_target(Some(length), target).with_style(style)
    }

    /// JSON lines and a bar never share a terminal.
    fn shows_progress(&self) -> bool {
        self.heard && !self.quiet && !(self.json && self.shown)
    }

    /// Ends the command: says what went wrong, if anything, and gives the exit code.
    pub fn finish(&self, outcome: Outcome) -> ExitCode {
        let Err(failure) = outcome else {
            return ExitCode::SUCCESS;
        };
        if let Some(message) = failure.message() {
            self.talk(&format!("{} {message}", self.paint("error:", "31;1")));
        }
        failure.exit_code()
    }

    /// A closed standard error is no reason to stop working.
    fn talk(&self, line: &str) {
        writeln!(stderr().lock(), "{line}").ok();
    }

    fn paint(&self, text: &str, code: &str) -> String {
        if self.color {
            format!("\x1b[{code}m{text}\x1b[0m")
        } else {
            text.to_string()
        }
    }

    /// What went wrong with one of several files, said also when little is to be said.
    pub fn error(&self, text: impl AsRef<str>) {
        self.talk(&format!(
            "{} {}",
            self.paint("error:", "31;1"),
            text.as_ref()
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_is_for_who_watches_standard_error() {
        let printer = |json, shown, heard| Printer {
            json,
            quiet: false,
            verbose: false,
            shown,
            heard,
            color: false,
        };
        assert!(printer(false, true, true).shows_progress());
        assert!(printer(false, false, true).shows_progress(), "> results");
        assert!(
            printer(true, false, true).shows_progress(),
            "--json > lines"
        );
        assert!(
            !printer(true, true, true).shows_progress(),
            "lines on the terminal"
        );
        assert!(!printer(false, true, false).shows_progress(), "2> log");
        let quiet = Printer {
            quiet: true,
            ..printer(false, true, true)
        };
        assert!(!quiet.shows_progress());
    }
}
