//! Runs that are stopped, by the clock, by Ctrl-C or by force, and go on.

use super::{SMALL, lines, with_preset, with_run, without_clock};
use crate::workbench::Workbench;
use serde_json::Value;

/// The iterations of a run, without the clock.
fn metrics(bench: &Workbench, run: &str) -> Vec<Value> {
    let text = std::fs::read(bench.path(run).join("metrics.jsonl")).unwrap_or_default();
    lines(&text).into_iter().map(without_clock).collect()
}

#[test]
fn a_run_that_is_stopped_goes_on_to_the_same_numbers() {
    let bench = with_preset();
    let train = |out, rest: &[&str]| {
        let line = ["train", "sway.txt", "--preset", "small.json"];
        let more = ["--samples", "2560", "--out", out];
        bench
            .mimic(&[&line[..], &more, rest].concat())
            .assert()
            .success();
    };
    train("whole", &[]);
    train("cut", &["--minutes", "1e-9"]);
    assert_eq!(
        metrics(&bench, "cut").len(),
        1,
        "stopped after the first iteration, in the middle of a round"
    );
    bench.mimic(&["eval", "cut"]).assert().success();
    bench
        .mimic(&["train", "--resume", "cut", "--threads", "1"])
        .assert()
        .success();
    assert_eq!(metrics(&bench, "cut"), metrics(&bench, "whole"));
}

/// The first round is longer than the time.
#[test]
fn a_run_that_was_cut_short_at_once_is_the_newest_all_the_same() {
    let bench = with_preset();
    bench.write(
        "round.json",
        br#"{ "environments": 8, "group": 4, "horizon": 16, "round": 50, "samples": 12800, "hidden": [16] }"#,
    );
    let line = ["train", "sway.txt", "--preset", "round.json"];
    let output = bench
        .mimic(&[&line[..], &["--minutes", "1e-9"]].concat())
        .assert()
        .success();
    let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    assert!(
        text.contains(
            "goes on from the last one, at 0 of 12.8k samples, and repeats what came after"
        ),
        "{text}"
    );
    assert_eq!(bench.json(&["eval"]), bench.json(&["eval", "sway"]));
}

