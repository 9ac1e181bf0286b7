//! `mimic plot`: draws the learning curves of runs.

use crate::amount;
use crate::args::Replace;
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::output::{self, Form, Maker, Output};
use crate::plot::curves::{self, Curve, Panel, Scale};
use crate::printer::Printer;
use mimic::explain::plain;
use mimic::file::Lock;
use mimic::file::text_at_most;
use mimic::run::{Checkpoint, files};
use serde_json::{Map, Value, json};
use std::io::ErrorKind::NotFound;
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

/// Most bytes that are read of a run's log or evaluation. Chosen: a line of a log has about five hundred, and no run has a
/// million iterations.
const MOST_BYTES: u64 = 1 << 30;

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
    lines: Vec<Map<String, Value>>,
    evaluation: Option<Value>,
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
        let text = text_at_most(&path, MOST_BYTES).map_err(|e| {
            let failure = Failure::unreadable(&path, &e);
            match e.kind() {
                NotFound => failure.with_remedy("train the run first"),
                _ => failure,
            }
        })?;
        let mut lines = Vec::new();
        // The last line has no end while it is being written.
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        for (number, line) in whole.lines().enumerate() {
            let line = serde_json::from_str(line).map_err(|e| {
                // The reader counts lines too, from the start of this one.
                let e = e.to_string();
                let cause = e.split(" at line ").next().unwrap_or(&e);
                Failure::input(&path, format!("this is not an iteration ({cause})"))
                    .with_place(format!("line {}", number + 1))
                    .with_remedy("remove the line")
            })?;
            lines.push(line);
        }
        if lines.is_empty() {
            return Err(
                Failure::input(&path, "it holds no iteration yet").with_remedy("train longer")
            );
        }
        let name = folder.file_name().unwrap_or(folder.as_os_str());
        Ok(Self {
            name: name.to_string_lossy().into_owned(),
            evaluation: evaluation(&folder.join(files::EVALUATION))?,
            folder: folder.to_owned(),
            saved: saved(folder, &lines),
            lines,
        })
    }

    fn samples(&self) -> f64 {
        let last = self.lines.last().and_then(|line| line.get("samples"));
        last.and_then(Value::as_f64).unwrap_or(0.0)
    }

    /// (samples, value) of every iteration that has this field.
    fn points(&self, field: &str) -> Vec<(f64, f64)> {
        let number = |line: &Map<String, Value>, field: &str| line.get(field)?.as_f64();
        let points = self.lines.iter();
        points
            .filter_map(|line| Some((number(line, "samples")?, number(line, field)?)))
            .collect()
    }

    /// A field of the evaluation, averaged over the run's motions.
    fn evaluated(&self, field: &str) -> Option<f64> {
        let evaluation = self.evaluation.as_ref()?;
        let Some(motions) = evaluation["motions"].as_array() else {
            return evaluation[field].as_f64();
        };
        let values: Option<Vec<f64>> = motions.iter().map(|m| m[field].as_f64()).collect();
        let values = values.filter(|values| !values.is_empty())?;
        Some(values.iter().sum::<f64>() / values.len() as f64)
    }
}

/// Samples of the checkpoint, if the log goes on after it and nobody trains the run.
fn saved(folder: &Path, lines: &[Map<String, Value>]) -> Option<u64> {
    let logged = lines.last()?.get("samples")?.as_u64()?;
    let saved = Checkpoint::load(folder.join(files::CHECKPOINT))
        .ok()?
        .samples;
    (saved < logged && Lock::holder(folder).is_none()).then_some(saved)
}

/// The evaluation of a run; an unfinished one has none.
fn evaluation(path: &Path) -> Outcome<Option<Value>> {
    if !path.exists() {
        return Ok(None);
    }
    let text = text_at_most(path, MOST_BYTES).map_err(|e| Failure::unreadable(path, &e))?;
    let value = serde_json::from_str(&text).map_err(|e| {
        Failure::input(path, format!("this is not an evaluation ({e})"))
            .with_remedy("write it again with `mimic eval`")
    })?;
    Ok(Some(value))
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
    let learned = FIGURES.iter().map(|(field, heading, scale)| Panel {
        heading,
        scale: *scale,
        curves: logs
            .iter()
            .map(|log| curve(log.points(field), smooth))
            .collect(),
    });
    let evaluated = EVALUATED.iter().map(|(field, heading)| Panel {
        heading,
        scale: Scale::Linear,
        curves: logs
            .iter()
            .map(|log| {
                let dot = log.evaluated(field).map(|value| (log.samples(), value));
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

fn report(path: &Path, names: &[String], logs: &[Log]) -> Value {
    let run = |(name, log): (&String, &Log)| {
        let column = |field: &str| -> Vec<Value> {
            let value = |line: &Map<String, Value>| line.get(field).cloned().unwrap_or_default();
            log.lines.iter().map(value).collect()
        };
        let mut run = json!({ "run": log.folder.display().to_string(), "name": name, "samples": column("samples") });
        for (field, ..) in FIGURES {
            run[field] = column(field).into();
        }
        let evaluated = EVALUATED.map(|(field, _)| (field.to_owned(), json!(log.evaluated(field))));
        run["evaluation"] = Value::Object(Map::from_iter(evaluated));
        run
    };
    let runs: Vec<Value> = names.iter().zip(logs).map(run).collect();
    json!({ "plot": path.display().to_string(), "runs": runs })
}

fn summary(path: &Path, names: &[String], logs: &[Log]) -> String {
    let mut text = format!("{}\n", plain(&path.display().to_string()));
    for (name, log) in names.iter().zip(logs) {
        let last = log.points("normalized_return").last().map(|(_, y)| *y);
        let figure = |value: Option<f64>, digits: usize| {
            value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
        };
        let saved = log.saved.map_or_else(String::new, |saved| {
            format!(" ({} of them saved)", amount::count(saved))
        });
        text += &format!(
            "  {}: {}, {:.2} M samples{saved}, normalised return {}, survival {}, local error {} mm\n",
            plain(name),
            iterations(log.lines.len()),
            log.samples() / 1e6,
            figure(last, 3),
            figure(log.evaluated("survival"), 3),
            figure(log.evaluated("mpjpe_local_mm"), 1),
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
