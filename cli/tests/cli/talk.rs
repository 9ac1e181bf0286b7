//! How much is said, and in what form.

use crate::workbench::Workbench;
use serde_json::Value;

/// A clip that is told to loop although its end is far from its start.
fn with_gap() -> Workbench {
    let bench = Workbench::with_clip();
    let text = std::fs::read_to_string(bench.path("sway.txt")).expect("the clip is there");
    let mut clip: Value = serde_json::from_str(&text).expect("it is JSON");
    // The left knee bends more and more.
    for (number, frame) in clip["Frames"]
        .as_array_mut()
        .into_iter()
        .flatten()
        .enumerate()
    {
        frame[31] = (-0.1 - 0.04 * number as f64).into();
    }
    bench.write("gap.txt", clip.to_string().as_bytes());
    bench
}

fn talk(bench: &Workbench, line: &[&str]) -> String {
    let output = bench.mimic(line).assert().success();
    String::from_utf8_lossy(&output.get_output().stderr).into_owned()
}

#[test]
fn what_retargeting_finds_is_said_once() {
    let bench = with_gap();
    let said = talk(&bench, &["retarget", "gap.txt"]);
    assert_eq!(said.matches("[loop-gap]").count(), 1, "{said}");
    assert!(
        said.contains("(`--loop clamp`) [loop-gap]"),
        "the flag that decides otherwise: {said}"
    );
    let report = bench.json(&["retarget", "gap.txt"]);
    let problems = report["problems"].as_array().into_iter().flatten();
    let ids: Vec<_> = problems.filter(|p| p["severity"] != "note").collect();
    assert_eq!(said.lines().count(), ids.len(), "{said} for {ids:?}");
}

#[test]
fn what_is_found_in_several_files_is_said_once_with_a_count() {
    let bench = with_gap();
    let gap = std::fs::read(bench.path("gap.txt")).expect("it was written");
    bench.write("gap2.txt", &gap);
    bench.write("gap3.txt", &gap);
    let tiny = br#"{ "environments": 4, "group": 4, "horizon": 8, "round": 1, "samples": 32, "hidden": [8] }"#;
    bench.write("tiny.json", tiny);
    let said = talk(
        &bench,
        &[
            "train",
            "gap.txt",
            "gap2.txt",
            "gap3.txt",
            "--preset",
            "tiny.json",
        ],
    );
    let gaps: Vec<&str> = said
        .lines()
        .filter(|line| line.contains("[loop-gap]"))
        .collect();
    assert_eq!(gaps.len(), 1, "{said}");
    assert!(gaps[0].contains("`gap.txt`: "), "{said}");
    assert!(
        gaps[0].ends_with("[loop-gap], and 2 more like it"),
        "{said}"
    );
}

#[test]
fn quiet_says_results_and_errors_alone() {
    let bench = with_gap();
    let output = bench
        .mimic(&["retarget", "gap.txt", "--quiet"])
        .assert()
        .success();
    assert!(output.get_output().stderr.is_empty());
    assert!(!output.get_output().stdout.is_empty());
    let said = bench.complaint(&["retarget", "nothing.txt", "--quiet"], 2);
    assert!(said.starts_with("error: `nothing.txt`"), "{said}");
    bench
        .mimic(&["info", "gap.txt", "--quiet", "--verbose"])
        .assert()
        .code(2);
}

