//! The learning curves of runs: a grid of panels, a colour per run.

use super::svg::{MOST_MARKS, escaped, svg, tick_step};
use std::fmt::Write;

const COLUMNS: usize = 3;
const PANEL: [f64; 2] = [300.0, 150.0];
const LEFT: f64 = 56.0;
const RIGHT: f64 = 20.0;
/// Space above a panel for its heading, and below it for its axis.
const HEAD: f64 = 30.0;
const FOOT: f64 = 34.0;
const TITLE: f64 = 40.0;
const LEGEND_ROW: f64 = 20.0;

/// Space between a curve and the frame, as a share of the curve's range.
const MARGIN: f64 = 0.05;

/// Colours that people with colour blindness can tell apart too (Okabe and Ito).
const COLORS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#444444",
];

/// The scale of a panel's vertical axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Equal steps are equal differences.
    Linear,
    /// Equal steps are equal factors.
    Logarithmic,
}

/// One figure of all runs.
pub struct Panel {
    /// What the panel shows, with its unit.
    pub heading: &'static str,
    /// The scale of its vertical axis.
    pub scale: Scale,
    /// One per run, in the order of the legend; empty where a run has none.
    pub curves: Vec<Curve>,
}

/// Points of one run, (samples, value), in order of samples; values are finite.
#[derive(Clone, Debug, Default)]
pub struct Curve {
    /// The values as they were logged.
    pub raw: Vec<(f64, f64)>,
    /// The smoothed curve, drawn in front; the same as `raw` if nothing is smoothed.
    pub smooth: Vec<(f64, f64)>,
}

/// Panels in rows of three over the number of samples, under a legend of the `runs`.
pub fn curves(runs: &[String], panels: &[Panel]) -> String {
    let samples = panels.iter().flat_map(|p| &p.curves).flat_map(|c| &c.raw);
    let most = samples.map(|(x, _)| *x).fold(1.0, f64::max);
    let cell = [LEFT + PANEL[0] + RIGHT, HEAD + PANEL[1] + FOOT];
    let width = COLUMNS as f64 * cell[0];
    let mut body = String::new();
    text(&mut body, [LEFT, 26.0], "title", "learning curves");
    let top = legend(&mut body, runs, width);
    for (number, panel) in panels.iter().enumerate() {
        let (row, column) = (number / COLUMNS, number % COLUMNS);
        let corner = [
            LEFT + cell[0] * column as f64,
            top + HEAD + cell[1] * row as f64,
        ];
        draw(&mut body, panel, corner, most);
    }
    let rows = panels.len().div_ceil(COLUMNS) as f64;
    svg(width, top + rows * cell[1] + 8.0, &body)
}

/// Draws the names with their colours, as many in a row as fit. Returns where the panels begin.
fn legend(body: &mut String, runs: &[String], width: f64) -> f64 {
    let (mut x, mut y) = (LEFT, TITLE + 8.0);
    for (number, run) in runs.iter().enumerate() {
        let wide = 40.0 + 7.2 * run.chars().count() as f64;
        if x > LEFT && x + wide > width - RIGHT {
            (x, y) = (LEFT, y + LEGEND_ROW);
        }
        let color = color(number);
        writeln!(
            body,
            r#"<path class="line" stroke="{color}" style="stroke-width:3" d="M{x:.1} {:.1}h18"/>"#,
            y - 4.0
        )
        .ok();
        text(body, [x + 24.0, y], "legend", run);
        x += wide;
    }
    y + 6.0
}

fn color(run: usize) -> &'static str {
    COLORS[run % COLORS.len()]
}

