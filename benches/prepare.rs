//! Speed of importing beside ufbx alone, and of retargeting, on one thread.
//!
//! `cargo bench -p mimic --bench prepare [FILE.fbx ...]`. Without files, our own kick. What is compared alternates within
//! each round; figures are medians over rounds, so that their ratios mean something on a machine that does other work too.

use mimic::clip::Clip;
use mimic::import::{self, Options};
use mimic::retarget;
use mimic::skeleton::Skeleton;
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

const ROUNDS: usize = 5;

/// Milliseconds.
fn time<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let done = work();
    (start.elapsed().as_secs_f64() * 1e3, done)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// ufbx on the same work: the file, and every node's place in every frame of its longest take.
fn by_ufbx(bytes: &[u8], frames: usize, fps: f64) -> Option<usize> {
    let scene = ufbx::load_memory(bytes, ufbx::LoadOpts::default()).ok()?;
    let span = |stack: &ufbx::AnimStack| stack.time_end - stack.time_begin;
    let longest = scene
        .anim_stacks
        .iter()
        .max_by(|a, b| span(a).total_cmp(&span(b)));
    let mut placed = 0;
    let stack = longest?;
    for f in 0..frames {
        let time = stack.time_begin + f as f64 / fps;
        let posed = ufbx::evaluate_scene(&scene, &stack.anim, time, ufbx::EvaluateOpts::default());
        placed += posed.ok()?.nodes.len();
    }
    Some(placed)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut files: Vec<PathBuf> = std::env::args()
        .skip(1)
        .filter(|arg| !arg.starts_with("--"))
        .map(PathBuf::from)
        .collect();
    if files.is_empty() {
        files.push(PathBuf::from(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/clips/kick.fbx"
        )));
    }
    let bytes = files
        .iter()
        .map(std::fs::read)
        .collect::<Result<Vec<_>, _>>()?;
    let read = |bytes: &[u8]| import::read(bytes, "bench.fbx", None, &Options::default());
    let clips = bytes
        .iter()
        .map(|bytes| read(bytes))
        .collect::<Result<Vec<Clip>, _>>()?;
    let (mut ours, mut parsed, mut placed) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let mut sums = [0.0; 3];
        for (bytes, clip) in bytes.iter().zip(&clips) {
            sums[0] += time(|| read(bytes)).0;
            sums[1] += time(|| ufbx::load_memory(bytes, ufbx::LoadOpts::default()).is_ok()).0;
            sums[2] += time(|| by_ufbx(bytes, clip.frames.len(), clip.fps).is_some()).0;
        }
        ours.push(sums[0]);
        parsed.push(sums[1]);
        placed.push(sums[2]);
    }
    let (ours, parsed, placed) = (median(ours), median(parsed), median(placed));
    println!("{} files", files.len());
    println!("import: {ours:.1} ms");
    println!(
        "ufbx, the file alone: {parsed:.1} ms, import takes {:.2} times as long",
        ours / parsed
    );
    println!(
        "ufbx, all frames as well: {placed:.1} ms, {:.2} times",
        ours / placed
    );
    let skeleton = Skeleton::load("humanoid")?;
    let (mut frames, mut milliseconds) = (0, Vec::new());
    for clip in &clips {
        let warm = retarget::retarget(clip, &skeleton, &retarget::Options::default())?;
        frames += warm.motion.qpos.len();
        let rounds = (0..ROUNDS).map(|_| {
            time(|| retarget::retarget(clip, &skeleton, &retarget::Options::default()).is_ok()).0
        });
        milliseconds.push(median(rounds.collect()));
    }
    let total: f64 = milliseconds.iter().sum();
    println!(
        "retargeting: {frames} frames in {total:.1} ms, {:.0} frames/s",
        frames as f64 / total * 1e3
    );
    Ok(())
}
