//! `mimic info`: what is in an animation file.

use crate::args::Replace;
use crate::failure::Outcome;
use crate::locate;
use crate::output::{Form, Maker, Output};
use crate::printer::Printer;
use mimic::clip::{Clip, Joint, Problem, Severity};
use mimic::explain::plain;
use mimic::humanoid::{self, HumanoidMap, Slot};
use mimic::import::{self, TakeInfo};
use serde::Serialize;
use serde_json::json;
use std::fmt::Write;
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
    takes: Vec<TakeInfo>,
    joints: Vec<String>,
    up_axis: String,
    unit_m: f64,
    map: Vec<Row>,
    problems: Vec<Problem>,
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
        let (mut report, joints) = look(&file)?;
        let map = match humanoid::map(&joints) {
            Ok(map) => map,
            Err(e) => {
                report.problems.push(not_humanoid(&e));
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

fn not_humanoid(reason: &humanoid::Error) -> Problem {
    Problem {
        id: "not-humanoid".into(),
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
    let report = Report {
        file: file.display().to_string(),
        format: found.format,
        takes: found.takes,
        joints: names(&found.joints),
        up_axis: found.up_axis,
        unit_m: found.unit_m,
        map: Vec::new(),
        problems: found.problems,
    };
    Ok((report, found.joints))
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
        takes: vec![take],
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
    let mut text = String::new();
    let Report {
        file,
        format,
        up_axis,
        unit_m,
        joints,
        ..
    } = report;
    let joints = joints.len();
    let head = format!("{file}: {format}, {up_axis} up, {unit_m} m per unit, {joints} joints");
    line(&mut text, head);
    section(&mut text, "takes");
    for (index, take) in report.takes.iter().enumerate() {
        line(&mut text, take_line(index + 1, take));
    }
    section(&mut text, "joint map");
    for row in &report.map {
        line(&mut text, map_line(row));
    }
    if !report.problems.is_empty() {
        section(&mut text, "problems");
    }
    for Problem {
        id,
        severity,
        message,
        ..
    } in &report.problems
    {
        let severity = format!("{severity:?}").to_lowercase();
        line(&mut text, format!("     {severity:8} {id}: {message}"));
    }
    text
}

fn take_line(number: usize, take: &TakeInfo) -> String {
    let TakeInfo {
        name,
        fps,
        frames,
        duration_s,
        ..
    } = take;
    format!("{number:>3}  {name:32} {frames:>6} frames  {fps:>6.1} Hz  {duration_s:>7.2} s")
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

fn section(text: &mut String, title: &str) {
    text.push('\n');
    line(text, title.to_owned());
}

/// Adds a line, whatever the names in it hold. Writing to a string cannot fail.
fn line(text: &mut String, line: String) {
    writeln!(text, "{}", plain(line.trim_end())).ok();
}