/// Draws one panel with its top left corner at `[left, top]`, over samples from 0 to `most`.
fn draw(body: &mut String, panel: &Panel, [left, top]: [f64; 2], most: f64) {
    let [width, height] = PANEL;
    text(body, [left, top - 8.0], "heading", panel.heading);
    let axis = Axis::of(panel);
    for (value, label) in axis.ticks() {
        let y = top + height * (1.0 - axis.share(value));
        writeln!(
            body,
            r#"<path class="grid" d="M{left:.1} {y:.1}h{width}"/>"#
        )
        .ok();
        text(body, [left - 6.0, y + 4.0], "tick", &label);
    }
    let step = tick_step(most, width / 2.0);
    let ticks = (0..MOST_MARKS).map(|n| f64::from(n) * step);
    for samples in ticks.take_while(|samples| *samples <= most * (1.0 + 1e-9)) {
        let x = left + width * samples / most;
        writeln!(
            body,
            r#"<path class="grid" d="M{x:.1} {top:.1}v{height}"/>"#
        )
        .ok();
        text(body, [x, top + height + 16.0], "time", &count(samples));
    }
    for (number, curve) in panel.curves.iter().enumerate() {
        let place = |(x, y): &(f64, f64)| {
            [
                left + width * x / most,
                top + height * (1.0 - axis.share(*y)),
            ]
        };
        if curve.raw != curve.smooth {
            line(body, "raw", color(number), curve.raw.iter().map(place));
        }
        line(body, "line", color(number), curve.smooth.iter().map(place));
    }
    writeln!(
        body,
        r#"<rect class="frame" x="{left:.1}" y="{top:.1}" width="{width}" height="{height}"/>"#
    )
    .ok();
}

/// Draws a curve; a single point becomes a dot.
fn line(body: &mut String, class: &str, color: &str, points: impl Iterator<Item = [f64; 2]>) {
    let points: Vec<[f64; 2]> = points.collect();
    if let [[x, y]] = points[..] {
        writeln!(
            body,
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.5" fill="{color}"/>"#
        )
        .ok();
        return;
    }
    let mut path = String::new();
    for [x, y] in points {
        let command = if path.is_empty() { 'M' } else { 'L' };
        write!(path, "{command}{x:.1} {y:.1}").ok();
    }
    if !path.is_empty() {
        writeln!(
            body,
            r#"<path class="{class}" stroke="{color}" d="{path}"/>"#
        )
        .ok();
    }
}

fn text(body: &mut String, [x, y]: [f64; 2], class: &str, text: &str) {
    let text = escaped(text);
    writeln!(
        body,
        r#"<text class="{class}" x="{x:.1}" y="{y:.1}">{text}</text>"#
    )
    .ok();
}

/// The vertical axis of a panel. The ends of a logarithmic axis are powers of ten.
struct Axis {
    scale: Scale,
    low: f64,
    high: f64,
}

