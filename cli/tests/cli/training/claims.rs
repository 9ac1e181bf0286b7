//! A run is one process's: its folder is claimed, held while it is trained, and never shared.

use super::{SMALL, lines, with_preset, with_run};
use crate::workbench::Workbench;
use serde_json::{Value, json};
use std::process::{Child, Command, Stdio};

/// Starts the program without waiting for it.
fn start(bench: &Workbench, arguments: &[&str]) -> Child {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("mimic"));
    command
        .args(arguments)
        .current_dir(bench.path("."))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command.spawn().expect("the program starts")
}

fn object(bench: &Workbench, file: &str) -> Value {
    let text = std::fs::read(bench.path(file)).unwrap_or_default();
    serde_json::from_slice(&text).unwrap_or_default()
}

/// A run that is trained for a second or more.
fn long(bench: &Workbench) -> Child {
    bench.write(
        "long.json",
        br#"{ "environments": 8, "group": 4, "horizon": 16, "round": 2, "samples": 100000000, "hidden": [16] }"#,
    );
    let line = ["train", "sway.txt", "--preset", "long.json", "--out", "run"];
    let child = start(bench, &line);
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(60);
    while !bench.path("run/checkpoint.safetensors").exists() && std::time::Instant::now() < deadline
    {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child
}

fn end(mut child: Child) {
    child.kill().expect("a signal can be sent");
    child.wait().expect("the program ends");
}

#[test]
fn trainings_that_start_at_once_make_a_run_each() {
    let bench = with_preset();
    let seeds = ["11", "12", "13", "14"];
    let train = |seed| {
        let line = [
            "train",
            "sway.txt",
            "--preset",
            "small.json",
            "--seed",
            seed,
        ];
        start(&bench, &line)
    };
    let children: Vec<Child> = seeds.map(train).into();
    let mut folders = Vec::new();
    for (child, seed) in children.into_iter().zip(seeds) {
        let output = child.wait_with_output().expect("the program ends");
        assert!(output.status.success(), "{output:?}");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let folder = text.lines().next().expect("the folder").to_owned();
        let config = object(&bench, &format!("{folder}/config.json"));
        assert_eq!(config["plan"]["seed"].to_string(), seed, "{folder}");
        // The policy is that of the seed, too: learned alone, it comes out the same.
        let alone = format!("alone-{seed}");
        let line = [
            "train",
            "sway.txt",
            "--preset",
            "small.json",
            "--seed",
            seed,
        ];
        bench
            .mimic(&[&line[..], &["--out", &alone]].concat())
            .assert()
            .success();
        let policy = |run: &str| std::fs::read(bench.path(run).join("policy.safetensors")).ok();
        assert!(policy(&folder).is_some());
        assert_eq!(policy(&folder), policy(&alone), "{folder}");
        let logged = std::fs::read(bench.path(&folder).join("metrics.jsonl")).unwrap_or_default();
        assert_eq!(lines(&logged).len(), 4, "{folder}");
        folders.push(folder);
    }
    folders.sort();
    let expected = ["runs/sway", "runs/sway-2", "runs/sway-3", "runs/sway-4"];
    assert_eq!(folders, expected);
}

#[test]
fn who_comes_second_is_told_who_holds_the_run() {
    let bench = with_preset();
    let child = long(&bench);
    let holder = format!("(process {}, ", child.id());
    for line in [&["train", "--resume", "run"][..], &SMALL] {
        let said = bench.complaint(line, 2);
        let said_who = said.contains(&holder) || said.contains("already holds a run");
        assert!(said_who, "{said}");
    }
    let said = bench.complaint(&["train", "--resume", "run"], 2);
    assert!(said.contains(&holder), "{said}");
    // Its policy can be measured, but is soon another one.
    let output = bench.mimic(&["eval", "run"]).assert().success();
    let said = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
    assert!(
        said.contains("not kept") && said.contains(&holder),
        "{said}"
    );
    assert!(!bench.path("run/eval.json").exists());
    end(child);
    // The lock went with the process, however that ended.
    bench
        .mimic(&["train", "--resume", "run", "--minutes", "1e-9"])
        .assert()
        .success();
}

#[test]
fn a_run_wants_a_folder_of_its_own() {
    let bench = with_preset();
    let train = |out: &str| {
        let line = ["train", "sway.txt", "--preset", "small.json", "--out", out];
        bench.error_about(out, &line, 2)
    };
    bench.write("eval.json", b"mine");
    let before = std::fs::read_dir(bench.path(".")).expect("listed").count();
    for (out, cause) in [
        (".", "holds other files"),
        ("/", "holds other files"),
        ("eval.json", "this is not a folder"),
    ] {
        let message = train(out)["message"].to_string();
        assert!(message.contains(cause), "{message}");
    }
    // The file in the way is named, not what would lie in it.
    let line = ["train", "sway.txt", "--preset", "small.json"];
    let inside = [&line[..], &["--out", "eval.json/run"]].concat();
    bench.error_about("eval.json", &inside, 2);
    assert_eq!(object(&bench, "eval.json"), Value::Null);
    let after = std::fs::read_dir(bench.path(".")).expect("listed").count();
    assert_eq!(before, after, "nothing was added");
    bench.write("runs", b"");
    bench.error_about("runs", &line, 2);
    std::fs::remove_file(bench.path("runs")).expect("removed");
    // An empty folder will do.
    std::fs::create_dir(bench.path("run")).expect("a folder");
    bench.mimic(&SMALL).assert().success();
}

#[test]
fn a_run_that_fails_before_its_first_checkpoint_leaves_nothing() {
    let bench = with_preset();
    // Learning this fast ends in numbers that are not finite.
    let line = [
        "train",
        "sway.txt",
        "--preset",
        "small.json",
        "--set",
        "ppo.learning_rate=1e30",
        "--set",
        "ppo.max_learning_rate=1e30",
        "--set",
        "ppo.target_kl=null",
    ];
    let said = bench.complaint(&line, 1);
    assert!(said.contains("not finite"), "{said}");
    assert!(!bench.path("runs/sway").exists());
    // What a killed process left is no run that is picked up without its name, and its folder stays its own.
    bench.mimic(&SMALL).assert().success();
    std::fs::create_dir_all(bench.path("runs/left")).expect("a folder");
    for file in [
        "config.json",
        "skeleton.xml",
        "skeleton.json",
        "reference-0.motion",
    ] {
        let from = bench.path("run").join(file);
        std::fs::copy(from, bench.path("runs/left").join(file)).expect("copied");
    }
    let said = bench.complaint(&["eval"], 2);
    assert!(said.contains("nothing was saved of this run yet"), "{said}");
    bench
        .mimic(&["train", "--resume", "left"])
        .assert()
        .success();
    assert_eq!(bench.json(&["eval"]), bench.json(&["eval", "left"]));
}

#[test]
fn a_lost_or_damaged_policy_is_made_again_from_the_checkpoint() {
    let bench = with_run();
    let policy = bench.path("run/policy.safetensors");
    let whole = std::fs::read(&policy).expect("it was saved");
    let resume = ["train", "--resume", "run"];
    let mut cut = whole.clone();
    cut.truncate(whole.len() / 2);
    // The last bytes of the file are numbers of the policy.
    let mut altered = whole.clone();
    let last = altered.len() - 2;
    altered[last] ^= 1;
    for (damage, what) in [
        (None, "lost"),
        (Some(cut), "cut"),
        (Some(altered), "altered"),
    ] {
        match damage {
            Some(bytes) => std::fs::write(&policy, bytes).expect("written"),
            None => std::fs::remove_file(&policy).expect("removed"),
        }
        bench.mimic(&resume).assert().success();
        assert_eq!(std::fs::read(&policy).ok(), Some(whole.clone()), "{what}");
        assert_eq!(object(&bench, "run/eval.json")["episodes"], json!(32));
    }
}

/// All files of a folder and their bytes.
fn contents(bench: &Workbench, folder: &str) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(bench.path(folder)).into_iter().flatten();
    let mut files: Vec<_> = entries
        .flatten()
        .map(|entry| {
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, std::fs::read(entry.path()).unwrap_or_default())
        })
        .collect();
    files.sort();
    files
}

