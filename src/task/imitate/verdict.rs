//! Whether a motion is learned.

use crate::task::{Measure, Performance, Verdict};

/// Most start phases that the verdict names; the evaluation has them all.
const NAMED: usize = 3;

/// A motion is learned by who survives nearly all of it and stays close to it: both measures say which values are enough.
pub fn verdict(found: &Performance) -> Verdict {
    let [survival, error] = ["survival", "mpjpe_local_mm"].map(|name| found.measure(name));
    let lasts = survival.is_some_and(|survival| survival.is_enough());
    let close = error.is_some_and(|error| error.is_enough());
    let value = |measure: Option<&Measure>| measure.map_or(f64::NAN, |m| m.value);
    match (lasts, close, found.failed) {
        (true, true, []) => Verdict::learned(format!(
            "learned: it lasts from all {} start phases",
            found.episodes
        )),
        (true, true, failed) => {
            Verdict::learned(format!("learned, but it fails from {}", phases(failed)))
        }
        (true, false, _) => Verdict::not_yet(format!(
            "not yet learned: it lasts, but its bodies are {:.0} mm off",
            value(error)
        )),
        (false, ..) => Verdict::not_yet(format!(
            "not yet learned: it lasts {:.0} % of the time",
            100.0 * value(survival)
        )),
    }
}

/// The first few phases, and how many more there are.
fn phases(failed: &[f64]) -> String {
    let first = failed.iter().take(NAMED);
    let first: Vec<String> = first.map(|phase| format!("{phase:.2}")).collect();
    let word = if failed.len() == 1 { "phase" } else { "phases" };
    match failed.len().saturating_sub(NAMED) {
        0 => format!("{word} {}", first.join(", ")),
        more => format!("{word} {} and {more} more", first.join(", ")),
    }
}
