//! `mimic edit`: makes one clip of others.

use crate::args::{Replace, positive, span};
use crate::clip_report::ClipReport;
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::output::{Form, Maker, Output, result_path};
use crate::printer::Printer;
use mimic::clip::Clip;
use mimic::clip::edit::Plane;
use mimic::explain::Explain;
use mimic::file::text_at_most;
use mimic::humanoid::{self, HumanoidMap};
use mimic::import;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Edits are applied in the order of the list above, whatever their order on the command line: each \
clip is trimmed and mirrored, then the clips are joined, and the other edits apply to the whole.

Examples:
  mimic edit kick.clip --mirror              swap sides (writes kick-edited.clip)
  mimic edit take.fbx --loop --in-place      cut the best cycle, on the spot
  mimic edit take.clip --trim 2..9 --loop --shortest 2
  mimic edit walk.clip kick.clip --blend 0.4 --out combo.clip
  mimic edit run.clip --speed 1.2 --fps 60
  mimic edit jump.clip --warp 0:0,0.5:0.8,1:1
                                             delay what happens at 0.5 s to 0.8 s";

/// Default length of a blend, seconds. Chosen.
const BLEND: f64 = 0.2;
/// Default of the shortest cycle that is looked for, seconds. Chosen: a bit shorter than the two steps of
/// fast running.
const SHORTEST: f64 = 0.5;

/// Trim, mirror, join, loop, time-warp and resample clips
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Clips, or animation files as for `mimic import`; several are joined in this order
    #[arg(required = true, value_name = "CLIP")]
    clips: Vec<PathBuf>,
    /// Clip to write, or a folder [default: NAME-edited.clip in this folder]
    #[arg(long, short, value_name = "PATH")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replace: Replace,
    #[command(flatten)]
    edits: Edits,
}

#[derive(clap::Args, Debug)]
#[command(next_help_heading = "Edits, in the order they are applied")]
struct Edits {
    /// Part of each clip to keep, in seconds, e.g. 0.5..2
    #[arg(long, value_name = "A..B", value_parser = span, allow_hyphen_values = true)]
    trim: Option<(f64, f64)>,
    /// Swap left and right
    #[arg(long)]
    mirror: bool,
    /// Joint map for `--mirror`, as written by `mimic info --write-map` [default: found by joint names and rest pose]
    #[arg(long, value_name = "FILE", requires = "mirror")]
    map: Option<PathBuf>,
    /// Seconds over which joined clips blend into each other [default: 0.2]
    #[arg(long, value_name = "S", value_parser = not_negative, allow_negative_numbers = true)]
    blend: Option<f64>,
    /// Cut out the best cycle and make its end lead into its start
    #[arg(long = "loop")]
    loops: bool,
    /// Shortest cycle that `--loop` may choose, in seconds [default: 0.5]
    #[arg(long, value_name = "S", value_parser = positive, allow_negative_numbers = true, requires = "loops")]
    shortest: Option<f64>,
    /// Playback speed factor: 2 is twice as fast, 0.5 half as fast
    #[arg(long, value_name = "FACTOR", value_parser = positive, allow_negative_numbers = true, conflicts_with = "warp")]
    speed: Option<f64>,
    /// Move moments in time: FROM:TO,FROM:TO in seconds; the time between them is stretched evenly
    #[arg(long, value_name = "POINTS", value_parser = points, allow_hyphen_values = true)]
    warp: Option<Points>,
    /// Remove the steady travel over the ground
    #[arg(long)]
    in_place: bool,
    /// Add steady travel: X forward and Y to the left, in metres per second
    #[arg(long, value_name = "X,Y", value_parser = pair, allow_hyphen_values = true)]
    travel: Option<(f64, f64)>,
    /// Frames per second to resample to
    #[arg(long, value_name = "HZ", value_parser = positive, allow_negative_numbers = true)]
    fps: Option<f64>,
}

/// Moments of a clip and when they are to happen, seconds.
#[derive(Clone, Debug)]
struct Points(Vec<(f64, f64)>);

