//! `mimic doctor`: checks whether this machine has what the work needs.

use crate::failure::{Failure, Outcome};
use crate::printer::Printer;
use crate::recording;
use crate::viewer::{self, Viewer};
use mimic::file::Unfinished;
use serde::Serialize;
use serde_json::json;
use std::io::Write;
use std::path::Path;

const EXAMPLES: &str = "\
Examples:
  mimic doctor                      print a table
  mimic doctor --json               print JSON for scripts

Exit code 1 means that something necessary is missing. Optional things don't count.";

/// Check this machine, and say how to fix what is missing
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {}

/// What a check found.
#[derive(Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
enum State {
    /// All is well.
    Good,
    /// Something is slower or unavailable without it.
    Weak,
    /// Nothing works without it.
    Missing,
}

/// One line of the table.
#[derive(Serialize)]
struct Check {
    id: &'static str,
    state: State,
    found: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    remedy: Option<String>,
}

impl Args {
    /// Runs the command.
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let checks = [cores(), simd(), folder(), viewer(), clips(library)];
        let missing: Vec<_> = ids(&checks, State::Missing);
        let json = json!({ "ok": missing.is_empty(), "checks": &checks });
        if missing.is_empty() {
            return printer.result(&json, || table(&checks));
        }
        let failure = Failure::work(format!("this machine lacks: {}", missing.join(", ")))
            .with_remedy("follow the advice in the table");
        printer.partial_result(json, || table(&checks), failure)
    }
}

fn ids(checks: &[Check], state: State) -> Vec<&'static str> {
    checks
        .iter()
        .filter(|c| c.state == state)
        .map(|c| c.id)
        .collect()
}

fn cores() -> Check {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    Check {
        id: "cores",
        state: if threads > 1 {
            State::Good
        } else {
            State::Weak
        },
        found: format!("{threads} hardware threads"),
        remedy: (threads < 2).then(|| "give it more cores: training uses all of them".into()),
    }
}

#[cfg(target_arch = "x86_64")]
fn simd() -> Check {
    let (avx2, fma) = (
        is_x86_feature_detected!("avx2"),
        is_x86_feature_detected!("fma"),
    );
    let good = avx2 && fma;
    Check {
        id: "simd",
        state: if good { State::Good } else { State::Weak },
        found: format!("AVX2 {}, FMA {}", yes(avx2), yes(fma)),
        remedy: (!good).then(|| {
            "use a processor from 2013 or later: networks run several times slower without".into()
        }),
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn simd() -> Check {
    Check {
        id: "simd",
        state: State::Good,
        found: format!("{} vectors", std::env::consts::ARCH),
        remedy: None,
    }
}

fn yes(flag: bool) -> &'static str {
    if flag { "yes" } else { "no" }
}

/// Shows by writing a file that this folder can hold results.
fn folder() -> Check {
    // Under a name that no file of the user has.
    let probe = Unfinished::beside("doctor");
    let written = probe.and_then(|mut probe| probe.file().write_all(b"mimic"));
    let here = std::env::current_dir().unwrap_or_default();
    Check {
        id: "folder",
        state: if written.is_ok() {
            State::Good
        } else {
            State::Missing
        },
        found: match &written {
            Ok(()) => format!("{} can be written", here.display()),
            Err(e) => format!("{} cannot be written: {e}", here.display()),
        },
        remedy: written
            .is_err()
            .then(|| "work in a folder of your own, or name one with `--out PATH`".into()),
    }
}

fn viewer() -> Check {
    if !recording::AVAILABLE {
        return Check {
            id: "viewer",
            state: State::Weak,
            found: "this build cannot write recordings".into(),
            remedy: Some(recording::HOW_TO_GET.into()),
        };
    }
    let Some(viewer) = Viewer::find() else {
        return Check {
            id: "viewer",
            state: State::Weak,
            found: "rerun is not on the search path".into(),
            remedy: Some(format!(
                "{}; `mimic replay --save` works without it",
                viewer::install()
            )),
        };
    };
    let version = viewer.version.as_deref().unwrap_or("of unknown version");
    let good = viewer.fits();
    Check {
        id: "viewer",
        state: if good { State::Good } else { State::Weak },
        found: format!("rerun {version} at {}", viewer.path().display()),
        remedy: (!good).then(|| {
            format!(
                "recordings are written for version {}: {}",
                viewer::VERSION,
                viewer::install()
            )
        }),
    }
}

fn clips(library: &Path) -> Check {
    let count = std::fs::read_dir(library).map(Iterator::count);
    Check {
        id: "library",
        state: if count.is_ok() {
            State::Good
        } else {
            State::Weak
        },
        found: match &count {
            Ok(count) => format!("{} has {count} entries", library.display()),
            Err(_) => format!("there is no folder {}", library.display()),
        },
        remedy: count
            .is_err()
            .then(|| "name the folder of your clips with `--library DIR` or `MIMIC_LIBRARY`, or give paths".into()),
    }
}

fn table(checks: &[Check]) -> String {
    let mut text = String::new();
    for check in checks {
        let mark = match check.state {
            State::Good => "good",
            State::Weak => "weak",
            State::Missing => "MISSING",
        };
        text += &format!("{:8} {:8} {}\n", check.id, mark, check.found);
        if let Some(remedy) = &check.remedy {
            text += &format!("{:17} {remedy}\n", "");
        }
    }
    text
}
