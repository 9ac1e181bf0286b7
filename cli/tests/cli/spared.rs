//! A result takes the place of what the same command made from the same input, and of nothing else.

use crate::workbench::Workbench;
use sha2::{Digest, Sha256};
use std::fs;

/// Two clips of one name, in the folders `a` and `b`: `b` sways twice as fast.
fn with_namesakes() -> Workbench {
    let bench = Workbench::with_clip();
    for folder in ["a", "b"] {
        fs::create_dir(bench.path(folder)).expect("a folder can be made");
    }
    let text = fs::read_to_string(bench.path("sway.txt")).expect("the clip is there");
    bench.write("a/sway.txt", text.as_bytes());
    let fast = text.replace("0.03333333333333333", "0.016666666666666666");
    assert_ne!(text, fast);
    bench.write("b/sway.txt", fast.as_bytes());
    bench
}

/// Runs a line that has to be refused because of `file`, which stays as it is; then the same with `--force`.
fn refused(bench: &Workbench, line: &[&str], file: &str) {
    let before = fs::read(bench.path(file)).expect("it is there");
    let error = bench.error_about(file, line, 2);
    let remedy = error["remedy"].as_str().unwrap_or_default();
    assert!(remedy.contains("`--force`"), "{error}");
    let kept = fs::read(bench.path(file)).expect("it is still there");
    assert_eq!(kept, before, "{line:?}");
    bench.mimic(line).arg("--force").assert().success();
    let now = fs::read(bench.path(file)).expect("it is there");
    assert_ne!(now, before, "{line:?} --force");
    assert!(leftovers(bench).is_empty(), "{:?}", leftovers(bench));
}

fn leftovers(bench: &Workbench) -> Vec<String> {
    let entries = fs::read_dir(bench.path(".")).expect("a folder").flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter(|name| name.starts_with('.')).collect()
}

#[test]
fn a_namesake_is_not_replaced() {
    let bench = with_namesakes();
    for (verb, flag, out) in [
        ("import", "--out", "sway.clip"),
        ("retarget", "--out", "sway.motion"),
        ("tracks", "--plot", "sway.svg"),
        ("tracks", "--csv", "sway.csv"),
        #[cfg(feature = "rerun")]
        ("replay", "--save", "sway.rrd"),
    ] {
        let line = |input| [verb, input, flag, out];
        bench.mimic(&line("a/sway.txt")).assert().success();
        // The daily loop: the same once more, by another way to the same file, and where there are options with others.
        bench.mimic(&line("a/../a/sway.txt")).assert().success();
        if flag != "--csv" {
            let other = [&line("a/sway.txt")[..], &["--fps", "60"]].concat();
            bench.mimic(&other).assert().success();
        }
        refused(&bench, &line("b/sway.txt"), out);
    }
}

/// Where no name is given, several inputs lead to one.
#[test]
fn names_that_follow_from_the_input_are_no_exception() {
    let bench = with_namesakes();
    bench.mimic(&["import", "a/sway.txt"]).assert().success();
    refused(&bench, &["import", "b/sway.txt"], "sway.clip");
    refused(&bench, &["import", "a/sway.txt"], "sway.clip");
    bench
        .mimic(&["import", "a/sway.txt", "--out", "c/"])
        .assert()
        .success();
    bench
        .mimic(&["retarget", "sway.clip", "--fps", "30"])
        .assert()
        .code(2);
    bench
        .mimic(&["import", "b/sway.txt", "--out", "d/"])
        .assert()
        .success();
    bench.mimic(&["retarget", "c/sway.clip"]).assert().success();
    refused(&bench, &["retarget", "d/sway.clip"], "sway.motion");
    // Of several files the others are imported all the same.
    bench.write(
        "a/swing.txt",
        &fs::read(bench.path("a/sway.txt")).expect("there"),
    );
    bench
        .mimic(&["import", "b/sway.txt", "a/swing.txt"])
        .assert()
        .code(2);
    assert!(bench.path("swing.clip").exists());
}

