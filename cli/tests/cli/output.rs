//! Results on standard output, talk on standard error, and little of that when nobody watches.

use crate::workbench::Workbench;
use std::io::Read;
use std::process::{Command, Stdio};

#[test]
fn piped_output_is_quiet() {
    let bench = Workbench::with_clip();
    let output = bench.mimic(&["import", "sway.txt"]).assert().success();
    let output = output.get_output();
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        text.starts_with("sway.clip: 31 frames at 30.0 Hz"),
        "{text}"
    );
    assert!(!text.contains('\x1b'), "no colours in a pipe");
}

#[test]
fn info_has_the_fields_that_scripts_rely_on() {
    let bench = Workbench::with_clip();
    let info = bench.json(&["info", "sway.txt"]);
    assert_eq!(info["file"], "sway.txt");
    assert_eq!(info["format"], "deepmimic");
    assert_eq!(info["takes"][0]["frames"], 31);
    assert_eq!(info["takes"][0]["fps"], 30.0);
    let duration = info["takes"][0]["duration_s"].as_f64().unwrap_or(0.0);
    assert!((duration - 1.0).abs() < 1e-9, "30 frames of 1/30 s");
    assert_eq!(info["up_axis"], "+Y");
    assert_eq!(info["unit_m"], 1.0);
    assert!(info["problems"].is_array());
    let joints: Vec<_> = info["joints"].as_array().into_iter().flatten().collect();
    assert_eq!(joints.len(), 15);
    let map: Vec<_> = info["map"].as_array().into_iter().flatten().collect();
    let knee = map.iter().find(|row| row["slot"] == "left-lower-leg");
    let knee = knee.expect("the left knee is in the map");
    assert_eq!(knee["joint"], "left_knee");
    assert!(knee["confidence"].as_f64() > Some(0.5));
    assert!(knee["reason"].as_str().is_some_and(|r| !r.is_empty()));
}

#[test]
fn import_has_the_fields_that_scripts_rely_on() {
    let bench = Workbench::with_clip();
    let import = bench.json(&["import", "sway.txt", "--fps", "60", "--out", "made/"]);
    assert_eq!(import["clip"], "made/sway.clip");
    assert_eq!(import["fps"], 60.0);
    assert_eq!(import["frames"], 61);
    assert_eq!(import["duration_s"], 1.0);
    assert_eq!(import["joints"], 15);
    assert_eq!(import["loop"], "wrap");
    assert!(import["problems"].is_array());
    let info = bench.json(&["info", "made/sway.clip"]);
    assert_eq!(info["takes"][0]["frames"], 61);
}

#[test]
fn several_files_go_into_a_folder() {
    let bench = Workbench::with_clip();
    std::fs::copy(bench.path("sway.txt"), bench.path("swing.txt")).expect("a file can be copied");
    let said = bench.complaint(&["import", "sway.txt", "swing.txt", "--out", "one.clip"], 2);
    assert!(said.contains("`--out one/`"), "{said}");
    let import = bench.json(&["import", "sway.txt", "swing.txt", "--out", "made/"]);
    assert_eq!(import["clips"].as_array().map(Vec::len), Some(2));
    assert!(bench.path("made/sway.clip").exists() && bench.path("made/swing.clip").exists());
}

#[test]
fn the_files_that_can_be_read_are_imported_whatever_the_others_are() {
    let bench = Workbench::with_clip();
    bench.write("empty.fbx", b"");
    let output = bench
        .mimic(&["import", "empty.fbx", "sway.txt"])
        .assert()
        .code(2);
    let said = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
    assert!(
        said.contains("empty.fbx") && said.contains("1 of 2"),
        "{said}"
    );
    assert!(bench.path("sway.clip").exists());
}

