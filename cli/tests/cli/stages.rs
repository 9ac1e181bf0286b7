//! Any stage takes the file of an earlier one and does what is missing.

use crate::workbench::Workbench;
use serde_json::Value;

#[test]
fn retarget_has_the_fields_that_scripts_rely_on() {
    let bench = Workbench::with_clip();
    let report = bench.json(&["retarget", "sway.txt"]);
    assert_eq!(report["motion"], "sway.motion");
    assert_eq!(report["frames"], 31);
    for path in [
        "/seconds",
        "/frames_per_second",
        "/keypoint_error_m/mean",
        "/keypoint_error_m/max",
        "/foot_skate_m_s",
        "/penetration_m/mean",
        "/penetration_m/max",
        "/float_m",
        "/joint_limit_violations",
    ] {
        assert!(report.pointer(path).is_some_and(Value::is_number), "{path}");
    }
    assert!(report["map"].as_array().is_some_and(|map| map.len() >= 12));
    assert!(report["problems"].is_array());
    assert!(bench.path("sway.motion").exists());
}

#[test]
fn every_way_to_a_motion_leads_to_the_same_motion() {
    let bench = Workbench::with_clip();
    bench.mimic(&["import", "sway.txt"]).assert().success();
    bench
        .mimic(&["retarget", "sway.clip", "--out", "by-clip/"])
        .assert()
        .success();
    bench
        .mimic(&["retarget", "sway.txt", "--out", "direct/"])
        .assert()
        .success();
    bench
        .mimic(&["info", "sway.txt", "--write-map", "map.json"])
        .assert()
        .success();
    bench
        .mimic(&[
            "retarget", "sway.txt", "--map", "map.json", "--out", "mapped/",
        ])
        .assert()
        .success();
    let read = |folder: &str| {
        let path = bench.path(&format!("{folder}/sway.motion"));
        let mut bytes = std::fs::read(path).expect("it was written");
        assert!(bytes.len() > 1000);
        // What made the motion stands in its header; it is as long for both.
        let at = bytes.windows(6).position(|some| some == b"made\\\"");
        bytes[at.expect("it says what made it")..][..160].fill(0);
        bytes
    };
    let tracks = |folder: &str| bench.json(&["tracks", &format!("{folder}/sway.motion")]);
    assert_eq!(read("direct"), read("by-clip"));
    assert_eq!(tracks("direct"), tracks("mapped"));
    assert_eq!(tracks("direct"), bench.json(&["tracks", "sway.txt"]));
}

#[test]
fn tracks_are_shown_drawn_and_tabled() {
    let bench = Workbench::with_clip();
    let line = [
        "tracks",
        "sway.txt",
        "--plot",
        "out/sway.svg",
        "--csv",
        "sway.csv",
    ];
    let report = bench.json(&line);
    assert_eq!(report["frames"], 31);
    assert_eq!(report["loop"], "wrap");
    let height = report["com_height_m"]["mean"].as_f64();
    assert!(
        height.is_some_and(|h| (0.7..1.1).contains(&h)),
        "somebody stands: {height:?}"
    );
    let contacts: Vec<_> = report["contacts"]
        .as_array()
        .into_iter()
        .flatten()
        .collect();
    let standing = contacts.iter().filter(|c| c["share"] == 1.0);
    let standing: Vec<_> = standing.map(|c| c["body"].as_str()).collect();
    assert_eq!(standing, [Some("right_foot"), Some("left_foot")]);
    assert!(
        contacts
            .iter()
            .all(|c| c["share"] == 1.0 || c["share"] == 0.0)
    );
    let svg = std::fs::read_to_string(bench.path("out/sway.svg")).unwrap_or_default();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    assert!(!svg.contains("NaN") && svg.contains("linear momentum"));
    let csv = std::fs::read_to_string(bench.path("sway.csv")).unwrap_or_default();
    let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
    assert_eq!(columns.len(), 32, "a heading and a row per frame");
    assert!(columns.iter().all(|count| *count == columns[0]));
}

#[test]
fn left_out_the_newest_file_is_taken() {
    let bench = Workbench::with_clip();
    let said = bench.complaint(&["retarget"], 2);
    assert!(
        said.contains("no file was given, and there is no `.clip` file"),
        "{said}"
    );
    bench.mimic(&["import", "sway.txt"]).assert().success();
    let report = bench.json(&["retarget"]);
    assert_eq!(report["motion"], "sway.motion");
    assert_eq!(bench.json(&["tracks"])["motion"], "sway");
}

#[cfg(feature = "rerun")]
#[test]
fn a_motion_is_recorded_for_the_viewer() {
    let bench = Workbench::with_clip();
    let shown = bench.json(&["replay", "sway.txt", "--save", "out/sway.rrd"]);
    assert_eq!(shown["recording"], "out/sway.rrd");
    assert_eq!(shown["frames"], 31);
    assert_eq!(shown["agent"], false);
    let bytes = std::fs::read(bench.path("out/sway.rrd")).unwrap_or_default();
    assert!(bytes.starts_with(b"RRF") && bytes.len() > 10_000);
    let left: Vec<_> = std::fs::read_dir(bench.path("out"))
        .into_iter()
        .flatten()
        .collect();
    assert_eq!(left.len(), 1, "nothing half-written stays");
}

