//! `mimic info`: what is in an animation file.

use crate::amount;
use crate::args::Replace;
use crate::failure::Outcome;
use crate::locate;
use crate::output::{Form, Maker, Output};
use crate::printer::Printer;
use crate::progress;
use mimic::clip::{Clip, Joint, Problem, Severity};
use mimic::explain::{Explain, plain};
use mimic::humanoid::{self, HumanoidMap, Slot};
use mimic::import::{self, TakeInfo};
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic info kick.fbx                        show takes, joints and joint map
  mimic info kick.fbx --write-map kick.json  write the joint map, to edit it
  mimic info kick.clip --json                print JSON for scripts";

/// Show what is in an animation file: takes, joints, units, joint map and problems
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// FBX, glTF, BVH, ASF/AMC or DeepMimic file, or a clip
    file: PathBuf,
    /// Write the joint map to FILE, to edit it and pass it to `mimic retarget --map`
    #[arg(long, value_name = "FILE")]
    write_map: Option<PathBuf>,
    #[command(flatten)]
    replace: Replace,
}

/// What is in a file of any kind.
#[derive(Serialize)]
struct Report {
    file: String,
    format: String,
    takes: Vec<Take>,
    joints: Vec<String>,
    up_axis: String,
    unit_m: f64,
    map: Vec<Row>,
    problems: Vec<Problem>,
}

/// One take of the file.
#[derive(Serialize)]
struct Take {
    #[serde(flatten)]
    info: TakeInfo,
    /// Whether it is read when none is named.
    default: bool,
}

/// One slot of the joint map.
#[derive(Serialize)]
pub struct Row {
    pub slot: String,
    pub joint: String,
    pub confidence: f64,
    pub reason: String,
}

impl Args {
    /// Runs the command.
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let file = locate::clip(&self.file, library, &locate::CLIPS)?;
        let what = format!("reading `{}`", file.display());
        let (mut report, joints) = progress::during(printer, &what, |_| look(&file))?;
        let map = match humanoid::map(&joints) {
            Ok(map) => map,
            Err(e) => {
                // First, for a file may have hundreds of others.
                report.problems.insert(0, not_humanoid(&e));
                humanoid::partial(&joints)
            }
        };
        report.map = rows(&map, &joints);
        if let Some(path) = &self.write_map {
            let maker = Maker::new("info", [&file]);
            let force = self.replace.force;
            let output = Output::new(path.clone(), Form::Map, maker, "--write-map", force);
            output.write_text(&map_file(&map, &joints))?;
            tell(path, &map, printer);
        }
        printer.result(&report, || text(&report))
    }
}

/// Id of the problem that a figure can't be retargeted without a joint map.
const NOT_HUMANOID: &str = "not-humanoid";

fn not_humanoid(reason: &humanoid::Error) -> Problem {
    Problem {
        id: NOT_HUMANOID.into(),
        severity: Severity::Warning,
        message: reason.to_string(),
    }
}

/// The map as a file to edit. If a required slot has no joint, all slots are listed, and those without a joint are `null`.
fn map_file(map: &HumanoidMap, joints: &[Joint]) -> String {
    if empty(map).is_empty() {
        return map.to_json(joints);
    }
    let line = |slot: Slot| {
        let joint = map.joint(slot).and_then(|joint| joints.get(joint));
        let name = json!(joint.map(|joint| &joint.name));
        format!("  {}: {name}", json!(slot.name()))
    };
    format!("{{\n{}\n}}\n", Slot::ALL.map(line).join(",\n"))
}

/// Required slots without a joint.
fn empty(map: &HumanoidMap) -> Vec<&'static str> {
    let needed = Slot::REQUIRED.into_iter();
    let empty = needed.filter(|slot| map.joint(*slot).is_none());
    empty.map(Slot::name).collect()
}

fn tell(path: &Path, map: &HumanoidMap, printer: &Printer) {
    let (path, empty) = (path.display(), empty(map));
    if empty.is_empty() {
        return printer.note(format!("wrote {path}"));
    }
    let empty = empty.join(", ");
    printer.warn(format!(
        "`{path}` needs joints for {empty}; write their names there (`mimic info --json` lists all `joints`)"
    ));
}

