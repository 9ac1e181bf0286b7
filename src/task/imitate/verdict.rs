//! Whether a motion is learned.

use crate::task::{Measure, Performance, Verdict};

/// Most start phases that the verdict names; the evaluation has them all.
const NAMED: usize = 3;

/// A motion is learned by who survives nearly all of it and stays close to it: every measure that says which values are enough
/// has to be enough.
pub fn verdict(found: &Performance) -> Verdict {
    match missed(found) {
        Some(miss) => Verdict::not_yet(format!("not yet learned: {miss}")),
        None => Verdict::learned(learned(found)),
    }
}

/// What keeps a motion from being learned, the worst first.
fn missed(found: &Performance) -> Option<String> {
    let is_enough = |name: &str| found.measure(name).is_some_and(Measure::is_enough);
    let value = |name: &str| found.measure(name).map_or(f64::NAN, |m| m.value);
    if !is_enough("survival") {
        let percent = 100.0 * value("survival");
        return Some(format!("it lasts {percent:.0} % of the time"));
    }
    if !is_enough("mpjpe_local_mm") {
        let error = value("mpjpe_local_mm");
        return Some(format!("it lasts, but its bodies are {error:.0} mm off"));
    }
    let misses = |measure: &&Measure| measure.enough.is_some() && !measure.is_enough();
    Some(match found.measures.iter().find(misses)?.name {
        "mpjpe_global_mm" => format!(
            "it lasts and keeps the pose, but is {:.0} mm away from where it should be",
            value("mpjpe_global_mm")
        ),
        _ => match counting(found).0 {
            counting if counting.is_empty() => format!("it fails from {}", phases(found.failed)),
            counting => format!("it fails from {}", phases(&counting)),
        },
    })
}

/// How well it is learned.
fn learned(found: &Performance) -> String {
    let turning = found.measure("angular_momentum_error");
    let (counting, excused) = counting(found);
    if counting.is_empty() && !excused.is_empty() {
        let all = found.episodes - found.beyond_reach.len();
        let verb = if excused.len() == 1 { "is" } else { "are" };
        return format!(
            "learned: it lasts from all {all} start phases within reach; {} {verb} beyond reach",
            phases(&excused)
        );
    }
    match counting[..] {
        // Whoever stands performs such a motion, trained or not.
        [] if turning.is_some_and(|error| error.value.is_nan()) => {
            "learned, but nothing turns in this motion, so there was little to learn".to_owned()
        }
        [] => format!("learned: it lasts from all {} start phases", found.episodes),
        _ => format!("learned, but it fails from {}", phases(&counting)),
    }
}

/// The starts that failed: those that count, and those that are beyond reach.
fn counting(found: &Performance) -> (Vec<f64>, Vec<f64>) {
    let counts = |start: &f64| !found.beyond_reach.contains(start);
    found.failed.iter().partition(|start| counts(start))
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
