//! Runs and numbers that nobody should believe: out of range, damaged, forged.

use super::{SMALL, with_preset, with_run};
use serde_json::Value;

#[test]
fn numbers_out_of_range_are_wrong_usage() {
    let bench = with_preset();
    for (line, remedy) in [
        (&["train", "sway.txt", "--minutes", "1e20"][..], "at most"),
        (&["bench", "--seconds", "1e20"], "at most"),
        (&["eval", "--seconds", "1e20"], "at most"),
        (&["replay", "--rerun", "--seconds", "1e20"], "at most"),
        (&["eval", "--threads", "0"], "from 1 to"),
        (&["eval", "--threads", "100000"], "from 1 to"),
        (&["bench", "--threads", "100000"], "from 1 to"),
        (
            &["train", "sway.txt", "--threads", "18446744073709551615"],
            "from 1 to",
        ),
        (&["eval", "--episodes", "1000000000000"], "from 1 to"),
        (
            &["train", "sway.txt", "--set", "environments=1000000000"],
            "from 1 to 16384",
        ),
        (
            &["train", "sway.txt", "--set", "horizon=1000000000"],
            "from 1 to 65536",
        ),
        (
            &["train", "sway.txt", "--set", "hidden=[65536,65536]"],
            "at most 16777216",
        ),
        (
            &[
                "train",
                "sway.txt",
                "--set",
                "hidden=[65536,65536]",
                "--set",
                "environments=8192",
            ],
            "at most",
        ),
        (
            &["train", "sway.txt", "--set", "task.episode_s=1e12"],
            "up to 3600",
        ),
        (
            &["train", "sway.txt", "--set", "task.actions.scale=1e12"],
            "up to 10",
        ),
        (
            &[
                "train",
                "sway.txt",
                "--set",
                "task.physics.substeps=4000000000",
            ],
            "from 1 to 1000",
        ),
    ] {
        let output = bench.mimic(line).assert().code(2);
        let said = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
        assert!(said.contains(remedy), "{said}");
    }
}

#[test]
fn a_run_that_cannot_be_written_says_what_to_do_and_how_to_go_on() {
    let bench = with_preset();
    let cut = ["--samples", "2560", "--minutes", "1e-9"];
    bench.mimic(&[&SMALL[..], &cut].concat()).assert().success();
    let policy = bench.path("run/policy.safetensors");
    std::fs::remove_file(&policy).expect("it was saved");
    std::fs::create_dir(&policy).expect("a folder can be made");
    let resume = ["train", "--resume", "run"];
    let said = bench.complaint(&resume, 2);
    assert!(said.contains("policy.safetensors"), "{said}");
    assert!(said.contains("move it away"), "{said}");
    assert!(said.contains("train --resume run"), "{said}");
    std::fs::remove_dir(&policy).expect("it is empty");
    bench.mimic(&resume).assert().success();

    bench.write("config.json", b"{}");
    std::fs::create_dir_all(bench.path("other/skeleton.xml")).expect("a folder can be made");
    std::fs::rename(bench.path("config.json"), bench.path("other/config.json")).expect("moved");
    bench.complaint(&["eval", "other"], 2);
}

/// What came from elsewhere may have been made to do harm.
#[test]
fn forged_runs_are_refused_in_bearable_time() {
    let bench = with_run();
    let path = bench.path("run/config.json");
    let config = std::fs::read_to_string(&path).expect("it is text");
    let evaluate = |cause: &str| {
        let said = bench.complaint(&["eval", "run"], 2);
        assert!(
            said.contains("run/config.json") && said.contains(cause),
            "{said}"
        );
        bench.complaint(&["train", "--resume", "run"], 2);
    };
    for (setting, value) in [
        ("environments", "1000000000000"),
        ("horizon", "18446744073709551615"),
        ("episode_s", "1e300"),
    ] {
        let mut forged: Value = serde_json::from_str(&config).expect("it is JSON");
        let plan = &mut forged["plan"];
        let place = match setting {
            "episode_s" => &mut plan["task"],
            _ => plan,
        };
        place[setting] = serde_json::from_str(value).expect("a number");
        bench.write("run/config.json", forged.to_string().as_bytes());
        evaluate(setting);
    }
    let reference = r#""reference-0.motion""#;
    let often = [reference; 1000].join(",");
    bench.write(
        "run/config.json",
        config.replace(reference, &often).as_bytes(),
    );
    evaluate("listed twice");
    bench.write("run/config.json", &vec![b' '; 5 << 20]);
    evaluate("bytes");
    bench.write("run/config.json", config.as_bytes());

    let episodes = ["eval", "run", "--episodes", "1000000", "--seconds", "3600"];
    let said = bench.complaint(&episodes, 2);
    assert!(said.contains("at most 500000"), "{said}");

    #[cfg(unix)]
    for file in [
        "config.json",
        "skeleton.xml",
        "reference-0.motion",
        "policy.safetensors",
    ] {
        let (path, kept) = (bench.path("run").join(file), bench.path("kept"));
        std::fs::rename(&path, &kept).expect("moved");
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.is_ok_and(|status| status.success()));
        let said = bench.complaint(&["eval", "run"], 2);
        // A folder whose `config.json` isn't a file is no run at all.
        assert!(said.contains(file) || file == "config.json", "{said}");
        std::fs::remove_file(&path).expect("removed");
        std::fs::rename(&kept, &path).expect("moved back");
    }
}

