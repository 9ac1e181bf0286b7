//! `mimic eval`: how well an agent performs what it learned.

use crate::args::at_least_one;
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::output;
use crate::printer::Printer;
use crate::runs::{self, Measured};
use mimic::evaluate::{Failed, Options};
use mimic::learn::Run;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic eval                        the newest run
  mimic eval runs/kick --episodes 64 --out kick-64.json
  mimic eval kick --perturb         how it takes shoves, more or less weight and friction
  mimic eval kick --json            the same fields as in runs/kick/eval.json

A run's own eval.json is written with the default episodes and seconds alone, so that runs can be compared by it.";

/// Phases that a table's line has room for.
const MOST_PHASES: usize = 8;

/// Every frame of every episode is held in memory until all are measured.
const MOST_SECONDS: f64 = 3600.0;

/// Measure how well an agent performs: survival, tracking errors, contacts, momentum
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Run folder, or its name in runs/ [default: the newest]
    run: Option<PathBuf>,
    /// Episodes, started at phases spread evenly over the motion
    #[arg(long, value_name = "N", default_value_t = Options::default().episodes, value_parser = at_least_one)]
    episodes: usize,
    /// Length of an episode of a looping motion; one that ends is played to its end
    #[arg(long, value_name = "S", default_value_t = Options::default().seconds, value_parser = seconds)]
    seconds: f64,
    /// Play every phase a second time, disturbed: shoves, weight and friction as in the run's training, or else the
    /// usual ones (docs/presets.md); from the first shove on the reference follows the agent [default: for runs that were
    /// trained so]
    #[arg(long)]
    perturb: bool,
    /// Threads [default: all]; the result is the same at any number
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    threads: Option<usize>,
    /// Write the result to this file, as JSON [default: the run's eval.json, with default episodes and seconds]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
}

fn seconds(text: &str) -> Result<f64, String> {
    runs::at_most(text, MOST_SECONDS, "seconds")
}

impl Args {
    pub fn run(self, printer: &Printer) -> Outcome {
        runs::use_threads(self.threads)?;
        let run = runs::open(self.run.as_deref())?;
        let options = Options {
            episodes: self.episodes,
            seconds: self.seconds,
            perturbations: runs::perturbations(&run, self.perturb),
        };
        let out = self
            .out
            .as_deref()
            .map(|out| place(out, &run))
            .transpose()?;
        let results = runs::evaluate(&run, &options, printer)?;
        let kept = match out {
            Some(out) => write(&out, &results),
            None => {
                keep(&run, &options, &results, printer);
                Ok(())
            }
        };
        printer.result(&runs::evaluation_json(&results), || text(&results))?;
        kept
    }
}

/// Where `--out` puts the result: never over what the run is made of, nor over its own evaluation.
fn place(out: &Path, run: &Run) -> Outcome<PathBuf> {
    let path = output::result_path(Some(out), "eval", "json");
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok();
    let own = folder.is_some() && folder == run.dir().canonicalize().ok();
    let (inside, whose) = match own {
        true => (true, "the"),
        false => (folder.is_some_and(|folder| locate::is_run(&folder)), "a"),
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if inside && !name.starts_with("eval-") {
        return Err(Failure::input(
            &path,
            format!("belongs to {whose} run, name a file elsewhere, or one like `eval-long.json`"),
        ));
    }
    output::spare_others(&path, "json")?;
    Ok(path)
}

fn write(path: &Path, results: &[Measured]) -> Outcome {
    if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, e))?;
    }
    output::write_whole(path, runs::evaluation_text(results).as_bytes())
}

/// A run that can't be written, such as somebody else's, can still be measured.
fn keep(run: &Run, options: &Options, results: &[Measured], printer: &Printer) {
    let usual = Options {
        perturbations: options.perturbations,
        ..Options::default()
    };
    if *options != usual {
        printer.note(format!(
            "`{}` keeps its evaluation with the default options; `--out FILE` writes this one",
            run.dir().display()
        ));
    } else if let Err(failure) = runs::keep(run, results) {
        let reason = failure.message().unwrap_or_default();
        printer.warn(format!("{reason}; `--out FILE` writes it elsewhere"));
    }
}

/// Start phases from which it fails, the first few of them.
fn failed(failures: &[Failed], how: &str) -> Option<(String, String)> {
    let starts = failures.iter().take(MOST_PHASES);
    let mut phases: Vec<String> = starts.map(|f| format!("{:.2}", f.start)).collect();
    if failures.len() > MOST_PHASES {
        phases.push("…".to_owned());
    }
    let name = format!("fails from phase{how}");
    (!phases.is_empty()).then(|| (name, phases.join(" ")))
}

/// A table per motion.
pub fn text(results: &[Measured]) -> String {
    let table = |measured: &Measured| {
        let (name, e) = (&measured.motion, &measured.evaluation);
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let rows = [
            ("survival", percent(e.survival)),
            (
                "survival, from the first frame",
                percent(e.survival_from_start),
            ),
            (
                "success, mean error below 0.5 m",
                percent(e.success_mean_0_5),
            ),
            (
                "success, no error above 0.25 m",
                percent(e.success_max_0_25),
            ),
            ("body error, global", format!("{:.1} mm", e.mpjpe_global_mm)),
            (
                "body error, root subtracted",
                format!("{:.1} mm", e.mpjpe_local_mm),
            ),
            ("velocity error", format!("{:.3} m/s", e.velocity_error_m_s)),
            (
                "centre of mass error",
                format!("{:.1} mm", 1e3 * e.com_error_m),
            ),
            ("angular momentum error", percent(e.angular_momentum_error)),
            ("contact F1", format!("{:.3}", e.contact_f1)),
            ("foot skate", format!("{:.3} m/s", e.foot_skate_m_s)),
            ("normalised return", format!("{:.3}", e.normalized_return)),
            (
                "root turned",
                format!("{:.2} rad", e.root_rotation_turned_rad),
            ),
        ];
        let digests = [("from rest", &e.from_rest), ("disturbed", &e.perturbed)];
        let digests = digests
            .into_iter()
            .filter_map(|(how, digest)| Some((how, digest.as_ref()?)));
        let rows = rows.map(|(name, value)| (name.to_owned(), value));
        let more = digests.flat_map(|(how, d)| {
            [
                (format!("survival, {how}"), percent(d.survival)),
                (
                    format!("body error, local, {how}"),
                    format!("{:.1} mm", d.mpjpe_local_mm),
                ),
            ]
        });
        let shoved = e.perturbed.iter();
        let shoved = shoved.filter_map(|d| failed(&d.failures, ", disturbed"));
        let failed = failed(&e.failures, "").into_iter().chain(shoved);
        let rows = rows.into_iter().chain(more).chain(failed);
        let rows: String = rows
            .map(|(name, value)| format!("  {name:34} {value:>12}\n"))
            .collect();
        format!("{name}, {} episodes\n{rows}", e.episodes)
    };
    results.iter().map(table).collect()
}