impl Args {
    /// Runs the command.
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        self.refuse_nothing()?;
        let inputs = self.clips.iter();
        let inputs: Vec<PathBuf> = inputs
            .map(|clip| locate::clip(clip, library, &locate::CLIPS))
            .collect::<Outcome<_>>()?;
        let first = inputs[0].as_path();
        let stem = first.file_stem().unwrap_or_default().to_string_lossy();
        let path = result_path(self.out.as_deref(), &format!("{stem}-edited"), Form::Clip);
        // Other edits of the same clips are another clip.
        let maker = Maker::new("edit", &inputs)
            .with(format!("{:?}", self.edits))
            .by(" with the same edits");
        let output = Output::new(path, Form::Clip, maker, "--out", self.replace.force);
        output.check()?;
        let mut clips = Vec::with_capacity(inputs.len());
        for input in &inputs {
            clips.push(self.edits.prepare(input)?);
        }
        let mut clip = self.edits.apply(clips, first)?;
        clip.name = output
            .path()
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        output.write(|made| Ok(clip.to_bytes(made)?))?;
        let report = ClipReport::new(output.path(), clip);
        printer.problems(report.problems());
        printer.result(&report, || report.line())
    }

    /// Refuses a command that would change nothing: it must be a mistake.
    fn refuse_nothing(&self) -> Outcome {
        let several = self.clips.len() > 1;
        if self.edits.blend.is_some() && !several {
            return Err(Failure::user("`--blend` needs at least two clips")
                .with_remedy("name the clip that is to follow"));
        }
        if several || self.edits.are_any() {
            return Ok(());
        }
        Err(Failure::user("there is nothing to edit")
            .with_remedy("choose an edit, such as `--mirror`, or name another clip to join"))
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

    /// Reads one of the clips and applies the edits that come before joining.
    fn prepare(&self, input: &Path) -> Outcome<Clip> {
        let mut clip = read(input)?;
        if let Some((from, to)) = self.trim {
            clip = clip
                .trim(from, to)
                .map_err(|e| Failure::in_file(input, e))?;
        }
        if self.mirror {
            let map = self.map(&clip, input)?;
            let pairs = humanoid::pairs(&clip.joints, &map);
            let mirrored = clip.mirror(&pairs, &Plane::sagittal(&clip.joints, &pairs));
            clip = mirrored.map_err(|e| Failure::in_file(input, e))?;
        }
        Ok(clip)
    }

    fn map(&self, clip: &Clip, input: &Path) -> Outcome<HumanoidMap> {
        if let Some(path) = &self.map {
            let text = text_at_most(path, HumanoidMap::MOST_BYTES)
                .map_err(|e| Failure::unreadable(path, &e))?;
            return HumanoidMap::from_json(&text, &clip.joints)
                .map_err(|e| Failure::in_file(path, e));
        }
        humanoid::map(&clip.joints).map_err(|e| {
            let cause = format!("left and right are not known, so the clip cannot be mirrored: {}", e.explain().cause);
            Failure::input(input, cause).with_remedy(
                "complete the map that `mimic info --write-map` writes, and pass it with `--map FILE`",
            )
        })
    }

    /// Joins the clips and applies the edits that come after that. What goes wrong is blamed on the file of the `first`.
    fn apply(&self, clips: Vec<Clip>, first: &Path) -> Outcome<Clip> {
        let wrong = |e| Failure::in_file(first, e);
        let mut clip = match <[Clip; 1]>::try_from(clips) {
            Ok([one]) => one,
            Err(several) => Clip::join(&several, self.blend.unwrap_or(BLEND)).map_err(wrong)?,
        };
        if self.loops {
            let shortest = self.shortest.unwrap_or(SHORTEST);
            clip = clip.cut_loop(shortest).map_err(wrong)?;
        }
        let fps = self.fps.unwrap_or(clip.fps);
        if let Some(factor) = self.speed {
            clip = clip.speed(factor, fps).map_err(wrong)?;
        }
        if let Some(Points(points)) = &self.warp {
            clip = clip.warp(points, fps).map_err(wrong)?;
        }
        if self.in_place {
            clip = clip.in_place().map_err(wrong)?;
        }
        if let Some((x, y)) = self.travel {
            clip = clip.travel([x, y].into()).map_err(wrong)?;
        }
        match self.fps {
            Some(fps) => clip.resample(fps).map_err(wrong),
            None => Ok(clip),
        }
    }
}

fn read(input: &Path) -> Outcome<Clip> {
    if locate::has_extension(input, "clip") {
        return Ok(Clip::load(input)?);
    }
    Ok(import::load(input, &import::Options::default())?)
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
        _ => Err("must not be negative".into()),
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