/// A network of numbers that aren't finite moves nothing, and would be measured as if it stood still.
#[test]
fn a_policy_that_is_not_of_numbers_is_not_measured() {
    let bench = with_run();
    let policy = std::fs::read(bench.path("run/policy.safetensors")).expect("the policy is there");
    let (length, rest) = policy.split_first_chunk::<8>().expect("a header");
    let header = u64::from_le_bytes(*length) as usize;
    let text: Value = serde_json::from_slice(&rest[..header]).expect("it is JSON");
    for name in [
        "actor.0.weight",
        "critic.0.bias",
        "normalizer.mean",
        "normalizer.count",
    ] {
        let at = text[name]["data_offsets"][0].as_u64().expect("a place") as usize + 8 + header;
        let (mut damaged, nan) = (policy.clone(), f32::NAN.to_le_bytes());
        match text[name]["dtype"].as_str() {
            Some("F32") => damaged[at..at + 4].copy_from_slice(&nan),
            _ => damaged[at..at + 8].copy_from_slice(&f64::INFINITY.to_le_bytes()),
        }
        bench.write("run/policy.safetensors", &damaged);
        let said = bench.complaint(&["eval", "run"], 2);
        assert!(
            said.contains("policy.safetensors")
                && said.contains("normalizer") | said.contains(name),
            "{said}"
        );
    }
    // Finite numbers can lead to others.
    let at = text["actor.0.weight"]["data_offsets"][0]
        .as_u64()
        .expect("a place") as usize;
    let mut damaged = policy.clone();
    let end = text["actor.0.weight"]["data_offsets"][1]
        .as_u64()
        .expect("a place") as usize;
    for number in damaged[8 + header + at..8 + header + end].chunks_exact_mut(4) {
        number.copy_from_slice(&3e38_f32.to_le_bytes());
    }
    bench.write("run/policy.safetensors", &damaged);
    let said = bench.complaint(&["eval", "run"], 1);
    assert!(said.contains("not finite"), "{said}");
}

#[test]
fn damaged_runs_are_named() {
    let bench = with_run();
    let skeleton = std::fs::read(bench.path("run/skeleton.xml")).expect("it is there");
    bench.write("run/skeleton.xml", &skeleton[..skeleton.len() / 2]);
    let said = bench.complaint(&["eval", "run"], 2);
    assert!(said.contains("run/skeleton.xml"), "{said}");
    bench.write("run/skeleton.xml", &skeleton);
    let policy = std::fs::read(bench.path("run/policy.safetensors")).expect("the policy is there");
    bench.write("run/policy.safetensors", &policy[..policy.len() / 2]);
    let said = bench.complaint(&["eval", "run"], 2);
    assert!(said.contains("policy.safetensors"), "{said}");
    bench.write("run/config.json", b"{}");
    let said = bench.complaint(&["eval", "run"], 2);
    assert!(said.contains("not the configuration of a run"), "{said}");
    bench.write(
        "run/config.json",
        br#"{"format": "run", "version": 2, "new": []}"#,
    );
    let said = bench.complaint(&["eval", "run"], 2);
    assert!(said.contains("newer version"), "{said}");
    bench.write("run/config.json", b"{");
    let said = bench.complaint(&["eval", "run"], 2);
    assert!(said.contains("config.json"), "{said}");
}
