//! `mimic runs`.

use crate::workbench::Workbench;
use serde_json::Value;

/// The listed runs by their folders, in order.
fn listed(bench: &Workbench, line: &[&str]) -> Vec<(String, Value)> {
    let report = bench.json(line);
    let runs = report["runs"].as_array().expect("a list").iter();
    runs.map(|run| {
        let folder = run["run"].as_str().expect("a folder").to_owned();
        (folder, run.clone())
    })
    .collect()
}

#[test]
fn without_runs_the_list_is_empty() {
    let bench = Workbench::new();
    assert_eq!(listed(&bench, &["runs"]), []);
    let output = bench.mimic(&["runs"]).assert().success();
    let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    assert!(text.contains("no runs in `runs`"), "{text}");
    bench.error_about("nowhere", &["runs", "nowhere"], 2);
}

#[test]
fn runs_are_listed_with_what_they_learned_the_newest_last() {
    let bench = Workbench::with_run();
    let plan = r#"{ "environments": 4, "group": 4, "horizon": 8, "round": 1, "samples": 3200, "hidden": [8] }"#;
    bench.write("long.json", plan.as_bytes());
    let line = ["train", "sway.txt", "sway.txt", "--preset", "long.json"];
    let cut = ["--minutes", "1e-9", "--out", "runs/cut"];
    bench.mimic(&[&line[..], &cut].concat()).assert().success();

    let runs = listed(&bench, &["runs"]);
    let [(first, whole), (second, cut)] = &runs[..] else {
        panic!("two runs: {runs:?}");
    };
    assert_eq!((first.as_str(), second.as_str()), ("runs/sway", "runs/cut"));
    assert_eq!(whole["state"], "finished");
    assert_eq!(
        (&whole["samples"], &whole["planned"]),
        (&32.into(), &32.into())
    );
    assert_eq!(whole["clips"], serde_json::json!(["sway"]));
    assert_eq!(cut["state"], "stopped");
    assert_eq!(
        (&cut["samples"], &cut["planned"]),
        (&32.into(), &3200.into())
    );
    assert_eq!(cut["clips"], serde_json::json!(["sway", "sway"]));
    let kept = std::fs::read(bench.path("runs/sway/eval.json")).expect("it was evaluated");
    let kept: Value = serde_json::from_slice(&kept).expect("it is JSON");
    assert_eq!(whole["survival"], kept["survival"]);
    for (_, run) in &runs {
        assert_eq!(run["task"], "imitate");
        assert_eq!(run["error"], Value::Null);
        let when = run["when"].as_str().unwrap_or_default();
        assert!(when.starts_with("20") && when.ends_with('Z'), "{when}");
    }

    let output = bench.mimic(&["runs"]).assert().success();
    let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert!(
        lines[1].contains("32 of 32") && lines[1].contains("finished"),
        "{text}"
    );
    assert!(
        lines[2].contains("sway + 1") && lines[2].contains("32 of 3.2k"),
        "{text}"
    );
    assert!(
        lines.iter().all(|line| line.chars().count() <= 80),
        "{text}"
    );
    // One run, by its name.
    assert_eq!(listed(&bench, &["runs", "cut"]).len(), 1);
}

