//! 0 success, 1 the work failed, 2 wrong usage or input.

use crate::workbench::Workbench;

#[test]
fn help_and_version_succeed() {
    let bench = Workbench::new();
    bench.mimic(&["--help"]).assert().success();
    bench.mimic(&["--version"]).assert().success();
    for verb in [
        "info",
        "import",
        "edit",
        "retarget",
        "tracks",
        "train",
        "runs",
        "eval",
        "replay",
        "bench",
        "doctor",
        "completions",
        "man",
    ] {
        let output = bench.mimic(&[verb, "--help"]).assert().success();
        let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
        assert!(text.contains("Examples:"), "{verb} shows examples");
    }
}

#[test]
fn a_typo_in_a_flag_or_verb_is_wrong_usage() {
    let bench = Workbench::with_clip();
    for line in [
        &["info", "sway.txt", "--jsno"][..],
        &["imprt", "sway.txt"],
        &["import"],
        &["import", "sway.txt", "--fps", "fast"],
        &["import", "sway.txt", "--trim", "2..1"],
        &["import", "sway.txt", "--up", "w"],
        &["train", "sway.txt", "--samples", "many"],
        &["train", "sway.txt", "--resume", "sway"],
        &["eval", "--episodes", "0"],
        &[],
    ] {
        bench.mimic(line).assert().code(2);
    }
}

#[test]
fn wrong_files_are_named_with_a_remedy() {
    let bench = Workbench::with_clip();
    let whole = std::fs::read(bench.path("sway.txt")).expect("the clip is there");
    bench.write("empty.fbx", b"");
    bench.write("notes.glb", b"kick it harder\n");
    bench.write("half.txt", &whole[..whole.len() / 2]);
    bench.write("half.fbx", b"Kaydara FBX Binary  \0\x1a\0\xe8\x1c\0\0");
    bench.write("half.glb", b"glTF\x02\0\0\0\xff\xff\0\0");
    bench.write("false.clip", &[0xff; 64]);
    for file in [
        "empty.fbx",
        "notes.glb",
        "half.txt",
        "half.fbx",
        "half.glb",
        "false.clip",
    ] {
        let error = bench.error_about(file, &["info", file], 2);
        let message = error["message"].as_str().unwrap_or_default();
        assert!(message.starts_with(&format!("`{file}`: ")), "{message}");
    }
    for file in ["empty.fbx", "notes.glb", "half.txt", "half.fbx", "half.glb"] {
        bench.error_about(file, &["import", file], 2);
        assert!(!bench.path(file).with_extension("clip").exists());
    }
}

/// An error is one JSON object with `--json`, that of a flag that doesn't exist as well.
#[test]
fn errors_are_json_too() {
    let bench = Workbench::new();
    let output = bench
        .mimic(&["info", "kick.fbx", "--json", "--jsno"])
        .assert()
        .code(2);
    let printed = &output.get_output().stdout;
    let printed: serde_json::Value = serde_json::from_slice(printed).expect("one JSON object");
    let error = &printed["error"];
    assert_eq!(error["exit"], 2);
    let remedy = error["remedy"].as_str().unwrap_or_default();
    assert!(remedy.contains("'--json'"), "{error}");
    assert!(error["file"].is_null() && error["place"].is_null());
}

