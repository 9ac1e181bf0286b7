//! `mimic tracks`: what a motion's body does: centre of mass, momenta, contacts, feasibility.

use crate::args::{ImportArgs, RetargetArgs};
use crate::failure::Outcome;
use crate::locate;
use crate::output::{make_room, write_whole};
use crate::plot;
use crate::prepare::{Preparation, Prepared};
use crate::printer::Printer;
use mimic::clip::LoopMode;
use mimic::motion::Motion;
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic tracks kick.motion                      a summary
  mimic tracks kick.fbx --plot kick.svg         imports and retargets first
  mimic tracks kick.motion --csv kick.csv       every frame, for other tools";

/// Show phase, centre of mass, momenta, contacts and feasibility of a motion
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Motion, clip or animation file [default: the newest motion]
    #[arg(value_name = "MOTION")]
    motion: Option<PathBuf>,
    /// Draw the tracks
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Write every frame as comma-separated values
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    import: ImportArgs,
    #[command(flatten)]
    retarget: RetargetArgs,
}

#[derive(Serialize)]
struct Spread {
    min: f64,
    mean: f64,
    max: f64,
}

#[derive(Serialize)]
struct Contact {
    body: String,
    /// Part of the frames in which it stands on the ground.
    share: f64,
}

#[derive(Serialize)]
struct Report {
    motion: String,
    skeleton: String,
    frames: usize,
    fps: f64,
    duration_s: f64,
    #[serde(rename = "loop")]
    loop_mode: LoopMode,
    cycle_translation_m: [f64; 3],
    cycle_heading_rad: f64,
    com_height_m: Spread,
    com_speed_m_s: Spread,
    linear_momentum: Spread,
    angular_momentum: Spread,
    /// Force and moment that no ground contact can supply.
    unsupported_force_n: Spread,
    unsupported_moment_n_m: Spread,
    contacts: Vec<Contact>,
}

impl Args {
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let file = locate::file_or_newest(
            self.motion.as_deref(),
            library,
            &locate::ANIMATIONS,
            "motion",
        )?;
        let preparation = Preparation::new(file, &self.import, &self.retarget);
        let Prepared { motion, .. } = preparation.run(printer)?;
        if let Some(path) = &self.plot {
            save(path, &preparation.file, &plot::tracks(&motion), printer)?;
        }
        if let Some(path) = &self.csv {
            save(path, &preparation.file, &table(&motion), printer)?;
        }
        let report = report(&motion);
        printer.result(&report, || text(&report))
    }
}

fn save(path: &Path, input: &Path, text: &str, printer: &Printer) -> Outcome {
    make_room(path, input)?;
    write_whole(path, text.as_bytes())?;
    printer.note(format!("wrote {}", path.display()));
    Ok(())
}

fn report(motion: &Motion) -> Report {
    let tracks = &motion.tracks;
    let residual = &tracks.root_wrench_residual;
    Report {
        motion: motion.name.clone(),
        skeleton: motion.skeleton_name.clone(),
        frames: motion.qpos.len(),
        fps: motion.fps,
        duration_s: motion.duration(),
        loop_mode: motion.loop_mode,
        cycle_translation_m: motion.cycle.translation.into(),
        cycle_heading_rad: motion.cycle.heading,
        com_height_m: spread(tracks.com.iter().map(|p| p.z)),
        com_speed_m_s: spread(tracks.com_velocity.iter().map(|v| v.norm())),
        linear_momentum: spread(tracks.linear_momentum.iter().map(|p| p.norm())),
        angular_momentum: spread(tracks.angular_momentum.iter().map(|l| l.norm())),
        unsupported_force_n: spread(residual.iter().map(|w| w.fixed_rows::<3>(0).norm())),
        unsupported_moment_n_m: spread(residual.iter().map(|w| w.fixed_rows::<3>(3).norm())),
        contacts: contacts(motion),
    }
}

