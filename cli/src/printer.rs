//! The only file that prints: results on standard output, everything else on standard error.

use crate::args::Talk;
use crate::failure::{Failure, Outcome, flag};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use mimic::clip::{Problem, Severity};
use mimic::explain::{is_plain, plain};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::process::ExitCode;

/// How and how much is printed.
#[derive(Clone, Copy)]
pub struct Printer {
    json: bool,
    quiet: bool,
    verbose: bool,
    /// Standard output is a terminal.
    shown: bool,
    /// Standard error is a terminal.
    heard: bool,
    color: bool,
}

impl Printer {
    /// As the flags ask for, and as fits where the two streams go.
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

    /// Whether results are JSON.
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

    /// The result of work that failed in part. In JSON the object holds the error too, so that it stays the only one.
    pub fn partial_result(
        &self,
        mut json: Value,
        text: impl FnOnce() -> String,
        failure: Failure,
    ) -> Outcome {
        json["error"] = failure.json();
        self.result(&json, text)?;
        Err(failure.partly())
    }

    /// One JSON object on a line of its own.
    pub fn json_line(&self, json: &impl Serialize) -> Outcome {
        let line = serde_json::to_string(json)
            .map_err(|e| Failure::work(format!("cannot write the result as JSON: {e}")))?;
        self.text(&escaped(&line))
    }

    /// Text on standard output, ended by a line break. Whatever it holds, it only shows letters.
    pub fn text(&self, text: &str) -> Outcome {
        let shown = |c: char| match c {
            '\n' | '\t' => c,
            c if is_plain(c) => c,
            _ => ' ',
        };
        let text: String = text.chars().map(shown).collect();
        let mut out = stdout().lock();
        let end: &[u8] = if text.ends_with('\n') { b"" } else { b"\n" };
        out.write_all(text.as_bytes())
            .and_then(|()| out.write_all(end))
            .and_then(|()| out.flush())
            .map_err(|e| Failure::print(&e))
    }

    /// Says what is going on, to people at a terminal and with `--verbose`.
    pub fn note(&self, text: impl AsRef<str>) {
        if !self.quiet && (self.heard || self.verbose) {
            self.talk("", text.as_ref());
        }
    }

    /// Says what has to be known even where standard error goes to a file.
    pub fn say(&self, text: impl AsRef<str>) {
        if !self.quiet {
            self.talk("", text.as_ref());
        }
    }

    /// Says what only `--verbose` asks for.
    pub fn detail(&self, text: impl AsRef<str>) {
        if self.verbose && !self.quiet {
            self.talk("", text.as_ref());
        }
    }

    /// Says what may be wrong with the result.
    pub fn warn(&self, text: impl AsRef<str>) {
        if !self.quiet {
            self.talk(&self.paint("warning:", "33"), text.as_ref());
        }
    }

    /// Says what was found in a file: warnings and errors always, notes with `--verbose`.
    pub fn problems(&self, problems: &[Problem]) {
        for problem in problems {
            let line = words(problem);
            match problem.severity {
                Severity::Note => self.detail(format!("note: {line}")),
                Severity::Warning | Severity::Error => self.warn(line),
            }
        }
    }

    /// Says which take was chosen of files that have several, for these are read for the first time: once, for the first of
    /// them, with a count.
    pub fn choices(&self, files: &[(String, &[Problem])]) {
        let chosen = files.iter().filter_map(|(file, problems)| {
            let choice = problems
                .iter()
                .find(|problem| problem.id == "several-takes");
            Some((file, choice?))
        });
        let chosen: Vec<_> = chosen.collect();
        // Who asked for notes has it already.
        let Some((file, first)) = chosen.first().filter(|_| !self.verbose) else {
            return;
        };
        let more = match chosen.len() - 1 {
            0 => String::new(),
            more => format!(", and {more} more like it"),
        };
        self.say(format!("note: `{file}`: {}{more}", words(first)));
    }

