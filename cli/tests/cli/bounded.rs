//! Files that ask for too much, are damaged, or are at fault: one line, at once, about the right file.

use crate::workbench::Workbench;
use serde_json::Value;

/// A file of tensors with other metadata.
fn with_metadata(bytes: &[u8], change: impl Fn(&mut Value)) -> Vec<u8> {
    let (length, rest) = bytes.split_first_chunk::<8>().expect("a header");
    let (header, tensors) = rest.split_at(u64::from_le_bytes(*length) as usize);
    let mut header: Value = serde_json::from_slice(header).expect("it is JSON");
    let metadata = &mut header["__metadata__"]["mimic"];
    let mut ours: Value = serde_json::from_str(metadata.as_str().expect("a text")).expect("JSON");
    change(&mut ours);
    *metadata = ours.to_string().into();
    let header = header.to_string();
    [
        &(header.len() as u64).to_le_bytes(),
        header.as_bytes(),
        tensors,
    ]
    .concat()
}

/// A file of tensors whose tensor `name`, of doubles, begins with another number.
fn with_number(bytes: &[u8], name: &str, number: f64) -> Vec<u8> {
    let length = u64::from_le_bytes(*bytes.first_chunk().expect("a header")) as usize;
    let header: Value = serde_json::from_slice(&bytes[8..8 + length]).expect("it is JSON");
    let at = header[name]["data_offsets"][0]
        .as_u64()
        .expect("it is there") as usize;
    let mut changed = bytes.to_vec();
    changed[8 + length + at..][..8].copy_from_slice(&number.to_le_bytes());
    changed
}

/// Rates and durations that would fill any memory, from files, flags and edits: one line, at once.
#[test]
fn rates_and_lengths_are_bounded() {
    let bench = Workbench::with_run();
    for line in [["import", "sway.txt"], ["retarget", "sway.txt"]] {
        bench.mimic(&line).assert().success();
    }
    let read = |name: &str| std::fs::read(bench.path(name)).expect("it is there");
    let (clip, motion) = (read("sway.clip"), read("sway.motion"));
    let begun = std::time::Instant::now();
    for fps in [1e-300, 1e-20, 1e-9, 1e-3, 0.05, 2e4] {
        let slow = |bytes: &[u8]| with_metadata(bytes, |ours| ours["fps"] = fps.into());
        bench.write("slow.clip", &slow(&clip));
        bench.write("slow.motion", &slow(&motion));
        bench.write("runs/sway/reference-0.motion", &slow(&motion));
        let own = "runs/sway/reference-0.motion";
        for (file, line) in [
            ("slow.clip", &["info", "slow.clip"][..]),
            (
                "slow.clip",
                &["edit", "slow.clip", "--speed", "2", "--out", "x.clip"],
            ),
            ("slow.clip", &["retarget", "slow.clip"]),
            ("slow.motion", &["tracks", "slow.motion"]),
            (
                "slow.motion",
                &["train", "slow.motion", "--preset", "tiny.json"],
            ),
            (own, &["eval", "sway"]),
            (own, &["train", "--resume", "sway"]),
        ] {
            let message = bench.error_about(file, line, 2)["message"].to_string();
            assert!(message.contains("fps"), "{message}");
        }
        let fps = fps.to_string();
        bench.error(&["import", "sway.txt", "--fps", &fps], 2);
    }
    for (edit, value) in [
        ("--speed", "0.0001"),
        ("--warp", "0:0,1:1e5"),
        ("--warp", "0:0,1:1e-320"),
    ] {
        bench.error(&["edit", "sway.clip", edit, value, "--out", "x.clip"], 2);
    }
    // Frames that last for minutes.
    let sway: Value = serde_json::from_slice(&read("sway.txt")).expect("it is JSON");
    for (seconds, verb) in [(1e6, "import"), (1e3, "retarget"), (45.0, "train")] {
        let mut long = sway.clone();
        let frames = long["Frames"].as_array_mut().expect("frames");
        frames
            .iter_mut()
            .for_each(|frame| frame[0] = seconds.into());
        bench.write("long.txt", long.to_string().as_bytes());
        let line = match verb {
            "train" => vec![
                verb,
                "long.txt",
                "--fps",
                "0.5",
                "--preset",
                "tiny.json",
                "--quiet",
            ],
            _ => vec![verb, "long.txt", "--fps", "0.5"],
        };
        let message = bench.error(&line, 2)["message"].to_string();
        assert!(
            message.contains("lasts") || message.contains("too many"),
            "{message}"
        );
        assert!(!bench.path("runs/long").exists());
    }
    assert!(begun.elapsed().as_secs() < 60);
}