#[test]
fn two_edits_of_a_clip_are_two_clips() {
    let bench = Workbench::with_clip();
    bench.mimic(&["import", "sway.txt"]).assert().success();
    let mirror = ["edit", "sway.clip", "--mirror"];
    bench.mimic(&mirror).assert().success();
    bench.mimic(&mirror).assert().success();
    for other in [
        &["--speed", "2"][..],
        &["--trim", "0..0.5"],
        &["--trim", "0..0.6"],
        &["--mirror", "--in-place"],
    ] {
        refused(
            &bench,
            &[&["edit", "sway.clip"], other].concat(),
            "sway-edited.clip",
        );
    }
    // An import doesn't take the place of an edit, nor of a clip that somebody's own program changed.
    bench
        .mimic(&["edit", "sway.txt", "--mirror", "--out", "mine.clip"])
        .assert()
        .success();
    refused(
        &bench,
        &["import", "sway.txt", "--out", "mine.clip"],
        "mine.clip",
    );
    let mut bytes = fs::read(bench.path("mine.clip")).expect("it is there");
    *bytes.last_mut().expect("there are bytes") ^= 1;
    bench.write("mine.clip", &bytes);
    refused(
        &bench,
        &["import", "sway.txt", "--out", "mine.clip"],
        "mine.clip",
    );
}

#[test]
fn what_somebody_wrote_by_hand_stays() {
    let bench = Workbench::with_clip();
    let map = ["info", "sway.txt", "--write-map", "map.json"];
    bench.mimic(&map).assert().success();
    bench.mimic(&map).assert().success();
    let text = fs::read_to_string(bench.path("map.json")).expect("the map is there");
    bench.write(
        "map.json",
        text.replace("  \"neck", "\n  \"neck").as_bytes(),
    );
    bench.write("map.json", format!("{text}\n").as_bytes());
    refused(&bench, &map, "map.json");
    let plot = ["tracks", "sway.txt", "--plot", "sway.svg"];
    bench.mimic(&plot).assert().success();
    let text = fs::read_to_string(bench.path("sway.svg")).expect("the drawing is there");
    bench.write("sway.svg", text.replace("#fff", "#eee").as_bytes());
    refused(&bench, &plot, "sway.svg");
    for (line, file) in [
        (&["import", "sway.txt"][..], "sway.clip"),
        (&["retarget", "sway.txt"], "sway.motion"),
        (&["edit", "sway.txt", "--mirror"], "sway-edited.clip"),
        (&["tracks", "sway.txt", "--csv", "mine.csv"], "mine.csv"),
        (&["man", "--out", "."], "./mimic.1"),
        #[cfg(feature = "rerun")]
        (&["replay", "sway.txt", "--save", "mine.rrd"], "mine.rrd"),
    ] {
        bench.write(file, b"mine\n");
        refused(&bench, line, file);
        bench.mimic(line).assert().success();
    }
}

#[test]
fn what_is_made_of_runs_spares_others() {
    let bench = Workbench::with_run();
    let train = [
        "train",
        "sway.txt",
        "--preset",
        "tiny.json",
        "--seed",
        "5",
        "--out",
        "other/sway",
    ];
    bench.mimic(&train).assert().success();
    bench.mimic(&["plot", "sway"]).assert().success();
    bench
        .mimic(&["plot", "sway", "--smooth", "1"])
        .assert()
        .success();
    refused(&bench, &["plot", "other/sway"], "sway.svg");
    let eval = |run| {
        [
            "eval",
            run,
            "--episodes",
            "2",
            "--seconds",
            "1",
            "--out",
            "e.json",
        ]
    };
    bench.mimic(&eval("sway")).assert().success();
    bench.mimic(&eval("sway")).assert().success();
    let before = fs::read(bench.path("e.json")).expect("it is there");
    let other = bench
        .mimic(&eval("other/sway"))
        .arg("--json")
        .assert()
        .code(2);
    // It was measured, so it is printed.
    let printed: serde_json::Value =
        serde_json::from_slice(&other.get_output().stdout).expect("one JSON object");
    assert!(
        printed["survival"].is_number() && printed["error"]["exit"] == 2,
        "{printed}"
    );
    assert_eq!(fs::read(bench.path("e.json")).expect("it is there"), before);
    bench
        .mimic(&eval("other/sway"))
        .arg("--force")
        .assert()
        .success();
    assert_ne!(fs::read(bench.path("e.json")).expect("it is there"), before);
    // Not even by force: a run would be lost.
    for (line, file) in [
        (&["eval", "other/sway", "--out"][..], "config.json"),
        (&["eval", "other/sway", "--out"], "eval.json"),
        (&["info", "sway.txt", "--write-map"], "skeleton.json"),
        (&["retarget", "sway.txt", "--out"], "reference-0.motion"),
        #[cfg(feature = "rerun")]
        (&["replay", "other/sway", "--save"], "replay.rrd"),
    ] {
        let path = format!("runs/sway/{file}");
        let before = fs::read(bench.path(&path)).expect("the run has it");
        bench.error_about(&path, &[line, &[&path, "--force"]].concat(), 2);
        assert_eq!(fs::read(bench.path(&path)).expect("the run has it"), before);
    }
}