#[test]
fn inputs_are_found_by_name_in_the_library() {
    let bench = Workbench::with_clip();
    bench
        .mimic(&["import", "sway.txt", "--out", "shelf/"])
        .assert()
        .success();
    std::fs::remove_file(bench.path("sway.txt")).expect("a file can be removed");
    let info = bench.json(&["info", "sway", "--library", "shelf"]);
    assert_eq!(info["file"], "shelf/sway.clip");
    bench
        .mimic(&["info", "sway"])
        .env("MIMIC_LIBRARY", "shelf")
        .assert()
        .success();
    let said = bench.complaint(&["info", "swing", "--library", "shelf"], 2);
    assert!(said.contains("a name from the library: sway"), "{said}");
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let bench = Workbench::new();
    let program = assert_cmd::cargo::cargo_bin("mimic");
    let mut child = Command::new(program)
        .args(["completions", "zsh"])
        .current_dir(bench.path("."))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let status = child.wait().expect("the program ends");
    let mut said = String::new();
    if let Some(mut stderr) = child.stderr.take() {
        stderr.read_to_string(&mut said).expect("its talk is text");
    }
    assert!(status.success(), "{said}");
    assert_eq!(said, "");
}

#[test]
fn completions_and_manual_know_every_verb() {
    let bench = Workbench::new();
    // What the script of `mimic completions fish` asks at the first word.
    let mut asked = bench.mimic(&["--", "mimic", ""]);
    let output = asked.env("MIMIC_COMPLETE", "fish").assert().success();
    let offered = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    bench.mimic(&["man", "--out", "man"]).assert().success();
    for verb in [
        "info", "import", "retarget", "tracks", "train", "runs", "eval", "replay", "bench",
        "doctor",
    ] {
        assert!(offered.contains(&format!("{verb}\t")), "{offered}");
        let page = std::fs::read_to_string(bench.path(&format!("man/mimic-{verb}.1")));
        assert!(page.is_ok_and(|page| page.contains("Examples:")), "{verb}");
    }
}

#[test]
fn doctor_reports_every_check() {
    let bench = Workbench::new();
    let report = bench.json(&["doctor"]);
    assert_eq!(report["ok"], true);
    let checks: Vec<_> = report["checks"].as_array().into_iter().flatten().collect();
    for id in ["cores", "simd", "folder", "viewer", "library"] {
        assert!(checks.iter().any(|check| check["id"] == id), "{id}");
    }
}

/// A result takes the place of an older one of its kind, never of anything else.
#[cfg(feature = "rerun")]
#[test]
fn files_of_another_kind_are_spared() {
    let bench = Workbench::with_run();
    bench.write("other.txt", b"mine");
    std::fs::create_dir(bench.path("copy")).expect("a folder can be made");
    for file in ["config.json", "policy.safetensors"] {
        let bytes = std::fs::read(bench.path("runs/sway").join(file)).expect("the run has it");
        bench.write(&format!("copy/{file}"), &bytes);
    }
    for line in [
        &["replay", "sway", "--save", "other.txt"][..],
        &["replay", "sway", "--save", "copy/policy.safetensors"],
        &["eval", "sway", "--out", "other.txt"],
        &["eval", "sway", "--out", "copy/config.json"],
        &["plot", "sway", "--out", "other.txt"],
        &["import", "sway.txt", "--out", "other.txt"],
        &["retarget", "sway.txt", "--out", "other.txt"],
        &["tracks", "sway.txt", "--csv", "other.txt"],
        &["info", "sway.txt", "--write-map", "other.txt"],
    ] {
        let file = line[line.len() - 1];
        let before = std::fs::read(bench.path(file)).expect("it is there");
        let said = bench.complaint(line, 2);
        assert!(said.contains(file), "{line:?}: {said}");
        assert_eq!(
            std::fs::read(bench.path(file)).ok(),
            Some(before),
            "{line:?}"
        );
    }
    for _ in 0..2 {
        bench
            .mimic(&["replay", "sway", "--save", "a.rrd"])
            .assert()
            .success();
    }
}
