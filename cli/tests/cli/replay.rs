//! Where recordings go, and what is refused.

use crate::workbench::Workbench;
use std::fs;

fn names(bench: &Workbench, folder: &str) -> Vec<String> {
    let entries = fs::read_dir(bench.path(folder)).into_iter().flatten();
    let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
    let mut names: Vec<_> = entries
        .filter_map(|entry| Some(name(entry.ok()?)))
        .collect();
    names.sort();
    names
}

#[test]
fn a_recording_goes_into_a_folder_and_spares_its_neighbours() {
    let bench = Workbench::with_clip();
    fs::create_dir(bench.path("out")).expect("a folder can be made");
    bench.write("out/sway.rrd.part", b"somebody's own");
    for save in ["out/", "out", "out/sway.rrd"] {
        let shown = bench.json(&["replay", "sway.txt", "--save", save]);
        assert_eq!(shown["recording"], "out/sway.rrd");
        assert_eq!(names(&bench, "out"), ["sway.rrd", "sway.rrd.part"]);
    }
    let kept = fs::read(bench.path("out/sway.rrd.part")).unwrap_or_default();
    assert_eq!(kept, b"somebody's own");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode =
            |name: &str| fs::metadata(bench.path(name)).map(|m| m.permissions().mode() & 0o777);
        assert_eq!(
            mode("out/sway.rrd").ok(),
            mode("sway.txt").ok(),
            "a file like any other"
        );
    }
}

#[test]
fn a_recording_is_written_whatever_the_environment_says() {
    let bench = Workbench::with_clip();
    let line = ["replay", "sway.txt", "--save", "sway.rrd"];
    bench.mimic(&line).env("RERUN", "off").assert().success();
    let bytes = fs::read(bench.path("sway.rrd")).unwrap_or_default();
    assert!(bytes.len() > 10_000, "{} bytes", bytes.len());
}

#[test]
fn flags_that_have_nothing_to_act_on_are_refused() {
    let bench = Workbench::with_run();
    for (flags, reason) in [
        (
            &["--fps", "60"][..],
            "import options apply to animation files",
        ),
        (&["--take", "1"], "import options apply to animation files"),
        (
            &["--skeleton", "humanoid"],
            "`--skeleton`, `--map` and `--weight` apply to clips",
        ),
        (
            &["--map", "map.json"],
            "`--skeleton`, `--map` and `--weight` apply to clips",
        ),
    ] {
        let line = [&["replay", "sway", "--save", "a.rrd"], flags].concat();
        let said = bench.complaint(&line, 2);
        assert!(
            said.contains("`runs/sway`: this is a run already") && said.contains(reason),
            "{said}"
        );
    }
    for flags in [
        &["--beside"][..],
        &["--seconds", "3"],
        &["--motion", "2"],
        &["--phase", "0.5"],
        &["--perturb"],
        &["--sequence", "sway"],
    ] {
        let line = [&["replay", "sway.txt", "--save", "a.rrd"], flags].concat();
        let said = bench.complaint(&line, 2);
        assert!(
            said.contains("`sway.txt`: this has no agent") && said.contains(flags[0]),
            "{said}"
        );
    }
    let line = [
        "replay",
        "sway",
        "--save",
        "beside.rrd",
        "--beside",
        "--seconds",
        "1",
        "--motion",
        "1",
    ];
    let shown = bench.json(&line);
    assert_eq!(shown["agent"], true);
    bench.json(&["replay", "sway", "--save", "over.rrd", "--seconds", "1"]);
    let late = [
        "replay",
        "sway",
        "--save",
        "late.rrd",
        "--seconds",
        "1",
        "--phase",
    ];
    bench.json(&[&late[..], &["0.5"]].concat());
    for wrong in ["1.5", "-1", "nan", "x"] {
        let output = bench
            .mimic(&[&late[..], &[wrong]].concat())
            .assert()
            .code(2);
        let said = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
        assert!(said.contains("--phase"), "{said}");
    }
    let read = |name: &str| fs::read(bench.path(name)).unwrap_or_default();
    assert!(read("beside.rrd").starts_with(b"RRF"));
    assert_ne!(read("beside.rrd").len(), 0);
    assert_ne!(read("late.rrd"), read("over.rrd"));
    let said = bench.complaint(&["replay", "sway", "--save", "a.rrd", "--motion", "2"], 2);
    assert!(said.contains("no number 2"), "{said}");
}