/// Numbers that are finite, but that no simulation can bear.
#[test]
fn motions_at_the_end_of_the_world_are_refused() {
    let bench = Workbench::with_clip();
    bench.mimic(&["retarget", "sway.txt"]).assert().success();
    bench.write("tiny.json", crate::workbench::TINY);
    let motion = std::fs::read(bench.path("sway.motion")).expect("it is there");
    for (tensor, number) in [
        ("qpos", 1e12),
        ("qpos", -1e300),
        ("qvel", 1e38),
        ("qvel", -1e6),
    ] {
        bench.write("far.motion", &with_number(&motion, tensor, number));
        let line = ["train", "far.motion", "--preset", "tiny.json"];
        let message = bench.error_about("far.motion", &line, 2)["message"].to_string();
        assert!(message.contains(tensor), "{message}");
    }
    let far = with_metadata(&motion, |ours| {
        ours["cycle"]["translation"][0] = 1e30.into();
    });
    bench.write("far.motion", &far);
    bench.error_about("far.motion", &["tracks", "far.motion"], 2);
}

/// A motion that lasts too long to be evaluated isn't learned first.
#[test]
fn what_can_not_be_evaluated_is_not_learned() {
    let bench = Workbench::with_clip();
    bench.write("tiny.json", crate::workbench::TINY);
    let text = std::fs::read(bench.path("sway.txt")).expect("it is there");
    let mut long: Value = serde_json::from_slice(&text).expect("it is JSON");
    long["Loop"] = "none".into();
    let frames = long["Frames"].as_array_mut().expect("frames");
    frames.iter_mut().for_each(|frame| frame[0] = 20.0.into());
    bench.write("long.txt", long.to_string().as_bytes());
    let line = ["train", "long.txt", "--fps", "1", "--preset", "tiny.json"];
    let error = bench.error(&line, 2);
    assert!(
        error["message"].to_string().contains("`long` lasts 600 s"),
        "{error}"
    );
    assert!(error["remedy"].to_string().contains("--trim"), "{error}");
    assert!(!bench.path("runs").exists());
    let part = [&line[..], &["--trim", "0..60"]].concat();
    bench.mimic(&part).assert().success();
}

/// All commands take the same evaluations for none.
#[test]
fn a_damaged_evaluation_is_made_again() {
    let bench = Workbench::with_run();
    let path = bench.path("runs/sway/eval.json");
    let whole = std::fs::read(&path).expect("it was evaluated");
    for text in [
        "",
        "[",
        "{}",
        "\"x\"",
        "[{}]",
        r#"{"survival": 1e400}"#,
        r#"{"survival": 1e308}"#,
        r#"{"motions": [{}]}"#,
    ] {
        bench.write("runs/sway/eval.json", text.as_bytes());
        let run = bench.json(&["runs"])["runs"][0].clone();
        assert_eq!(run["state"], "stopped", "{text}");
        assert_eq!(run["survival"], Value::Null, "{text}");
        bench.error_about("runs/sway/eval.json", &["plot", "sway"], 2);
        bench
            .mimic(&["train", "--resume", "sway"])
            .assert()
            .success();
        assert_eq!(std::fs::read(&path).ok(), Some(whole.clone()), "{text}");
    }
}

