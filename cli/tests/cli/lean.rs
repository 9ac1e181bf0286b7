//! A build without the feature `rerun`, as for a server.

use crate::workbench::Workbench;

#[test]
fn a_run_is_trained_without_a_recording() {
    let bench = Workbench::with_run();
    assert!(bench.path("runs/sway/eval.json").exists());
    assert!(!bench.path("runs/sway/replay.rrd").exists());
    let said = bench.complaint(&["train", "--resume", "sway"], 2);
    assert!(said.contains("finished"), "{said}");
}

#[test]
fn a_replay_says_which_build_can_record() {
    let bench = Workbench::with_clip();
    for sink in [&["--save", "a.rrd"][..], &["--rerun"], &["--serve"]] {
        let line = [&["replay", "sway.txt"], sink].concat();
        let error = bench.error(&line, 1);
        let remedy = error["remedy"].as_str().unwrap_or_default();
        assert!(
            remedy.contains("cargo install --locked --path cli"),
            "{error}"
        );
    }
    assert!(!bench.path("a.rrd").exists());
}
