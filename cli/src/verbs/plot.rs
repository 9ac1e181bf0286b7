//! `mimic plot`: draws the learning curves of runs.

mod log;

use crate::amount;
use crate::args::Replace;
use crate::failure::Outcome;
use crate::locate;
use crate::output::{self, Form, Maker, Output};
use crate::plot::curves::{self, Curve, Panel, Scale};
use crate::printer::Printer;
use log::{Columns, columns};
use mimic::explain::plain;
use mimic::file::Lock;
use mimic::run::{Checkpoint, Run, Scores, files};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic plot                                 draw the newest run, e.g. kick.svg
  mimic plot kick kick-seed7 -o seeds.svg    draw two runs in the same panels
  mimic plot kick --smooth 1                 draw every iteration, unsmoothed
  mimic plot kick --json > curves.json       write the numbers as well

Thin lines show single iterations, thick lines their moving average. Dots show the evaluation at \
the end.";

/// By default a curve is averaged over the run's length divided by this. Chosen: noise fades, and rises stay visible.
const SMOOTH_POINTS: usize = 50;

/// The panels: field of metrics.jsonl, heading, scale.
const FIGURES: [(&str, &str, Scale); 10] = [
    ("return", "return of an episode", Scale::Linear),
    ("normalized_return", "normalised return", Scale::Linear),
    ("episode_length", "episode length, s", Scale::Linear),
    ("policy_loss", "policy loss", Scale::Linear),
    ("value_loss", "value loss", Scale::Logarithmic),
    (
        "explained_variance",
        "explained variance of returns",
        Scale::Linear,
    ),
    ("approx_kl", "KL of an update", Scale::Linear),
    ("learning_rate", "learning rate", Scale::Logarithmic),
    (
        "action_std",
        "action noise, standard deviation",
        Scale::Linear,
    ),
    ("samples_per_second", "samples per second", Scale::Linear),
];

/// The number of one of them.
const NORMALIZED_RETURN: usize = 1;

/// The panels from eval.json: field, heading.
const EVALUATED: [(&str, &str); 2] = [
    ("survival", "evaluation: survival"),
    ("mpjpe_local_mm", "evaluation: local error, mm"),
];

/// Draw the learning curves of one or several runs
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Run folders, or their names in runs/ [default: the newest run]
    #[arg(value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Iterations to average each point over; 1 for none [default: a fiftieth of the run]
    #[arg(long, value_name = "N", value_parser = crate::args::at_least_one, allow_negative_numbers = true)]
    smooth: Option<usize>,
    /// SVG file to write, or a folder [default: RUN.svg, or curves.svg for several runs]
    #[arg(long, short, value_name = "FILE.svg")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replace: Replace,
}

/// What a run logged while it learned.
struct Log {
    name: String,
    folder: PathBuf,
    columns: Columns,
    scores: Option<Scores>,
    /// Samples of the checkpoint from which the run goes on, if it was stopped after that.
    saved: Option<u64>,
}

impl Args {
    /// Runs the command.
    pub fn run(self, printer: &Printer) -> Outcome {
        let folders = match self.runs.is_empty() {
            true => vec![locate::run(None)?],
            false => self
                .runs
                .iter()
                .map(|run| locate::run(Some(run)))
                .collect::<Outcome<_>>()?,
        };
        let logs = folders
            .iter()
            .map(|folder| Log::read(folder))
            .collect::<Outcome<Vec<_>>>()?;
        let names = distinct(&logs);
        let file = match logs.as_slice() {
            [one] => one.name.as_str(),
            _ => "curves",
        };
        let path = output::result_path(self.out.as_deref(), file, Form::Drawing);
        let maker = Maker::new("plot", &folders);
        let output = Output::new(path, Form::Drawing, maker, "--out", self.replace.force);
        let panels = panels(&logs, self.smooth);
        output.write_text(&curves::curves(&names, &panels))?;
        let path = output.path();
        let report = report(path, &names, &logs);
        printer.result(&report, || summary(path, &names, &logs))
    }
}

impl Log {
    fn read(folder: &Path) -> Outcome<Self> {
        let path = folder.join(files::METRICS);
        let columns = columns(&path)?;
        let name = folder.file_name().unwrap_or(folder.as_os_str());
        Ok(Self {
            name: name.to_string_lossy().into_owned(),
            scores: Run::scores(folder)?,
            folder: folder.to_owned(),
            saved: saved(folder, &columns),
            columns,
        })
    }

    fn samples(&self) -> f64 {
        let last = self.columns.values(&self.columns.samples).last();
        last.filter(|samples| samples.is_finite()).unwrap_or(0.0)
    }

    /// (samples, value) of every iteration that has figure number `figure`.
    fn points(&self, figure: usize) -> Vec<(f64, f64)> {
        let columns = &self.columns;
        let points = columns.samples.iter().zip(&columns.figures[figure]);
        let points = points.map(|(x, y)| (*x, *y));
        points
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .collect()
    }

    /// Number `figure` of [`EVALUATED`].
    fn evaluated(&self, figure: usize) -> Option<f64> {
        let scores = self.scores?;
        [Some(scores.survival), scores.mpjpe_local_mm][figure]
    }
}

/// Samples of the checkpoint, if the log goes on after it and nobody trains the run.
fn saved(folder: &Path, log: &Columns) -> Option<u64> {
    let logged = log.values(&log.samples).last()?;
    let saved = Checkpoint::load(folder.join(files::CHECKPOINT))
        .ok()?
        .samples;
    ((saved as f64) < logged && Lock::holder(folder).is_none()).then_some(saved)
}