#[test]
fn a_broken_run_is_listed_with_its_reason() {
    let bench = Workbench::with_run();
    for (file, bytes, reason) in [
        ("config.json", Some(&b"{"[..]), "config.json"),
        ("config.json", None, "no config.json"),
        (
            "checkpoint.safetensors",
            Some(b"damaged"),
            "checkpoint.safetensors",
        ),
        ("reference-0.motion", None, "reference-0.motion"),
    ] {
        let path = bench.path("runs/sway").join(file);
        let whole = std::fs::read(&path).expect("a run has this file");
        match bytes {
            Some(bytes) => std::fs::write(&path, bytes).expect("it can be damaged"),
            None => std::fs::remove_file(&path).expect("it can be lost"),
        }
        let runs = listed(&bench, &["runs"]);
        assert_eq!(runs.len(), 1);
        assert_eq!(runs[0].1["state"], "broken", "{file}");
        let message = runs[0].1["error"]["message"].as_str().unwrap_or_default();
        assert!(message.contains(reason), "{message}");
        let output = bench.mimic(&["runs"]).assert().success();
        let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
        assert!(text.contains(&format!("broken: {message}")), "{text}");
        std::fs::write(&path, whole).expect("it can be mended");
    }
    assert_eq!(listed(&bench, &["runs"])[0].1["state"], "finished");
    // What never was a run is none.
    std::fs::create_dir(bench.path("runs/notes")).expect("a folder can be made");
    bench.write("runs/notes/todo.txt", b"train more");
    assert_eq!(listed(&bench, &["runs"]).len(), 1);
}

#[test]
fn a_run_that_is_being_trained_is_listed_with_who_does_it() {
    let bench = Workbench::with_clip();
    let plan = r#"{ "environments": 4, "group": 4, "horizon": 8, "round": 1, "samples": 320000000, "hidden": [8] }"#;
    bench.write("endless.json", plan.as_bytes());
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("mimic"));
    let mut running = command
        .args(["train", "sway.txt", "--preset", "endless.json"])
        .current_dir(bench.path("."))
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("the program starts");
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(60);
    let mut run = Value::Null;
    while std::time::Instant::now() < deadline && run["samples"].as_u64().unwrap_or(0) == 0 {
        std::thread::sleep(std::time::Duration::from_millis(20));
        run = bench.json(&["runs"])["runs"][0].clone();
    }
    let id = running.id();
    running.kill().expect("it runs");
    running.wait().expect("it ends");
    assert_eq!(run["state"], "training", "{run}");
    let holder = run["held_by"].as_str().unwrap_or_default();
    assert!(holder.starts_with(&format!("process {id}")), "{holder}");
    let killed = &bench.json(&["runs"])["runs"][0];
    assert_eq!(
        (&killed["state"], &killed["held_by"]),
        (&"stopped".into(), &Value::Null)
    );
}

/// Root may read everything, so there is nothing to test for it.
#[cfg(unix)]
#[test]
fn what_can_not_be_read_is_not_taken_for_nothing() {
    use std::os::unix::fs::PermissionsExt;
    let bench = Workbench::with_run();
    let close = |path: &str, mode| {
        let mode = std::fs::Permissions::from_mode(mode);
        std::fs::set_permissions(bench.path(path), mode).expect("it is ours");
    };
    close("runs/sway", 0);
    if std::fs::read_dir(bench.path("runs/sway")).is_ok() {
        return;
    }
    let listed = bench.json(&["runs"]);
    let message = listed["runs"][0]["error"]["message"].as_str();
    assert!(
        message.is_some_and(|m| m.contains("cannot be read")),
        "{listed}"
    );
    let said = bench.complaint(&["eval", "sway"], 2);
    assert!(said.contains("cannot be read"), "{said}");
    close("runs", 0);
    for line in [&["runs"][..], &["eval"], &["eval", "sway"]] {
        let said = bench.complaint(line, 2);
        assert!(said.contains("cannot be read"), "{line:?}: {said}");
    }
    close("runs", 0o755);
    close("runs/sway", 0o755);
}

#[test]
fn a_clock_that_was_put_back_is_no_puzzle() {
    let bench = Workbench::with_run();
    let soon = std::time::SystemTime::now() + std::time::Duration::from_secs(7200);
    let file = std::fs::File::open(bench.path("runs/sway/checkpoint.safetensors"));
    file.and_then(|file| file.set_modified(soon))
        .expect("it is ours");
    let output = bench.mimic(&["runs"]).assert().success();
    let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    assert!(text.contains("in ") && !text.contains("ago"), "{text}");
}
