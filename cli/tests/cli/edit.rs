//! What `mimic edit` makes of clips, and what it refuses.

use crate::workbench::Workbench;
use serde_json::Value;
use std::path::Path;

/// With our own clips in the library.
fn with_ours() -> Workbench {
    let bench = Workbench::new();
    std::fs::create_dir(bench.path("clips")).expect("a folder can be made");
    for file in ["walk.glb", "kick.fbx"] {
        let ours = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../clips")
            .join(file);
        let bytes = std::fs::read(ours).expect("our own clip is there");
        bench.write(&format!("clips/{file}"), &bytes);
    }
    for name in ["walk", "kick"] {
        bench.mimic(&["import", name]).assert().success();
    }
    bench
}

fn frames(report: &Value) -> u64 {
    report["frames"].as_u64().expect("a number of frames")
}

#[test]
fn the_report_is_that_of_an_import() {
    let bench = with_ours();
    let import = bench.json(&["import", "walk"]);
    let edit = bench.json(&["edit", "walk.clip", "--fps", "60"]);
    let keys = |report: &Value| -> Vec<String> {
        report
            .as_object()
            .into_iter()
            .flatten()
            .map(|(key, _)| key.clone())
            .collect()
    };
    assert_eq!(keys(&edit), keys(&import));
    assert_eq!(edit["clip"], "walk-edited.clip");
    assert_eq!((frames(&edit), edit["fps"].as_f64()), (67, Some(60.0)));
    assert_eq!(edit["loop"], "wrap");
    let info = bench.json(&["info", "walk-edited.clip"]);
    assert_eq!(info["takes"][0]["frames"], 67);
}

#[test]
fn edits_are_made_in_their_order() {
    let bench = with_ours();
    // Seconds of the trim are the source's: 1 s at twice the speed is half a second.
    let line = [
        "edit",
        "kick.clip",
        "--fps",
        "120",
        "--speed",
        "2",
        "--trim",
        "0.5..1.5",
    ];
    let report = bench.json(&line);
    assert_eq!(
        (frames(&report), report["duration_s"].as_f64()),
        (61, Some(0.5))
    );
    let line = [
        "edit",
        "kick.clip",
        "--warp",
        "0:0,0.5:0.8",
        "--out",
        "slow.clip",
    ];
    let report = bench.json(&line);
    assert_eq!(
        (report["clip"].as_str(), frames(&report)),
        (Some("slow.clip"), 139)
    );
}

#[test]
fn three_walks_become_one_cycle() {
    let bench = with_ours();
    let walks = bench.json(&[
        "edit",
        "walk.clip",
        "walk",
        "walk.clip",
        "--out",
        "long.clip",
    ]);
    assert_eq!(
        (frames(&walks), walks["loop"].as_str()),
        (100, Some("clamp"))
    );
    let cycle = bench.json(&[
        "edit",
        "long.clip",
        "--loop",
        "--in-place",
        "--travel",
        "-1,0.5",
    ]);
    assert_eq!((frames(&cycle), cycle["loop"].as_str()), (34, Some("wrap")));
    let longer = bench.json(&["edit", "long.clip", "--loop", "--shortest", "2", "--force"]);
    assert_eq!(frames(&longer), 67);
    let combo = bench.json(&[
        "edit",
        "walk.clip",
        "kick.clip",
        "--blend",
        "0.4",
        "--out",
        "made/",
    ]);
    assert_eq!(combo["clip"], "made/walk-edited.clip");
    assert_eq!(frames(&combo), 34 + 60);
}

/// Both ways to mirror write the same, and twice is the clip again.
#[test]
fn a_mirror_is_a_mirror() {
    let bench = with_ours();
    let bytes =
        |file: &str| rotations(&std::fs::read(bench.path(file)).expect("the clip is there"));
    bench.json(&["import", "kick", "--mirror", "--out", "left.clip"]);
    bench.json(&["edit", "kick", "--mirror", "--out", "edited.clip"]);
    let apart = |a: &str, b: &str| {
        let (a, b) = (bytes(a), bytes(b));
        assert_eq!(a.len(), b.len());
        a.iter()
            .zip(&b)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max)
    };
    assert!(apart("left.clip", "edited.clip") < 1e-6);
    assert!(apart("left.clip", "kick.clip") > 0.1);
    bench.json(&["edit", "left.clip", "--mirror", "--out", "right.clip"]);
    assert!(apart("right.clip", "kick.clip") < 1e-6);
    // Only import and edit have it.
    bench
        .mimic(&["retarget", "kick.clip", "--mirror"])
        .assert()
        .code(2);
    bench
        .mimic(&["train", "kick.clip", "--mirror"])
        .assert()
        .code(2);
}