/// Names for the legend; runs of the same name go by their folders.
fn distinct(logs: &[Log]) -> Vec<String> {
    let shared = |name: &str| logs.iter().filter(|log| log.name == name).count() > 1;
    logs.iter()
        .map(|log| match shared(&log.name) {
            true => log.folder.display().to_string(),
            false => log.name.clone(),
        })
        .collect()
}

/// The panels for which at least one run has numbers.
fn panels(logs: &[Log], smooth: Option<usize>) -> Vec<Panel> {
    let learned = FIGURES.iter().enumerate();
    let learned = learned.map(|(figure, (_, heading, scale))| Panel {
        heading,
        scale: *scale,
        curves: logs
            .iter()
            .map(|log| curve(log.points(figure), smooth))
            .collect(),
    });
    let evaluated = EVALUATED.iter().enumerate();
    let evaluated = evaluated.map(|(figure, (_, heading))| Panel {
        heading,
        scale: Scale::Linear,
        curves: logs
            .iter()
            .map(|log| {
                let dot = log.evaluated(figure).map(|value| (log.samples(), value));
                curve(dot.into_iter().collect(), Some(1))
            })
            .collect(),
    });
    let filled = |panel: &Panel| panel.curves.iter().any(|curve| !curve.raw.is_empty());
    learned.chain(evaluated).filter(filled).collect()
}

fn curve(raw: Vec<(f64, f64)>, smooth: Option<usize>) -> Curve {
    let window = smooth.unwrap_or(raw.len() / SMOOTH_POINTS).max(1);
    Curve {
        smooth: mean_around(&raw, window),
        raw,
    }
}

/// Centred moving average over `window` values. Towards the ends the window shrinks but stays centred, so that a straight
/// line stays straight.
fn mean_around(points: &[(f64, f64)], window: usize) -> Vec<(f64, f64)> {
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    for (_, value) in points {
        sum += value;
        sums.push(sum);
    }
    let mean = |i: usize| {
        let reach = (window / 2).min(i).min(points.len() - 1 - i);
        let (from, to) = (i - reach, i + reach + 1);
        (sums[to] - sums[from]) / (to - from) as f64
    };
    (0..points.len()).map(|i| (points[i].0, mean(i))).collect()
}

fn iterations(count: usize) -> String {
    match count {
        1 => "1 iteration".to_owned(),
        count => format!("{count} iterations"),
    }
}

/// The numbers for scripts, written as they are serialized.
#[derive(Serialize)]
struct Report<'a> {
    plot: String,
    runs: Vec<RunReport<'a>>,
}

struct RunReport<'a> {
    name: &'a str,
    log: &'a Log,
}

struct Column<'a>(&'a Columns, &'a [f64]);

fn report<'a>(path: &Path, names: &'a [String], logs: &'a [Log]) -> Report<'a> {
    let runs = names.iter().zip(logs);
    Report {
        plot: path.display().to_string(),
        runs: runs.map(|(name, log)| RunReport { name, log }).collect(),
    }
}

impl Serialize for RunReport<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Log {
            folder, columns, ..
        } = self.log;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("run", &folder.display().to_string())?;
        map.serialize_entry("name", self.name)?;
        map.serialize_entry("samples", &Column(columns, &columns.samples))?;
        for ((field, ..), figure) in FIGURES.iter().zip(&columns.figures) {
            map.serialize_entry(field, &Column(columns, figure))?;
        }
        let evaluated = EVALUATED.iter().enumerate();
        let evaluated = evaluated.map(|(n, (field, _))| (*field, self.log.evaluated(n)));
        map.serialize_entry("evaluation", &BTreeMap::from_iter(evaluated))?;
        map.end()
    }
}

impl Serialize for Column<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.values(self.1).map(number))
    }
}

/// A number of the log as it stands there: counts have no decimal point.
fn number(value: f64) -> Value {
    match value.fract() == 0.0 && value.abs() < 1e15 {
        true => json!(value as i64),
        false => json!(value),
    }
}

fn summary(path: &Path, names: &[String], logs: &[Log]) -> String {
    let mut text = format!("{}\n", plain(&path.display().to_string()));
    for (name, log) in names.iter().zip(logs) {
        let last = log.points(NORMALIZED_RETURN).last().map(|(_, y)| *y);
        let figure = |value: Option<f64>, digits: usize| {
            value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
        };
        let saved = log.saved.map_or_else(String::new, |saved| {
            format!(" ({} of them saved)", amount::count(saved))
        });
        text += &format!(
            "  {}: {}, {:.2} M samples{saved}, normalised return {}, survival {}, local error {} mm\n",
            plain(name),
            iterations(log.columns.iterations),
            log.samples() / 1e6,
            figure(last, 3),
            figure(log.evaluated(0), 3),
            figure(log.evaluated(1), 1),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_keeps_lines_and_means() {
        let line: Vec<_> = (0..9).map(|x| (f64::from(x), 2.0 * f64::from(x))).collect();
        assert_eq!(mean_around(&line, 5), line);
        let peak = [(0.0, 0.0), (1.0, 3.0), (2.0, 0.0)];
        assert_eq!(mean_around(&peak, 3), [(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]);
        assert_eq!(mean_around(&peak, 1), peak);
        assert!(mean_around(&[], 3).is_empty());
    }
}
