//! `mimic doctor`: whether this machine has what the work needs.

use crate::failure::{Failure, Outcome};
use crate::printer::Printer;
use crate::viewer::{self, Viewer};
use serde::Serialize;
use serde_json::json;
use std::path::Path;

const EXAMPLES: &str = "\
Examples:
  mimic doctor                      a table
  mimic doctor --json               the same for scripts

Exit code 1 means that something needed is missing; what would merely be nice to have does not count.";

/// Check this machine, and say how to mend what is missing
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {}

#[derive(Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
enum State {
    Good,
    /// Something works less well without it.
    Weak,
    /// Nothing works without it.
    Missing,
}

#[derive(Serialize)]
struct Check {
    id: &'static str,
    state: State,
    found: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    remedy: Option<String>,
}

impl Args {
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let checks = [cores(), simd(), folder(), viewer(), clips(library)];
        let missing: Vec<_> = ids(&checks, State::Missing);
        let json = json!({ "ok": missing.is_empty(), "checks": &checks });
        printer.result(&json, || table(&checks))?;
        if missing.is_empty() {
            return Ok(());
        }
        Err(Failure::work(format!(
            "missing here: {}",
            missing.join(", ")
        )))
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
        remedy: (threads < 2).then(|| "training uses every core it gets; give it more".into()),
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
            "networks run several times slower without; use a processor of 2013 or later".into()
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

/// Proves by writing that this folder can hold results.
fn folder() -> Check {
    let probe = format!(".mimic-doctor-{}", std::process::id());
    let written = std::fs::write(&probe, b"mimic").and_then(|()| std::fs::remove_file(&probe));
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
            .then(|| "go to a folder of your own, or name one with `--out`".into()),
    }
}

fn viewer() -> Check {
    let Some(viewer) = Viewer::find() else {
        return Check {
            id: "viewer",
            state: State::Weak,
            found: "rerun is not on the search path".into(),
            remedy: Some(format!(
                "{}; `mimic replay --save` works without",
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
                "recordings are for {}: {}",
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
            Ok(count) => format!("{} with {count} entries", library.display()),
            Err(_) => format!("no folder {}", library.display()),
        },
        remedy: count
            .is_err()
            .then(|| "name one with `--library DIR` or `MIMIC_LIBRARY`; paths work without".into()),
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