#[cfg(feature = "rerun")]
#[test]
fn replay_without_a_viewer_says_how_to_get_one() {
    let bench = Workbench::with_clip();
    let mut command = bench.mimic(&["replay", "sway.txt", "--rerun"]);
    let output = command.env("PATH", bench.path(".")).assert().code(1);
    let said = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
    assert!(said.contains("pip install rerun-sdk=="), "{said}");
    assert!(said.contains("--save"), "{said}");
    bench.mimic(&["replay", "sway.txt"]).assert().code(2);
    let said = bench.complaint(&["replay", "sway.txt", "--connect", "127.0.0.1:1"], 1);
    assert!(said.contains("no viewer listens"), "{said}");
    let said = bench.complaint(&["replay", "sway.txt", "--connect", "nonsense"], 2);
    assert!(said.contains("host:port"), "{said}");
}

/// Two characters of one name are told apart in words.
#[test]
fn a_character_that_changed_is_named_as_such() {
    let bench = Workbench::with_clip();
    let humanoid = concat!(env!("CARGO_MANIFEST_DIR"), "/../skeletons/humanoid.xml");
    let text = std::fs::read_to_string(humanoid).expect("the character is there");
    let slots = std::fs::read(humanoid.replace(".xml", ".json")).expect("its slots are there");
    bench.write("my.xml", text.as_bytes());
    bench.write("my.json", &slots);
    let line = ["retarget", "sway.txt", "--skeleton", "my.xml"];
    bench.mimic(&line).assert().success();
    bench.write("my.xml", format!("{text}<!-- heavier -->").as_bytes());
    let line = ["tracks", "sway.motion", "--skeleton", "my.xml"];
    let said = bench.complaint(&line, 2);
    assert!(
        said.contains("another skeleton that is called `my` too") && !said.contains("differs"),
        "{said}"
    );
    let said = bench.complaint(&["tracks", "sway.motion", "--skeleton", "robot"], 2);
    assert!(
        said.contains("for skeleton `my`, not for `robot`"),
        "{said}"
    );
}

#[test]
fn options_that_come_too_late_are_refused() {
    let bench = Workbench::with_clip();
    bench.mimic(&["import", "sway.txt"]).assert().success();
    bench.mimic(&["retarget", "sway.txt"]).assert().success();
    let said = bench.complaint(&["retarget", "sway.clip", "--fps", "30"], 2);
    assert!(said.contains("this is a clip already"), "{said}");
    let said = bench.complaint(&["tracks", "sway.motion", "--take", "1"], 2);
    assert!(said.contains("this is a motion already"), "{said}");
    let said = bench.complaint(&["retarget", "sway.motion"], 2);
    assert!(said.contains("this is a motion already"), "{said}");
    let said = bench.complaint(&["retarget", "sway.txt", "--skeleton", "giant"], 2);
    assert!(said.contains("giant"), "{said}");
}

#[test]
fn a_map_with_a_wrong_joint_is_refused_by_name() {
    let bench = Workbench::with_clip();
    bench.write("map.json", br#"{ "hips": "pelvis" }"#);
    let said = bench.complaint(&["retarget", "sway.txt", "--map", "map.json"], 2);
    assert!(
        said.contains("map.json") && said.contains("pelvis"),
        "{said}"
    );
}

#[test]
fn damaged_clips_and_motions_are_named() {
    let bench = Workbench::with_clip();
    bench.mimic(&["import", "sway.txt"]).assert().success();
    bench.mimic(&["retarget", "sway.txt"]).assert().success();
    for name in ["sway.clip", "sway.motion"] {
        let whole = std::fs::read(bench.path(name)).expect("the file is there");
        for keep in [0, 5, whole.len() / 2, whole.len() - 1] {
            let cut = format!("cut-{keep}-{name}");
            bench.write(&cut, &whole[..keep]);
            bench.error_about(&cut, &["tracks", &cut], 2);
        }
    }
}

#[test]
fn a_slot_can_count_more() {
    let bench = Workbench::with_clip();
    let line = [
        "retarget",
        "sway.txt",
        "--out",
        "head.motion",
        "--weight",
        "head=3",
    ];
    bench.mimic(&line).assert().success();
    bench
        .mimic(&["retarget", "sway.txt", "--out", "sway.motion"])
        .assert()
        .success();
    let read = |name: &str| std::fs::read(bench.path(name)).expect("it was written");
    assert_ne!(read("head.motion"), read("sway.motion"));
    for (wrong, reason) in [
        ("tail=1", "there is no slot `tail`"),
        ("head", "head=3"),
        ("head=x", "not a number"),
        ("head=-1", "0 to 100"),
    ] {
        let output = bench
            .mimic(&["retarget", "sway.txt", "--weight", wrong])
            .assert()
            .code(2);
        let said = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
        assert!(said.contains(reason), "{said}");
    }
    let said = bench.complaint(&["tracks", "sway.motion", "--weight", "head=2"], 2);
    assert!(said.contains("`--weight` applies to clips"), "{said}");
}
