//! What is said of a clip that was written.

use mimic::clip::{Clip, LoopMode, Problem};
use serde::Serialize;
use std::path::Path;

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

    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }

    /// The same for people.
    pub fn line(&self) -> String {
        let loops = match self.loop_mode {
            LoopMode::Wrap => "loops",
            LoopMode::Clamp => "ends",
        };
        let Self {
            clip,
            fps,
            frames,
            duration_s,
            joints,
            ..
        } = self;
        format!(
            "{clip}: {frames} frames at {fps:.1} Hz, {duration_s:.2} s, {joints} joints, {loops}"
        )
    }
}