/// The rotations of all frames.
fn rotations(file: &[u8]) -> Vec<f32> {
    let (length, rest) = file.split_at(8);
    let length = u64::from_le_bytes(length.try_into().expect("eight bytes")) as usize;
    let header: Value = serde_json::from_slice(&rest[..length]).expect("a header");
    let offsets = &header["local_rotation"]["data_offsets"];
    let offset = |k: usize| length + offsets[k].as_u64().expect("an offset") as usize;
    let data = &rest[offset(0)..offset(1)];
    data.as_chunks::<4>()
        .0
        .iter()
        .map(|b| f32::from_le_bytes(*b))
        .collect()
}

#[test]
fn what_cannot_be_done_is_refused_with_a_remedy() {
    let bench = with_ours();
    bench.mimic(&["retarget", "walk.clip"]).assert().success();
    bench.write("one.bvh", ONE.as_bytes());
    for (line, said) in [
        (&["edit", "walk.clip"][..], "there is nothing to edit"),
        (
            &["edit", "walk.clip", "--blend", "0.2"],
            "needs at least two clips",
        ),
        (
            &["edit", "walk.clip", "--trim", "5..6"],
            "choose a part within",
        ),
        (
            &["edit", "walk.clip", "--loop", "--shortest", "9"],
            "allow shorter cycles",
        ),
        (
            &["edit", "walk.clip", "--speed", "0.000002"],
            "make it shorter",
        ),
        (
            &["edit", "walk.clip", "--warp", "0.5:0.8,0.4:1"],
            "let both times rise",
        ),
        (&["edit", "walk.clip", "--fps", "1e9"], "to 10000"),
        (
            &["edit", "walk.motion", "--mirror"],
            "this is a motion, not a clip",
        ),
        (&["edit", "one.bvh", "--mirror"], "`--map FILE`"),
        (
            &["edit", "walk.clip", "one.bvh"],
            "join clips of one figure",
        ),
        (
            &["import", "one.bvh", "--mirror"],
            "left and right aren't known",
        ),
        (
            &["edit", "walk.clip", "--mirror", "--out", "walk.clip"],
            "this is the input itself",
        ),
        (&["edit", "nothing.clip", "--mirror"], "no such file"),
    ] {
        let error = bench.error(line, 2);
        let message = error["message"].as_str().unwrap_or_default();
        assert!(message.contains(said), "{error}");
        assert!(error["remedy"].is_string(), "{error}");
    }
    for line in [
        &["edit"][..],
        &["edit", "walk.clip", "--fps", "0"],
        &["edit", "walk.clip", "--fps", "nan"],
        &["edit", "walk.clip", "--speed", "-1"],
        &["edit", "walk.clip", "--speed", "2", "--warp", "1:2"],
        &["edit", "walk.clip", "--travel", "1"],
        &["edit", "walk.clip", "--travel", "inf,0"],
        &["edit", "walk.clip", "--warp", "1"],
        &["edit", "walk.clip", "--fps", "30", "--shortest", "1"],
        &["edit", "walk.clip", "--fps", "30", "--map", "map.json"],
        &["edit", "walk.clip", "walk.clip", "--blend", "-1"],
    ] {
        bench.mimic(line).assert().code(2);
    }
    assert!(!bench.path("walk-edited.clip").exists());
}

/// A figure of one joint.
const ONE: &str = "HIERARCHY
ROOT only
{
OFFSET 0 0 0
CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
End Site
{
OFFSET 0 1 0
}
}
MOTION
Frames: 2
Frame Time: 0.1
0 0 0 0 0 0
0 1 0 0 0 10
";
