//! What was found by attacking the program: files that never end, numbers without a next one, and files of others in the way.

use crate::workbench::Workbench;
use serde_json::Value;

/// A number so large that the next mark of an axis is the same number.
#[test]
fn a_drawing_of_any_numbers_ends() {
    let bench = Workbench::with_run();
    let most = "1.7976931348623157e308";
    for (samples, size) in [
        ("1", "1e17"),
        ("1", "1e308"),
        ("1", "-1e300"),
        (most, "1"),
        (most, most),
    ] {
        let line =
            format!("{{\"iteration\":1,\"samples\":{samples},\"normalized_return\":{size}}}\n");
        bench.write("runs/sway/metrics.jsonl", line.repeat(2).as_bytes());
        bench.write(
            "runs/sway/eval.json",
            format!("{{\"survival\":{size}}}").as_bytes(),
        );
        let plot = ["plot", "sway", "--out", "curves.svg", "--force"];
        // Whether it can be drawn or not, it ends.
        let mut program = bench.mimic(&plot);
        let output = program.timeout(std::time::Duration::from_secs(20));
        let code = output.assert().get_output().status.code();
        assert!(matches!(code, Some(0 | 2)), "{size}: {code:?}");
    }
}

#[cfg(unix)]
#[test]
fn runs_are_listed_whatever_their_files_are() {
    let bench = Workbench::with_run();
    for file in ["eval.json", "metrics.jsonl"] {
        let path = bench.path("runs/sway").join(file);
        let whole = std::fs::read(&path).expect("it is there");
        std::fs::remove_file(&path).expect("removed");
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.is_ok_and(|status| status.success()));
        let mut program = bench.mimic(&["runs"]);
        let output = program.timeout(std::time::Duration::from_secs(20));
        output.assert().success();
        std::fs::remove_file(&path).expect("removed");
        std::fs::write(&path, whole).expect("written");
    }
}

/// What only looks like ours, or was left by nobody, stays.
#[test]
fn files_of_others_stay_where_a_run_is_refused_or_made() {
    let bench = Workbench::with_run();
    let lock = std::fs::read(bench.path("runs/sway/.mimic.lock")).expect("it is there");
    std::fs::create_dir(bench.path("mine")).expect("a folder");
    let train = |more: &[&str], code| {
        let line = [
            "train",
            "sway.txt",
            "--preset",
            "tiny.json",
            "--out",
            "mine",
        ];
        bench.mimic(&[&line[..], more].concat()).assert().code(code);
    };
    for name in ["mine/.mimic-notes", "mine/.mimic-99999-config"] {
        bench.write(name, b"precious");
        train(&[], 2);
        std::fs::rename(bench.path(name), bench.path("notes")).expect("it stayed");
    }
    bench.write("mine/.mimic.lock", &lock);
    bench.write("mine/skeleton.xml", b"<mujoco/>");
    train(&["--set", "ppo.gamma=5"], 2);
    let kept = std::fs::read(bench.path("mine/skeleton.xml")).expect("it stayed");
    assert_eq!(kept, b"<mujoco/>");
}

#[cfg(unix)]
#[test]
fn a_resumed_run_writes_into_its_own_folder_alone() {
    let bench = Workbench::with_run();
    let more = |text: Vec<u8>| {
        let mut config: Value = serde_json::from_slice(&text).expect("it is JSON");
        config["plan"]["samples"] = 64.into();
        config.to_string()
    };
    let config = std::fs::read(bench.path("runs/sway/config.json")).expect("it is there");
    bench.write("runs/sway/config.json", more(config).as_bytes());
    let resume = ["train", "--resume", "sway"];
    let at = |name: &str| bench.path("runs/sway").join(name);
    // A link that leads nowhere.
    std::fs::rename(at("metrics.jsonl"), bench.path("kept")).expect("moved");
    std::os::unix::fs::symlink(bench.path("victim"), at("metrics.jsonl")).expect("a link");
    bench.complaint(&resume, 2);
    assert!(!bench.path("victim").exists());
    std::fs::rename(bench.path("kept"), at("metrics.jsonl")).expect("moved back");
    // Another file's second name.
    bench.write("precious", b"precious");
    std::fs::remove_file(at(".mimic.lock")).expect("removed");
    std::fs::hard_link(bench.path("precious"), at(".mimic.lock")).expect("a link");
    let said = bench.complaint(&resume, 2);
    assert!(said.contains(".mimic.lock"), "{said}");
    let kept = std::fs::read(bench.path("precious")).expect("it is there");
    assert_eq!(kept, b"precious");
    std::fs::remove_file(at(".mimic.lock")).expect("removed");
    // What was learned isn't replaced by a beginning.
    let policy = std::fs::read(at("policy.safetensors")).expect("it is there");
    std::fs::rename(at("checkpoint.safetensors"), bench.path("kept")).expect("moved");
    let said = bench.complaint(&resume, 2);
    assert!(said.contains("checkpoint.safetensors"), "{said}");
    assert_eq!(std::fs::read(at("policy.safetensors")).ok(), Some(policy));
    std::fs::rename(bench.path("kept"), at("checkpoint.safetensors")).expect("moved back");
    bench.mimic(&resume).assert().success();
}

#[test]
fn a_moment_is_no_evaluation() {
    let bench = Workbench::with_run();
    let said = bench.complaint(&["eval", "sway", "--seconds", "1e-4"], 2);
    assert!(said.contains("at least 1 s"), "{said}");
}
