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

/// The table: what was measured of the simulated character, of the animated one, and which values are good.
pub fn table(found: &SteeringEvaluation) -> String {
    let mut text = line("steered by random input", "character", "animated", "good");
    let share = |name: &str, value: f64, least: f64| {
        let percent = 100.0 * value;
        let missed = if percent >= least { "" } else { "  missed" };
        let good = format!("{least:.0} % or more{missed}");
        line(&format!("  {name}"), &format!("{percent:.1} %"), "", &good)
    };
    let seconds = found.seconds;
    text += &share(
        &format!("{seconds:.0} s without a fall"),
        found.survival,
        UPRIGHT[0],
    );
    let pushes = format!("the same, pushed by {:.0} N·s", found.pushed.impulse_ns);
    text += &share(&pushes, found.pushed.survival, UPRIGHT[1]);
    for bound in &BOUNDS {
        let shown = |figures: &Figures| shown((bound.value)(figures), bound.unit);
        let missed = match (bound.value)(&found.agent) <= bound.most {
            true => "",
            false => "  missed",
        };
        let good = format!("{}{} or less{missed}", bound.most, bound.unit);
        let name = format!("  {}", bound.name);
        text += &line(&name, &shown(&found.agent), &shown(&found.reference), &good);
    }
    let turned = format!("{:.1} %", 100.0 * found.agent.turn_180.success);
    let animated = format!("{:.1} %", 100.0 * found.reference.turn_180.success);
    text += &line("  turns that succeed", &turned, &animated, "95 % or more");
    let error = format!("{:.1} mm", found.mpjpe_local_mm);
    text += &line("  body error, root subtracted", &error, "", "40 mm or less");
    let step = format!("{:.3} ms", found.step_ms);
    text + &line(
        "  one control step on one core",
        &step,
        "",
        "0.3 ms or less",
    )
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
