//! A character that is steered: trained, measured and recorded from a fresh clone's own clips.

use crate::workbench::Workbench;
use std::path::Path;

/// A folder with clips of ours.
fn bench(clips: &[&str]) -> Workbench {
    let bench = Workbench::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../clips");
    for name in clips {
        let bytes = std::fs::read(root.join(name)).expect("our own clip is there");
        bench.write(name, &bytes);
    }
    bench
}

#[test]
fn a_steered_run_is_trained_and_measured() {
    let bench = bench(&["idle.glb", "walk.glb", "kick.fbx"]);
    let train = [
        "train",
        "idle.glb",
        "walk.glb",
        "kick.fbx",
        "--task",
        "steer",
        "--verbose",
    ];
    let short = ["--samples", "4096", "--out", "run"];
    let output = bench
        .mimic(&[&train[..], &short].concat())
        .output()
        .expect("it runs");
    let (said, shown) = (
        String::from_utf8_lossy(&output.stderr).into_owned(),
        String::from_utf8_lossy(&output.stdout).into_owned(),
    );
    assert!(output.status.success(), "{said}");
    // What each motion is for is seen in it, and said.
    for (file, role) in [
        ("idle.glb", "stands"),
        ("walk.glb", "goes forward at 1.2"),
        ("kick.fbx", "isn't used yet"),
    ] {
        let found = said
            .lines()
            .any(|line| line.contains(file) && line.contains(role));
        assert!(found, "{file} {role}: {said}");
    }
    assert!(
        shown.contains("60 s without a fall") && shown.contains("turn by 180°"),
        "{shown}"
    );
    assert!(bench.path("run/replay.rrd").exists());

    let output = bench
        .mimic(&["eval", "run", "--json"])
        .output()
        .expect("it runs");
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let kept = std::fs::read_to_string(bench.path("run/eval.json")).expect("it is kept");
    let kept: serde_json::Value = serde_json::from_str(&kept).expect("JSON");
    // How long a step takes is the machine's.
    for field in [
        "survival",
        "heading_error_deg",
        "turn_180",
        "pushed",
        "reference",
    ] {
        assert!(!report[field].is_null(), "{field}: {report}");
        assert_eq!(report[field], kept[field], "{field}");
    }
    assert_eq!(report["episodes"], 32);
    // More than can be kept is refused before anything is performed.
    let much = ["eval", "run", "--episodes", "1000000", "--seconds", "3600"];
    let said = bench.complaint(&much, 2);
    assert!(said.contains("fewer or shorter episodes"), "{said}");
}

#[test]
fn who_cannot_stand_is_refused_in_a_line() {
    let bench = bench(&["walk.glb", "kick.fbx"]);
    let output = bench
        .mimic(&["train", "walk.glb", "--task", "steer"])
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    let line = said.lines().last().unwrap_or_default();
    assert!(
        line.contains("no motion stands still") && line.contains("idle"),
        "{said}"
    );
    assert!(!bench.path("runs/walk").exists(), "no folder is left");
}
