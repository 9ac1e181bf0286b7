//! `mimic tracks`: shows how a motion's body moves as a whole.

use crate::args::{ImportArgs, Replace, RetargetArgs};
use crate::checks;
use crate::failure::Outcome;
use crate::locate;
use crate::output::{Form, Maker, Output};
use crate::plot;
use crate::prepare::{Preparation, Prepared};
use crate::printer::Printer;
use mimic::clip::LoopMode;
use mimic::explain::plain;
use mimic::motion::{Check, ContactShare, Extent, Motion, Summary};
use mimic::skeleton::Skeleton;
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic tracks kick.motion                   print a summary
  mimic tracks kick.fbx --plot kick.svg      import, retarget, and draw the tracks
  mimic tracks kick.motion --csv kick.csv    write every frame, for other tools";

/// Show the tracks of a motion: phase, centre of mass, momenta, contacts and feasibility
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Motion, clip or animation file [default: the newest motion]
    #[arg(value_name = "MOTION")]
    motion: Option<PathBuf>,
    /// Draw the tracks to FILE.svg
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Write the tracks of every frame to FILE.csv, as comma-separated values
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    replace: Replace,
    #[command(flatten)]
    import: ImportArgs,
    #[command(flatten)]
    retarget: RetargetArgs,
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
    #[serde(flatten)]
    summary: Summary,
    quality: Vec<Check>,
}

impl Args {
    /// Runs the command.
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let file = locate::file_or_newest(
            self.motion.as_deref(),
            library,
            &locate::ANIMATIONS,
            "motion",
        )?;
        let preparation = Preparation::new(file, &self.import, &self.retarget);
        let plot = self.output(self.plot.as_deref(), "--plot", Form::Drawing, &preparation);
        let csv = self.output(self.csv.as_deref(), "--csv", Form::Table, &preparation);
        for output in plot.iter().chain(&csv) {
            output.check()?;
        }
        let Prepared {
            motion, skeleton, ..
        } = preparation.run(printer)?;
        // The one that may be refused comes first.
        if let Some(output) = csv {
            save(&output, &table(&motion), printer)?;
        }
        if let Some(output) = plot {
            save(&output, &plot::tracks(&motion), printer)?;
        }
        let report = report(&motion, &skeleton);
        printer.result(&report, || text(&report))
    }

    /// The file of a flag, if that was given.
    fn output(
        &self,
        path: Option<&Path>,
        flag: &'static str,
        form: Form,
        source: &Preparation,
    ) -> Option<Output> {
        let detail = self.retarget.detail(&source.name());
        let maker = Maker::new("tracks", [&source.file]).with(detail);
        let maker = maker.by(" for the same character and take");
        let path = path?.to_owned();
        Some(Output::new(path, form, maker, flag, self.replace.force))
    }
}

fn save(output: &Output, text: &str, printer: &Printer) -> Outcome {
    output.write_text(text)?;
    printer.note(format!("wrote {}", output.path().display()));
    Ok(())
}

fn report(motion: &Motion, skeleton: &Skeleton) -> Report {
    Report {
        motion: motion.name.clone(),
        skeleton: motion.skeleton_name.clone(),
        frames: motion.qpos.len(),
        fps: motion.fps,
        duration_s: motion.duration(),
        loop_mode: motion.loop_mode,
        cycle_translation_m: motion.cycle.translation.into(),
        cycle_heading_rad: motion.cycle.heading,
        summary: motion.summary(),
        quality: motion.quality(skeleton),
    }
}

fn text(report: &Report) -> String {
    let loops = match report.loop_mode {
        LoopMode::Wrap => "loops",
        LoopMode::Clamp => "plays once",
    };
    let mut text = format!(
        "{} on {}: {} frames at {:.1} Hz, {:.2} s, {loops}\n\n{:32} {:>9} {:>9} {:>9}\n",
        plain(&report.motion),
        plain(&report.skeleton),
        report.frames,
        report.fps,
        report.duration_s,
        "",
        "min",
        "mean",
        "max"
    );
    let summary = &report.summary;
    for (name, Extent { min, mean, max }) in [
        ("height of centre of mass, m", &summary.com_height_m),
        ("speed of centre of mass, m/s", &summary.com_speed_m_s),
        ("linear momentum, kg·m/s", &summary.linear_momentum),
        ("angular momentum, kg·m²/s", &summary.angular_momentum),
        ("unsupported force, N", &summary.unsupported_force_n),
        ("unsupported moment, N·m", &summary.unsupported_moment_n_m),
    ] {
        writeln!(text, "{name:32} {min:9.2} {mean:9.2} {max:9.2}").ok();
    }
    // Every body may touch the ground; most never do.
    let down = summary
        .contacts
        .iter()
        .filter(|contact| contact.share > 0.0);
    for ContactShare { body, share } in down {
        let name = plain(&format!("{body} on the ground"));
        writeln!(text, "{name:32} {:>8.0} %", 100.0 * share).ok();
    }
    let [x, y, _] = report.cycle_translation_m;
    if report.loop_mode == LoopMode::Wrap {
        let turn = report.cycle_heading_rad.to_degrees();
        writeln!(
            text,
            "each cycle travels {x:.2} m forward and {y:.2} m to the left, and turns by {turn:.1}°"
        )
        .ok();
    }
    text + "\n" + checks::table(&report.quality).trim_end()
}

/// The tracks as comma-separated values, a row per frame.
fn table(motion: &Motion) -> String {
    let mut text = header(motion).join(",") + "\n";
    for frame in 0..motion.qpos.len() {
        text += &(row(motion, frame).join(",") + "\n");
    }
    text
}

fn header(motion: &Motion) -> Vec<String> {
    let mut header: Vec<String> = ["frame", "time_s", "phase"].map(String::from).into();
    for name in [
        "com",
        "com_velocity",
        "linear_momentum",
        "angular_momentum",
        "unsupported_force",
        "unsupported_moment",
    ] {
        header.extend(["x", "y", "z"].map(|axis| format!("{name}_{axis}")));
    }
    let contacts = motion.contact_names();
    header.extend(contacts.iter().map(|body| cell(&format!("contact_{body}"))));
    header
}

/// A name as a cell of a table: on one line, and in quotes where it has to be.
fn cell(name: &str) -> String {
    let name = plain(name);
    if name.contains([',', '"']) {
        return format!("\"{}\"", name.replace('"', "\"\""));
    }
    name
}

/// The values of one frame, in the order of the header.
fn row(motion: &Motion, frame: usize) -> Vec<String> {
    let tracks = &motion.tracks;
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
    let wrench = tracks.root_wrench_residual.get(frame);
    row.extend(wrench.into_iter().flatten().map(number));
    let contacts = tracks.contact.get(frame).into_iter().flatten();
    row.extend(contacts.map(|c| u8::from(*c).to_string()));
    row
}

/// Six decimals, a micrometre of a length. Adding 0.0 turns a negative zero into a plain one.
fn number(value: &f64) -> String {
    format!("{:.6}", (value * 1e6).round() / 1e6 + 0.0)
}
