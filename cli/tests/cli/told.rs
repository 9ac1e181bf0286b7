//! What the program chooses or changes by itself, it says: without `--verbose`, in a line.

use crate::import::with_two_takes;
use crate::workbench::Workbench;
use serde_json::Value;

/// What a line that succeeds says on standard error.
fn said(bench: &Workbench, line: &[&str]) -> String {
    let output = bench.mimic(line).assert().success();
    String::from_utf8_lossy(&output.get_output().stderr).into_owned()
}

#[test]
fn a_part_that_ends_early_is_said_by_whoever_trims() {
    let bench = Workbench::with_clip();
    bench.write("tiny.json", crate::workbench::TINY);
    bench
        .mimic(&["import", "sway.txt", "--out", "whole.clip"])
        .assert()
        .success();
    for line in [
        &[
            "import",
            "sway.txt",
            "--trim",
            "0.2..9",
            "--out",
            "part.clip",
        ][..],
        &[
            "edit",
            "whole.clip",
            "--trim",
            "0.2..9",
            "--out",
            "edited.clip",
        ],
        &["retarget", "sway.txt", "--trim", "..9"],
        &[
            "train",
            "sway.txt",
            "--trim",
            "0.2..1.5",
            "--preset",
            "tiny.json",
        ],
    ] {
        let said = said(&bench, line);
        assert!(
            said.contains("ends at 1 s and not at ") && said.contains("[part-shortened]"),
            "{line:?}: {said}"
        );
    }
    for part in ["0.2..1", "0.5..", "..0.5"] {
        let line = [
            "import",
            "sway.txt",
            "--trim",
            part,
            "--out",
            "fine.clip",
            "--force",
        ];
        assert_eq!(said(&bench, &line), "", "{part}");
    }
}

#[test]
fn the_take_that_was_chosen_is_said_once() {
    let bench = with_two_takes();
    let line = ["import", "two.gltf"];
    let note = said(&bench, &line);
    assert!(
        note.starts_with("note: `two.gltf`: ") && note.contains("chose take `up`"),
        "{note}"
    );
    assert!(note.contains("(`--take TAKE`)"), "{note}");
    assert_eq!(note.lines().count(), 1, "{note}");
    assert_eq!(
        said(&bench, &[&line[..], &["-v"]].concat())
            .matches("chose take")
            .count(),
        1
    );
    assert_eq!(said(&bench, &[&line[..], &["--quiet"]].concat()), "");
    // Who chooses is told nothing, nor who works on the clip later.
    assert_eq!(said(&bench, &["import", "two.gltf", "--take", "up"]), "");
    assert!(!said(&bench, &["edit", "two.clip", "--speed", "2"]).contains("chose take"));
}

#[test]
fn takes_are_named_as_a_shell_takes_them() {
    let bench = with_two_takes();
    let text = std::fs::read_to_string(bench.path("two.gltf")).expect("it is text");
    let text = text
        .replace("\"up\"", "\"Rig|jump_a\"")
        .replace("\"down\"", "\"Rig|down\"");
    bench.write("two.gltf", text.as_bytes());
    let remedy = |take: &str| bench.error(&["import", "two.gltf", "--take", take], 2);
    let near = remedy("jump")["remedy"]
        .as_str()
        .unwrap_or_default()
        .to_owned();
    assert!(near.starts_with("did you mean `jump_a`?"), "{near}");
    bench
        .mimic(&["import", "two.gltf", "--take", "jump_a"])
        .assert()
        .success();
    for number in ["0", "3", "99"] {
        let message = remedy(number)["message"].to_string();
        let expected = format!("there is no take number {number}: the file has 2 takes");
        assert!(message.contains(&expected), "{message}");
    }
}

#[test]
fn a_motion_of_another_character_than_the_presets_is_said() {
    let bench = Workbench::with_clip();
    bench.mimic(&["retarget", "sway.txt"]).assert().success();
    let set = [
        "--samples",
        "1",
        "--set",
        "environments=8",
        "--set",
        "horizon=8",
        "--set",
        "hidden=[8]",
    ];
    let train = |line: &[&str]| said(&bench, &[&["train"], line, &set[..]].concat());
    let other = train(&["sway.motion", "--preset", "booth2020"]);
    for word in ["`humanoid`", "`marathon`", "`booth2020`", "give the clip"] {
        assert!(other.contains(word), "{word}: {other}");
    }
    assert!(!train(&["sway.motion"]).contains("character"));
    assert!(!train(&["sway.motion", "--preset", "deepmimic"]).contains("character"));
    assert!(!train(&["sway.txt", "--preset", "booth2020"]).contains("was made for"));
}

#[test]
fn a_motion_that_is_given_twice_is_said() {
    let bench = Workbench::with_clip();
    bench.write("tiny.json", crate::workbench::TINY);
    let line = ["train", "sway.txt", "./sway.txt", "--preset", "tiny.json"];
    assert!(said(&bench, &line).contains("is given more than once"));
}

#[test]
fn samples_come_in_iterations() {
    let bench = Workbench::with_clip();
    bench.write("tiny.json", crate::workbench::TINY);
    let line = [
        "train",
        "sway.txt",
        "--preset",
        "tiny.json",
        "--samples",
        "5",
    ];
    let output = bench.mimic(&line).assert().success();
    let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    let why = "it learned from 32 samples, not 5, because samples come in iterations of 32";
    assert!(
        text.lines()
            .nth(1)
            .is_some_and(|verdict| verdict.contains(why)),
        "{text}"
    );
    let output = bench.mimic(&["runs"]).assert().success();
    let listed = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    assert!(listed.contains("  5 of 5  "), "{listed}");
    let exact: Value = bench.json(&["runs"]);
    assert_eq!(exact["runs"][0]["samples"], 32);
}