/// Whatever takes the place of the folder that is trained in, it is not written, and the trainer says why it stops.
#[cfg(unix)]
#[test]
fn a_trainer_whose_folder_is_moved_stops_and_spares_what_takes_its_place() {
    let bench = with_run();
    std::fs::rename(bench.path("run"), bench.path("other")).expect("moved");
    for place in ["nothing", "a run", "an empty folder", "a link to a run"] {
        let child = long(&bench);
        std::fs::rename(bench.path("run"), bench.path("away")).expect("moved");
        match place {
            "nothing" => {}
            "a run" => {
                std::fs::create_dir(bench.path("run")).expect("a folder");
                for (name, bytes) in contents(&bench, "other") {
                    bench.write(&format!("run/{name}"), &bytes);
                }
            }
            "an empty folder" => std::fs::create_dir(bench.path("run")).expect("a folder"),
            _ => std::os::unix::fs::symlink("other", bench.path("run")).expect("a link"),
        }
        let before = contents(&bench, "run");
        let output = child.wait_with_output().expect("the program ends");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{place}: {said}");
        assert_eq!(said.lines().count(), 1, "{place}: {said}");
        assert!(
            said.contains("`run`: the folder of this run was moved"),
            "{said}"
        );
        assert_eq!(contents(&bench, "run"), before, "{place}");
        // It goes on where its folder is now.
        let line = ["train", "--resume", "away", "--minutes", "1e-9"];
        bench.mimic(&line).assert().success();
        std::fs::remove_dir_all(bench.path("away")).expect("removed");
        std::fs::remove_dir_all(bench.path("run"))
            .or_else(|_| std::fs::remove_file(bench.path("run")))
            .ok();
    }
}

#[test]
fn a_folder_of_the_user_stays_and_those_made_for_a_failed_run_do_not() {
    let bench = with_preset();
    let fails = |out: &str| {
        let line = ["train", "sway.txt", "--preset", "small.json", "--out", out];
        let rates = [
            "ppo.learning_rate=1e30",
            "ppo.max_learning_rate=1e30",
            "ppo.target_kl=null",
        ];
        let set = rates.iter().flat_map(|rate| ["--set", rate]);
        let said = bench.complaint(&line.into_iter().chain(set).collect::<Vec<_>>(), 1);
        assert!(said.contains("not finite"), "{said}");
    };
    for mine in ["mine", "outer/mine"] {
        std::fs::create_dir_all(bench.path(mine)).expect("a folder");
        fails(mine);
        assert_eq!(contents(&bench, mine), [], "{mine}");
        assert!(bench.path(mine).is_dir(), "{mine}");
    }
    fails("deep/a/b");
    assert!(!bench.path("deep").exists());
    fails("outer/mine/deep/a");
    assert_eq!(contents(&bench, "outer/mine"), []);
}
