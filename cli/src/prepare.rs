//! From any file to a motion: every stage accepts the file of an earlier one and does what is missing.

use crate::args::{ImportArgs, RetargetArgs};
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::printer::Printer;
use crate::progress;
use crate::shell;
use mimic::clip::{Clip, Problem};
use mimic::file::text_at_most;
use mimic::humanoid::HumanoidMap;
use mimic::import;
use mimic::motion::Motion;
use mimic::retarget;
use mimic::skeleton::Skeleton;
use std::path::{Path, PathBuf};

/// A motion, and the skeleton that it moves.
pub struct Prepared {
    /// The motion.
    pub motion: Motion,
    /// The skeleton.
    pub skeleton: Skeleton,
    /// How long retargeting took; `None` for a motion that was read from a file.
    pub seconds: Option<f64>,
    /// What was found on the way.
    pub problems: Vec<Problem>,
}

/// A file, and how to make a motion of it.
pub struct Preparation {
    /// The file that was given.
    pub file: PathBuf,
    import: ImportArgs,
    retarget: RetargetArgs,
    to_perform: bool,
}

impl Preparation {
    /// With the options of the command line.
    pub fn new(file: PathBuf, import: &ImportArgs, retarget: &RetargetArgs) -> Self {
        Self {
            file,
            import: import.clone(),
            retarget: retarget.clone(),
            to_perform: false,
        }
    }

    /// See [`retarget::Options::to_perform`].
    pub fn for_performance(self, to_perform: bool) -> Self {
        Self { to_perform, ..self }
    }

    /// Name of the motion: that of the file, and of the take if one was asked for.
    pub fn name(&self) -> String {
        let stem = self.file.file_stem().unwrap_or_default().to_string_lossy();
        match self.import.take() {
            Some(take) => format!("{stem}-{take}"),
            None => stem.into_owned(),
        }
    }

    /// Whether the file is a motion already.
    pub fn is_motion(&self) -> bool {
        locate::has_extension(&self.file, "motion")
    }

    /// Reads the motion, or makes it, and says what was found on the way.
    pub fn run(&self, printer: &Printer) -> Outcome<Prepared> {
        let mut prepared = Self::run_all(std::slice::from_ref(self), printer)?;
        Ok(prepared.remove(0))
    }

    /// The same for several files, of which what repeats is said once.
    pub fn run_all(all: &[Self], printer: &Printer) -> Outcome<Vec<Prepared>> {
        let prepared = all.iter().map(|one| one.prepare(printer));
        let prepared: Vec<Prepared> = prepared.collect::<Outcome<_>>()?;
        let files = all.iter().map(|one| one.file.display().to_string());
        let problems = prepared.iter().map(|one| one.problems.as_slice());
        let found: Vec<_> = files.zip(problems).collect();
        let sources = all.iter().zip(&found);
        // A clip says the same of the file that it was made from.
        let sources = sources.filter(|(one, _)| !locate::has_extension(&one.file, "clip"));
        printer.choices(&sources.map(|(_, found)| found.clone()).collect::<Vec<_>>());
        printer.problems_of(&found);
        Ok(prepared)
    }

    fn prepare(&self, printer: &Printer) -> Outcome<Prepared> {
        if self.is_motion() {
            return self.load(printer);
        }
        let what = format!("reading `{}`", self.file.display());
        let clip = progress::during(printer, &what, |_| self.clip())?;
        let skeleton = self.retarget.skeleton()?;
        let map = self.map(&clip)?;
        printer.note(format!(
            "retargeting `{}` to `{}`",
            self.file.display(),
            skeleton.name
        ));
        let weights = self.retarget.weight.iter().copied().collect();
        let options = retarget::Options {
            map,
            weights,
            to_perform: self.to_perform,
        };
        let what = format!("retargeting `{}`", self.file.display());
        let done = progress::during(printer, &what, |share| {
            retarget::retarget_watched(&clip, &skeleton, &options, &|done| share.set(done))
        });
        let done = done.map_err(|e| Failure::in_file(&self.file, e))?;
        let new = |problem: &&Problem| !clip.problems.contains(problem);
        let found = done.report.problems.iter().filter(new).cloned();
        let left_out = left_out(&skeleton);
        let problems = clip.problems.iter().cloned().chain(found);
        let problems = problems.chain(left_out).collect();
        let (mut motion, seconds) = (done.motion, Some(done.seconds));
        motion.name = self.name();
        Ok(Prepared {
            motion,
            skeleton,
            seconds,
            problems,
        })
    }

    /// Reads a motion and finds its skeleton.
    fn load(&self, printer: &Printer) -> Outcome<Prepared> {
        self.import.refuse_for(&self.file, "a motion")?;
        let flags = [
            ("--map", self.retarget.map.is_some()),
            ("--weight", !self.retarget.weight.is_empty()),
        ];
        if let Some((flag, _)) = flags.into_iter().find(|(_, given)| *given) {
            let cause = format!("this is a motion, and `{flag}` applies to clips");
            return Err(Failure::input(&self.file, cause)
                .with_remedy("give the clip that the motion was made from"));
        }
        let motion = Motion::load(&self.file)?;
        let skeleton = self.skeleton_of(&motion)?;
        motion
            .check_skeleton(&skeleton)
            .map_err(|e| Failure::in_file(&self.file, e))?;
        printer.detail(format!("read `{}`", self.file.display()));
        Ok(Prepared {
            motion,
            problems: left_out(&skeleton),
            skeleton,
            seconds: None,
        })
    }

    /// The skeleton that a motion names, unless `--skeleton` gives its file.
    fn skeleton_of(&self, motion: &Motion) -> Outcome<Skeleton> {
        if self.retarget.skeleton.is_some() {
            return self.retarget.skeleton();
        }
        Skeleton::load(&motion.skeleton_name).map_err(|_| {
            let name = &motion.skeleton_name;
            let cause =
                format!("this motion was made for the character `{name}`, which is not built in");
            let file = shell::path(Path::new(&format!("{name}.xml")));
            let remedy = format!("give the character's file with `--skeleton {file}`");
            Failure::input(&self.file, cause).with_remedy(remedy)
        })
    }

    /// Reads or imports the clip.
    fn clip(&self) -> Outcome<Clip> {
        let file = &self.file;
        if locate::has_extension(file, "clip") {
            self.import.refuse_for(file, "a clip")?;
            return Ok(Clip::load(file)?);
        }
        Ok(import::load(file, &self.import.options())?)
    }

    /// The joint map of `--map`, if there is one.
    fn map(&self, clip: &Clip) -> Outcome<Option<HumanoidMap>> {
        let Some(path) = &self.retarget.map else {
            return Ok(None);
        };
        let text = text_at_most(path, HumanoidMap::MOST_BYTES).map_err(|e| {
            let failure = Failure::unreadable(path, &e);
            match locate::meant_file(path, "json") {
                Some(meant) => failure.with_remedy(meant),
                None => failure,
            }
        })?;
        let map =
            HumanoidMap::from_json(&text, &clip.joints).map_err(|e| Failure::in_file(path, e))?;
        Ok(Some(map))
    }
}

/// What of a character isn't simulated.
fn left_out(skeleton: &Skeleton) -> Vec<Problem> {
    let warning = |text: String| {
        let text = format!("character `{}`: {text}", skeleton.name);
        Problem::warning("not-simulated", text)
    };
    skeleton.left_out().into_iter().map(warning).collect()
}
