//! `mimic runs`: lists training runs.

use crate::amount;
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::printer::Printer;
use mimic::explain::plain;
use mimic::file::Lock;
use mimic::run::{Checkpoint, Run, files};
use serde::Serialize;
use serde_json::{Value, json};
use std::fs::File;
use std::io::ErrorKind::NotFound;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

const EXAMPLES: &str = "\
Examples:
  mimic runs                                 list the runs in runs/, the newest last
  mimic runs experiments                     list those in another folder
  mimic runs --json                          print JSON for scripts

A run is `preparing` while a process makes its motions, `training` while a process writes it, `finished` once it has learned from all its samples \
and was measured, `stopped` before that (`mimic train --resume RUN` goes on), and `broken` if its \
files cannot be read. Survival is that of its last evaluation, averaged over its clips. Samples are those from which \
`--resume` goes on, and at most the planned number: a run learns in whole iterations, so it may have \
learned from a few more.";

/// List training runs: what they learn, how far they are, how well they do
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Folder with runs in it, or one run [default: runs/]
    #[arg(value_name = "FOLDER")]
    folder: Option<PathBuf>,
}

/// How a run stands.
#[derive(Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
enum State {
    /// Nothing is learned yet: its motions are made.
    Preparing,
    Training,
    Stopped,
    Finished,
    Broken,
}

/// What is listed of a run. Of a broken one, only what does not depend on its files.
#[derive(Serialize)]
struct Entry {
    run: PathBuf,
    state: State,
    /// Who trains it.
    held_by: Option<String>,
    clips: Vec<String>,
    task: Option<String>,
    /// How many it has learned from, and how many it is to learn from.
    samples: Option<u64>,
    planned: Option<u64>,
    survival: Option<f64>,
    /// When it learned last.
    when: Option<String>,
    error: Option<Value>,
    #[serde(skip)]
    learned: Option<SystemTime>,
}

impl Args {
    /// Runs the command.
    pub fn run(self, printer: &Printer) -> Outcome {
        let folder = self.folder.as_deref();
        let mut entries: Vec<Entry> = folders(folder)?.iter().map(|run| entry(run)).collect();
        entries.sort_by(|a, b| (a.learned, &a.run).cmp(&(b.learned, &b.run)));
        let place = folder.unwrap_or(Path::new(locate::RUNS)).display();
        let place = plain(&place.to_string());
        printer.result(&json!({ "runs": entries }), || match entries.is_empty() {
            true => format!("there are no runs in `{place}`; make one with `mimic train CLIP`"),
            false => text(&entries),
        })
    }
}

/// The folders to list. The folder of all runs appears with the first of them.
fn folders(wanted: Option<&Path>) -> Outcome<Vec<PathBuf>> {
    let Some(folder) = wanted else {
        let folder = Path::new(locate::RUNS);
        return match std::fs::read_dir(folder) {
            Err(cause) if cause.kind() != NotFound => Err(Failure::unreadable(folder, &cause)),
            _ => Ok(locate::runs(folder)),
        };
    };
    if let Some(run) = locate::existing_run(folder) {
        return Ok(vec![run]);
    }
    match std::fs::read_dir(folder) {
        Ok(_) => Ok(locate::runs(folder)),
        Err(_) if folder.is_file() => Err(locate::absent_run(folder)),
        Err(cause) if cause.kind() == NotFound => Err(locate::absent_run(folder)),
        Err(cause) => Err(Failure::unreadable(folder, &cause)),
    }
}

/// What a run's files say of it.
fn entry(run: &Path) -> Entry {
    let learned = locate::run_time(run);
    let bare = Entry {
        run: run.to_owned(),
        state: State::Broken,
        held_by: Lock::holder(run).map(|holder| holder.to_string()),
        clips: Vec::new(),
        task: None,
        samples: None,
        planned: None,
        survival: None,
        when: learned.map(amount::date),
        error: None,
        learned,
    };
    let is_made = run.join(files::CONFIG).try_exists().unwrap_or(true);
    if bare.held_by.is_some() && !is_made {
        let state = State::Preparing;
        return Entry { state, ..bare };
    }
    match read(run, bare.held_by.is_some()) {
        Ok(found) => Entry {
            run: bare.run,
            held_by: bare.held_by,
            when: bare.when,
            learned,
            ..found
        },
        Err(failure) => Entry {
            error: Some(failure.json()),
            ..bare
        },
    }
}