#[test]
fn a_finished_run_is_finished_only_with_its_results() {
    let bench = with_run();
    let resume = ["train", "--resume", "run"];
    let before = metrics(&bench, "run");
    for file in ["eval.json", "replay.rrd"] {
        let path = bench.path("run").join(file);
        // Without a recording there was nothing to show.
        if std::fs::remove_file(&path).is_ok() {
            bench.mimic(&resume).assert().success();
            assert!(path.exists(), "{file} is made up for");
        }
    }
    assert_eq!(metrics(&bench, "run"), before, "nothing more was learned");
    bench.write("run/replay.rrd", b"");
    let said = bench.complaint(&resume, 2);
    for part in ["finished", "eval run", "replay run --rerun"] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn what_is_not_there_cannot_go_on() {
    let bench = with_preset();
    let said = bench.complaint(&["train", "--resume", "nothing"], 2);
    assert!(said.contains("there is no run of this name"), "{said}");
    let said = bench.complaint(&["eval", "sway.txt"], 2);
    assert!(said.contains("a run is a folder"), "{said}");
    std::fs::write(bench.path("run"), b"").expect("a file can be written");
    bench.complaint(&SMALL, 2);
}

#[cfg(unix)]
mod signals {
    use super::*;
    use std::io::Read;
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

    const ITERATIONS: usize = 160;
    const ROUND: u64 = 8;

    /// A program that is still running when its test fails goes with it.
    struct Running(Child);

    impl Drop for Running {
        fn drop(&mut self) {
            self.0.kill().ok();
            self.0.wait().ok();
        }
    }

    fn bench() -> Workbench {
        let bench = with_preset();
        let plan = format!(
            r#"{{ "environments": 8, "group": 4, "horizon": 16, "round": {ROUND}, "samples": {}, "hidden": [16] }}"#,
            ITERATIONS * 8 * 16
        );
        bench.write("small.json", plan.as_bytes());
        bench
    }

    fn start(bench: &Workbench, arguments: &[&str]) -> Running {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("mimic"));
        command
            .args(arguments)
            .current_dir(bench.path("."))
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        Running(command.spawn().expect("the program starts"))
    }

    fn wait_until(condition: impl Fn() -> bool) {
        let deadline = Instant::now() + Duration::from_secs(60);
        while !condition() && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn interrupt(running: &Running) {
        signal(running, "-INT");
    }

    fn signal(running: &Running, signal: &str) {
        let id = running.0.id().to_string();
        let kill = Command::new("kill").args([signal, &id]).status();
        assert!(kill.is_ok_and(|status| status.success()));
    }

    /// Whole lines of the log; the one that is being written doesn't count.
    fn logged_iterations(bench: &Workbench) -> u64 {
        let text = std::fs::read_to_string(bench.path("run/metrics.jsonl")).unwrap_or_default();
        text.matches('\n').count() as u64
    }

    fn talk(running: &mut Running) -> String {
        let mut said = String::new();
        let stderr = running.0.stderr.as_mut().expect("it is piped");
        stderr.read_to_string(&mut said).expect("its talk is text");
        said
    }

    /// Iterations that the checkpoint has seen, from the header of the file.
    fn saved_iteration(bench: &Workbench) -> Option<u64> {
        let bytes = std::fs::read(bench.path("run/checkpoint.safetensors")).ok()?;
        let (length, rest) = bytes.split_first_chunk::<8>()?;
        let header = rest.get(..u64::from_le_bytes(*length) as usize)?;
        let header: Value = serde_json::from_slice(header).ok()?;
        let details = header["__metadata__"]["mimic"].as_str()?;
        serde_json::from_str::<Value>(details).ok()?["iteration"].as_u64()
    }

    fn assert_same_as_unbroken(bench: &Workbench, what: &str) {
        let whole = [
            "train",
            "sway.txt",
            "--preset",
            "small.json",
            "--out",
            "whole",
        ];
        bench.mimic(&whole).assert().success();
        let unbroken = metrics(bench, "whole");
        assert_eq!(unbroken.len(), ITERATIONS);
        assert_eq!(metrics(bench, "run"), unbroken, "{what}");
    }

    /// Ctrl-C, a system that shuts down, a terminal that closes.
    #[test]
    fn signals_save_and_stop() {
        for name in ["-INT", "-TERM", "-HUP"] {
            stops_at(name);
        }
    }

    fn stops_at(name: &str) {
        let bench = bench();
        let mut running = start(&bench, &SMALL);
        let logged = || logged_iterations(&bench);
        // In the middle of a round, so that it has something to finish.
        wait_until(|| logged() > ROUND && logged() % ROUND == 2);
        signal(&running, name);
        let status = running.0.wait().expect("the program ends");
        assert!(status.success());
        let said = talk(&mut running);
        assert!(said.contains("stopped; continue with"), "{said}");
        assert!(said.contains("train --resume run"), "{said}");

        assert!(logged() < ITERATIONS as u64, "it stopped before its end");
        assert!(logged().is_multiple_of(ROUND), "the round was finished");
        assert_eq!(saved_iteration(&bench), Some(logged()));
        bench
            .mimic(&["train", "--resume", "run"])
            .assert()
            .success();
        assert_same_as_unbroken(&bench, &format!("stopped by {name}"));
    }

    #[test]
    fn nohup_outlives_its_terminal() {
        let bench = bench();
        let mut command = Command::new("nohup");
        command
            .arg(assert_cmd::cargo::cargo_bin("mimic"))
            .args(SMALL)
            .current_dir(bench.path("."))
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        let mut running = Running(command.spawn().expect("the program starts"));
        wait_until(|| logged_iterations(&bench) > ROUND);
        signal(&running, "-HUP");
        assert!(running.0.wait().is_ok_and(|status| status.success()));
        assert_eq!(logged_iterations(&bench), ITERATIONS as u64);
    }

    /// As with `--json | head -1`.
    #[test]
    fn a_reader_that_goes_away_costs_nothing_that_was_learned() {
        let bench = bench();
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("mimic"));
        command
            .args(SMALL)
            .arg("--json")
            .current_dir(bench.path("."))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut running = Running(command.spawn().expect("the program starts"));
        drop(running.0.stdout.take());
        let status = running.0.wait().expect("the program ends");
        assert!(status.success(), "{status}");
        let said = talk(&mut running);
        assert!(said.contains("train --resume run"), "{said}");
        let logged = logged_iterations(&bench);
        assert!(logged > 0 && logged.is_multiple_of(ROUND), "{logged}");
        assert_eq!(saved_iteration(&bench), Some(logged));
        bench
            .mimic(&["train", "--resume", "run"])
            .assert()
            .success();
        assert_same_as_unbroken(&bench, "left by its reader");
    }

    #[test]
    fn ctrl_c_ends_the_evaluation_and_a_resume_makes_up_for_it() {
        let bench = with_preset();
        // So many motions that their evaluation takes longer than a signal.
        let plan = r#"{ "environments": 16, "horizon": 16, "samples": 256, "hidden": [16] }"#;
        bench.write("small.json", plan.as_bytes());
        let inputs = ["sway.txt"; 15];
        let mut running = start(&bench, &[&SMALL[..], &inputs].concat());
        wait_until(|| bench.path("run/policy.safetensors").exists());
        interrupt(&running);
        let status = running.0.wait().expect("the program ends");
        // Success when the signal came just before the evaluation.
        assert!(matches!(status.code(), Some(0 | 130)), "{status}");
        let said = talk(&mut running);
        assert!(said.contains("stopped; continue with"), "{said}");
        assert!(!bench.path("run/eval.json").exists());

        let resume = ["train", "--resume", "run"];
        bench.mimic(&resume).assert().success();
        assert!(bench.path("run/eval.json").exists());
        assert_eq!(metrics(&bench, "run").len(), 1);
    }

    #[test]
    fn a_killed_run_goes_on_to_the_same_numbers() {
        let bench = bench();
        let mut moments = Vec::new();
        for _ in 0..3 {
            let begun = bench.path("run/config.json").exists();
            let resume = ["train", "--resume", "run"];
            let mut running = start(&bench, if begun { &resume } else { &SMALL });
            let now = SystemTime::now().duration_since(UNIX_EPOCH);
            let moment = now.map_or(0, |now| now.subsec_micros() % 500);
            moments.push(moment);
            std::thread::sleep(Duration::from_millis(moment.into()));
            if running.0.try_wait().is_ok_and(|ended| ended.is_some()) {
                break;
            }
            running.0.kill().expect("a signal can be sent");
            running.0.wait().expect("the program ends");
        }
        let begun = bench.path("run/config.json").exists();
        let resume = ["train", "--resume", "run"];
        if !bench.path("run/replay.rrd").exists() {
            bench
                .mimic(if begun { &resume } else { &SMALL })
                .assert()
                .success();
        }
        assert_same_as_unbroken(&bench, &format!("killed after {moments:?} ms"));
    }

    /// A clip that takes a while to retarget.
    fn with_long_clip() -> Workbench {
        let bench = with_preset();
        let text = std::fs::read(bench.path("sway.txt")).expect("the clip is there");
        let mut clip: Value = serde_json::from_slice(&text).expect("it is JSON");
        let frames = clip["Frames"].as_array().expect("a list").clone();
        clip["Frames"] = frames.iter().cycle().take(6000).cloned().collect();
        bench.write("sway.txt", clip.to_string().as_bytes());
        bench
    }

    #[test]
    fn a_run_that_is_prepared_is_listed_and_leaves_nothing_when_it_is_stopped() {
        for name in ["-INT", "-TERM", "-HUP"] {
            let bench = with_long_clip();
            let line = ["train", "sway.txt", "--preset", "small.json"];
            let mut running = start(&bench, &line);
            wait_until(|| bench.path("runs/sway/.mimic.lock").exists());
            let listed = bench.json(&["runs"]);
            let run = &listed["runs"][0];
            assert_eq!(run["state"], "preparing", "{listed}");
            let holder = run["held_by"].as_str().unwrap_or_default();
            assert!(holder.contains(&running.0.id().to_string()), "{listed}");
            signal(&running, name);
            let status = running.0.wait().expect("the program ends");
            assert_eq!(status.code(), Some(130), "{name}");
            assert!(!bench.path("runs").exists(), "{name}");
        }
    }

    #[test]
    fn a_second_signal_before_the_first_save_leaves_nothing() {
        let bench = bench();
        let plan = r#"{ "environments": 8, "group": 4, "horizon": 16, "round": 100000, "samples": 128000000, "hidden": [16] }"#;
        bench.write("small.json", plan.as_bytes());
        let mut running = start(&bench, &SMALL);
        wait_until(|| logged_iterations(&bench) > 1);
        interrupt(&running);
        std::thread::sleep(Duration::from_millis(200));
        interrupt(&running);
        assert_eq!(
            running.0.wait().ok().and_then(|status| status.code()),
            Some(130)
        );
        let said = talk(&mut running);
        assert!(said.contains("before anything was saved"), "{said}");
        assert!(!bench.path("run").exists());
    }

    /// `ulimit -f`: the system lets no file grow further.
    #[test]
    fn files_that_may_not_grow_are_reported() {
        let bench = with_run();
        let before = std::fs::read_dir(bench.path(".")).expect("listed").count();
        for line in [
            "train sway.txt --preset small.json --out cut",
            "import sway.txt",
            "retarget sway.txt",
            "tracks sway.txt --plot sway.svg",
            "plot run",
        ] {
            let program = assert_cmd::cargo::cargo_bin("mimic");
            let script = format!("ulimit -f 1; exec '{}' {line}", program.display());
            let output = Command::new("sh")
                .args(["-c", &script])
                .current_dir(bench.path("."))
                .output()
                .expect("it runs");
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(1), "{line}: {said}");
            assert!(said.contains("cannot be written"), "{line}: {said}");
            let after = std::fs::read_dir(bench.path(".")).expect("listed").count();
            assert_eq!(before, after, "{line}: nothing was added");
        }
    }
}