/// Takes of one name, or of names that make the same file name, are not the same.
#[test]
fn a_take_does_not_replace_another() {
    let bench = crate::import::with_two_takes();
    let line = |take| ["import", "two.gltf", "--take", take, "--out", "take.clip"];
    bench.mimic(&line("up")).assert().success();
    bench.mimic(&line("up")).assert().success();
    refused(&bench, &line("down"), "take.clip");
    for _ in 0..2 {
        let all = ["import", "two.gltf", "--take", "all", "--out", "takes/"];
        bench.mimic(&all).assert().success();
    }
}

#[test]
fn a_result_is_called_what_it_is() {
    let bench = Workbench::with_clip();
    fs::create_dir(bench.path("folder")).expect("a folder can be made");
    for (line, ending) in [
        (&["import", "sway.txt", "--out", "sway.motion"][..], ".clip"),
        (&["import", "sway.txt", "--out", "new"], ".clip"),
        (
            &["edit", "sway.txt", "--mirror", "--out", "new.fbx"],
            ".clip",
        ),
        (&["retarget", "sway.txt", "--out", "new.clip"], ".motion"),
        (&["tracks", "sway.txt", "--csv", "new.svg"], ".csv"),
        (&["tracks", "sway.txt", "--plot", "new.png"], ".svg"),
        (&["info", "sway.txt", "--write-map", "new.txt"], ".json"),
        #[cfg(feature = "rerun")]
        (&["replay", "sway.txt", "--save", "new.mp4"], ".rrd"),
        #[cfg(feature = "rerun")]
        (&["replay", "sway.txt", "--save", "new"], ".rrd"),
        // Folders are no files, and files no folders.
        (&["tracks", "sway.txt", "--csv", "folder"], "NAME.csv"),
        (&["tracks", "sway.txt", "--plot", "folder"], "NAME.svg"),
        (&["info", "sway.txt", "--write-map", "folder/"], "NAME.json"),
    ] {
        let file = line[line.len() - 1].trim_end_matches('/');
        let said = bench.complaint(line, 2);
        assert!(said.contains(file) && said.contains(ending), "{said}");
        assert!(said.contains(line[line.len() - 2]), "the flag: {said}");
        assert!(!bench.path(file).is_file(), "{line:?}");
    }
}

/// Of several commands that write one file at once, one does, and the others say so.
#[test]
fn of_several_at_once_one_writes() {
    let bench = Workbench::new();
    let text = Workbench::with_clip();
    let text = fs::read(text.path("sway.txt")).expect("the clip is there");
    let folders: Vec<String> = (0..8).map(|n| format!("f{n}")).collect();
    for folder in &folders {
        fs::create_dir(bench.path(folder)).expect("a folder can be made");
        bench.write(&format!("{folder}/sway.txt"), &text);
    }
    let program = assert_cmd::cargo::cargo_bin("mimic");
    let start = |(number, folder): (usize, &String)| {
        let fps = (30 + number).to_string();
        std::process::Command::new(&program)
            .args([
                "import",
                &format!("{folder}/sway.txt"),
                "--fps",
                &fps,
                "--out",
                "sway.clip",
            ])
            .current_dir(bench.path("."))
            .output()
    };
    let codes: Vec<_> = std::thread::scope(|scope| {
        let start = &start;
        let all: Vec<_> = folders
            .iter()
            .enumerate()
            .map(|one| scope.spawn(move || start(one)))
            .collect();
        all.into_iter()
            .map(|one| {
                one.join()
                    .expect("no panic")
                    .expect("it runs")
                    .status
                    .code()
            })
            .collect()
    });
    let count = |code| codes.iter().filter(|c| **c == Some(code)).count();
    assert_eq!((count(0), count(2)), (1, 7), "{codes:?}");
    assert!(leftovers(&bench).is_empty());
}

/// A full disk is said, also by what other libraries write for us; nothing is left half written.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_failed_work() {
    let bench = Workbench::with_clip();
    // A limit on the size of files stands in for the disk: 8 blocks of half a kilobyte.
    let limited = |line: &[&str]| {
        let program = assert_cmd::cargo::cargo_bin("mimic");
        std::process::Command::new("sh")
            .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\""])
            .arg(program)
            .args(line)
            .current_dir(bench.path("."))
            .output()
            .expect("it runs")
    };
    for line in [
        &["import", "sway.txt"][..],
        &["retarget", "sway.txt"],
        &["tracks", "sway.txt", "--plot", "sway.svg"],
        #[cfg(feature = "rerun")]
        &["replay", "sway.txt", "--save", "sway.rrd"],
    ] {
        let output = limited(line);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{line:?}: {said}");
        assert!(said.contains("cannot be written (File too large"), "{said}");
        assert!(!said.contains(".mimic-"), "{said}");
        assert_eq!(leftovers(&bench), Vec::<String>::new());
    }
    let entries = fs::read_dir(bench.path(".")).expect("a folder");
    assert_eq!(entries.count(), 1, "the clip alone");
}

