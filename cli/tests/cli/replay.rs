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

/// `mimic replay sway.txt`, which finds that viewer.
#[cfg(unix)]
fn replay(bench: &Workbench, line: &[&str]) -> std::process::Command {
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("mimic"));
    let path = format!("{}:/usr/bin:/bin", bench.path(".").display());
    command
        .args(["replay", "sway.txt"])
        .args(line)
        .current_dir(bench.path("."))
        .env("PATH", path)
        .env("TMPDIR", bench.path("tmp"));
    fs::create_dir_all(bench.path("tmp")).expect("a folder can be made");
    command
}

/// A port of this machine at which nobody listens.
#[cfg(unix)]
fn free_port() -> u16 {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("there is one");
    listener.local_addr().expect("it has an address").port()
}

#[cfg(unix)]
#[test]
fn a_viewer_that_fails_is_failed_work() {
    let bench = with_viewer("echo noise; echo noise >&2; exit 3");
    let place = format!("127.0.0.1:{}", free_port());
    for sink in [&["--serve"][..], &["--rerun", "--bind", &place]] {
        let output = replay(&bench, sink).output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(
            said.contains("exit status: 3") && said.contains("--save"),
            "{said}"
        );
        assert!(
            !said.contains("noise"),
            "the viewer's talk is its own: {said}"
        );
        assert!(output.stdout.is_empty(), "the viewer's talk is no result");
        assert_eq!(names(&bench, "tmp"), Vec::<String>::new());
    }
}

/// A viewer that ends before anybody could look served nothing.
#[cfg(unix)]
#[test]
fn a_viewer_that_ends_at_once_is_failed_work() {
    let bench = with_viewer("exit 0");
    let output = replay(&bench, &["--serve"]).output().expect("it runs");
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(names(&bench, "tmp"), Vec::<String>::new());
}

