//! How well a steered character follows its player, as a table.

use mimic::evaluate::{Figures, SteeringEvaluation};

/// From which value on a figure is good enough: those that a player wouldn't complain about. Chosen.
struct Bound {
    name: &'static str,
    unit: &'static str,
    /// What the figure has to be at most, in its unit.
    most: f64,
    value: fn(&Figures) -> f64,
}

const BOUNDS: [Bound; 9] = [
    Bound {
        name: "heading off by, mean",
        unit: "°",
        most: 10.0,
        value: |f| f.heading_error_deg.mean,
    },
    Bound {
        name: "heading off by, 95 % at most",
        unit: "°",
        most: 20.0,
        value: |f| f.heading_error_deg.p95,
    },
    Bound {
        name: "facing off by, mean",
        unit: "°",
        most: 10.0,
        value: |f| f.facing_error_deg.mean,
    },
    Bound {
        name: "facing off by, 95 % at most",
        unit: "°",
        most: 20.0,
        value: |f| f.facing_error_deg.p95,
    },
    Bound {
        name: "speed off by, mean",
        unit: " m/s",
        most: 0.15,
        value: |f| f.speed_error_m_s,
    },
    Bound {
        name: "answer to a start",
        unit: " s",
        most: 0.8,
        value: |f| f.rise_s,
    },
    Bound {
        name: "turn by 180°",
        unit: " s",
        most: 2.0,
        value: |f| f.turn_180.seconds,
    },
    Bound {
        name: "drift in a minute of standing",
        unit: " cm",
        most: 5.0,
        value: |f| 100.0 * f.idle_drift_m,
    },
    Bound {
        name: "slide of a standing foot",
        unit: " cm",
        most: 3.0,
        value: |f| 100.0 * f.slide_per_stance_m,
    },
];

/// Least share of the episodes without a fall, in per cent: without pushes and with them.
const UPRIGHT: [f64; 2] = [95.0, 90.0];
/// Least share of the turns that succeed, in per cent.
const TURNED: f64 = 95.0;

/// The table: what was measured of the simulated character, of the animated one, and which values are good.
pub fn table(found: &SteeringEvaluation) -> String {
    let mut text = line("steered by random input", "character", "animated", "good");
    let seconds = found.seconds;
    let alone = format!("{seconds:.0} s without a fall");
    let pushed = format!("the same, pushed by {:.0} N·s", found.pushed.impulse_ns);
    let turns = |of: &Figures| of.turn_180.success;
    text += &share(&alone, found.survival, None, UPRIGHT[0]);
    text += &share(&pushed, found.pushed.survival, None, UPRIGHT[1]);
    text += &share(
        "turns that succeed",
        turns(&found.agent),
        Some(turns(&found.reference)),
        TURNED,
    );
    for bound in &BOUNDS {
        let of = bound.value;
        text += &size(
            bound.name,
            of(&found.agent),
            Some(of(&found.reference)),
            bound.most,
            bound.unit,
        );
    }
    text += &size(
        "body error, root subtracted",
        found.mpjpe_local_mm,
        None,
        40.0,
        " mm",
    );
    text + &size(
        "one control step on one core",
        found.step_ms,
        None,
        0.3,
        " ms",
    )
}

/// A share, of which more is better; `least` is in per cent.
fn share(name: &str, agent: f64, animated: Option<f64>, least: f64) -> String {
    let percent = |value: f64| format!("{:.1} %", 100.0 * value);
    let good = format!("{least:.0} % or more{}", missed(100.0 * agent >= least));
    let animated = animated.map_or_else(String::new, percent);
    line(&format!("  {name}"), &percent(agent), &animated, &good)
}

/// A size, of which less is better.
fn size(name: &str, agent: f64, animated: Option<f64>, most: f64, unit: &str) -> String {
    let good = format!("{most}{unit} or less{}", missed(agent <= most));
    let animated = animated.map_or_else(String::new, |value| shown(value, unit));
    line(&format!("  {name}"), &shown(agent, unit), &animated, &good)
}

fn missed(is_good: bool) -> &'static str {
    if is_good { "" } else { "  missed" }
}

fn line(name: &str, agent: &str, animated: &str, good: &str) -> String {
    let line = format!("{name:38} {agent:>12} {animated:>12}  {good}");
    line.trim_end().to_owned() + "\n"
}

/// A value with its unit; a dash for one that isn't defined.
fn shown(value: f64, unit: &str) -> String {
    match value.is_finite() {
        true => format!("{value:.2}{unit}"),
        false => "-".to_owned(),
    }
}
