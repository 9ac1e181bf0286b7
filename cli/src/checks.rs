//! The checks of a motion as lines of text.

use crate::failure::flag;
use mimic::clip::Severity;
use mimic::explain::Parameter;
use mimic::motion::Check;
use std::fmt::Write;

/// A line for every check, then what to do about those that failed.
pub fn table(checks: &[Check]) -> String {
    let mut text = String::new();
    for check in checks {
        let verdict = match (check.passed, check.severity) {
            (true, _) => "good",
            (false, Severity::Note) => "note",
            (false, Severity::Warning) => "warn",
            (false, Severity::Error) => "bad",
        };
        let (id, name) = (check.id, check.name);
        writeln!(text, "{verdict:4}  {id:22} {:24}  {name}", amounts(check)).ok();
    }
    text + &advice(checks)
}

/// What to do about the checks that failed.
pub fn advice(checks: &[Check]) -> String {
    let mut text = String::new();
    for check in checks.iter().filter(|check| !check.passed) {
        let at = check
            .frame
            .map_or(String::new(), |f| format!(", frame {f}"));
        let (id, amounts, advice) = (check.id, amounts(check), check.advice);
        let flags = flags(check);
        writeln!(text, "{id} ({amounts}{at}): {advice}{flags}").ok();
    }
    text
}

/// The flags that the advice is about, in brackets: ` (`--trim A..B`)`.
fn flags(check: &Check) -> String {
    let flag = |parameter: &Parameter| match parameter {
        // The only one that isn't a flag of importing or retargeting.
        Parameter::Speed => Some("`mimic edit --speed FACTOR`".to_owned()),
        other => flag(*other).map(|flag| format!("`{flag}`")),
    };
    let flags: Vec<String> = check.parameters.iter().filter_map(flag).collect();
    match flags.is_empty() {
        true => String::new(),
        false => format!(" ({})", flags.join(", ")),
    }
}

fn amounts(check: &Check) -> String {
    let short = |value: f64| {
        let text = format!("{value:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    let unit = format!(" {}", check.unit);
    let value = format!("{}{}", short(check.value), unit.trim_end());
    format!("{value}, limit {}", short(check.limit))
}
