//! The tracks of a motion: panels over time, one below the other.

use super::svg::{MOST_MARKS, escaped, short, svg, tick_step};
use mimic::motion::Motion;
use std::fmt::Write;

const WIDTH: f64 = 900.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 150.0;
const TOP: f64 = 62.0;
const GAP: f64 = 34.0;
const PANEL: f64 = 120.0;
const LANE: f64 = 20.0;

const COLORS: [&str; 4] = ["#c8553d", "#2a7f9e", "#6a994e", "#444444"];

/// A curve of a panel.
struct Line<'a> {
    name: &'a str,
    color: &'a str,
    values: Vec<f64>,
}

/// Draws contacts, centre of mass, momenta, the force that no contact can supply, and phase.
pub fn tracks(motion: &Motion) -> String {
    let tracks = &motion.tracks;
    let mut sheet = Sheet::new(motion);
    sheet.lanes(motion);
    sheet.panel("centre of mass, m", &xyz(&tracks.com));
    sheet.panel(
        "velocity of the centre of mass, m/s",
        &xyz(&tracks.com_velocity),
    );
    sheet.panel("linear momentum, kg·m/s", &xyz(&tracks.linear_momentum));
    sheet.panel("angular momentum, kg·m²/s", &xyz(&tracks.angular_momentum));
    let unsupported = Line {
        name: "magnitude",
        color: COLORS[3],
        values: tracks.unsupported_force().collect(),
    };
    sheet.panel("force that no contact can supply, N", &[unsupported]);
    let phase = Line {
        name: "phase",
        color: COLORS[3],
        values: tracks.phase.clone(),
    };
    sheet.panel("phase", &[phase]);
    sheet.finish()
}

/// The three components of a track as curves.
fn xyz(track: &[nalgebra::Vector3<f64>]) -> [Line<'static>; 3] {
    let names = ["x forward", "y left", "z up"];
    std::array::from_fn(|axis| Line {
        name: names[axis],
        color: COLORS[axis],
        values: track.iter().map(|v| v[axis]).collect(),
    })
}

/// The drawing so far.
struct Sheet {
    body: String,
    /// Top of the next panel.
    y: f64,
    duration: f64,
    fps: f64,
}

impl Sheet {
    fn new(motion: &Motion) -> Self {
        let mut sheet = Self {
            body: String::new(),
            y: TOP,
            duration: motion.duration().max(1.0 / motion.fps),
            fps: motion.fps,
        };
        let title = format!("{} on {}", motion.name, motion.skeleton_name);
        sheet.text(LEFT, 24.0, "title", &title);
        sheet
    }

    fn x(&self, frame: usize) -> f64 {
        let share = frame as f64 / self.fps / self.duration;
        LEFT + share.min(1.0) * (WIDTH - LEFT - RIGHT)
    }

    /// Draws a bar for every stretch of time in which a body touches the ground, for each that ever does.
    fn lanes(&mut self, motion: &Motion) {
        let names = motion.contact_names();
        self.heading("ground contact");
        let top = self.y;
        let rows = &motion.tracks.contact;
        let track = |contact: usize| -> Vec<bool> {
            let down = |row: &Vec<bool>| row.get(contact) == Some(&true);
            rows.iter().map(down).collect()
        };
        let tracks = names.iter().enumerate();
        let tracks = tracks.map(|(contact, name)| (name, track(contact)));
        let down: Vec<_> = tracks.filter(|(_, down)| down.contains(&true)).collect();
        for (lane, (name, down)) in down.iter().enumerate() {
            let y = top + LANE * lane as f64;
            self.text(WIDTH - RIGHT + 8.0, y + 13.0, "legend", name);
            for (from, to) in stretches(down) {
                let (x, width) = (self.x(from), self.x(to) - self.x(from));
                let color = COLORS[lane % COLORS.len()];
                let height = LANE - 6.0;
                self.draw(format!(
                    r#"<rect x="{x:.1}" y="{:.1}" width="{width:.1}" height="{height}" rx="2" fill="{color}"/>"#,
                    y + 3.0
                ));
            }
        }
        let height = LANE * down.len().max(1) as f64;
        self.frame(height);
        self.y = top + height + GAP;
    }

