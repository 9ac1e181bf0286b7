//! A folder with a small clip in it, and `mimic` run there.

use assert_cmd::Command;
use serde_json::{Value, json};
use std::path::PathBuf;
use tempfile::TempDir;

pub struct Workbench(TempDir);

/// A preset whose training takes a moment.
pub const TINY: &[u8] =
    br#"{ "environments": 4, "group": 4, "horizon": 8, "round": 1, "samples": 32, "hidden": [8] }"#;

impl Workbench {
    pub fn new() -> Self {
        Self(TempDir::new().expect("a temporary folder can be made"))
    }

    /// With `sway.txt`: somebody who stands and sways for a second.
    pub fn with_clip() -> Self {
        let bench = Self::new();
        bench.write("sway.txt", sway().to_string().as_bytes());
        bench
    }

    /// With `runs/sway`: a run that has learned nothing, but is whole.
    pub fn with_run() -> Self {
        let bench = Self::with_clip();
        bench.write("tiny.json", TINY);
        let line = ["train", "sway.txt", "--preset", "tiny.json"];
        bench.mimic(&line).assert().success();
        bench
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).expect("a file can be written");
    }

    pub fn mimic(&self, arguments: &[&str]) -> Command {
        let mut command = Command::cargo_bin("mimic").expect("the program is built");
        command
            .current_dir(self.0.path())
            .env_remove("MIMIC_LIBRARY")
            .args(arguments);
        command
    }

    /// Runs with `--json` and gives the one object it prints.
    pub fn json(&self, arguments: &[&str]) -> Value {
        let output = self.mimic(arguments).arg("--json").assert().success();
        let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
        assert_eq!(text.trim_end().lines().count(), 1, "one line: {text}");
        serde_json::from_str(&text).expect("the output is JSON")
    }

    /// Runs what has to fail with `code`; gives the one line it says about that.
    pub fn complaint(&self, arguments: &[&str], code: i32) -> String {
        let output = self.mimic(arguments).assert().code(code);
        let output = output.get_output();
        assert!(output.stdout.is_empty(), "nothing on standard output");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(text.lines().count(), 1, "one line: {text}");
        text
    }

    /// Runs with `--json` what has to fail with `code`; gives the error that it prints, which is also what it says.
    pub fn error(&self, arguments: &[&str], code: i32) -> Value {
        let output = self.mimic(arguments).arg("--json").assert().code(code);
        let output = output.get_output();
        let printed: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        let error = printed["error"].clone();
        assert_eq!(error["exit"], code);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let message = error["message"].as_str().expect("a message");
        assert_eq!(said, format!("error: {message}\n"));
        error
    }

    /// Runs what has to fail because of `file`: the error names the file, in its message once, and has a remedy.
    pub fn error_about(&self, file: &str, arguments: &[&str], code: i32) -> Value {
        let error = self.error(arguments, code);
        let message = error["message"].as_str().unwrap_or_default();
        assert_eq!(error["file"], file, "{message}");
        assert_eq!(message.matches(file).count(), 1, "{message}");
        let remedy = error["remedy"].as_str().unwrap_or_default();
        assert!(!remedy.is_empty(), "no remedy: {message}");
        assert!(message.ends_with(&format!("; {remedy}")), "{message}");
        error
    }
}

/// Somebody who stands and sways.
fn sway() -> Value {
    standing(0.1)
}

/// The same, who stands still.
pub fn still() -> Value {
    standing(0.0)
}

/// A DeepMimic motion: per frame its duration, root position and rotation, then joint rotations. The chest leans by so much,
/// radians.
fn standing(lean: f64) -> Value {
    let upright = [1.0, 0.0, 0.0, 0.0];
    let frame = |f: u32| {
        let angle = lean * (f64::from(f) / 30.0 * std::f64::consts::TAU).sin();
        let lean = [(angle / 2.0).cos(), (angle / 2.0).sin(), 0.0, 0.0];
        let mut row = vec![1.0 / 30.0, 0.0, 0.86, 0.0];
        row.extend(upright);
        row.extend(lean);
        row.extend(upright);
        for _side in 0..2 {
            let (knee, elbow) = (-0.1, 0.3);
            row.extend(upright);
            row.push(knee);
            row.extend(upright);
            row.extend(upright);
            row.push(elbow);
        }
        row
    };
    let frames: Vec<Vec<f64>> = (0..=30).map(frame).collect();
    json!({ "Loop": "wrap", "Frames": frames })
}