/// What `mimic` says at a terminal, which `script` plays; `None` where there is no `script`.
#[cfg(target_os = "linux")]
fn at_a_terminal(bench: &Workbench, no_color: &str) -> Option<String> {
    let program = assert_cmd::cargo::cargo_bin("mimic");
    let command = format!("'{}' info nothing.fbx", program.display());
    let output = std::process::Command::new("script")
        .args(["-qec", &command, "/dev/null"])
        .env("NO_COLOR", no_color)
        .current_dir(bench.path("."))
        .stdin(std::process::Stdio::null())
        .output()
        .ok()?;
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

#[cfg(target_os = "linux")]
#[test]
fn colours_are_for_terminals_without_no_color() {
    let bench = Workbench::new();
    let (Some(coloured), Some(plain)) = (at_a_terminal(&bench, ""), at_a_terminal(&bench, "1"))
    else {
        mimic_test_support::skip("no `script` program to play a terminal");
        return;
    };
    assert!(coloured.contains("\x1b[31;1merror:"), "{coloured}");
    assert!(
        plain.contains("error: `nothing.fbx`") && !plain.contains('\x1b'),
        "{plain}"
    );
}

#[test]
fn completions_and_manual_are_json_too() {
    let bench = Workbench::new();
    for (line, word) in [
        (&["completions", "bash"][..], "complete "),
        (&["man"], ".TH"),
    ] {
        let text = bench.json(line)["text"].as_str().map(str::to_owned);
        assert!(text.is_some_and(|text| text.contains(word)), "{line:?}");
    }
    let pages = bench.json(&["man", "--out", "man"]);
    assert_eq!(pages["pages"][0], "man/mimic.1");
}

#[test]
fn files_are_named_once_with_a_remedy() {
    let bench = Workbench::with_clip();
    bench.mimic(&["retarget", "sway.txt"]).assert().success();
    let motion = std::fs::read(bench.path("sway.motion")).expect("the motion is there");
    bench.write("cut.motion", &motion[..motion.len() / 2]);
    bench.write("broken.xml", b"<mujoco><worldbody>");
    bench.write("list.json", b"[]");
    for (line, file) in [
        (&["tracks", "cut.motion"][..], "cut.motion"),
        (&["retarget", "sway.txt", "--skeleton", "no.xml"], "no.xml"),
        (
            &["retarget", "sway.txt", "--skeleton", "broken.xml"],
            "broken.xml",
        ),
        (&["retarget", "sway.txt", "--map", "no.json"], "no.json"),
    ] {
        bench.error_about(file, line, 2);
    }
    let said = bench.complaint(&["retarget", "sway.txt", "--skeleton", "giant"], 2);
    assert_eq!(said.matches("giant").count(), 1, "{said}");
    let said = bench.complaint(&["retarget", "sway.txt", "--map", "list.json"], 2);
    assert!(
        said.contains("`list.json`: the joint map isn't a JSON object"),
        "{said}"
    );
}

/// Whoever runs the tests may be allowed to write anywhere, but not in the system's own view of itself.
#[cfg(target_os = "linux")]
#[test]
fn no_message_has_the_name_of_a_temporary_file() {
    let bench = Workbench::with_clip();
    for line in [
        &["import", "sway.txt", "--out", "/proc/sway.clip"][..],
        &["retarget", "sway.txt", "--out", "/proc/sway.motion"],
        &["tracks", "sway.txt", "--csv", "/proc/sway.csv"],
        &["tracks", "sway.txt", "--plot", "/proc/sway.svg"],
        &["info", "sway.txt", "--write-map", "/proc/map.json"],
        #[cfg(feature = "rerun")]
        &["replay", "sway.txt", "--save", "/proc/sway.rrd"],
    ] {
        let error = bench.error_about(line[3], line, 1);
        let message = error["message"].as_str().unwrap_or_default();
        assert!(message.contains("cannot be written ("), "{message}");
        assert!(
            message.contains("(os error "),
            "the system's reason: {message}"
        );
        assert!(!message.contains(".mimic-"), "{message}");
    }
}

#[test]
fn what_cannot_be_written_is_named_once_with_a_remedy() {
    let bench = Workbench::with_clip();
    std::fs::create_dir_all(bench.path("taken/sway.clip/in")).expect("folders can be made");
    std::fs::create_dir_all(bench.path("taken/sway.motion/in")).expect("folders can be made");
    for (verb, file) in [
        ("import", "taken/sway.clip"),
        ("retarget", "taken/sway.motion"),
    ] {
        let error = bench.error_about(file, &[verb, "sway.txt", "--out", "taken/"], 2);
        let message = error["message"].as_str().unwrap_or_default();
        assert!(message.contains("this is a folder"), "{message}");
    }
}

#[test]
fn a_failed_retarget_leaves_no_folder() {
    let bench = Workbench::with_clip();
    bench.write("empty.fbx", b"");
    bench.complaint(&["retarget", "empty.fbx", "--out", "made/"], 2);
    assert!(!bench.path("made").exists());
    bench.complaint(&["retarget", "sway.txt", "--out", "sway.txt"], 2);
}