/// What a killed process left is gone after the next write into its folder.
#[cfg(target_os = "linux")]
#[test]
fn unfinished_files_of_killed_processes_are_removed() {
    let bench = Workbench::with_clip();
    let mut dead = std::process::Command::new("true")
        .spawn()
        .expect("it starts");
    let number = dead.id();
    dead.wait().expect("it ends");
    // Nobody's files but ours have names that are sealed.
    let sealed = |random: &str| {
        let own = format!("{number}-{random}");
        let digest = Sha256::digest(format!("an unfinished file of mimic, {own}"));
        format!(".mimic-{own}-{}", &format!("{digest:x}")[48..])
    };
    let others = [
        ".mimic-2024-backup".to_owned(),
        ".mimic-99999-config".to_owned(),
        format!(".mimic-{number}-Ab3dEf"),
        ".mimic-mine".to_owned(),
    ];
    for name in &others {
        bench.write(name, b"somebody's own");
    }
    // The second time it is there already.
    for _ in 0..2 {
        for random in ["0123456789abcdef", "fedcba9876543210"] {
            bench.write(&sealed(random), b"half");
        }
        bench.mimic(&["import", "sway.txt"]).assert().success();
        let mut left = leftovers(&bench);
        left.sort();
        let mut kept = others.to_vec();
        kept.sort();
        assert_eq!(left, kept);
    }
}

/// A result of other options or of another character is another result, and the refusal says what is compared.
#[test]
fn what_differs_is_said() {
    let bench = Workbench::with_run();
    for (first, second, what) in [
        (
            &["edit", "sway.txt", "--mirror"][..],
            &["edit", "sway.txt", "--speed", "2"][..],
            "`mimic edit` made from `sway.txt` with the same edits;",
        ),
        (
            &["retarget", "sway.txt"],
            &["retarget", "sway.txt", "--skeleton", "robot"],
            "`mimic retarget` made from `sway.txt` for the same character and take;",
        ),
        (
            &["tracks", "sway.txt", "--plot", "tracks.svg"],
            &[
                "tracks",
                "sway.txt",
                "--plot",
                "tracks.svg",
                "--skeleton",
                "robot",
            ],
            "`mimic tracks` made from `sway.txt` for the same character and take;",
        ),
        (
            &["plot", "sway", "--out", "a.svg"],
            &["plot", "sway", "runs/sway", "--out", "a.svg"],
            "`mimic plot` made from `runs/sway` and `runs/sway`;",
        ),
        (
            &["plot", "sway"],
            &["tracks", "sway.txt", "--plot", "sway.svg"],
            "`mimic tracks` made from `sway.txt` for the same character and take;",
        ),
    ] {
        bench.mimic(first).assert().success();
        bench.mimic(first).assert().success();
        let said = bench.complaint(second, 2);
        assert!(said.contains(&format!("it is not what {what}")), "{said}");
        bench
            .mimic(&[second, &["--force"]].concat())
            .assert()
            .success();
        bench.mimic(second).assert().success();
        bench.complaint(first, 2);
    }
}

