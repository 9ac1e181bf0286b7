//! `mimic replay`: an agent with its reference, or a motion alone, in the rerun viewer.

use crate::args::{ImportArgs, RetargetArgs, at_least_one, positive};
use crate::failure::{Failure, Outcome};
use crate::locate;
use crate::output::make_room;
use crate::prepare::Preparation;
use crate::printer::Printer;
use crate::recording::{self, Recording, Sink};
use crate::runs;
use crate::viewer::{self, Viewer};
use serde_json::json;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  mimic replay --rerun                      the newest run, in the viewer
  mimic replay kick --rerun --beside        the run or clip `kick`, agent and reference side by side
  mimic replay walk.fbx --save walk.rrd     imports and retargets first; open it with `rerun walk.rrd`
  mimic replay kick --connect 127.0.0.1:9876";

/// Metres between agent and reference when they stand side by side.
const BESIDE: f64 = 1.2;

/// Watch an agent with its reference, or a motion alone, in the rerun viewer
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Run, motion, clip or animation file [default: the newest run, else the newest motion]
    #[arg(value_name = "RUN|MOTION")]
    what: Option<PathBuf>,
    #[command(flatten)]
    sinks: Sinks,
    /// Show the reference at the agent's side instead of over it
    #[arg(long)]
    beside: bool,
    /// Seconds to show of a looping motion that an agent performs
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = positive)]
    seconds: f64,
    /// Which motion to show, by number from 1, of a run that learned several
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = at_least_one)]
    motion: usize,
    #[command(flatten)]
    import: ImportArgs,
    #[command(flatten)]
    retarget: RetargetArgs,
}

/// Where the recording goes; several are possible.
#[derive(clap::Args)]
#[group(required = true, multiple = true)]
struct Sinks {
    /// Open the viewer
    #[arg(long)]
    rerun: bool,
    /// Write the recording to a file
    #[arg(long, value_name = "FILE.rrd")]
    save: Option<PathBuf>,
    /// Send it to a viewer that listens, e.g. 127.0.0.1:9876
    #[arg(long, value_name = "ADDR")]
    connect: Option<String>,
    /// Serve it to web browsers until stopped
    #[arg(long)]
    serve: bool,
}

impl Args {
    pub fn run(self, library: &Path, printer: &Printer) -> Outcome {
        let viewer = (self.sinks.rerun || self.sinks.serve)
            .then(Viewer::require)
            .transpose()?;
        let (mut shown, source) = self.record(library, printer)?;
        if self.beside {
            shown.beside = BESIDE;
        }
        self.sinks.show(&shown, &source, viewer.as_ref(), printer)?;
        let json = json!({
            "name": shown.name,
            "recording": self.sinks.save,
            "frames": shown.phase.len(),
            "fps": shown.fps,
            "agent": shown.agent.is_some(),
        });
        printer.result(&json, || summary(&shown, self.sinks.save.as_deref()))
    }
}

impl Args {
    /// A run by path or name, else an animation by path or name; left out, the newest run, else the newest motion.
    fn record(&self, library: &Path, printer: &Printer) -> Outcome<(Recording, PathBuf)> {
        let run = match &self.what {
            Some(what) => locate::existing_run(what),
            None => locate::newest_run(),
        };
        if let Some(run) = run {
            let recording = runs::record(&runs::open(Some(&run))?, self.motion - 1, self.seconds)?;
            return Ok((recording, run));
        }
        let what = self.what.as_deref();
        let source = locate::file_or_newest(what, library, &locate::ANIMATIONS, "motion")?;
        let preparation = Preparation::new(source.clone(), &self.import, &self.retarget);
        let prepared = preparation.run(printer)?;
        let recording = Recording::of_motion(&prepared.motion, &prepared.skeleton);
        Ok((recording, source))
    }
}

fn summary(shown: &Recording, saved: Option<&Path>) -> String {
    let frames = shown.phase.len();
    let who = if shown.agent.is_some() {
        "agent and reference"
    } else {
        "reference"
    };
    let place = saved.map_or_else(|| shown.name.clone(), |path| path.display().to_string());
    format!("{place}: {who}, {frames} frames at {:.1} Hz", shown.fps)
}

impl Sinks {
    fn show(
        &self,
        shown: &Recording,
        source: &Path,
        viewer: Option<&Viewer>,
        printer: &Printer,
    ) -> Outcome {
        if let Some(path) = &self.save {
            save(shown, path, source)?;
        }
        if let Some(place) = &self.connect {
            send(shown, viewer::address(place))?;
        }
        let Some(viewer) = viewer else {
            return Ok(());
        };
        if !viewer.fits() {
            let version = viewer.version.as_deref().unwrap_or("of unknown version");
            printer.warn(format!(
                "the viewer is {version}, recordings are for {}: {}",
                viewer::VERSION,
                viewer::install()
            ));
        }
        if self.rerun {
            send(shown, viewer.open()?)?;
        }
        if self.serve {
            serve(shown, viewer)?;
        }
        Ok(())
    }
}

/// Writes beside the goal and renames, so that no half recording is ever found.
pub fn save(shown: &Recording, path: &Path, source: &Path) -> Outcome {
    make_room(path, source)?;
    let part = path.with_extension("rrd.part");
    recording::write(shown, &Sink::File(part.clone())).map_err(|e| Failure::write(path, e))?;
    std::fs::rename(&part, path).map_err(|e| Failure::write(path, e))
}

fn send(shown: &Recording, address: String) -> Outcome {
    viewer::reach(&address)?;
    let failed = |e| Failure::work(format!("cannot send the recording to `{address}`: {e}"));
    recording::write(shown, &Sink::Viewer(address.clone())).map_err(failed)
}

fn serve(shown: &Recording, viewer: &Viewer) -> Outcome {
    let path = std::env::temp_dir().join(format!("mimic-{}.rrd", std::process::id()));
    recording::write(shown, &Sink::File(path.clone())).map_err(|e| Failure::write(&path, e))?;
    // The viewer ends by the same Ctrl-C; we outlive it to clean up.
    ctrlc::set_handler(|| {}).ok();
    let served = viewer.serve(&path);
    std::fs::remove_file(&path).ok();
    served
}
