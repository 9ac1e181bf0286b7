//! `mimic eval`: how well an agent performs what it learned.

use crate::args::{at_least_one, positive};
use crate::failure::Outcome;
use crate::printer::Printer;
use crate::runs;
use mimic::evaluate::{Evaluation, Options};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  mimic eval                        the newest run
  mimic eval runs/kick --episodes 64
  mimic eval kick --json            the same fields as in runs/kick/eval.json";

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
    #[arg(long, value_name = "S", default_value_t = Options::default().seconds, value_parser = positive)]
    seconds: f64,
    /// Threads [default: all]; the result is the same at any number
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

impl Args {
    pub fn run(self, printer: &Printer) -> Outcome {
        runs::use_threads(self.threads)?;
        let run = runs::open(self.run.as_deref())?;
        let options = Options {
            episodes: self.episodes,
            seconds: self.seconds,
        };
        let results = runs::evaluate(&run, &options, printer)?;
        printer.result(&runs::evaluation_json(&results), || text(&results))
    }
}

/// A table per motion.
pub fn text(results: &[(String, Evaluation)]) -> String {
    let table = |(name, e): &(String, Evaluation)| {
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
        let rows = rows.map(|(name, value)| format!("  {name:34} {value:>12}\n"));
        format!("{name}, {} episodes\n{}", e.episodes, rows.concat())
    };
    results.iter().map(table).collect()
}