fn contacts(motion: &Motion) -> Vec<Contact> {
    let rows = &motion.tracks.contact;
    let share = |c: usize| {
        let down = rows.iter().filter(|row| row.get(c) == Some(&true)).count();
        down as f64 / rows.len().max(1) as f64
    };
    let names = plot::contact_names(motion).into_iter().enumerate();
    names
        .map(|(c, body)| Contact {
            body,
            share: share(c),
        })
        .collect()
}

fn spread(values: impl Iterator<Item = f64>) -> Spread {
    let (mut count, mut sum) = (0usize, 0.0);
    let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values {
        (count, sum) = (count + 1, sum + value);
        (min, max) = (min.min(value), max.max(value));
    }
    if count == 0 {
        (min, max) = (0.0, 0.0);
    }
    let mean = sum / count.max(1) as f64;
    Spread { min, mean, max }
}

fn text(report: &Report) -> String {
    let loops = match report.loop_mode {
        LoopMode::Wrap => "loops",
        LoopMode::Clamp => "ends",
    };
    let mut text = format!(
        "{} on {}: {} frames at {:.1} Hz, {:.2} s, {loops}\n\n{:32} {:>9} {:>9} {:>9}\n",
        report.motion,
        report.skeleton,
        report.frames,
        report.fps,
        report.duration_s,
        "",
        "least",
        "mean",
        "most"
    );
    for (name, Spread { min, mean, max }) in [
        ("height of centre of mass, m", &report.com_height_m),
        ("speed of centre of mass, m/s", &report.com_speed_m_s),
        ("linear momentum, kg·m/s", &report.linear_momentum),
        ("angular momentum, kg·m²/s", &report.angular_momentum),
        ("unsupported force, N", &report.unsupported_force_n),
        ("unsupported moment, N·m", &report.unsupported_moment_n_m),
    ] {
        writeln!(text, "{name:32} {min:9.2} {mean:9.2} {max:9.2}").ok();
    }
    for Contact { body, share } in &report.contacts {
        let name = format!("{body} on the ground");
        writeln!(text, "{name:32} {:>8.0} %", 100.0 * share).ok();
    }
    let [x, y, _] = report.cycle_translation_m;
    if report.loop_mode == LoopMode::Wrap {
        let turn = report.cycle_heading_rad.to_degrees();
        writeln!(
            text,
            "a cycle travels {x:.2} m forward, {y:.2} m to the left, and turns {turn:.1}°"
        )
        .ok();
    }
    text
}

/// A row per frame.
fn table(motion: &Motion) -> String {
    let tracks = &motion.tracks;
    let mut header: Vec<String> = ["frame", "time_s", "phase"].map(String::from).into();
    for name in ["com", "com_velocity", "linear_momentum", "angular_momentum"] {
        header.extend(["x", "y", "z"].map(|axis| format!("{name}_{axis}")));
    }
    for name in ["unsupported_force", "unsupported_moment"] {
        header.extend(["x", "y", "z"].map(|axis| format!("{name}_{axis}")));
    }
    header.extend(
        plot::contact_names(motion)
            .iter()
            .map(|body| format!("contact_{body}")),
    );
    let mut text = header.join(",") + "\n";
    for frame in 0..motion.qpos.len() {
        let mut row = vec![frame.to_string(), number(&(frame as f64 / motion.fps))];
        row.extend(tracks.phase.get(frame).map(number));
        for track in [
            &tracks.com,
            &tracks.com_velocity,
            &tracks.linear_momentum,
            &tracks.angular_momentum,
        ] {
            row.extend(track.get(frame).into_iter().flatten().map(number));
        }
        row.extend(
            tracks
                .root_wrench_residual
                .get(frame)
                .into_iter()
                .flatten()
                .map(number),
        );
        row.extend(
            tracks
                .contact
                .get(frame)
                .into_iter()
                .flatten()
                .map(|c| u8::from(*c).to_string()),
        );
        text += &(row.join(",") + "\n");
    }
    text
}

/// To the micrometre and below anything that matters; without negative zeros.
fn number(value: &f64) -> String {
    format!("{:.6}", (value * 1e6).round() / 1e6 + 0.0)
}