fn look(file: &Path) -> Outcome<(Report, Vec<Joint>)> {
    if locate::has_extension(file, "clip") {
        let clip = Clip::load(file)?;
        return Ok(of_clip(file, clip));
    }
    let found = import::inspect(file)?;
    let default = found.default_take;
    let take = |(at, info)| Take {
        info,
        default: default == Some(at),
    };
    let mut problems = found.problems;
    if default.is_some() {
        let more = of_default_take(file);
        problems.extend(
            more.into_iter()
                .filter(|p| !problems.contains(p))
                .collect::<Vec<_>>(),
        );
    }
    let report = Report {
        file: file.display().to_string(),
        format: found.format,
        takes: found.takes.into_iter().enumerate().map(take).collect(),
        joints: names(&found.joints),
        up_axis: found.up_axis,
        unit_m: found.unit_m,
        map: Vec::new(),
        problems,
    };
    Ok((report, found.joints))
}

/// What importing the default take would say, such as why a frame is left out, or why the take is refused.
fn of_default_take(file: &Path) -> Vec<Problem> {
    match import::load(file, &import::Options::default()) {
        Ok(clip) => clip.problems,
        Err(error) => vec![Problem::error("not-importable", error.explain().cause)],
    }
}

fn of_clip(file: &Path, clip: Clip) -> (Report, Vec<Joint>) {
    let take = TakeInfo {
        name: clip.source.take.clone(),
        fps: clip.fps,
        frames: clip.frames.len(),
        duration_s: clip.duration(),
    };
    let report = Report {
        file: file.display().to_string(),
        format: "clip".into(),
        takes: vec![Take {
            info: take,
            default: true,
        }],
        joints: names(&clip.joints),
        up_axis: "+Z".into(),
        unit_m: 1.0,
        map: Vec::new(),
        problems: clip.problems,
    };
    (report, clip.joints)
}

fn names(joints: &[Joint]) -> Vec<String> {
    joints.iter().map(|joint| joint.name.clone()).collect()
}

/// The joint map in the order of the slots.
pub fn rows(map: &HumanoidMap, joints: &[Joint]) -> Vec<Row> {
    let row = |(slot, found): (&Slot, &humanoid::Match)| {
        Some(Row {
            slot: slot.name().into(),
            joint: joints.get(found.joint)?.name.clone(),
            confidence: found.confidence,
            reason: found.reason.clone(),
        })
    };
    map.matches.iter().filter_map(row).collect()
}

fn text(report: &Report) -> String {
    let mut text = format!(
        "{}: {}, {} up, {} m per unit, {} joints\n",
        plain(&report.file),
        report.format,
        report.up_axis,
        amount::digits(report.unit_m),
        report.joints.len()
    );
    let takes = report.takes.iter().enumerate();
    let several = report.takes.len() > 1;
    section(
        &mut text,
        "takes",
        takes.map(|(at, take)| take_line(at + 1, take, several)),
    );
    let is_humanoid = report
        .problems
        .iter()
        .all(|problem| problem.id != NOT_HUMANOID);
    let title = match is_humanoid || report.map.is_empty() {
        true => "joint map",
        false => "joint map, which is not that of a humanoid: see the first problem",
    };
    section(&mut text, title, report.map.iter().map(map_line));
    section(
        &mut text,
        "problems",
        report.problems.iter().map(problem_line),
    );
    text
}

/// A heading with its lines, or with "none".
fn section(text: &mut String, title: &str, lines: impl ExactSizeIterator<Item = String>) {
    *text += &match lines.len() {
        0 => format!("\n{title}: none\n"),
        _ => format!("\n{title}\n"),
    };
    for line in lines {
        *text += &plain(line.trim_end());
        text.push('\n');
    }
}

fn take_line(number: usize, take: &Take, several: bool) -> String {
    let TakeInfo {
        name,
        fps,
        frames,
        duration_s,
        ..
    } = &take.info;
    let (fps, duration) = (amount::digits(*fps), amount::digits(*duration_s));
    // Keys may be farther apart than frames can be counted.
    let frames = match *frames {
        usize::MAX => "-".to_owned(),
        frames => frames.to_string(),
    };
    let default = if several && take.default {
        "  default"
    } else {
        ""
    };
    format!("{number:>3}  {name:32} {frames:>6} frames  {fps:>6} Hz  {duration:>7} s{default}")
}

fn problem_line(problem: &Problem) -> String {
    let Problem {
        id,
        severity,
        message,
        ..
    } = problem;
    let severity = format!("{severity:?}").to_lowercase();
    format!("     {severity:8} {id}: {message}")
}

fn map_line(row: &Row) -> String {
    let Row {
        slot,
        joint,
        confidence,
        reason,
    } = row;
    let percent = 100.0 * confidence;
    format!("     {slot:16} {joint:32} {percent:>3.0} %  {reason}")
}
