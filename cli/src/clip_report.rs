//! What `import` and `edit` report of a clip that they wrote.

use mimic::clip::{Clip, LoopMode, Problem};
use mimic::explain::plain;
use serde::Serialize;
use std::path::Path;

/// The clip's file and what is in it.
#[derive(Serialize)]
pub struct ClipReport {
    clip: String,
    fps: f64,
    frames: usize,
    duration_s: f64,
    joints: usize,
    #[serde(rename = "loop")]
    loop_mode: LoopMode,
    problems: Vec<Problem>,
}

impl ClipReport {
    /// Of the clip that was written to `path`.
    pub fn new(path: &Path, clip: Clip) -> Self {
        Self {
            clip: path.display().to_string(),
            fps: clip.fps,
            frames: clip.frames.len(),
            duration_s: clip.duration(),
            joints: clip.joints.len(),
            loop_mode: clip.loop_mode,
            problems: clip.problems,
        }
    }

    /// The clip's file.
    pub fn file(&self) -> &str {
        &self.clip
    }

    /// What import or edit found wrong with it.
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }

    /// The report in a line of text.
    pub fn line(&self) -> String {
        let loops = match self.loop_mode {
            LoopMode::Wrap => "loops",
            LoopMode::Clamp => "plays once",
        };
        let Self {
            clip,
            fps,
            frames,
            duration_s,
            joints,
            ..
        } = self;
        plain(&format!(
            "{clip}: {frames} frames at {fps:.1} Hz, {duration_s:.2} s, {joints} joints, {loops}"
        ))
    }
}
