//! Names and flags that are nearly right are answered with what was probably meant.

use crate::workbench::Workbench;
use serde_json::Value;

/// The remedy of a line that names something wrong.
fn remedy(bench: &Workbench, line: &[&str]) -> String {
    let output = bench.mimic(line).arg("--json").assert().code(2);
    let printed: Value = serde_json::from_slice(&output.get_output().stdout).expect("JSON");
    let remedy = printed["error"]["remedy"].as_str();
    remedy.unwrap_or_default().to_owned()
}

#[test]
fn names_that_are_nearly_right_are_understood() {
    let bench = Workbench::with_run();
    std::fs::create_dir(bench.path("clips")).expect("a folder can be made");
    std::fs::copy(bench.path("sway.txt"), bench.path("clips/lean.txt")).expect("copied");
    bench.write("map.json", br#"{ "hip": "root" }"#);
    for (line, meant) in [
        (&["info", "sawy.txt"][..], "sway.txt"),
        (&["retarget", "sway.fbx"], "sway.txt"),
        (&["import", "clips/laen.txt"], "clips/lean.txt"),
        (&["tracks", "leen"], "lean"),
        (&["train", "SWAY.TXT"], "sway.txt"),
        (&["eval", "swya"], "sway"),
        (&["plot", "runs/swayy"], "runs/sway"),
        (&["replay", "swya", "--save", "a.rrd"], "sway"),
        (&["train", "--resume", "way"], "sway"),
        (&["train", "sway.txt", "--preset", "deepmimik"], "deepmimic"),
        (&["train", "sway.txt", "--preset", "swai"], "sway"),
        (&["train", "sway.txt", "--skeleton", "humaniod"], "humanoid"),
        (&["import", "sway.txt", "--take", "sawy"], "sway"),
        (&["retarget", "sway.txt", "--map", "map.json"], "hips"),
        (&["retarget", "sway.txt", "--map", "mpa.json"], "map.json"),
        (&["retarget", "sway.txt", "--weight", "haed=2"], "head"),
        (&["train", "sway.txt", "--set", "ppo.gama=1"], "ppo.gamma"),
    ] {
        let said = remedy(&bench, line);
        assert!(said.contains(&format!("`{meant}`")), "{line:?}: {said}");
    }
}

/// Many files end alike: the rest of a name has to be near.
#[test]
fn endings_alone_are_no_likeness() {
    let bench = Workbench::with_clip();
    for clip in ["kick.clip", "01_01.clip", "01_01-edited.clip"] {
        bench
            .mimic(&["import", "sway.txt", "--out", clip])
            .assert()
            .success();
        bench.mimic(&["retarget", clip]).assert().success();
    }
    for (line, meant) in [
        (&["tracks", "kick.motin"][..], "kick.motion"),
        (&["info", "kick.clp"], "kick.clip"),
        (&["train", "01_01-edit.motion"], "01_01-edited.motion"),
        (&["edit", "01_1.clip", "--mirror"], "01_01.clip"),
    ] {
        let said = remedy(&bench, line);
        assert_eq!(said, format!("did you mean `{meant}`?"), "{line:?}");
    }
    let said = remedy(&bench, &["tracks", "jump.motion"]);
    assert!(!said.contains("did you mean"), "{said}");
}

#[test]
fn what_is_like_nothing_gets_a_list() {
    let bench = Workbench::with_run();
    let said = remedy(&bench, &["eval", "zzz"]);
    assert_eq!(said, "choose one of the runs: sway");
    let said = remedy(&bench, &["train", "sway.txt", "--skeleton", "zzz"]);
    assert!(said.starts_with("use one of humanoid, "), "{said}");
}

#[test]
fn flags_by_their_other_names_are_understood() {
    let bench = Workbench::with_clip();
    for (line, flag) in [
        (&["train", "sway.txt", "--steps", "5M"][..], "--samples"),
        (&["train", "sway.txt", "--time", "5"], "--minutes"),
        (&["import", "sway.txt", "--output", "a.clip"], "--out"),
        (&["import", "sway.txt", "--frames", "3"], "--trim"),
    ] {
        let said = remedy(&bench, line);
        assert_eq!(said, format!("did you mean `{flag}`?"), "{line:?}");
    }
}
