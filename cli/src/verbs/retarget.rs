//! `mimic retarget`: makes a clip a motion of a physics character.

use crate::args::{ImportArgs, Replace, RetargetArgs};
use crate::checks;
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::output::{Form, Maker, Output, result_path};
use crate::prepare::{Preparation, Prepared};
use crate::printer::Printer;
use mimic::explain::plain;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic retarget kick.clip                      write kick.motion
  mimic retarget kick.fbx --out motions/        import first; write into a folder
  mimic retarget kick.fbx --map kick.json       use an edited joint map
  mimic retarget kick.fbx --skeleton robot.xml  use your own MJCF character";

/// Retarget a clip to a physics character and compute its tracks
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Clip or animation file [default: the newest clip]
    #[arg(value_name = "CLIP")]
    clip: Option<PathBuf>,
    /// Motion to write, or a folder [default: NAME.motion in this folder]
    #[arg(long, short, value_name = "PATH")]
    out: Option<PathBuf>,
    /// Favour flights that a body can perform over closeness to the clip, as `mimic train` does: longer flights, and a partial
    /// correction of spin where a full one would change too much
    #[arg(long)]
    to_perform: bool,
    #[command(flatten)]
    replace: Replace,
    #[command(flatten)]
    retarget: RetargetArgs,
    #[command(flatten)]
    import: ImportArgs,
}

impl Args {
    /// Runs the command.
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let file = locate::file_or_newest(self.clip.as_deref(), library, &locate::CLIPS, "clip")?;
        let preparation = Preparation::new(file.clone(), &self.import, &self.retarget)
            .for_performance(self.to_perform);
        if preparation.is_motion() {
            return Err(Failure::input(&file, "this is a motion already")
                .with_remedy("give the clip that it was made from"));
        }
        let name = preparation.name();
        let path = result_path(self.out.as_deref(), &name, Form::Motion);
        // A motion of another character is another motion.
        let maker = Maker::new("retarget", [&file]).with(self.retarget.detail(&name));
        let maker = maker.by(" for the same character and take");
        let output = Output::new(path, Form::Motion, maker, "--out", self.replace.force);
        output.check()?;
        let Prepared {
            motion,
            skeleton,
            seconds,
            ..
        } = preparation.run(printer)?;
        let quality = motion.quality(&skeleton);
        let seconds = seconds.unwrap_or_default();
        output.write(|made| Ok(motion.to_bytes(made)?))?;
        let frames = motion.qpos.len();
        let mut report = json!({
            "motion": output.path().display().to_string(),
            "frames": frames,
            "fps": motion.fps,
            "seconds": seconds,
            "frames_per_second": frames as f64 / seconds.max(1e-9),
            "quality": quality,
        });
        if let (Value::Object(report), Value::Object(found)) = (&mut report, json!(motion.report)) {
            report.extend(found);
        }
        printer.result(&report, || {
            text(&report) + "\n" + checks::advice(&quality).trim_end()
        })
    }
}

fn text(report: &Value) -> String {
    let number = |path: &str| {
        report
            .pointer(path)
            .and_then(Value::as_f64)
            .unwrap_or_default()
    };
    let motion = plain(report["motion"].as_str().unwrap_or_default());
    format!(
        "{motion}: {} frames at {:.1} Hz in {:.2} s\n  \
         keypoint error   mean {:.1} cm, max {:.1} cm\n  \
         foot skate       {:.1} cm/s where the source stands\n  \
         penetration      mean {:.1} cm, max {:.1} cm\n  \
         float            {:.1} cm above the ground where the source stands\n  \
         joint limits     {} violations",
        report["frames"],
        number("/fps"),
        number("/seconds"),
        100.0 * number("/keypoint_error_m/mean"),
        100.0 * number("/keypoint_error_m/max"),
        100.0 * number("/foot_skate_m_s"),
        100.0 * number("/penetration_m/mean"),
        100.0 * number("/penetration_m/max"),
        100.0 * number("/float_m"),
        number("/joint_limit_violations"),
    )
}
