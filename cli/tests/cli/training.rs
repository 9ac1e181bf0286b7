//! `train`, `eval`, `replay` of a run, `bench`.

use crate::workbench::Workbench;
use serde_json::Value;
use std::process::{Command, Stdio};

/// A few iterations of a small network: enough to have a run, not to learn anything.
fn with_preset() -> Workbench {
    let bench = Workbench::with_clip();
    bench.write(
        "small.json",
        br#"{ "environments": 8, "group": 4, "horizon": 16, "round": 2, "samples": 512, "hidden": [16] }"#,
    );
    bench
}

fn lines(text: &[u8]) -> Vec<Value> {
    let text = String::from_utf8_lossy(text).into_owned();
    text.lines()
        .map(|line| serde_json::from_str(line).expect("a line is JSON"))
        .collect()
}

/// What an iteration is but for the clock.
fn without_clock(mut line: Value) -> Value {
    if let Some(line) = line.as_object_mut() {
        line.remove("seconds");
        line.remove("samples_per_second");
    }
    line
}

#[test]
fn a_run_is_trained_measured_and_recorded() {
    let bench = with_preset();
    let line = ["train", "sway.txt", "--preset", "small.json", "--json"];
    let output = bench.mimic(&line).assert().success();
    let printed = lines(&output.get_output().stdout);
    assert_eq!(printed.len(), 4, "512 samples in iterations of 128");
    let logged = std::fs::read(bench.path("runs/sway/metrics.jsonl")).unwrap_or_default();
    assert_eq!(printed, lines(&logged));
    for field in [
        "iteration",
        "samples",
        "samples_per_second",
        "seconds",
        "policy_loss",
        "value_loss",
        "approx_kl",
        "clip_fraction",
        "explained_variance",
        "learning_rate",
    ] {
        assert!(printed[0][field].is_number(), "{field}");
    }
    // Null where no episode ended.
    for field in ["return", "normalized_return", "episode_length"] {
        assert!(printed[0].get(field).is_some(), "{field}");
    }
    assert!(printed[0]["reward_terms"].is_object());
    for file in [
        "config.json",
        "checkpoint.safetensors",
        "policy.safetensors",
        "eval.json",
    ] {
        assert!(bench.path("runs/sway").join(file).is_file(), "{file}");
    }

    let eval = bench.json(&["eval", "sway", "--episodes", "2", "--seconds", "2"]);
    assert_eq!(eval["episodes"], 2);
    for field in [
        "survival",
        "success_mean_0_5",
        "success_max_0_25",
        "mpjpe_global_mm",
        "mpjpe_local_mm",
        "velocity_error_m_s",
        "com_error_m",
        "angular_momentum_error",
        "contact_f1",
        "foot_skate_m_s",
        "normalized_return",
        "root_rotation_turned_rad",
    ] {
        assert!(eval[field].is_number(), "{field}");
    }
    let shown = bench.json(&["replay", "--save", "sway.rrd"]);
    assert_eq!(shown["agent"], true);

    let said = bench.complaint(&["train", "sway.txt", "--out", "runs/sway"], 2);
    assert!(said.contains("holds a run already"), "{said}");
    let said = bench.complaint(&["train", "--resume", "sway"], 2);
    assert!(said.contains("finished"), "{said}");
    bench.mimic(&line).assert().success();
    assert!(
        bench.path("runs/sway-2/eval.json").is_file(),
        "a finished run is not overwritten"
    );
}

#[test]
fn a_run_that_is_stopped_goes_on_to_the_same_numbers() {
    let bench = with_preset();
    let train = |out: &str| {
        [
            "train",
            "sway.txt",
            "--preset",
            "small.json",
            "--samples",
            "5120",
            "--out",
            out,
        ]
        .map(String::from)
    };
    bench
        .mimic(&train("whole").each_ref().map(String::as_str))
        .assert()
        .success();
    let hurried: Vec<String> = train("cut")
        .into_iter()
        .chain(["--minutes".into(), "1e-9".into()])
        .collect();
    bench
        .mimic(&hurried.iter().map(String::as_str).collect::<Vec<_>>())
        .assert()
        .success();
    let read = |run: &str| {
        lines(&std::fs::read(bench.path(run).join("metrics.jsonl")).unwrap_or_default())
    };
    assert_eq!(read("cut").len(), 2, "stopped after the first round");
    bench
        .mimic(&["train", "--resume", "cut", "--threads", "1"])
        .assert()
        .success();
    let numbers = |run: &str| read(run).into_iter().map(without_clock).collect::<Vec<_>>();
    assert_eq!(numbers("cut"), numbers("whole"));
}

#[cfg(unix)]
#[test]
fn ctrl_c_saves_and_stops() {
    let bench = with_preset();
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("mimic"))
        .args([
            "train",
            "sway.txt",
            "--preset",
            "small.json",
            "--samples",
            "1000M",
            "--out",
            "run",
        ])
        .current_dir(bench.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let checkpoint = bench.path("run/checkpoint.safetensors");
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(60);
    while !checkpoint.exists() && std::time::Instant::now() < deadline {
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    let id = child.id().to_string();
    Command::new("kill")
        .args(["-INT", &id])
        .status()
        .expect("a signal can be sent");
    let status = child.wait().expect("the program ends");
    assert!(status.success());
    assert!(checkpoint.exists());
    let said = bench.complaint(&["train", "--resume", "nothing"], 2);
    assert!(said.contains("no run there"), "{said}");
}

#[test]
fn damaged_runs_are_named() {
    let bench = with_preset();
    bench
        .mimic(&[
            "train",
            "sway.txt",
            "--preset",
            "small.json",
            "--out",
            "run",
        ])
        .assert()
        .success();
    let policy = std::fs::read(bench.path("run/policy.safetensors")).expect("the policy is there");
    bench.write("run/policy.safetensors", &policy[..policy.len() / 2]);
    let said = bench.complaint(&["eval", "run"], 2);
    assert!(said.contains("policy.safetensors"), "{said}");
    bench.write("run/config.json", b"{");
    let said = bench.complaint(&["eval", "run"], 2);
    assert!(said.contains("config.json"), "{said}");
    bench.write("wrong.json", br#"{ "horizons": 3 }"#);
    let said = bench.complaint(&["train", "sway.txt", "--preset", "wrong.json"], 2);
    assert!(
        said.contains("wrong.json") && said.contains("horizons"),
        "{said}"
    );
}

#[test]
fn bench_has_the_fields_that_scripts_rely_on() {
    let bench = Workbench::new();
    let report = bench.json(&["bench", "--seconds", "0.05"]);
    for field in [
        "threads",
        "physics_steps_per_second",
        "env_steps_per_second",
        "train_samples_per_second",
        "control_hz",
        "physics_hz",
        "dof",
        "reference_frames_per_second",
        "retarget_frames_per_second",
    ] {
        assert!(report[field].as_f64() > Some(0.0), "{field}");
    }
    assert!(report["network"].is_array());
}