    /// Says what was found in several files. A warning that repeats is said once, for the first of them, with a count.
    pub fn problems_of(&self, files: &[(String, &[Problem])]) {
        if let [(_, only)] = files {
            return self.problems(only);
        }
        let all = files
            .iter()
            .flat_map(|(file, problems)| problems.iter().map(move |p| (file, p)));
        let (notes, warnings): (Vec<_>, Vec<_>) =
            all.partition(|(_, problem)| problem.severity == Severity::Note);
        for (file, note) in notes {
            self.detail(format!("note: `{file}`: {}", words(note)));
        }
        let mut said = BTreeSet::new();
        for (file, problem) in &warnings {
            let id = &problem.id;
            if !said.insert(id) {
                continue;
            }
            let more = warnings.iter().filter(|(_, p)| p.id == *id).count() - 1;
            let more = match more {
                0 => String::new(),
                more => format!(", and {more} more like it"),
            };
            self.warn(format!("`{file}`: {}{more}", words(problem)));
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

    /// Ends the command: says what went wrong, if anything, and returns the exit code.
    pub fn finish(&self, outcome: Outcome) -> ExitCode {
        let Err(failure) = outcome else {
            return ExitCode::SUCCESS;
        };
        if let Some(message) = failure.message() {
            self.error(message);
        }
        if self.json && matches!(failure, Failure::Failed(_)) {
            json_error(&failure);
        }
        failure.code().into()
    }

    /// Says what went wrong, even with `--quiet`.
    pub fn error(&self, text: impl AsRef<str>) {
        self.talk(&self.paint("error:", "31;1"), text.as_ref());
    }

    /// A line on standard error, with a label of our own before it. A closed standard error is no reason to stop working.
    fn talk(&self, label: &str, line: &str) {
        let gap = if label.is_empty() { "" } else { " " };
        writeln!(stderr().lock(), "{label}{gap}{}", plain(line)).ok();
    }

    fn paint(&self, text: &str, code: &str) -> String {
        if self.color {
            format!("\x1b[{code}m{text}\x1b[0m")
        } else {
            text.to_string()
        }
    }
}

/// A problem in words, with the flag that decides otherwise and its id.
fn words(problem: &Problem) -> String {
    let Problem { id, message, .. } = problem;
    let flag = match id.as_str() {
        // Nobody knows which of the two was meant.
        "unknown-loop-word" => Some("--loop wrap` or `--loop clamp"),
        _ => problem.parameter().and_then(flag),
    };
    match flag {
        Some(flag) => format!("{message} (`{flag}`) [{id}]"),
        None => format!("{message} [{id}]"),
    }
}

/// An error of the command line itself, before its flags are known.
pub fn usage_error(failure: &Failure) {
    let talk = Talk {
        json: false,
        quiet: false,
        verbose: false,
    };
    if let Some(message) = failure.message() {
        Printer::new(&talk).error(message);
    }
}

/// The error as a JSON object on standard output.
pub fn json_error(failure: &Failure) {
    // A reader that went away doesn't change what happened.
    let line = json!({ "error": failure.json() }).to_string();
    writeln!(stdout(), "{}", escaped(&line)).ok();
}

/// JSON in which everything that isn't plain is escaped. It stands in strings alone, and they mean the same.
fn escaped(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for c in json.chars() {
        if is_plain(c) {
            text.push(c);
        } else {
            for unit in c.encode_utf16(&mut [0; 2]) {
                text += &format!("\\u{unit:04x}");
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_shows_no_control_characters_and_means_the_same() {
        let name = "a\u{9b}31m\u{7f}\u{202e}\u{e0041}\n\"ö";
        let line = escaped(&json!({ "name": name }).to_string());
        assert!(line.chars().all(is_plain), "{line}");
        let read: Value = serde_json::from_str(&line).expect("it is JSON");
        assert_eq!(read["name"], name);
    }

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
