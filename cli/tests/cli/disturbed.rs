//! `--perturb`: what is disturbed in training, evaluation and replay.

use crate::workbench::Workbench;
use serde_json::{Value, json};

#[test]
fn an_evaluation_tells_rest_and_disturbance_apart() {
    let bench = Workbench::with_run();
    let line = ["eval", "sway", "--episodes", "2", "--seconds", "1"];
    let plain = bench.json(&line);
    assert_eq!(
        (&plain["episodes"], &plain["perturbed"]),
        (&2.into(), &Value::Null)
    );
    assert_eq!(plain["from_rest"]["episodes"], 1);
    let shoved = bench.json(&[&line[..], &["--perturb"]].concat());
    assert_eq!(shoved["perturbed"]["episodes"], 2);
    for field in ["survival", "mpjpe_local_mm", "normalized_return"] {
        assert_eq!(shoved[field], plain[field], "the rest stays as it is");
        assert!(shoved["perturbed"][field].is_number() && shoved["from_rest"][field].is_number());
    }
    assert_ne!(
        shoved["perturbed"]["mpjpe_local_mm"],
        plain["mpjpe_local_mm"]
    );
}

/// The disturbances in the configuration of the run in `folder`.
fn perturbations(bench: &Workbench, folder: &str) -> Value {
    let file = bench.path(folder).join("config.json");
    let text = std::fs::read_to_string(file).expect("a config");
    let config: Value = serde_json::from_str(&text).expect("it is JSON");
    config["plan"]["task"]["perturbations"].clone()
}

#[test]
fn training_can_be_disturbed_and_is_measured_so() {
    let bench = Workbench::with_run();
    let line = ["train", "sway.txt", "--preset", "tiny.json", "--perturb"];
    let own = [&line[..], &["--out", "shoved"]].concat();
    bench.mimic(&own).assert().success();
    let usual = perturbations(&bench, "shoved");
    assert_eq!(
        (&usual["push_m_s"], &usual["follow"]),
        (&json!([0.2, 0.6]), &json!(true))
    );
    let text = std::fs::read_to_string(bench.path("shoved/eval.json")).expect("an evaluation");
    let measured: Value = serde_json::from_str(&text).expect("it is JSON");
    assert_eq!(measured["perturbed"]["episodes"], 32);
    assert_eq!(
        bench.json(&["eval", "shoved"]),
        measured,
        "so it is without the flag"
    );
    let wrong = [
        "train",
        "sway.txt",
        "--set",
        "task.perturbations.mass=[2,1]",
    ];
    let said = bench.complaint(&wrong, 2);
    assert!(
        said.contains("`task.perturbations.mass`: [2, 1] is not allowed"),
        "{said}"
    );
}

/// The flag fills in what isn't said, and takes nothing back that is.
#[test]
fn a_presets_own_disturbances_stay() {
    let bench = Workbench::with_run();
    let set = [
        "--set",
        "task.perturbations.push_m_s=[0.5,1]",
        "--set",
        "task.perturbations.follow=false",
    ];
    let first = [
        "train",
        "sway.txt",
        "--preset",
        "tiny.json",
        "--out",
        "first",
    ];
    bench.mimic(&[&first[..], &set].concat()).assert().success();
    let second = [
        "train",
        "sway.txt",
        "--preset",
        "first",
        "--perturb",
        "--out",
        "second",
    ];
    bench.mimic(&second).assert().success();
    let kept = perturbations(&bench, "second");
    assert_eq!(kept, perturbations(&bench, "first"));
    assert_eq!(
        (&kept["push_m_s"], &kept["follow"]),
        (&json!([0.5, 1.0]), &json!(false))
    );
}

/// Numbers that no training takes are refused in a run's own file, too, with the line where there is one.
#[test]
fn a_runs_configuration_is_checked() {
    let bench = Workbench::with_run();
    let file = "runs/sway/config.json";
    let text = std::fs::read_to_string(bench.path(file)).expect("a config");
    let config: Value = serde_json::from_str(&text).expect("it is JSON");
    let change = |key: &str, value: Value| {
        let mut config = config.clone();
        config["plan"]["task"]["perturbations"][key] = value;
        bench.write(file, format!("{config:#}").as_bytes());
        bench.complaint(&["eval", "sway", "--perturb"], 2)
    };
    let said = change("mass", json!([-1.0, -1.0]));
    assert!(
        said.contains(file) && said.contains("task.perturbations.mass"),
        "{said}"
    );
    let said = change("follow", json!("maybe"));
    assert!(
        said.contains(file) && said.contains("boolean") && said.contains("line"),
        "{said}"
    );
}