/// The value of a flag in what a viewer was started with, once it was.
#[cfg(unix)]
fn started_with(bench: &Workbench, flag: &str) -> String {
    let begun = std::time::Instant::now();
    while begun.elapsed().as_secs() < 20 {
        let text = fs::read_to_string(bench.path("arguments")).unwrap_or_default();
        if let Some(line) = text.lines().find_map(|line| line.strip_prefix(flag)) {
            return line.to_owned();
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    panic!("no viewer was started with `{flag}`");
}

/// The first line that a program prints.
#[cfg(unix)]
fn first_line(child: &mut std::process::Child) -> String {
    use std::io::BufRead;
    let mut line = String::new();
    let stdout = child.stdout.take().expect("it is piped");
    let mut lines = std::io::BufReader::new(stdout);
    lines.read_line(&mut line).expect("it prints");
    line
}

#[cfg(unix)]
fn signal(child: &std::process::Child, name: &str) {
    let status = std::process::Command::new("kill")
        .args([&format!("-{name}"), &child.id().to_string()])
        .status();
    assert!(status.is_ok_and(|status| status.success()), "{name}");
}

/// This test listens in the place of the viewer, which is a script.
#[cfg(unix)]
#[test]
fn what_is_served_is_for_this_machine_unless_it_is_said_otherwise() {
    let script =
        r#"sleep 60 & echo $! > sleeper; for a in "$@"; do echo "$a"; done > arguments; wait"#;
    for (bind, ip, name) in [
        (&[][..], "127.0.0.1", "INT"),
        (&["--bind", "0.0.0.0"], "0.0.0.0", "TERM"),
        (&["--bind", "localhost"], "127.0.0.1", "HUP"),
    ] {
        let bench = with_viewer(script);
        let mut child = replay(&bench, &[bind, &["--serve", "--json"]].concat())
            .stdout(std::process::Stdio::piped())
            .spawn()
            .expect("it starts");
        let recording = started_with(&bench, "");
        assert_eq!(started_with(&bench, "--bind="), ip, "{recording}");
        let port = |flag| started_with(&bench, flag).parse::<u16>().expect("a number");
        let (data, page) = (port("--port="), port("--web-viewer-port="));
        let listen = |port| std::net::TcpListener::bind((ip, port)).expect("it is free");
        let _places = (listen(data), listen(page));
        let text = fs::read_to_string(bench.path("arguments")).unwrap_or_default();
        let origin = text
            .lines()
            .find_map(|line| line.strip_prefix("--cors-allow-origin="));
        let others = (ip == "0.0.0.0").then(|| format!("http://*:{page}"));
        assert_eq!(origin, others.as_deref(), "other pages than its own");
        assert_eq!(names(&bench, "tmp").len(), 1, "the recording");
        let shown: serde_json::Value =
            serde_json::from_str(&first_line(&mut child)).expect("one JSON object");
        let address = shown["address"].as_str().unwrap_or_default();
        assert!(
            address.starts_with(&format!("http://127.0.0.1:{page}/?url=")),
            "{address}"
        );
        assert!(
            address.contains(&format!("127.0.0.1%3A{data}")),
            "{address}"
        );
        signal(&child, name);
        assert!(child.wait().is_ok_and(|status| status.success()), "{name}");
        assert_eq!(names(&bench, "tmp"), Vec::<String>::new());
        // The viewer, and what it started, are gone as well.
        let sleeper = fs::read_to_string(bench.path("sleeper")).expect("its number");
        let state = std::process::Command::new("ps")
            .args(["-o", "stat=", "-p", sleeper.trim()])
            .output();
        let state = state.map(|s| String::from_utf8_lossy(&s.stdout).trim().to_owned());
        assert!(
            state
                .as_ref()
                .is_ok_and(|s| s.is_empty() || s.starts_with('Z')),
            "{state:?}"
        );
    }
}

/// A port that was named is that one or none; one that wasn't is a free one.
/// A viewer that doesn't end when it is asked to, whether or not it ever listens.
#[cfg(unix)]
#[test]
fn a_stubborn_viewer_ends_with_what_it_serves() {
    let script = r#"trap '' TERM INT HUP; for a in "$@"; do echo "$a"; done > arguments; while :; do sleep 0.1; done"#;
    for (listens, name) in [
        (true, "INT"),
        (true, "TERM"),
        (false, "INT"),
        (false, "HUP"),
    ] {
        let bench = with_viewer(script);
        let mut child = replay(&bench, &["--serve", "--json"])
            .stdout(std::process::Stdio::piped())
            .spawn()
            .expect("it starts");
        let ports = ["--port=", "--web-viewer-port="].map(|flag| started_with(&bench, flag));
        let listen = |port: &String| {
            let place = format!("127.0.0.1:{port}");
            std::net::TcpListener::bind(place).expect("the port is free")
        };
        let listeners = ports.each_ref().map(|port| listens.then(|| listen(port)));
        if listens {
            first_line(&mut child);
        }
        signal(&child, name);
        let begun = std::time::Instant::now();
        let status = child.wait().expect("it ends");
        assert!(status.success(), "{name}: {status}");
        assert!(begun.elapsed().as_secs() < 6, "{name}");
        assert_eq!(names(&bench, "tmp"), Vec::<String>::new());
        drop(listeners);
    }
}

/// Whatever is called `rerun` may say nothing for ever.
#[cfg(unix)]
#[test]
fn a_viewer_that_does_not_say_its_version_is_not_waited_for() {
    let bench = with_viewer("");
    bench.write("rerun", b"#!/bin/sh\nsleep 30\n");
    let path = format!("{}:/usr/bin:/bin", bench.path(".").display());
    bench.write("tiny.json", crate::workbench::TINY);
    let trained = ["train", "sway.txt", "--preset", "tiny.json"];
    for line in [&["doctor"][..], &trained] {
        let begun = std::time::Instant::now();
        bench.mimic(line).env("PATH", &path).assert().success();
        assert!(begun.elapsed().as_secs() < 10, "{line:?}");
    }
}

#[cfg(unix)]
#[test]
fn a_port_that_is_taken_is_named() {
    let bench = with_viewer("exit 3");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("there is a free port");
    let place = taken.local_addr().expect("an address").to_string();
    for sink in ["--serve", "--rerun"] {
        let output = replay(&bench, &[sink, "--bind", &place])
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(
            said.contains(&place) && said.contains("`--bind ADDR:PORT`"),
            "{said}"
        );
    }
    for (bind, reason) in [
        ("203.0.113.77", "is not an address of this machine"),
        ("somewhere", "give an address of this machine"),
    ] {
        let output = replay(&bench, &["--serve", "--bind", bind])
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(reason), "{said}");
    }
}

#[test]
fn a_replay_has_to_go_somewhere() {
    let bench = Workbench::with_clip();
    let said = bench.complaint(&["replay", "sway.txt"], 2);
    for flag in ["`--rerun`", "`--serve`", "`--save FILE.rrd`"] {
        assert!(said.contains(flag), "{said}");
    }
    let line = ["replay", "sway.txt", "--save", "a.rrd", "--bind", "0.0.0.0"];
    let said = bench.complaint(&line, 2);
    assert!(said.contains("`--bind` is for the viewer"), "{said}");
    assert!(!bench.path("a.rrd").exists());
}

/// The real viewer, where it is installed.
#[cfg(target_os = "linux")]
#[test]
fn the_viewer_itself_listens_to_this_machine_alone() {
    let doctor = Workbench::new().json(&["doctor"]);
    let checks = doctor["checks"].as_array().cloned().unwrap_or_default();
    let viewer = checks.iter().find(|check| check["id"] == "viewer");
    let sockets = || std::process::Command::new("ss").arg("-ltn").output();
    if viewer.is_none_or(|check| check["state"] != "good") || sockets().is_err() {
        mimic_test_support::skip("no rerun viewer, or no `ss` to see where it listens");
        return;
    }
    let bench = Workbench::with_clip();
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("mimic"))
        .args(["replay", "sway.txt", "--serve", "--json"])
        .current_dir(bench.path("."))
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("it starts");
    let shown: serde_json::Value =
        serde_json::from_str(&first_line(&mut child)).expect("one JSON object");
    let address = shown["address"]
        .as_str()
        .unwrap_or_default()
        .replace("%3A", ":");
    let listening = sockets().expect("it ran before").stdout;
    let listening = String::from_utf8_lossy(&listening).into_owned();
    let ports: Vec<&str> = address
        .split("127.0.0.1:")
        .skip(1)
        .filter_map(|rest| rest.split(|c: char| !c.is_ascii_digit()).next())
        .collect();
    assert_eq!(ports.len(), 2, "{address}");
    for port in ports {
        let ends = format!(":{port}");
        let places = listening
            .split_whitespace()
            .filter(|word| word.ends_with(&ends));
        let places: Vec<&str> = places.collect();
        assert_eq!(places, [format!("127.0.0.1:{port}")], "{listening}");
    }
    signal(&child, "INT");
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success());
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "",
        "no talk of the viewer"
    );
}