    /// Draws a panel with its curves, axis and legend.
    fn panel(&mut self, heading: &str, lines: &[Line]) {
        self.heading(heading);
        let values = lines.iter().flat_map(|line| &line.values).copied();
        let (low, high) = values
            .filter(|v| v.is_finite())
            .fold((0.0_f64, 0.0_f64), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        // Curves that stay at zero get a range, too.
        let high = if high - low < 1e-9 { low + 1.0 } else { high };
        let top = self.y;
        let height = |value: f64| top + PANEL * (high - value) / (high - low);
        self.ticks(low, high, height);
        for (row, line) in lines.iter().enumerate() {
            self.curve(line, top + 14.0 + 18.0 * row as f64, height);
        }
        self.frame(PANEL);
        self.y = top + PANEL + GAP;
    }

    /// Draws the grid lines from `low` to `high` at their `height`, with their values on the left.
    fn ticks(&mut self, low: f64, high: f64, height: impl Fn(f64) -> f64) {
        let step = tick_step(high - low, PANEL);
        let first = (low / step).ceil();
        let ticks = (0..MOST_MARKS).map(|n| first + f64::from(n));
        for tick in ticks.take_while(|tick| tick * step <= high + 1e-9 * step) {
            let (value, y) = (tick * step + 0.0, height(tick * step));
            self.draw(format!(
                r#"<path class="grid" d="M{LEFT} {y:.1}H{:.1}"/>"#,
                WIDTH - RIGHT
            ));
            self.text(LEFT - 8.0, y + 4.0, "tick", &short(value));
        }
    }

    /// Draws a curve, and its name in the legend at `y`.
    fn curve(&mut self, line: &Line, y: f64, height: impl Fn(f64) -> f64) {
        let mut path = String::new();
        let values = line.values.iter().enumerate();
        for (frame, value) in values.filter(|(_, v)| v.is_finite()) {
            let command = if path.is_empty() { 'M' } else { 'L' };
            write!(path, "{command}{:.1} {:.1}", self.x(frame), height(*value)).ok();
        }
        let color = line.color;
        self.draw(format!(
            r#"<path class="line" stroke="{color}" d="{path}"/>"#
        ));
        let x = WIDTH - RIGHT + 8.0;
        self.draw(format!(
            r#"<path class="line" stroke="{color}" d="M{x} {:.1}h16"/>"#,
            y - 4.0
        ));
        self.text(x + 22.0, y, "legend", line.name);
    }

    fn heading(&mut self, text: &str) {
        self.text(LEFT, self.y - 7.0, "heading", text);
    }

    fn frame(&mut self, height: f64) {
        let (y, width) = (self.y, WIDTH - LEFT - RIGHT);
        self.draw(format!(
            r#"<rect class="frame" x="{LEFT}" y="{y:.1}" width="{width}" height="{height:.1}"/>"#
        ));
    }

    fn text(&mut self, x: f64, y: f64, class: &str, text: &str) {
        let text = escaped(text);
        self.draw(format!(
            r#"<text class="{class}" x="{x:.1}" y="{y:.1}">{text}</text>"#
        ));
    }

    fn draw(&mut self, element: String) {
        self.body += &element;
        self.body.push('\n');
    }

    /// Draws the time axis below the last panel, and returns the file.
    fn finish(mut self) -> String {
        let bottom = self.y - GAP;
        let step = tick_step(self.duration, 2.5 * PANEL);
        let ticks = (0..MOST_MARKS).map(|n| f64::from(n) * step);
        let duration = self.duration;
        for time in ticks.take_while(|time| *time <= duration + 1e-9) {
            let x = LEFT + time / duration * (WIDTH - LEFT - RIGHT);
            self.draw(format!(
                r#"<path class="grid" d="M{x:.1} {TOP}V{bottom:.1}"/>"#
            ));
            self.text(x, bottom + 18.0, "time", &format!("{} s", short(time)));
        }
        svg(WIDTH, bottom + 34.0, &self.body)
    }
}

/// Every run of `true`, as its first frame and the frame after its last.
fn stretches(down: &[bool]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = None;
    for (frame, down) in down.iter().copied().chain([false]).enumerate() {
        match (down, start) {
            (true, None) => start = Some(frame),
            (false, Some(from)) => {
                found.push((from, frame));
                start = None;
            }
            _ => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_are_found_at_both_ends() {
        assert_eq!(stretches(&[true, true, false, true]), [(0, 2), (3, 4)]);
        assert_eq!(stretches(&[false, true, false]), [(1, 2)]);
        assert!(stretches(&[]).is_empty());
    }
}
