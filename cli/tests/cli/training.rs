//! `train`, `eval`, `replay` of a run, `bench`.

mod bounds;
mod claims;
mod stopping;

use crate::workbench::Workbench;
use serde_json::Value;

/// A few iterations of a small network: enough to have a run, not to learn anything.
fn with_preset() -> Workbench {
    let bench = Workbench::with_clip();
    bench.write(
        "small.json",
        br#"{ "environments": 8, "group": 4, "horizon": 16, "round": 2, "samples": 512, "hidden": [16] }"#,
    );
    bench
}

/// A run of four iterations.
fn with_run() -> Workbench {
    let bench = with_preset();
    bench.mimic(&SMALL).assert().success();
    bench
}

const SMALL: [&str; 6] = [
    "train",
    "sway.txt",
    "--preset",
    "small.json",
    "--out",
    "run",
];

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
    let mut printed = lines(&output.get_output().stdout);
    let end = printed.pop().expect("a last line");
    assert_eq!(end["stopped"], "samples");
    assert_eq!(printed.len(), 4, "512 samples in iterations of 128");
    let logged = std::fs::read(bench.path("runs/sway/metrics.jsonl")).unwrap_or_default();
    let mut named = lines(&logged);
    for line in &mut named {
        line["run"] = "runs/sway".into();
    }
    assert_eq!(
        printed, named,
        "the log knows no place, for a run can be moved"
    );
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
    if cfg!(feature = "rerun") {
        let shown = bench.json(&["replay", "--save", "sway.rrd"]);
        assert_eq!(shown["agent"], true);
    }

    let said = bench.complaint(&["train", "sway.txt", "--out", "runs/sway"], 2);
    assert!(said.contains("already holds a run"), "{said}");
    bench.mimic(&line).assert().success();
    assert!(
        bench.path("runs/sway-2/eval.json").is_file(),
        "a finished run is not overwritten"
    );
}

#[test]
fn the_end_says_how_to_look_at_the_result() {
    let bench = with_preset();
    let output = bench.mimic(&SMALL).assert().success();
    let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    assert!(text.starts_with("run\n"), "{text}");
    if bench.path("run/replay.rrd").exists() {
        assert!(text.contains("rerun run/replay.rrd"), "{text}");
        assert!(text.contains("replay run --rerun"), "{text}");
    }
}

#[test]
fn other_options_leave_the_evaluation_of_the_run_alone() {
    let bench = with_run();
    let official = std::fs::read(bench.path("run/eval.json")).expect("it was evaluated");
    let line = ["eval", "run", "--episodes", "2", "--seconds", "2"];
    let short = bench.json(&line);
    assert_eq!(short["seconds"], 2.0, "the clip loops");
    let kept = std::fs::read(bench.path("run/eval.json")).expect("it is still there");
    assert_eq!(kept, official);

    let to = |out| [&line[..], &["--out", out]].concat();
    assert_eq!(bench.json(&to("made/short.json")), short);
    let written = std::fs::read(bench.path("made/short.json")).expect("it was asked for");
    assert_eq!(serde_json::from_slice::<Value>(&written).ok(), Some(short));
    for own in ["run/", "run/config.json"] {
        let said = bench.complaint(&to(own), 2);
        assert!(said.contains("belongs to the run"), "{said}");
    }
    bench.json(&to("run/eval-short.json"));
}

#[test]
fn a_run_that_cannot_be_written_is_measured_all_the_same() {
    let bench = with_run();
    std::fs::remove_file(bench.path("run/eval.json")).expect("it was evaluated");
    std::fs::create_dir(bench.path("run/eval.json")).expect("a folder can be made");
    let output = bench.mimic(&["eval", "run", "--json"]).assert().success();
    let output = output.get_output();
    assert_eq!(lines(&output.stdout)[0]["episodes"], 32);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        said.contains("eval.json") && said.contains("--out"),
        "{said}"
    );
}

#[test]
fn a_run_is_a_preset() {
    let bench = with_run();
    for (preset, out) in [("run/config.json", "a"), ("run", "b")] {
        let line = ["train", "sway.txt", "--preset", preset, "--out", out];
        bench.mimic(&line).assert().success();
        let config = |run: &str| std::fs::read(bench.path(run).join("config.json")).ok();
        assert_eq!(config(out), config("run"));
    }
    let said = bench.complaint(&["train", "sway.txt", "--preset", "absent"], 2);
    assert!(said.contains("no preset `absent`"), "{said}");
}

