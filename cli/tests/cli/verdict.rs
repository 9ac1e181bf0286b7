//! What is said of a run at its end.

use crate::workbench::{Workbench, still};
use serde_json::Value;
use std::path::Path;

/// A plan of many rounds, of which the first is soon done.
const LONG: &[u8] = br#"{ "environments": 4, "group": 4, "horizon": 8, "round": 1, "samples": 3200, "hidden": [8] }"#;

/// Trains our kick for a moment, after which it falls.
const KICK: [&str; 4] = ["train", "kick.fbx", "--preset", "tiny.json"];

/// With a run, and with our kick.
fn with_kick() -> Workbench {
    let bench = Workbench::with_run();
    let ours = Path::new(env!("CARGO_MANIFEST_DIR")).join("../clips/kick.fbx");
    std::fs::copy(ours, bench.path("kick.fbx")).expect("it can be copied");
    bench
}

fn text(bench: &Workbench, line: &[&str]) -> String {
    let output = bench.mimic(line).assert().success();
    String::from_utf8_lossy(&output.get_output().stdout).into_owned()
}

fn lines(text: &str) -> Vec<Value> {
    let lines = text.lines().map(serde_json::from_str);
    lines.collect::<Result<_, _>>().expect("lines of JSON")
}

#[test]
fn training_ends_with_a_verdict_and_what_is_good() {
    let bench = with_kick();
    let end = text(&bench, &[&KICK[..], &["--out", "run"]].concat());
    let evaluated = text(&bench, &["eval", "run"]);
    let mut said = end.lines();
    assert_eq!(said.next(), Some("run"));
    let verdict = said.next().unwrap_or_default();
    let kept = std::fs::read(bench.path("run/eval.json")).expect("it was evaluated");
    let kept: Value = serde_json::from_slice(&kept).expect("it is JSON");
    assert!(
        verdict.starts_with(kept["verdict"].as_str().expect("a verdict")),
        "{verdict}"
    );
    assert_eq!(kept["learned"], verdict.starts_with("learned"));
    // Who kicks after a few dozen samples has learned nothing, and is told how to.
    assert!(verdict.starts_with("not yet learned: "), "{verdict}");
    assert!(
        verdict.ends_with("by the same command with `--samples 4M`"),
        "{verdict}"
    );
    let table: Vec<&str> = said
        .take_while(|line| !line.starts_with("recording"))
        .collect();
    assert_eq!(
        table,
        evaluated
            .lines()
            .skip(2)
            .take_while(|line| !line.starts_with("watch it"))
            .collect::<Vec<_>>(),
        "one table"
    );
    assert!(
        table[0].starts_with("kick, 32 episodes") && table[0].ends_with("good"),
        "{end}"
    );
    for (measure, good) in [
        ("survival  ", "95.0 % or more"),
        ("body error, root subtracted  ", "50.0 mm or less"),
        ("contact F1", "more is better"),
        ("foot skate", "less is better"),
        ("root turned  ", "near "),
    ] {
        let mut row = table
            .iter()
            .filter(|row| row.trim_start().starts_with(measure));
        assert!(row.any(|row| row.contains(good)), "{measure}: {end}");
    }
    assert!(table.iter().all(|row| row.chars().count() <= 80), "{end}");
}

/// Each row with a bound says whether it misses it, and what isn't defined is no number.
#[test]
fn rows_that_miss_their_bound_are_marked_and_nothing_is_a_share_of_nothing() {
    let bench = with_kick();
    bench.write("still.txt", still().to_string().as_bytes());
    let plan = ["train", "still.txt", "--preset", "tiny.json"];
    let ends = [text(&bench, &plan), text(&bench, &KICK)];
    let mut missed = 0;
    for line in ends.iter().flat_map(|end| end.lines()) {
        let number = |text: &str| -> Option<f64> {
            let digits = text.split_whitespace().rev().nth(1)?;
            digits.parse().ok()
        };
        let mark = line.ends_with("  missed");
        missed += usize::from(mark);
        for (word, misses) in [
            (" or more", f64::lt as fn(&f64, &f64) -> bool),
            (" or less", f64::gt),
        ] {
            let Some((row, _)) = line.split_once(word) else {
                continue;
            };
            let (row, bound) = row.split_at(row.rfind("  ").expect("columns"));
            let (value, bound) = (number(row), number(bound));
            let (value, bound) = (value.expect("a value"), bound.expect("a bound"));
            assert_eq!(mark, misses(&value, &bound), "{line}");
        }
    }
    assert!(missed > 0, "{ends:?}");
    let row = ends[0]
        .lines()
        .find(|line| line.contains("angular momentum error"));
    let cells: Vec<&str> = row.expect("it is listed").split_whitespace().collect();
    assert_eq!(cells[3], "-", "{cells:?}");
    let kept = bench.json(&["eval", "runs/still"]);
    assert!(kept["angular_momentum_error"].is_null(), "{kept}");
    // Who reads the run isn't stopped by it.
    for line in [
        &["runs"][..],
        &["plot", "still"],
        &["plot", "still", "--json"],
    ] {
        bench.mimic(line).assert().success();
    }
}