/// Each number that can't be is refused with the reason, in one line, before any work.
#[test]
fn numbers_that_can_not_be_are_told_why() {
    let bench = Workbench::with_clip();
    for (line, reason) in [
        (
            &["train", "sway.txt", "--seed", "-1"][..],
            "must not be negative",
        ),
        (
            &["train", "sway.txt", "--seed", "1.5"],
            "not a whole number",
        ),
        (
            &["train", "sway.txt", "--samples", "1e30"],
            "must be at most 1e15",
        ),
        (
            &["train", "sway.txt", "--samples", "1.5"],
            "not a whole number",
        ),
        (
            &["train", "sway.txt", "--samples", "0"],
            "must be at least 1",
        ),
        (
            &["train", "sway.txt", "--samples", "-3"],
            "must be at least 1",
        ),
        (
            &["train", "sway.txt", "--minutes", "-3"],
            "must be greater than 0",
        ),
        (
            &["import", "sway.txt", "--fps", "1e300"],
            "must be from 0.1 to 10000",
        ),
        (
            &["import", "sway.txt", "--fps", "-3"],
            "must be greater than 0",
        ),
        (
            &["import", "sway.txt", "--trim", "-1..2"],
            "`-1` is before the start",
        ),
        (
            &["import", "sway.txt", "--trim", "2..1"],
            "the end must come after the start",
        ),
        (
            &["import", "sway.txt", "--take", ""],
            "a value is required for '--take <TAKE>'",
        ),
        (
            &["import", "sway.txt", "--out", ""],
            "a value is required for '--out <PATH>'",
        ),
        (
            &["edit", "sway.txt", "--speed", "-2"],
            "must be greater than 0",
        ),
        (
            &["edit", "sway.txt", "sway.txt", "--blend", "-2"],
            "must not be negative",
        ),
        (&["plot", "--smooth", "-2"], "must not be negative"),
        (&["eval", "--episodes", "0"], "must be from 1 to"),
        (
            &["replay", "sway.txt", "--motion", "-2"],
            "must not be negative",
        ),
    ] {
        let said = bench.complaint(line, 2);
        assert!(said.contains(reason), "{line:?}: {said}");
        assert!(said.contains("; "), "a remedy: {said}");
        bench.error(line, 2);
    }
}

#[test]
fn an_empty_variable_is_as_good_as_none() {
    let bench = Workbench::with_clip();
    std::fs::create_dir(bench.path("clips")).expect("a folder can be made");
    std::fs::rename(bench.path("sway.txt"), bench.path("clips/sway.txt")).expect("moved");
    let mut info = bench.mimic(&["info", "sway"]);
    info.env("MIMIC_LIBRARY", "").assert().success();
}

/// A folder and a file that may not be read are there, whatever the command had hoped for.
#[test]
fn what_is_there_is_not_called_missing() {
    let bench = Workbench::with_run();
    for folder in ["shelf", "runs"] {
        std::fs::create_dir_all(bench.path(folder)).expect("a folder can be made");
        let error = bench.error_about(folder, &["info", folder], 2);
        assert!(
            error["message"]
                .as_str()
                .is_some_and(|m| m.contains("this is a folder"))
        );
    }
    let said = bench.complaint(&["info", "runs/sway"], 2);
    assert!(
        said.contains("this is the folder of a run") && said.contains("`mimic replay runs/sway`"),
        "{said}"
    );
    // A name of a file that goes on after the file, and one that no system takes.
    bench.error_about("sway.txt/deep.fbx", &["info", "sway.txt/deep.fbx"], 2);
    let long = format!("{}.fbx", "x".repeat(300));
    let said = bench.complaint(&["info", &long], 2);
    assert!(said.contains("cannot be read"), "{said}");
}