/// Of a run that was cut within a round, all say where it goes on.
#[test]
fn a_run_that_was_cut_short_has_one_number() {
    let bench = Workbench::with_clip();
    let plan = br#"{ "environments": 4, "group": 4, "horizon": 8, "round": 50, "samples": 32000, "hidden": [8] }"#;
    bench.write("long.json", plan);
    let line = [
        "train",
        "sway.txt",
        "--preset",
        "long.json",
        "--minutes",
        "1e-9",
    ];
    let text = |line: &[&str]| {
        let output = bench.mimic(line).assert().success();
        String::from_utf8_lossy(&output.get_output().stdout).into_owned()
    };
    let end = text(&line);
    assert!(
        end.contains(
            "train --resume runs/sway` goes on from the last one, at 0 of 32k samples, and repeats"
        ),
        "{end}"
    );
    assert!(text(&["runs"]).contains("0 of 32k"));
    let plot = text(&["plot", "sway"]);
    assert!(plot.contains("(0 of them saved)"), "{plot}");
    assert_eq!(bench.json(&["runs"])["runs"][0]["samples"], 0);
}

/// A command that is shown can be pasted, whatever the names in it.
#[cfg(unix)]
#[test]
fn commands_that_are_shown_can_be_pasted() {
    let bench = Workbench::with_run();
    let name = "it's my $HOME";
    let line = ["train", "sway.txt", "--preset", "tiny.json", "--out", name];
    let output = bench.mimic(&line).assert().success();
    let end = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    let quoted = r"'it'\''s my $HOME'";
    assert!(end.contains(&format!("replay {quoted} --rerun")), "{end}");
    let again = bench.complaint(&line, 2);
    assert!(again.contains(&format!("`--resume {quoted}`")), "{again}");
    let done = bench.complaint(&["train", "--resume", name], 2);
    assert!(done.contains(&format!("eval {quoted}`")), "{done}");
    std::fs::rename(bench.path("runs/sway"), bench.path("-sway")).expect("renamed");
    let folder = bench.complaint(&["tracks", "--", "-sway"], 2);
    assert!(folder.contains("`mimic replay ./-sway`"), "{folder}");
}

/// What is wrong is said of what was typed, and what to do can be typed.
#[test]
fn wrong_lines_lead_to_right_ones() {
    let bench = Workbench::with_run();
    bench.mimic(&["import", "sway.txt"]).assert().success();
    for (line, parts) in [
        (
            &["runs", "sway.txt"][..],
            &["this is a file, and a run is a folder", "sway"][..],
        ),
        (
            &["import", "sway.txt", "sway.txt", "--out", "a.clip"],
            &["`--out a/`"],
        ),
        (
            &["train", "sway.txt", "--set", "ppo.gamma=abc"],
            &["expected a number", "0.95"],
        ),
        (
            &["eval", "sway", "walk"],
            &["`mimic plot sway walk`", "`mimic runs`"],
        ),
        (
            &["edit", "sway.txt", "--take", "1"],
            &["`mimic import sway.txt --take 1`"],
        ),
        (
            &["train", "--resume", "sway", "--samples", "9M"],
            &["number of samples is fixed"],
        ),
        (&["eval", "zzz"], &["there is no run of this name"]),
    ] {
        let said = bench.complaint(line, 2);
        for part in parts {
            assert!(said.contains(part), "{line:?}: {said}");
        }
        assert!(!said.contains("f64") && !said.contains("f32"), "{said}");
    }
}

/// A figure that can't be retargeted is told before its map, whatever else is in the file.
#[test]
fn a_figure_that_is_no_humanoid_is_told_first() {
    let bench = with_two_takes();
    let info = bench.json(&["info", "two.gltf"]);
    assert_eq!(info["problems"][0]["id"], "not-humanoid");
    let output = bench.mimic(&["info", "two.gltf"]).assert().success();
    let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    let first = text.lines().skip_while(|line| *line != "problems").nth(1);
    assert!(
        first.is_some_and(|line| line.contains("not-humanoid")),
        "{text}"
    );
    let whole = Workbench::with_clip();
    let output = whole.mimic(&["info", "sway.txt"]).assert().success();
    let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    assert!(text.contains("\njoint map\n"), "{text}");
}

#[cfg(feature = "rerun")]
mod viewer {
    use super::*;
    use std::net::TcpListener;

    #[test]
    fn what_is_no_viewer_or_says_nothing_is_not_waited_for() {
        let bench = Workbench::with_clip();
        let silent = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let place = silent.local_addr().expect("an address").to_string();
        let said = bench.complaint(&["replay", "sway.txt", "--connect", &place], 1);
        assert!(
            said.contains(&place) && said.contains("does not answer as a viewer"),
            "{said}"
        );
    }

    #[test]
    fn a_motion_that_a_run_has_not_learned_is_told() {
        let bench = Workbench::with_run();
        let line = ["replay", "sway", "--motion", "2", "--save", "a.rrd"];
        let said = bench.complaint(&line, 2);
        assert!(
            said.contains("1 motion, so there is no number 2; leave `--motion` out"),
            "{said}"
        );
        let said = bench.complaint(&["replay", "sway"], 2);
        assert!(
            said.contains("does not say where to show the replay; say it: "),
            "{said}"
        );
    }
}