#[test]
fn an_evaluation_names_its_run_and_how_to_watch_it() {
    let bench = Workbench::with_run();
    let shown = text(&bench, &["eval"]);
    assert_eq!(shown.lines().next(), Some("runs/sway"));
    let last = shown.lines().last().unwrap_or_default();
    assert!(
        last.starts_with("watch it") && last.ends_with(" replay runs/sway --rerun"),
        "{last}"
    );
}

#[test]
fn several_motions_have_one_sentence() {
    let bench = Workbench::with_run();
    let line = ["train", "sway.txt", "sway.txt", "--preset", "tiny.json"];
    let end = text(&bench, &line);
    let verdict = end.lines().nth(1).unwrap_or_default();
    let counts = [
        "learned 0 of 2 motions; ",
        "learned 1 of 2 motions; ",
        "learned 2 of 2 motions",
    ];
    assert!(
        counts.iter().any(|count| verdict.starts_with(count)),
        "{end}"
    );
    assert_eq!(end.matches("sway, 32 episodes").count(), 2);
}

#[test]
fn a_run_that_was_cut_short_says_so_and_how_to_go_on() {
    let bench = Workbench::with_clip();
    bench.write("long.json", LONG);
    let line = [
        "train",
        "sway.txt",
        "--preset",
        "long.json",
        "--minutes",
        "1e-9",
    ];
    let end = text(&bench, &line);
    let verdict = end.lines().nth(1).unwrap_or_default();
    let cut = "stopped by `--minutes` after 32 of 3.2k samples; go on with `";
    assert!(
        verdict.contains(cut) && verdict.ends_with(" train --resume runs/sway`"),
        "{end}"
    );
    let done = text(&bench, &["train", "--resume", "runs/sway"]);
    assert!(!done.contains("--minutes"), "{done}");
}

#[test]
fn the_last_line_of_json_says_why_training_ended() {
    let bench = Workbench::with_clip();
    bench.write("long.json", LONG);
    let line = ["train", "sway.txt", "--preset", "long.json", "--json"];
    let cut = lines(&text(&bench, &[&line[..], &["--minutes", "1e-9"]].concat()));
    assert_eq!(cut.len(), 2, "one iteration, and the end");
    let kept = |run: &str| -> Value {
        let kept = std::fs::read(bench.path(run).join("eval.json")).expect("it was evaluated");
        serde_json::from_slice(&kept).expect("it is JSON")
    };
    let expected = |stopped: &str| {
        let eval = kept("runs/sway");
        serde_json::json!({ "run": "runs/sway", "stopped": stopped, "eval": eval })
    };
    assert_eq!(cut[1], expected("minutes"));
    let done = lines(&text(&bench, &["train", "--resume", "sway", "--json"]));
    assert_eq!(done.last(), Some(&expected("samples")));
    assert_eq!(done.len(), 100, "99 iterations more, and the end");
    // What a killed session left out is made up for, and reported.
    std::fs::remove_file(bench.path("runs/sway/eval.json")).expect("it was evaluated");
    let again = lines(&text(&bench, &["train", "--resume", "sway", "--json"]));
    assert_eq!(again, [expected("samples")]);
}

#[cfg(unix)]
#[test]
fn an_interrupt_is_the_last_line_too() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    let bench = Workbench::with_clip();
    let plan = String::from_utf8_lossy(LONG).replace("3200", "320000000");
    bench.write("endless.json", plan.as_bytes());
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("mimic"));
    let mut running = command
        .args(["train", "sway.txt", "--preset", "endless.json", "--json"])
        .current_dir(bench.path("."))
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let out = running.stdout.take().expect("it is piped");
    let mut lines = BufReader::new(out).lines();
    lines
        .next()
        .expect("a first iteration")
        .expect("it is text");
    let id = running.id().to_string();
    let kill = Command::new("kill").args(["-INT", &id]).status();
    assert!(kill.is_ok_and(|status| status.success()));
    let last = lines.last().expect("a last line").expect("it is text");
    assert!(running.wait().is_ok_and(|status| status.success()));
    let expected = serde_json::json!({ "run": "runs/sway", "stopped": "interrupt", "eval": null });
    assert_eq!(serde_json::from_str::<Value>(&last).ok(), Some(expected));
}
