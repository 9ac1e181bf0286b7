//! `mimic import`: animation files become clips.

use crate::args::ImportArgs;
use crate::clip_report::ClipReport;
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::output::{file_name, make_room, names_folder, result_path};
use crate::printer::Printer;
use mimic::import;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic import kick.fbx                             writes kick.clip
  mimic import pack.glb --take run --out run.clip   one take of many
  mimic import pack.glb --take all --out clips/     each take as a clip of its own
  mimic import walk.fbx --trim 0.5..1.6 --loop wrap
  mimic import mixamo/*.fbx --out clips/            many files into a folder";

/// Read animation files and write them as clips
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// FBX, glTF, BVH, AMC or DeepMimic files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Clip to write, or a folder for many [default: NAME.clip in this folder]
    #[arg(long, short, value_name = "PATH")]
    out: Option<PathBuf>,
    /// Swap left and right
    #[arg(long)]
    mirror: bool,
    #[command(flatten)]
    import: ImportArgs,
}

/// Asks for every take of a file.
const ALL: &str = "all";

/// One take to read and where its clip goes.
struct Step {
    input: PathBuf,
    /// As for [`import::Options`].
    take: Option<String>,
    output: PathBuf,
}

impl Args {
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let steps = self.plan(library)?;
        let bar = printer.progress(steps.len() as u64, "{bar:30} {pos}/{len} {msg}");
        let (mut reports, mut failures) = (Vec::new(), Vec::new());
        for step in &steps {
            bar.set_message(step.input.display().to_string());
            match self.import(step) {
                Ok(report) => {
                    bar.suspend(|| printer.problems(report.problems()));
                    reports.push(report);
                }
                Err(failure) => failures.push((step.input.as_path(), failure)),
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        if let ([_], false) = (&steps[..], self.wants_all()) {
            failures.pop().map_or(Ok(()), |(_, failure)| Err(failure))?;
            return reports
                .iter()
                .try_for_each(|one| printer.result(one, || one.line()));
        }
        print(&reports, &failures, printer)?;
        summary(failures, steps.len(), printer)
    }

    /// Everything that can be wrong with the command is found before the first file is written.
    fn plan(&self, library: &Path) -> Outcome<Vec<Step>> {
        let many = self.files.len() > 1 || self.wants_all();
        if let Some(out) = self.out.as_deref().filter(|out| many && !names_folder(out)) {
            let out = out.display();
            return Err(Failure::user(format!(
                "several clips can't become the one file `{out}`, name a folder: `--out {out}/`"
            )));
        }
        let mut taken = BTreeMap::new();
        let mut steps = Vec::new();
        for file in &self.files {
            let input = locate::file(file, library, &locate::SOURCES)?;
            for (take, name) in self.takes(&input)? {
                let output = result_path(self.out.as_deref(), &name, "clip");
                if let Some(other) = taken.insert(output.clone(), input.clone()) {
                    let (other, output) = (other.display(), output.display());
                    return Err(Failure::input(
                        &input,
                        format!("would become `{output}`, as would `{other}`"),
                    ));
                }
                steps.push(Step {
                    input: input.clone(),
                    take,
                    output,
                });
            }
        }
        Ok(steps)
    }

    fn wants_all(&self) -> bool {
        self.import.take() == Some(ALL)
    }

    /// The takes of a file that are wanted, and the names of their clips.
    fn takes(&self, input: &Path) -> Outcome<Vec<(Option<String>, String)>> {
        let stem = input.file_stem().unwrap_or_default().to_string_lossy();
        if !self.wants_all() {
            let take = self.import.take().map(str::to_owned);
            let name = match &take {
                Some(take) => format!("{stem}-{take}"),
                None => stem.into_owned(),
            };
            return Ok(vec![(take, name)]);
        }
        let found = import::inspect(input).map_err(|e| Failure::input(input, e))?;
        let takes = found.takes;
        if takes.is_empty() {
            let told = found.problems.iter().find(|p| p.id == "no-takes");
            let reason = told.map_or("holds no animation", |p| p.message.as_str());
            return Err(Failure::input(input, reason));
        }
        let mut names: Vec<String> = Vec::new();
        for (at, take) in takes.iter().enumerate() {
            // What exporters put before a `|` is the armature's name.
            let short = take.name.rsplit('|').next().unwrap_or(&take.name);
            let name = file_name(&format!("{stem}-{short}"));
            let is_new = !names.contains(&name);
            names.push(if is_new {
                name
            } else {
                format!("{name}-{}", at + 1)
            });
        }
        let numbers = (1..=names.len()).map(|number| Some(number.to_string()));
        Ok(numbers.zip(names).collect())
    }

    fn import(&self, step: &Step) -> Outcome<ClipReport> {
        let Step {
            input,
            take,
            output,
        } = step;
        if locate::has_extension(input, "clip") {
            return Err(Failure::input(
                input,
                "is a clip already, `mimic retarget` takes it as it is and `mimic edit` changes it",
            ));
        }
        let options = import::Options {
            take: take.clone(),
            mirror: self.mirror,
            ..self.import.options()
        };
        let clip = import::load(input, &options).map_err(|e| Failure::input(input, e))?;
        make_room(output, input, "clip")?;
        clip.save(output).map_err(|e| Failure::clip(output, e))?;
        Ok(ClipReport::new(output, clip))
    }
}

/// A file, and why it became no clip.
type Failed<'a> = (&'a Path, Failure);

/// The results of several files.
fn print(reports: &[ClipReport], failures: &[Failed], printer: &Printer) -> Outcome {
    if printer.is_json() {
        let failure =
            |(file, failure): &Failed| json!({ "file": file, "message": failure.message() });
        let failures: Vec<_> = failures.iter().map(failure).collect();
        return printer.json_line(&json!({ "clips": reports, "failures": failures }));
    }
    reports
        .iter()
        .try_for_each(|report| printer.text(&report.line()))
}

/// Ends as the worst of the files did.
fn summary(failures: Vec<Failed>, clips: usize, printer: &Printer) -> Outcome {
    let count = failures.len();
    for (_, failure) in &failures {
        printer.error(failure.message().unwrap_or_default());
    }
    let message = format!("{count} of {clips} clips could not be made");
    let is_user = |(_, failure): &Failed| matches!(failure, Failure::User(_));
    match failures.iter().all(is_user) {
        _ if count == 0 => Ok(()),
        true => Err(Failure::user(message)),
        false => Err(Failure::work(message)),
    }
}