#[test]
fn motions_of_a_run_are_shown_one_after_the_other() {
    let bench = Workbench::with_clip();
    let clip = fs::read(bench.path("sway.txt")).expect("the clip is there");
    bench.write("first.txt", &clip);
    bench.write("second.txt", &clip);
    // The first goes on; the second ends, and is played to its end.
    let ending = [
        "import",
        "second.txt",
        "--loop",
        "clamp",
        "--out",
        "second.clip",
    ];
    bench.mimic(&ending).assert().success();
    bench.write(
        "small.json",
        br#"{ "environments": 4, "group": 4, "horizon": 8, "round": 1, "samples": 64, "hidden": [8] }"#,
    );
    let train = [
        "train",
        "first.txt",
        "second.clip",
        "--preset",
        "small.json",
    ];
    bench.mimic(&train).assert().success();
    let line = [
        "replay",
        "--save",
        "a.rrd",
        "--seconds",
        "0.2",
        "--sequence",
    ];
    let shown = bench.json(&[&line[..], &["first,sec,first"]].concat());
    assert_eq!(shown["agent"], true);
    assert_eq!(
        shown.get("failed_s"),
        Some(&serde_json::Value::Null),
        "it sways where it stands"
    );
    // Of the second all 31 frames but what comes before its nearest moment, in its first half.
    let frames = shown["frames"].as_u64().expect("a number");
    assert!((6 + 15 + 6..=6 + 31 + 6).contains(&frames), "{frames}");
    for (wrong, reason) in [
        ("third", "no motion"),
        ("s", "several motions"),
        ("first,", "no motion"),
    ] {
        let said = bench.complaint(&[&line[..], &[wrong]].concat(), 2);
        assert!(
            said.contains(reason) && said.contains("first, second"),
            "{said}"
        );
    }
}

/// A walk that was hardly practised ends on its nose within a second or two.
#[test]
fn it_is_said_when_the_agent_fails() {
    let bench = Workbench::with_run();
    let walk = concat!(env!("CARGO_MANIFEST_DIR"), "/../clips/walk.glb");
    let shoves = [
        "--set",
        "task.perturbations.push_m_s=[3,3]",
        "--set",
        "task.perturbations.push_interval_s=[0.1,0.1]",
    ];
    let train = ["train", walk, "--preset", "tiny.json", "--out", "walking"];
    bench
        .mimic(&[&train[..], &shoves].concat())
        .assert()
        .success();
    let line = ["replay", "walking", "--save", "a.rrd", "--seconds", "9"];
    let shown = bench.json(&line);
    let failed = shown["failed_s"].as_f64().expect("it fails");
    let frames = shown["frames"].as_f64().expect("a number");
    assert!(
        failed < 5.0 && (failed * 30.0 + 1.0 - frames).abs() < 1e-6,
        "{shown}"
    );
    let said = bench.mimic(&line).assert().success();
    let said = String::from_utf8_lossy(&said.get_output().stdout).into_owned();
    assert!(said.contains("the agent fails after"), "{said}");
    let shoved = bench.json(&[&line[..], &["--perturb"]].concat());
    let sooner = shoved["failed_s"].as_f64().expect("it fails");
    assert!(sooner < failed, "{shoved}, {failed} s without shoves");
    assert_eq!(shown["shoves"], serde_json::json!([]));
    let first = &shoved["shoves"][0];
    let size = |axis: usize| first["impulse"][axis].as_f64().unwrap_or(f64::NAN);
    // 45 kg by 3 m/s, with the step of 1/30 s that follows a tenth of a second.
    assert!((size(0).hypot(size(1)) - 135.0).abs() < 0.1, "{first}");
    assert!(
        (first["at_s"].as_f64().unwrap_or(0.0) - 0.1).abs() < 0.04,
        "{first}"
    );
}

/// A viewer that does nothing but end like this.
#[cfg(unix)]
fn with_viewer(script: &str) -> Workbench {
    use std::os::unix::fs::PermissionsExt;
    let bench = Workbench::with_clip();
    let text =
        format!("#!/bin/sh\n[ \"$1\" = --version ] && echo rerun 0.36.3 && exit\n{script}\n");
    bench.write("rerun", text.as_bytes());
    let executable = fs::Permissions::from_mode(0o755);
    fs::set_permissions(bench.path("rerun"), executable).expect("it can be made executable");
    bench
}

#[cfg(unix)]
#[test]
fn a_viewer_that_fails_is_failed_work() {
    let bench = with_viewer("echo noise; exit 3");
    for sink in ["--serve", "--rerun"] {
        let mut command = bench.mimic(&["replay", "sway.txt", sink]);
        let path = format!("{}:/usr/bin:/bin", bench.path(".").display());
        let output = command.env("PATH", path).assert().code(1);
        let output = output.get_output();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            said.contains("exit status: 3") && said.contains("--save"),
            "{said}"
        );
        assert!(output.stdout.is_empty(), "the viewer's talk is no result");
    }
}

#[cfg(unix)]
#[test]
fn what_was_served_is_gone_afterwards() {
    let bench = with_viewer("ls \"$2\"");
    fs::create_dir(bench.path("tmp")).expect("a folder can be made");
    let mut command = bench.mimic(&["replay", "sway.txt", "--serve", "--json"]);
    let path = format!("{}:/usr/bin:/bin", bench.path(".").display());
    let command = command.env("PATH", path).env("TMPDIR", bench.path("tmp"));
    let output = command.assert().success();
    let said = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
    assert!(
        said.contains("tmp/mimic-") && said.contains(".rrd"),
        "{said}"
    );
    assert_eq!(names(&bench, "tmp"), Vec::<String>::new());
}