/// A list in a file that is read takes no more memory than the file has.
#[cfg(target_os = "linux")]
#[test]
fn files_of_a_run_are_read_in_little_memory() {
    let bench = Workbench::with_run();
    let many = |one: &str| one.repeat(600_000);
    let list = format!("[{}0]", many("{\"a\":0},"));
    let log = std::fs::read(bench.path("runs/sway/metrics.jsonl")).expect("it is there");
    for (file, text, lines) in [
        (
            "metrics.jsonl",
            many("{}\n"),
            &["plot sway", "plot sway --json"][..],
        ),
        (
            "metrics.jsonl",
            format!("{{\"q\":{list}}}\n"),
            &["plot sway"],
        ),
        ("eval.json", list.clone(), &["plot sway", "runs"]),
        (
            "eval.json",
            format!("{{\"survival\":1,\"q\":{list}}}"),
            &["plot sway", "runs"],
        ),
        (
            "eval.json",
            format!("{{\"motions\":{list}}}"),
            &["plot sway", "runs"],
        ),
        (
            "config.json",
            format!(
                "{{\"plan\":{{\"task\":{{\"actions\":{{\"kind\":\"residual\",\"q\":{}}}}}}}}}",
                &list[..900_000]
            ),
            &[
                "runs",
                "eval sway",
                "train sway.txt --preset runs/sway/config.json",
            ],
        ),
    ] {
        let path = bench.path("runs/sway").join(file);
        let whole = std::fs::read(&path).expect("it is there");
        std::fs::write(&path, text).expect("written");
        for line in lines {
            let program = assert_cmd::cargo::cargo_bin("mimic");
            // Memory for the program and its threads, and some times the file.
            let script = format!(
                "ulimit -v 700000; exec '{}' {line} --quiet",
                program.display()
            );
            let output = std::process::Command::new("sh")
                .args(["-c", &script])
                .current_dir(bench.path("."))
                .env("RAYON_NUM_THREADS", "2")
                .output()
                .expect("it runs");
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(
                matches!(output.status.code(), Some(0 | 2)),
                "{file}, {line}: {said}"
            );
        }
        std::fs::write(&path, whole).expect("written");
    }
    let kept = std::fs::read(bench.path("runs/sway/metrics.jsonl"));
    assert_eq!(kept.ok(), Some(log));
}

