//! `mimic edit`: clips become another clip.

use crate::args::{positive, span};
use crate::clip_report::ClipReport;
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::output::{make_room, result_path};
use crate::printer::Printer;
use mimic::clip::Clip;
use mimic::clip::edit::Plane;
use mimic::humanoid::{self, HumanoidMap};
use mimic::import;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Edits are made in the order in which they stand above, whatever the order on the line: each clip is
trimmed and mirrored, then they are joined, and the rest is done to the whole.

Examples:
  mimic edit kick.clip --mirror                     the other leg: writes kick-edited.clip
  mimic edit take.fbx --loop --in-place             the best cycle of a long take, on the spot
  mimic edit take.clip --trim 2..9 --loop --shortest 2
  mimic edit walk.clip kick.clip --blend 0.4 --out combo.clip
  mimic edit run.clip --speed 1.2 --fps 60
  mimic edit jump.clip --warp 0:0,0.5:0.8,1:1       what was at 0.5 s comes at 0.8 s";

/// How long a blend lasts where nothing is said, s.
const BLEND: f64 = 0.2;
/// Shortest cycle that is looked for where nothing is said, s.
const SHORTEST: f64 = 0.5;

/// Trim, mirror, join, loop, time-warp and resample clips
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Clips, or files that `mimic import` reads; several are joined one after another
    #[arg(required = true, value_name = "CLIP")]
    clips: Vec<PathBuf>,
    /// Clip to write, or a folder for it [default: NAME-edited.clip in this folder]
    #[arg(long, short, value_name = "PATH")]
    out: Option<PathBuf>,
    #[command(flatten)]
    edits: Edits,
}

#[derive(clap::Args)]
#[command(next_help_heading = "Edits, in their order")]
struct Edits {
    /// Part of each clip to keep, in seconds
    #[arg(long, value_name = "A..B", value_parser = span)]
    trim: Option<(f64, f64)>,
    /// Swap left and right
    #[arg(long)]
    mirror: bool,
    /// Joint map for `--mirror`, as `mimic info --write-map` writes it [default: found out]
    #[arg(long, value_name = "FILE", requires = "mirror")]
    map: Option<PathBuf>,
    /// Seconds over which clips that are joined blend into each other [default: 0.2]
    #[arg(long, value_name = "S", value_parser = not_negative)]
    blend: Option<f64>,
    /// Cut out the best cycle and close its seam
    #[arg(long = "loop")]
    loops: bool,
    /// Shortest cycle for `--loop`, in seconds [default: 0.5]
    #[arg(long, value_name = "S", value_parser = positive, requires = "loops")]
    shortest: Option<f64>,
    /// How many times as fast it becomes
    #[arg(long, value_name = "FACTOR", value_parser = positive, conflicts_with = "warp")]
    speed: Option<f64>,
    /// Moments and when they are to come, in seconds: FROM:TO,FROM:TO
    #[arg(long, value_name = "POINTS", value_parser = points)]
    warp: Option<Points>,
    /// Take the steady travel over the ground out
    #[arg(long)]
    in_place: bool,
    /// Metres per second to add, forward and to the left
    #[arg(long, value_name = "X,Y", value_parser = pair, allow_hyphen_values = true)]
    travel: Option<(f64, f64)>,
    /// Frames per second to resample at
    #[arg(long, value_name = "HZ", value_parser = positive)]
    fps: Option<f64>,
}

/// Moments of a clip and the times to which they come, s.
#[derive(Clone)]
struct Points(Vec<(f64, f64)>);

impl Args {
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        self.refuse_nothing()?;
        let inputs = self.clips.iter();
        let inputs: Vec<PathBuf> = inputs
            .map(|clip| locate::file(clip, library, &locate::CLIPS))
            .collect::<Outcome<_>>()?;
        let first = inputs[0].as_path();
        let stem = first.file_stem().unwrap_or_default().to_string_lossy();
        let output = result_path(self.out.as_deref(), &format!("{stem}-edited"), "clip");
        let mut clips = Vec::with_capacity(inputs.len());
        for input in &inputs {
            clips.push(self.edits.prepare(input)?);
        }
        let edited = self.edits.apply(clips);
        let mut clip = edited.map_err(|e| Failure::input(first, e))?;
        clip.name = output
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        for input in &inputs {
            make_room(&output, input, "clip")?;
        }
        clip.save(&output).map_err(|e| Failure::clip(&output, e))?;
        let report = ClipReport::new(&output, clip);
        printer.problems(report.problems());
        printer.result(&report, || report.line())
    }

    /// A command that would change nothing is a mistake.
    fn refuse_nothing(&self) -> Outcome {
        let several = self.clips.len() > 1;
        if self.edits.blend.is_some() && !several {
            return Err(Failure::user(
                "`--blend` has nothing to blend; name the clips that are to follow each other",
            ));
        }
        if several || self.edits.are_any() {
            return Ok(());
        }
        Err(Failure::user(
            "nothing to edit; name what is to be done, such as `--mirror`, or another clip to follow",
        ))
    }
}