/// What lies in the way of a run's own files is for its owner to move.
#[test]
fn what_is_in_the_way_of_a_runs_files_is_told() {
    for file in [
        "eval.json",
        "policy.safetensors",
        "replay.rrd",
        "metrics.jsonl",
        "checkpoint.safetensors",
    ] {
        let bench = Workbench::with_clip();
        bench.write("long.json", br#"{ "environments": 4, "group": 4, "horizon": 8, "round": 1, "samples": 96, "hidden": [8] }"#);
        let line = [
            "train",
            "sway.txt",
            "--preset",
            "long.json",
            "--minutes",
            "1e-9",
        ];
        bench.mimic(&line).assert().success();
        for link in [false, true] {
            let path = bench.path("runs/sway").join(file);
            match path.is_dir() {
                true => fs::remove_dir(&path),
                false => fs::remove_file(&path),
            }
            .ok();
            match link {
                #[cfg(unix)]
                true => std::os::unix::fs::symlink(&path, &path).expect("linked"),
                #[cfg(not(unix))]
                true => continue,
                false => fs::create_dir(&path).expect("made"),
            }
            // A link is replaced by who writes a whole file.
            let output = bench.mimic(&["train", "--resume", "sway"]).assert();
            let output = output.get_output();
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            match output.status.code() {
                Some(0) if link => continue,
                code => assert_eq!(code, Some(2), "{file}, link {link}: {said}"),
            }
            assert!(said.contains(file) && said.contains("; "), "{said}");
            if file == "metrics.jsonl" {
                let said = bench.complaint(&["plot", "sway"], 2);
                assert!(
                    said.contains(file) && !said.contains("train the run"),
                    "{said}"
                );
            }
        }
    }
}

#[test]
fn names_that_no_file_can_have_are_refused() {
    let bench = Workbench::with_run();
    let long = "x".repeat(5000);
    let (clip, rrd) = (format!("{long}.clip"), format!("{long}.rrd"));
    for line in [
        &["import", "sway.txt", "--out", &clip][..],
        &["edit", "sway.txt", "--mirror", "--out", &clip],
        &["replay", "sway.txt", "--save", &rrd],
        &["train", "sway.txt", "--preset", "tiny.json", "--out", &long],
        &["eval", "sway", "--out", &long],
        &["info", &clip],
        &["eval", &long],
        &["train", &clip],
        &["runs", &long],
        &["retarget", "sway.txt", "--map", &long],
        &["train", "sway.txt", "--preset", &long],
        &["train", "sway.txt", "--skeleton", &long],
    ] {
        let said = bench.complaint(line, 2);
        assert!(said.len() < 20_000, "{}", said.len());
    }
}

/// A result whose metadata somebody changed is theirs.
#[test]
fn what_is_changed_in_any_part_stays() {
    let bench = Workbench::with_clip();
    for (line, file, fields) in [
        (
            ["import", "sway.txt"],
            "sway.clip",
            &[r#"\"name\":\"sway\""#, r#"\"loop\":\"wrap\""#, "rootjoint"][..],
        ),
        (
            ["retarget", "sway.txt"],
            "sway.motion",
            &[r#"\"name\":\"sway\""#, r#"\"loop\":\"wrap\""#],
        ),
    ] {
        for field in fields {
            bench.mimic(&line).arg("--force").assert().success();
            // The same once more is no change.
            bench.mimic(&line).assert().success();
            let bytes = fs::read(bench.path(file)).expect("it is there");
            let at = bytes
                .windows(field.len())
                .position(|some| some == field.as_bytes());
            let Some(at) = at else {
                // What a format calls its joints is no concern of this test.
                continue;
            };
            let mut changed = bytes.clone();
            let letter = at + field.len() - 3;
            changed[letter] = if changed[letter] == b'a' { b'b' } else { b'a' };
            if field.contains("loop") {
                changed = bytes.clone();
                changed[at..at + field.len()].copy_from_slice(br#"\"loop\":\"wrap\""#);
                changed[at + 11..at + 15].copy_from_slice(b"clam");
            }
            bench.write(file, &changed);
            let error = bench.error_about(file, &line, 2);
            assert!(error["remedy"].to_string().contains("--force"), "{error}");
            assert_eq!(fs::read(bench.path(file)).ok(), Some(changed), "{field}");
        }
    }
}

/// A result that is put beside another source of the same name was made from the first.
#[test]
fn a_result_that_was_moved_beside_a_namesake_stays() {
    let bench = with_namesakes();
    let at = |folder: &str, line: &[&str]| {
        let mut command = bench.mimic(line);
        command.current_dir(bench.path(folder));
        command
    };
    for (line, file) in [
        (&["import", "sway.txt"][..], "sway.clip"),
        (&["retarget", "sway.txt"], "sway.motion"),
        (&["tracks", "sway.txt", "--plot", "sway.svg"], "sway.svg"),
        #[cfg(feature = "rerun")]
        (&["replay", "sway.txt", "--save", "sway.rrd"], "sway.rrd"),
    ] {
        at("a", line).assert().success();
        // Exported again, at the same place.
        let text = fs::read(bench.path("a/sway.txt")).expect("it is there");
        fs::write(bench.path("a/sway.txt"), [&text[..], b"\n"].concat()).expect("written");
        at("a", line).assert().success();
        let [from, to] = ["a", "b"].map(|folder| bench.path(folder).join(file));
        fs::rename(from, &to).expect("moved");
        let before = fs::read(&to).expect("it is there");
        at("b", line).assert().code(2);
        assert_eq!(fs::read(&to).ok(), Some(before), "{file}");
        // Both moved together are as they were.
        fs::create_dir_all(bench.path("c")).expect("a folder");
        fs::copy(bench.path("a/sway.txt"), bench.path("c/sway.txt")).expect("copied");
        fs::rename(&to, bench.path("c").join(file)).expect("moved");
        at("c", line).assert().success();
    }
}