/// The same in every object of settings, wherever it comes from.
#[test]
fn misspelt_settings_are_refused_in_objects_of_a_kind() {
    let bench = Workbench::with_run();
    let config = std::fs::read(bench.path("runs/sway/config.json")).expect("it is there");
    for (actions, wrong) in [
        (r#"{"kind":"residual","scale":0.3,"scael":9}"#, "scael"),
        (r#"{"kind":"absolute","reach":1,"scale":0.3}"#, "scale"),
        (r#"{"kind":"residual","scale":0.3,"reach":1}"#, "reach"),
        (r#"{"kind":"from-rest","reach":1,"":0}"#, "unknown field"),
        (r#"{"kind":"residual"}"#, "scale"),
    ] {
        let set = format!("task.actions={actions}");
        let said = bench.complaint(&["train", "sway.txt", "--set", &set], 2);
        assert!(said.contains(wrong), "{said}");
        let plan = format!(r#"{{"task": {{"kind": "imitate", "actions": {actions}}}}}"#);
        bench.write("plan.json", plan.as_bytes());
        let said = bench.complaint(&["train", "sway.txt", "--preset", "plan.json"], 2);
        assert!(said.contains(wrong) && said.contains("plan.json"), "{said}");
        let mut run: Value = serde_json::from_slice(&config).expect("it is JSON");
        run["plan"]["task"]["actions"] = serde_json::from_str(actions).expect("it is JSON");
        bench.write("runs/sway/config.json", run.to_string().as_bytes());
        let said = bench.complaint(&["eval", "sway"], 2);
        assert!(
            said.contains(wrong) && said.contains("config.json"),
            "{said}"
        );
    }
}

/// A message blames the file that is at fault.
#[test]
fn the_file_at_fault_is_blamed() {
    let bench = Workbench::with_run();
    let line = ["train", "sway.txt", "--preset", "tiny.json"];
    let set = |setting| [&line[..], &["--set", setting]].concat();
    let said = bench.complaint(&set("ppo.gamma=5"), 2);
    assert!(
        said.contains("`ppo.gamma`") && !said.contains("tiny.json"),
        "{said}"
    );
    bench.write("wrong.json", br#"{ "ppo": { "gamma": 5 } }"#);
    let own = ["train", "sway.txt", "--preset", "wrong.json"];
    bench.error_about("wrong.json", &own, 2);
    // Numbers of a checkpoint that aren't any.
    let path = bench.path("runs/sway/checkpoint.safetensors");
    let whole = std::fs::read(&path).expect("it was saved");
    for (tensor, number) in [("learning_rate", f64::NAN), ("value_scale", f64::INFINITY)] {
        std::fs::write(&path, with_number(&whole, tensor, number)).expect("written");
        let resume = ["train", "--resume", "sway"];
        let error = bench.error_about("runs/sway/checkpoint.safetensors", &resume, 2);
        assert!(error["message"].to_string().contains(tensor), "{error}");
    }
    let error = bench.error(&["import", "sway.txt", "--unit", "1e300"], 2);
    assert!(error["remedy"].to_string().contains("--unit"), "{error}");
    // A run without its configuration isn't what was meant.
    std::fs::remove_file(bench.path("runs/sway/config.json")).expect("removed");
    let said = bench.complaint(&["train", "sway.txt", "--preset", "sway"], 2);
    assert!(!said.contains("did you mean `sway`"), "{said}");
}

#[cfg(unix)]
#[test]
fn what_is_in_the_way_of_a_result_is_named_and_nothing_is_left() {
    let bench = Workbench::with_clip();
    let made = std::process::Command::new("mkfifo")
        .arg(bench.path("pipe"))
        .status();
    assert!(made.is_ok_and(|status| status.success()));
    std::os::unix::fs::symlink("nowhere", bench.path("link")).expect("a link");
    for place in ["pipe", "link", "sway.txt"] {
        let out = format!("{place}/");
        let error = bench.error(&["import", "sway.txt", "--out", &out], 2);
        assert!(error["file"].to_string().contains(place), "{error}");
        bench.error(
            &[
                "import",
                "sway.txt",
                "--out",
                &format!("{place}/new/x.clip"),
            ],
            2,
        );
        bench.error(&["man", "--out", place], 2);
    }
    bench.error(&["import", "sway.txt", "--out", "new/deep/x.bvh"], 2);
    assert!(!bench.path("new").exists());
}

/// What a character's file has that can't be simulated is told with the file, before anything is learned.
#[test]
fn a_character_that_can_not_be_simulated_is_named_by_its_file() {
    let bench = Workbench::with_clip();
    bench.write("tiny.json", crate::workbench::TINY);
    let skeletons = concat!(env!("CARGO_MANIFEST_DIR"), "/../skeletons");
    let read = |name: &str| std::fs::read_to_string(format!("{skeletons}/{name}"));
    let xml = read("humanoid.xml").expect("it is there");
    let slide = xml.replacen("type=\"hinge\"", "type=\"slide\"", 1);
    let slide = match slide == xml {
        true => xml.replacen(
            "<joint name=\"right_elbow\"",
            "<joint type=\"slide\" name=\"right_elbow\"",
            1,
        ),
        false => slide,
    };
    assert_ne!(slide, xml);
    bench.write("slide.xml", slide.as_bytes());
    bench.write(
        "slide.json",
        read("humanoid.json").expect("it is there").as_bytes(),
    );
    let line = [
        "train",
        "sway.txt",
        "--skeleton",
        "slide.xml",
        "--preset",
        "tiny.json",
    ];
    let error = bench.error_about("slide.xml", &line, 2);
    assert!(error["message"].to_string().contains("slide"), "{error}");
    assert!(!bench.path("runs").exists());
}

/// The environment asks for no more threads than a flag may.
#[test]
fn threads_of_the_environment_are_bounded() {
    let bench = Workbench::with_run();
    for line in [
        &["eval", "sway", "--episodes", "1", "--seconds", "1"][..],
        &["retarget", "sway.txt"],
    ] {
        let begun = std::time::Instant::now();
        bench
            .mimic(line)
            .env("RAYON_NUM_THREADS", "30000")
            .assert()
            .success();
        assert!(begun.elapsed().as_secs() < 10, "{line:?}");
    }
}