impl Axis {
    /// The range of the curves with a margin. It includes zero if that is near or the curves are flat. Curves that are flat
    /// at zero, or flat on a logarithmic axis, get half a unit on either side.
    fn of(panel: &Panel) -> Self {
        let curves = || {
            panel
                .curves
                .iter()
                .flat_map(|c| c.raw.iter().chain(&c.smooth))
        };
        let along = |value: f64| match panel.scale {
            Scale::Linear => value,
            Scale::Logarithmic => value.max(f64::MIN_POSITIVE).log10(),
        };
        let values = || curves().map(|(_, y)| along(*y));
        let (low, high) = (
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        );
        let (mut low, mut high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        if high - low < 1e-9 * high.abs().max(1e-3) {
            (low, high) = match panel.scale {
                Scale::Linear if high != 0.0 => (low.min(0.0), high.max(0.0)),
                _ => (low - 0.5, high + 0.5),
            };
        }
        let span = high - low;
        let near = |end: f64| panel.scale == Scale::Linear && end.abs() <= span;
        low = if low >= 0.0 && near(low) {
            0.0
        } else {
            low - MARGIN * span
        };
        high = if high <= 0.0 && near(high) {
            0.0
        } else {
            high + MARGIN * span
        };
        Axis {
            scale: panel.scale,
            low,
            high,
        }
    }

    /// 0 at the bottom, 1 at the top.
    fn share(&self, value: f64) -> f64 {
        let at = match self.scale {
            Scale::Linear => value,
            Scale::Logarithmic => value.max(f64::MIN_POSITIVE).log10(),
        };
        (at - self.low) / (self.high - self.low)
    }

    fn ticks(&self) -> Vec<(f64, String)> {
        // The ends of a linear axis are no powers, and there is no end to how far apart they may be.
        let powers: Vec<f64> = match self.scale {
            Scale::Linear => Vec::new(),
            Scale::Logarithmic => {
                let powers = self.low.ceil() as i32..=self.high.floor() as i32;
                powers.map(|p| 10f64.powi(p)).collect()
            }
        };
        if powers.len() >= 2 {
            let every = powers.len().div_ceil(5);
            return powers
                .into_iter()
                .step_by(every)
                .map(|v| (v, number(v)))
                .collect();
        }
        let (low, high) = match self.scale {
            Scale::Linear => (self.low, self.high),
            Scale::Logarithmic => (10f64.powf(self.low), 10f64.powf(self.high)),
        };
        let step = tick_step(high - low, PANEL[1]);
        let first = (low / step).ceil();
        // Of numbers so large that the next step is the same number, the first marks say enough.
        (0..MOST_MARKS)
            .map(|n| (first + f64::from(n)) * step + 0.0)
            .take_while(|value| *value <= high + 1e-9 * step)
            .map(|value| (value, mark(value, step)))
            .collect()
    }
}

/// As [`number()`], with enough digits to differ from the next mark, a `step` away.
fn mark(value: f64, step: f64) -> String {
    let short = number(value);
    if short != number(value + step) && short != number(value - step) {
        return short;
    }
    let digits = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

/// A number with three significant digits at most.
fn number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-3..1e5).contains(&size) {
        return format!("{value:.0e}");
    }
    let digits = (2.0 - size.max(1e-3).log10().floor()).clamp(0.0, 5.0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// A number of samples, in thousands or millions.
fn count(samples: f64) -> String {
    match samples {
        0.0 => "0".to_owned(),
        few if few < 1e3 => format!("{few:.0}"),
        some if some < 1e6 => format!("{} k", number(some / 1e3)),
        many => format!("{} M", number(many / 1e6)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(scale: Scale, values: &[f64]) -> Panel {
        let raw: Vec<_> = values
            .iter()
            .enumerate()
            .map(|(x, y)| (x as f64, *y))
            .collect();
        let smooth = raw.clone();
        Panel {
            heading: "figure",
            scale,
            curves: vec![Curve { raw, smooth }],
        }
    }

    #[test]
    fn axes_hold_their_curves_and_zero_where_it_is_near() {
        let axis = |scale, values: &[f64]| Axis::of(&panel(scale, values));
        let near = axis(Scale::Linear, &[0.2, 1.0]);
        assert_eq!((near.low, near.high), (0.0, 1.04));
        let far = axis(Scale::Linear, &[100.0, 101.0]);
        assert!((far.share(100.5) - 0.5).abs() < 1e-9 && far.share(101.0) < 1.0);
        let flat = axis(Scale::Linear, &[2.0, 2.0]);
        assert_eq!((flat.low, flat.high), (0.0, 2.1));
        let nothing = axis(Scale::Linear, &[0.0, 0.0]);
        assert_eq!(nothing.share(0.0), 0.5);
        let flat = axis(Scale::Logarithmic, &[1e-2, 1e-2]);
        assert!((flat.share(1e-2) - 0.5).abs() < 1e-12);
        let log = axis(Scale::Logarithmic, &[1e-4, 1e-2]);
        assert!((log.share(1e-3) - 0.5).abs() < 1e-12);
        let labels: Vec<String> = log.ticks().into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["1e-4", "0.001", "0.01"]);
        let close = axis(Scale::Linear, &[0.96963, 0.96974]).ticks();
        let labels: Vec<String> = close.into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["0.96965", "0.96970"]);
        let empty = axis(Scale::Linear, &[]).ticks();
        let labels: Vec<String> = empty.into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["0", "0.5", "1"], "30 pixels of 150 apart at least");
    }

    #[test]
    fn a_drawing_has_a_line_for_every_run_and_no_stray_markup() {
        let mut two = panel(Scale::Linear, &[0.0, 1.0, 0.5]);
        two.curves.push(two.curves[0].clone());
        let drawn = curves(&["a<b".to_owned(), "c".to_owned()], &[two]);
        for color in &COLORS[..2] {
            let line = format!(r#"<path class="line" stroke="{color}" d="M"#);
            assert_eq!(drawn.matches(&line).count(), 1, "{color}");
        }
        assert!(drawn.contains("a&lt;b") && !drawn.contains("NaN"));
        let one = curves(&["one".to_owned()], &[panel(Scale::Linear, &[3.0])]);
        assert!(one.contains("<circle"), "a single point shows");
    }

    #[test]
    fn numbers_are_short() {
        let found = [0.0, 0.25, 1.5, 20.0, 0.001, 1e-5, 2e6].map(number);
        assert_eq!(found, ["0", "0.25", "1.5", "20", "0.001", "1e-5", "2e6"]);
        let found = [0.0, 500.0, 20e3, 2.5e6].map(count);
        assert_eq!(found, ["0", "500", "20 k", "2.5 M"]);
    }
}