impl Edits {
    fn are_any(&self) -> bool {
        self.mirror
            || self.loops
            || self.in_place
            || self.trim.is_some()
            || self.speed.is_some()
            || self.warp.is_some()
            || self.travel.is_some()
            || self.fps.is_some()
    }

    /// One of the clips, with the edits that are made before they are joined.
    fn prepare(&self, input: &Path) -> Outcome<Clip> {
        let mut clip = read(input)?;
        if let Some((from, to)) = self.trim {
            clip = clip.trim(from, to).map_err(|e| Failure::input(input, e))?;
        }
        if self.mirror {
            let map = self.map(&clip, input)?;
            let pairs = humanoid::pairs(&clip.joints, &map);
            let mirrored = clip.mirror(&pairs, &Plane::sagittal(&clip.joints, &pairs));
            clip = mirrored.map_err(|e| Failure::input(input, e))?;
        }
        Ok(clip)
    }

    fn map(&self, clip: &Clip, input: &Path) -> Outcome<HumanoidMap> {
        if let Some(path) = &self.map {
            let text = std::fs::read_to_string(path).map_err(|e| Failure::unreadable(path, &e))?;
            return HumanoidMap::from_json(&text, &clip.joints)
                .map_err(|e| Failure::input(path, e));
        }
        humanoid::map(&clip.joints).map_err(|e| {
            let remedy =
                "complete what `mimic info --write-map` writes, and give it with `--map FILE`";
            Failure::input(
                input,
                format!("left and right aren't known, so it can't be mirrored: {e}; {remedy}"),
            )
        })
    }

    /// The clips as one, and what is done to that.
    fn apply(&self, clips: Vec<Clip>) -> Result<Clip, mimic::clip::Error> {
        let mut clip = match <[Clip; 1]>::try_from(clips) {
            Ok([one]) => one,
            Err(several) => Clip::join(&several, self.blend.unwrap_or(BLEND))?,
        };
        if self.loops {
            clip = clip.cut_loop(self.shortest.unwrap_or(SHORTEST))?;
        }
        let fps = self.fps.unwrap_or(clip.fps);
        if let Some(factor) = self.speed {
            clip = clip.speed(factor, fps)?;
        }
        if let Some(Points(points)) = &self.warp {
            clip = clip.warp(points, fps)?;
        }
        if self.in_place {
            clip = clip.in_place()?;
        }
        if let Some((x, y)) = self.travel {
            clip = clip.travel([x, y].into())?;
        }
        match self.fps {
            Some(fps) => clip.resample(fps),
            None => Ok(clip),
        }
    }
}

fn read(input: &Path) -> Outcome<Clip> {
    if locate::has_extension(input, "motion") {
        return Err(Failure::input(
            input,
            "is a motion, edits are made to clips; edit its clip and `mimic retarget` that again",
        ));
    }
    if locate::has_extension(input, "clip") {
        return Clip::load(input).map_err(|e| Failure::clip(input, e));
    }
    import::load(input, &import::Options::default()).map_err(|e| Failure::input(input, e))
}

fn number(text: &str) -> Result<f64, String> {
    let number: f64 = text
        .trim()
        .parse()
        .map_err(|_| format!("`{text}` is not a number"))?;
    if number.is_finite() {
        Ok(number)
    } else {
        Err(format!("`{text}` is not a finite number"))
    }
}

fn not_negative(text: &str) -> Result<f64, String> {
    match number(text)? {
        number if number >= 0.0 => Ok(number),
        _ => Err("a negative number".into()),
    }
}

fn pair(text: &str) -> Result<(f64, f64), String> {
    let (x, y) = text.split_once(',').ok_or("give two numbers as X,Y")?;
    Ok((number(x)?, number(y)?))
}

fn points(text: &str) -> Result<Points, String> {
    let point = |text: &str| {
        let (from, to) = text
            .split_once(':')
            .ok_or("give points as FROM:TO, e.g. 0.5:0.8")?;
        Ok((number(from)?, number(to)?))
    };
    text.split(',')
        .map(point)
        .collect::<Result<_, String>>()
        .map(Points)
}
