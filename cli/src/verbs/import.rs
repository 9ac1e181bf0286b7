//! `mimic import`: reads animation files and writes clips.

use crate::args::{ImportArgs, Replace};
use crate::clip_report::ClipReport;
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::output::{Form, Maker, Output, names_folder, result_path, safe_name};
use crate::printer::Printer;
use crate::progress;
use crate::shell;
use mimic::explain::plain;
use mimic::import;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic import kick.fbx                      write kick.clip
  mimic import pack.glb --take run           import one take: pack-run.clip
  mimic import pack.glb --take all -o clips/ write a clip for each take
  mimic import mixamo/*.fbx --out clips/     import many files into a folder
  mimic import walk.fbx --trim 0.5..1.6 --loop wrap";

/// Read animation files and write them as clips
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// FBX, glTF, VRM, BVH, AMC or DeepMimic files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Clip to write, or a folder for several [default: NAME.clip in this folder]
    #[arg(long, short, value_name = "PATH")]
    out: Option<PathBuf>,
    /// Swap left and right
    #[arg(long)]
    mirror: bool,
    #[command(flatten)]
    replace: Replace,
    #[command(flatten)]
    import: ImportArgs,
}

/// Asks for every take of a file.
const ALL: &str = "all";

/// One take to read, and where its clip goes.
struct Step {
    input: PathBuf,
    /// As for [`import::Options`].
    take: Option<String>,
    output: Output,
}

impl Args {
    /// Runs the command.
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let steps = self.plan(library)?;
        let bar = printer.progress(steps.len() as u64, "{bar:30} {pos}/{len} {msg}");
        let (mut reports, mut read, mut failures) = (Vec::new(), Vec::new(), Vec::new());
        for step in &steps {
            bar.set_message(plain(&step.input.display().to_string()));
            match self.import(step, printer) {
                Ok(report) => {
                    reports.push(report);
                    read.push(step.input.display().to_string());
                }
                Err(failure) => failures.push((step.input.as_path(), failure)),
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        let files = reports.iter().map(|report| report.file().to_owned());
        let problems = reports.iter().map(ClipReport::problems);
        let sources = read.into_iter().zip(problems.clone());
        printer.choices(&sources.collect::<Vec<_>>());
        printer.problems_of(&files.zip(problems).collect::<Vec<_>>());
        if let ([_], false) = (&steps[..], self.wants_all()) {
            failures.pop().map_or(Ok(()), |(_, failure)| Err(failure))?;
            return reports
                .iter()
                .try_for_each(|one| printer.result(one, || one.line()));
        }
        finish(&reports, failures, printer)
    }

    /// What is read and where it is written. Whatever can be wrong with the command shows here, before the first write.
    fn plan(&self, library: &Path) -> Outcome<Vec<Step>> {
        let many = self.files.len() > 1 || self.wants_all();
        if let Some(out) = self.out.as_deref().filter(|out| many && !names_folder(out)) {
            let cause = format!(
                "several clips cannot be written to one file, `{}`",
                out.display()
            );
            let folder = shell::path(&out.with_extension(""));
            let remedy = format!("name a folder: `--out {folder}/`");
            return Err(Failure::user(cause).with_remedy(remedy));
        }
        let mut taken = BTreeMap::new();
        let mut steps = Vec::new();
        for file in &self.files {
            let input = locate::clip(file, library, &locate::SOURCES)?;
            for (take, name) in self.takes(&input)? {
                let path = result_path(self.out.as_deref(), &name, Form::Clip);
                if let Some(other) = taken.insert(path.clone(), input.clone()) {
                    let (other, output) = (other.display(), path.display());
                    let cause =
                        format!("its clip would be `{output}`, and so would that of `{other}`");
                    return Err(Failure::input(&input, cause).with_remedy(
                        "import it by itself, into another folder with `--out FOLDER/`",
                    ));
                }
                let maker = Maker::new("import", [&input])
                    .with(&name)
                    .by(" of the same take");
                steps.push(Step {
                    input: input.clone(),
                    take,
                    output: Output::new(path, Form::Clip, maker, "--out", self.replace.force),
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
        let found = import::inspect(input)?;
        let takes = found.takes;
        if takes.is_empty() {
            // Import refuses such a file, and says what it holds instead.
            import::load(input, &import::Options::default())?;
        }
        let mut names: Vec<String> = Vec::new();
        for (at, take) in takes.iter().enumerate() {
            // Exporters put the armature's name and a `|` before that of the take.
            let short = take.name.rsplit('|').next().unwrap_or(&take.name);
            let name = safe_name(&format!("{stem}-{short}"));
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

    fn import(&self, step: &Step, printer: &Printer) -> Outcome<ClipReport> {
        let Step {
            input,
            take,
            output,
        } = step;
        if locate::has_extension(input, "clip") {
            return Err(Failure::input(input, "this is a clip already").with_remedy(
                "pass it to `mimic retarget` as it is, or change it with `mimic edit`",
            ));
        }
        output.check()?;
        let options = import::Options {
            take: take.clone(),
            mirror: self.mirror,
            ..self.import.options()
        };
        let what = format!("reading `{}`", input.display());
        let clip = progress::during(printer, &what, |_| import::load(input, &options))?;
        output.write(|made| Ok(clip.to_bytes(made)?))?;
        Ok(ClipReport::new(output.path(), clip))
    }
}

/// A file, and why there is no clip of it.
type Failed<'a> = (&'a Path, Failure);

/// Reports several files. The command fails if one of them did, and ends with the exit code of the worst.
fn finish(reports: &[ClipReport], failed: Vec<Failed>, printer: &Printer) -> Outcome {
    for (_, failure) in &failed {
        printer.error(failure.message().unwrap_or_default());
    }
    let entry = |(file, failure): &Failed| {
        let mut entry = failure.json();
        entry["file"] = json!(file.display().to_string());
        entry
    };
    let entries: Vec<_> = failed.iter().map(entry).collect();
    let report = json!({ "clips": reports, "failures": entries });
    let text = || {
        let lines: Vec<_> = reports.iter().map(ClipReport::line).collect();
        lines.join("\n")
    };
    let all = reports.len() + failed.len();
    let cause = format!("{} of {all} clips could not be imported", failed.len());
    match failed.iter().map(|(_, failure)| failure.code()).min() {
        None => printer.result(&report, text),
        Some(code) => {
            let failure = match code {
                1 => Failure::work(cause),
                _ => Failure::user(cause),
            };
            let remedy = "follow the advice for each of them";
            printer.partial_result(report, text, failure.with_remedy(remedy))
        }
    }
}