#[test]
fn a_wrong_setting_is_named_with_its_file() {
    let bench = with_preset();
    for (name, plan) in [
        ("group", r#"{ "group": 0 }"#),
        ("gamma", r#"{ "ppo": { "gamma": 3 } }"#),
        ("samples", r#"{ "samples": 0 }"#),
        ("horizons", r#"{ "horizons": 3 }"#),
        (
            "control_hz",
            r#"{ "task": { "physics": { "control_hz": 0 } } }"#,
        ),
    ] {
        bench.write("wrong.json", plan.as_bytes());
        let said = bench.complaint(&["train", "sway.txt", "--preset", "wrong.json"], 2);
        assert!(
            said.contains("`wrong.json`: ") && said.contains(name),
            "{said}"
        );
    }
    assert!(!bench.path("runs").exists());
}

#[test]
fn a_motion_of_one_frame_is_named() {
    let bench = with_preset();
    let whole = std::fs::read(bench.path("sway.txt")).expect("the clip is there");
    let mut clip: Value = serde_json::from_slice(&whole).expect("the clip is JSON");
    if let Some(frames) = clip["Frames"].as_array_mut() {
        frames.truncate(1);
    }
    bench.write("still.txt", clip.to_string().as_bytes());
    let line = ["train", "sway.txt", "still.txt", "--quiet"];
    let said = bench.complaint(&line, 2);
    assert!(said.contains("still.txt"), "{said}");
}

#[test]
fn a_first_run_is_called_the_first() {
    let bench = with_preset();
    std::fs::rename(bench.path("sway.txt"), bench.path("my sway.txt")).expect("a file moves");
    let line = [
        "train",
        "my sway.txt",
        "--preset",
        "small.json",
        "--verbose",
    ];
    for (run, is_second) in [("runs/my-sway", false), ("runs/my-sway-2", true)] {
        let output = bench.mimic(&line).assert().success();
        let said = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
        assert_eq!(said.contains("exists already"), is_second, "{said}");
        assert!(bench.path(run).exists());
    }
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

#[test]
fn a_published_preset_trains_on_its_character() {
    let bench = with_preset();
    let small = [
        "environments=8",
        "group=4",
        "horizon=16",
        "round=2",
        "samples=256",
        "hidden=[16]",
        "ppo.minibatch=64",
    ];
    for (preset, skeleton, observation, kernels) in [
        ("deepmimic", "humanoid", 193, "deepmimic-program"),
        ("deepmimic2018", "humanoid", 227, "deepmimic"),
        ("booth2020", "marathon", 258, "booth2020"),
    ] {
        let mut line = vec![
            "train", "sway.txt", "--preset", preset, "--out", preset, "--json",
        ];
        small.iter().for_each(|set| line.extend(["--set", set]));
        let output = bench.mimic(&line).assert().success();
        let terms = lines(&output.get_output().stdout)[0]["reward_terms"].clone();
        assert!(terms["end_effector"].as_f64() > Some(0.0), "{terms}");
        assert_eq!(terms.get("position"), None, "no term of other kernels");
        let text = std::fs::read_to_string(bench.path(preset).join("config.json"));
        let config: Value = serde_json::from_str(&text.expect("a config")).expect("is JSON");
        assert_eq!(config["skeleton"], skeleton);
        assert_eq!(config["plan"]["task"]["rewards"]["kernels"], kernels);
        assert_eq!(config["plan"]["hidden"], serde_json::json!([16]));
        let policy = std::fs::read(bench.path(preset).join("policy.safetensors"));
        let policy = String::from_utf8_lossy(&policy.expect("a policy")).into_owned();
        let first = format!("\"actor.0.weight\":{{\"dtype\":\"F32\",\"shape\":[{observation},16]");
        assert!(
            policy.contains(&first),
            "{preset} sees {observation} numbers"
        );
    }
}

#[test]
fn a_wrong_change_names_what_is_near() {
    let bench = with_preset();
    let said = |change: &str| {
        let line = ["train", "sway.txt", "--set", change];
        bench.complaint(&line, 2)
    };
    let wrong = said("task.termination.distance=1");
    assert!(wrong.contains("`task.terminations.distance`"), "{wrong}");
    assert!(
        said("ppo.gamma=3").contains("`ppo.gamma`: 3 is not allowed; give a number from 0 to 1")
    );
    let wrong = said("task.rewards.kernels=deepmimic");
    assert!(wrong.contains("`position`"), "{wrong}");
    assert!(said("task.rewards.kernels=mine").contains("the present one, \"tracking\""));
    assert!(!bench.path("runs").exists());
}

#[test]
fn curves_are_drawn_of_several_runs() {
    let bench = with_run();
    let other = [
        "train", "sway.txt", "--preset", "run", "--seed", "2", "--out", "other",
    ];
    bench.mimic(&other).assert().success();
    let report = bench.json(&["plot", "run", "other", "--out", "both.svg"]);
    assert_eq!(report["plot"], "both.svg");
    for (run, name) in [(0, "run"), (1, "other")] {
        let run = &report["runs"][run];
        assert_eq!(run["name"], name);
        assert_eq!(run["samples"], serde_json::json!([128, 256, 384, 512]));
        assert_eq!(run["value_loss"].as_array().map(Vec::len), Some(4));
        assert!(run["evaluation"]["survival"].is_number());
    }
    let drawn = std::fs::read_to_string(bench.path("both.svg")).expect("a drawing");
    for text in [">run<", ">other<", "policy loss", "evaluation: survival"] {
        assert!(drawn.contains(text), "{text}");
    }
    bench
        .mimic(&["plot", "run", "--smooth", "1"])
        .assert()
        .success();
    assert!(bench.path("run.svg").exists());
}

#[test]
fn a_run_that_cannot_be_drawn_is_named() {
    let bench = with_run();
    let said = bench.complaint(&["plot", "absent"], 2);
    assert!(said.contains("absent"), "{said}");
    bench.write("run/metrics.jsonl", b"{\"samples\": 1}\nnothing\n");
    let said = bench.complaint(&["plot", "run"], 2);
    assert!(
        said.contains("metrics.jsonl") && said.contains("line 2"),
        "{said}"
    );
    bench.write("run/metrics.jsonl", b"");
    let said = bench.complaint(&["plot", "run"], 2);
    assert!(said.contains("train longer"), "{said}");
    std::fs::remove_file(bench.path("run/metrics.jsonl")).expect("it was written");
    bench.complaint(&["plot", "run"], 2);
}
