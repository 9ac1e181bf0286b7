//! From whatever file is given to a motion: any stage takes the file of an earlier one and does what is missing.

use crate::args::{ImportArgs, RetargetArgs};
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::printer::Printer;
use mimic::clip::{Clip, Problem};
use mimic::humanoid::HumanoidMap;
use mimic::import;
use mimic::motion::Motion;
use mimic::retarget;
use mimic::skeleton::Skeleton;
use std::path::PathBuf;

/// A motion and the skeleton that it moves.
pub struct Prepared {
    pub motion: Motion,
    pub skeleton: Skeleton,
    /// How long retargeting took; `None` for a motion that was made before.
    pub seconds: Option<f64>,
}

/// How a file becomes a motion.
pub struct Preparation {
    pub file: PathBuf,
    import: ImportArgs,
    retarget: RetargetArgs,
    to_perform: bool,
}

impl Preparation {
    pub fn new(file: PathBuf, import: &ImportArgs, retarget: &RetargetArgs) -> Self {
        Self {
            file,
            import: import.clone(),
            retarget: retarget.clone(),
            to_perform: false,
        }
    }

    /// As in [`retarget::Options::to_perform`].
    pub fn for_performance(self, to_perform: bool) -> Self {
        Self { to_perform, ..self }
    }

    /// Name of what comes of it.
    pub fn name(&self) -> String {
        let stem = self.file.file_stem().unwrap_or_default().to_string_lossy();
        match self.import.take() {
            Some(take) => format!("{stem}-{take}"),
            None => stem.into_owned(),
        }
    }

    pub fn is_motion(&self) -> bool {
        locate::has_extension(&self.file, "motion")
    }

    /// Reads the motion, or makes it.
    pub fn run(&self, printer: &Printer) -> Outcome<Prepared> {
        if self.is_motion() {
            return self.load(printer);
        }
        let clip = self.clip()?;
        printer.problems(&clip.problems);
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
        let done = retarget::retarget(&clip, &skeleton, &options)
            .map_err(|e| Failure::input(&self.file, e))?;
        let new = |problem: &&Problem| !clip.problems.contains(problem);
        let found: Vec<_> = done.report.problems.iter().filter(new).cloned().collect();
        printer.problems(&found);
        let (mut motion, seconds) = (done.motion, Some(done.seconds));
        motion.name = self.name();
        Ok(Prepared {
            motion,
            skeleton,
            seconds,
        })
    }

    fn load(&self, printer: &Printer) -> Outcome<Prepared> {
        self.import.refuse_for(&self.file, "a motion")?;
        let flags = [
            ("--map", self.retarget.map.is_some()),
            ("--weight", !self.retarget.weight.is_empty()),
        ];
        if let Some((flag, _)) = flags.into_iter().find(|(_, given)| *given) {
            return Err(Failure::input(
                &self.file,
                format!("is retargeted already, `{flag}` doesn't apply; give the clip"),
            ));
        }
        let motion = Motion::load(&self.file).map_err(|e| Failure::motion(&self.file, e))?;
        let skeleton = self.skeleton_of(&motion)?;
        motion
            .check_skeleton(&skeleton)
            .map_err(|e| Failure::motion(&self.file, e))?;
        printer.detail(format!("read `{}`", self.file.display()));
        Ok(Prepared {
            motion,
            skeleton,
            seconds: None,
        })
    }

    /// The skeleton a motion names, unless another file is given for it.
    fn skeleton_of(&self, motion: &Motion) -> Outcome<Skeleton> {
        if self.retarget.skeleton.is_some() {
            return self.retarget.skeleton();
        }
        Skeleton::load(&motion.skeleton_name).map_err(|_| {
            let name = &motion.skeleton_name;
            Failure::input(
                &self.file,
                format!("was made for `{name}`, which isn't built in; give its file with `--skeleton {name}.xml`"),
            )
        })
    }

    fn clip(&self) -> Outcome<Clip> {
        let file = &self.file;
        if locate::has_extension(file, "clip") {
            self.import.refuse_for(file, "a clip")?;
            return Clip::load(file).map_err(|e| Failure::clip(file, e));
        }
        import::load(file, &self.import.options()).map_err(|e| Failure::input(file, e))
    }

    fn map(&self, clip: &Clip) -> Outcome<Option<HumanoidMap>> {
        let Some(path) = &self.retarget.map else {
            return Ok(None);
        };
        let text = std::fs::read_to_string(path).map_err(|e| Failure::unreadable(path, &e))?;
        let map =
            HumanoidMap::from_json(&text, &clip.joints).map_err(|e| Failure::input(path, e))?;
        Ok(Some(map))
    }
}