/// Whatever is wrong and whichever verb says so, standard output has one object, and its exit code is the program's.
#[test]
fn every_verb_fails_in_json() {
    let bench = Workbench::with_run();
    bench.write("empty.fbx", b"");
    bench.write("notes.txt", b"kick it harder");
    let verbs = [
        "info",
        "import",
        "edit",
        "retarget",
        "tracks",
        "train",
        "runs",
        "eval",
        "replay",
        "plot",
        "bench",
        "doctor",
        "completions",
        "man",
    ];
    let mut lines: Vec<Vec<&str>> = verbs.map(|verb| vec![verb, "--nothing"]).into();
    // Those that take a file or a run, without it and with wrong ones.
    for wrong in [
        "absent",
        "empty.fbx",
        "notes.txt",
        "far/away.clip",
        "",
        "--",
    ] {
        let takes = verbs
            .iter()
            .filter(|v| !["bench", "doctor", "completions", "man"].contains(v));
        lines.extend(takes.map(|verb| match *verb {
            "replay" => vec!["replay", "--save", "a.rrd", wrong],
            verb => vec![verb, wrong],
        }));
    }
    lines.extend([
        vec![],
        vec!["--quiet"],
        vec!["trian", "sway.txt"],
        vec!["info", "sway.txt", "--quiet", "--verbose"],
        vec!["import", "sway.txt", "--fps", "fast"],
        vec!["import", "sway.txt", "--out", "sway.txt/a.clip"],
        vec!["edit", "sway.txt", "--warp", "1"],
        vec!["edit", "sway.txt", "--speed", "-1"],
        vec!["retarget", "sway.txt", "--skeleton", "absent.xml"],
        vec!["train", "sway.txt", "--samples", "many"],
        vec!["train", "sway.txt", "--set", "nothing=1"],
        vec!["train", "sway.txt", "--resume", "sway"],
        vec!["train", "--resume", "sway"],
        vec!["eval", "sway", "--episodes", "0"],
        vec!["eval", "sway", "--out", "runs/sway/config.json"],
        vec!["replay", "sway"],
        vec!["plot", "sway", "--smooth", "0"],
        vec!["bench", "--seconds", "0"],
        vec!["completions", "tcsh"],
        vec!["man", "--out", "sway.txt"],
    ]);
    let mut failed = 0;
    for line in lines {
        let output = bench
            .mimic(&["--json"])
            .args(&line)
            .output()
            .expect("it runs");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let code = output.status.code().unwrap_or(-1);
        if code == 0 {
            // `runs ""` lists nothing, and what follows `--` may be left out.
            continue;
        }
        failed += 1;
        assert!(code == 1 || code == 2, "{line:?} ends with {code}");
        assert_eq!(text.lines().count(), 1, "{line:?}: {text}");
        let printed: serde_json::Value = serde_json::from_str(&text).expect("an object");
        let error = &printed["error"];
        assert_eq!(error["exit"], code, "{line:?}");
        for part in ["message", "remedy"] {
            let part = error[part].as_str().unwrap_or_default();
            assert!(
                !part.is_empty() && !part.contains(['\n', '\x1b']),
                "{line:?}: {error}"
            );
        }
        for part in ["file", "place"] {
            assert!(
                error[part].is_null() || error[part].is_string(),
                "{line:?}: {error}"
            );
        }
        assert!(
            !output.stderr.is_empty(),
            "{line:?} says so on standard error"
        );
    }
    assert!(failed > 60, "{failed} lines failed");
}

#[test]
fn what_is_not_there_is_named() {
    let bench = Workbench::new();
    for file in ["kick.fbx", "far/kick.fbx"] {
        let said = bench.complaint(&["info", file], 2);
        assert!(said.contains(&format!("`{file}`: no such file")), "{said}");
        bench.error_about(file, &["info", file], 2);
    }
}

#[test]
fn the_input_is_never_overwritten() {
    let bench = Workbench::with_clip();
    let before = std::fs::read(bench.path("sway.txt")).expect("the clip is there");
    for out in ["sway.txt", "./sway.txt"] {
        let said = bench.complaint(&["import", "sway.txt", "--out", out], 2);
        assert!(said.contains("this is the input itself"), "{said}");
    }
    let said = bench.complaint(&["info", "sway.txt", "--write-map", "sway.txt"], 2);
    assert!(said.contains("this is the input itself"), "{said}");
    let after = std::fs::read(bench.path("sway.txt")).expect("the clip is there");
    assert_eq!(before, after);
}

#[test]
fn a_file_where_a_folder_has_to_be_is_wrong_input() {
    let bench = Workbench::with_clip();
    let line = ["import", "sway.txt", "--out", "sway.txt/deep/a.clip"];
    let error = bench.error_about("sway.txt", &line, 2);
    let message = error["message"].as_str().unwrap_or_default();
    assert!(message.contains("needs a folder"), "{message}");
}