/// Reads a run. While it is `held`, its log is ahead of its checkpoint.
fn read(folder: &Path, held: bool) -> Outcome<Entry> {
    let config = folder.join(files::CONFIG);
    config
        .try_exists()
        .map_err(|e| Failure::unreadable(&config, &e))?;
    if !locate::is_run(folder) {
        let cause = format!("this was a run, and has no {} any more", files::CONFIG);
        return Err(Failure::input(folder, cause).with_remedy("remove the folder"));
    }
    let run = Run::open(folder)?;
    let plan = run.plan();
    let saved = folder.join(files::CHECKPOINT);
    let saved = match saved.exists() {
        true => Checkpoint::load(saved)?.samples,
        false => 0,
    };
    // One that can't be read counts as none, for a resumed run writes it again.
    let scores = Run::scores(folder).ok().flatten();
    let (state, samples) = match held {
        true => (State::Training, logged(folder).unwrap_or(saved).max(saved)),
        false if saved >= plan.samples && scores.is_some() => (State::Finished, saved),
        false => (State::Stopped, saved),
    };
    Ok(Entry {
        run: folder.to_owned(),
        state,
        held_by: None,
        clips: run.motions().iter().map(|m| m.name.clone()).collect(),
        task: Some(plan.task.name().to_owned()),
        samples: Some(samples),
        planned: Some(plan.samples),
        survival: scores.map(|scores| scores.survival),
        when: None,
        error: None,
        learned: None,
    })
}

/// Samples of the last line of the log. Only its end is read, for logs grow with the training.
fn logged(run: &Path) -> Option<u64> {
    /// Many times a line of the log.
    const END: u64 = 1 << 16;
    let path = run.join(files::METRICS);
    // Opening a pipe waits for who writes into it.
    let mut file = path.is_file().then(|| File::open(&path).ok()).flatten()?;
    let length = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(END)))
        .ok()?;
    let mut end = Vec::new();
    file.take(END).read_to_end(&mut end).ok()?;
    // The last line may be half written, and the first half read.
    let mut lines = end.rsplit(|byte| *byte == b'\n');
    lines.find_map(|line| serde_json::from_slice::<Value>(line).ok()?["samples"].as_u64())
}

/// The runs in columns, and below them what is wrong with those that are broken.
fn text(entries: &[Entry]) -> String {
    let heading = [
        "run", "clip", "task", "state", "samples", "survival", "when",
    ];
    let mut rows = vec![heading.map(str::to_owned)];
    rows.extend(entries.iter().map(row));
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
    let widths: Vec<usize> = (0..heading.len()).map(|c| width(c).unwrap_or(0)).collect();
    let line = |row: &[String; 7]| {
        let cells = row.iter().zip(&widths);
        let cells: Vec<String> = cells
            .map(|(cell, width)| format!("{cell:width$}"))
            .collect();
        cells.join("  ").trim_end().to_owned() + "\n"
    };
    let table: String = rows.iter().map(line).collect();
    let broken = entries.iter().filter_map(|entry| {
        let message = entry.error.as_ref()?["message"].as_str()?;
        Some(format!("broken: {message}\n"))
    });
    table + &broken.collect::<String>()
}

fn row(entry: &Entry) -> [String; 7] {
    let dash = || "-".to_owned();
    // Samples come in iterations, so a run learns from a few more than it was told to.
    let samples = entry.samples.zip(entry.planned).map(|(done, planned)| {
        let done = amount::count(done.min(planned));
        format!("{done} of {}", amount::count(planned))
    });
    let ago = entry.learned.map(|time| {
        // A clock that was put back, or of another machine, leaves files of the future.
        match time.elapsed() {
            Ok(past) => format!("{} ago", amount::duration(past.as_secs_f64())),
            Err(ahead) => format!("in {}", amount::duration(ahead.duration().as_secs_f64())),
        }
    });
    let state = json!(entry.state);
    let state = state.as_str().unwrap_or_default();
    let share = |share: f64| format!("{:.1} %", 100.0 * share);
    [
        plain(&entry.run.display().to_string()),
        clips(&entry.clips).unwrap_or_else(dash),
        entry.task.clone().unwrap_or_else(dash),
        state.to_owned(),
        samples.unwrap_or_else(dash),
        entry.survival.map_or_else(dash, share),
        entry.held_by.clone().or(ago).unwrap_or_else(dash),
    ]
}

/// The first clip, shortened, and how many more there are.
fn clips(names: &[String]) -> Option<String> {
    /// So that a usual line fits 80 columns.
    const LETTERS: usize = 16;
    let (first, more) = names.split_first()?;
    let mut text: String = plain(first).chars().take(LETTERS).collect();
    if first.chars().count() > LETTERS {
        text.pop();
        text.push('…');
    }
    match more.len() {
        0 => Some(text),
        more => Some(format!("{text} + {more}")),
    }
}
