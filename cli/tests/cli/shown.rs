//! What files hold reaches the terminal as letters alone.

use crate::workbench::Workbench;
use serde_json::{Value, json};

/// What must not reach a terminal: an escape code, a bell, an 8-bit escape code, the end of a line, a turned direction, a
/// hidden letter and NUL.
const NASTY: &str =
    "\u{1b}]0;owned\u{7}\u{9b}31m\r\nFAKE: 100 %\u{202e}txt.\u{2066}\u{e0041}\u{7f}\0";

/// `sway.txt` as it would be with these names: a glTF of a humanoid, 4 joints a limb.
fn nasty_gltf() -> Value {
    let mut nodes = Vec::new();
    let mut joints = Vec::new();
    // Name, parent, place of a standing body, Y up.
    let body: [(&str, usize, [f64; 3]); 15] = [
        ("hips", 0, [0.0, 0.95, 0.0]),
        ("spine", 0, [0.0, 0.2, 0.0]),
        ("head", 1, [0.0, 0.3, 0.0]),
        ("left_arm", 1, [0.2, 0.2, 0.0]),
        ("left_elbow", 3, [0.25, 0.0, 0.0]),
        ("left_wrist", 4, [0.25, 0.0, 0.0]),
        ("right_arm", 1, [-0.2, 0.2, 0.0]),
        ("right_elbow", 6, [-0.25, 0.0, 0.0]),
        ("right_wrist", 7, [-0.25, 0.0, 0.0]),
        ("left_hip", 0, [0.1, 0.0, 0.0]),
        ("left_knee", 9, [0.0, -0.45, 0.0]),
        ("left_ankle", 10, [0.0, -0.45, 0.0]),
        ("right_hip", 0, [-0.1, 0.0, 0.0]),
        ("right_knee", 12, [0.0, -0.45, 0.0]),
        ("right_ankle", 13, [0.0, -0.45, 0.0]),
    ];
    for (index, (name, _, place)) in body.iter().enumerate() {
        let children: Vec<usize> = (1..body.len())
            .filter(|child| body[*child].1 == index)
            .collect();
        let mut node = json!({ "name": format!("{name}{NASTY}"), "translation": place });
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        nodes.push(node);
        joints.push(index);
    }
    json!({
        "asset": { "version": "2.0" },
        "nodes": nodes,
        "skins": [{ "joints": joints }],
        "buffers": [{ "byteLength": 32, "uri": "nasty.bin" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 8 }, { "buffer": 0, "byteOffset": 8, "byteLength": 24 }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR" },
            { "bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3" }
        ],
        "animations": [{
            "name": format!("take{NASTY}"),
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
            "samplers": [{ "input": 0, "output": 1 }]
        }]
    })
}

fn with_nasty_names() -> Workbench {
    let bench = Workbench::new();
    let floats = [0.0_f32, 1.0, 0.0, 0.95, 0.0, 0.0, 0.93, 0.0];
    let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    bench.write("nasty.bin", &bytes);
    bench.write("nasty.gltf", nasty_gltf().to_string().as_bytes());
    bench
}

/// Whether a terminal would only show it.
fn is_harmless(text: &str) -> bool {
    let hidden = |c: char| {
        ('\u{202a}'..='\u{202e}').contains(&c)
            || ('\u{2066}'..='\u{2069}').contains(&c)
            || ('\u{e0000}'..='\u{e007f}').contains(&c)
    };
    let harmful = |c: char| c != '\n' && c.is_control() || hidden(c);
    !text.contains(harmful) && !text.lines().any(|line| line.starts_with("FAKE"))
}

/// Runs a line and gives both streams, after looking at them.
fn shown(bench: &Workbench, line: &[&str]) -> String {
    let output = bench.mimic(line).output().expect("it runs");
    let both = [output.stdout, output.stderr].concat();
    let text = String::from_utf8(both).expect("text");
    assert!(!text.is_empty() && is_harmless(&text), "{line:?}: {text:?}");
    text
}

#[test]
fn names_in_a_file_are_shown_as_letters() {
    let bench = with_nasty_names();
    for line in [
        &["info", "nasty.gltf"][..],
        &["import", "nasty.gltf", "--verbose"],
        &[
            "import",
            "nasty.gltf",
            "--take",
            "all",
            "--verbose",
            "--out",
            "all/",
        ],
        &["import", "nasty.gltf", "--take", "nothing"],
        &["info", "nasty.clip"],
        &["edit", "nasty.clip", "--mirror", "--verbose"],
        &["retarget", "nasty.clip", "--verbose"],
        &["tracks", "nasty.clip", "--verbose"],
        &["tracks", "nasty.motion"],
    ] {
        shown(&bench, line);
        let json = shown(&bench, &[line, &["--json"]].concat());
        let read = json.lines().next().map(serde_json::from_str::<Value>);
        assert!(matches!(read, Some(Ok(_))), "{json}");
    }
    // JSON means the very name.
    let info = bench.json(&["info", "nasty.gltf"]);
    assert_eq!(info["takes"][0]["name"], format!("take{NASTY}"));
    assert!(shown(&bench, &["info", "nasty.gltf"]).contains("left_knee"));
}

#[test]
fn so_are_names_of_files_and_of_what_is_made_of_them() {
    let bench = Workbench::with_clip();
    bench.write("tiny.json", crate::workbench::TINY);
    // A file's name holds all but NUL and the slash.
    let name = NASTY.replace('\0', "");
    let file = format!("sway{name}.txt");
    std::fs::rename(bench.path("sway.txt"), bench.path(&file)).expect("it can be renamed");
    let clip = format!("sway{name}.clip");
    let motion = format!("sway{name}.motion");
    let (csv, svg) = (format!("{name}.csv"), format!("{name}.svg"));
    let missing = format!("no{name}.fbx");
    let run = format!("runs/{name}");
    for line in [
        &["info", &file][..],
        &["import", &file, "--out", &clip],
        &["retarget", &clip, "--out", &motion],
        &[
            "tracks",
            &motion,
            "--csv",
            &csv,
            "--plot",
            &svg,
            "--verbose",
        ],
        &["info", &missing],
        &["import", &file, &missing],
        &["tracks", &missing],
        &["train", &motion, "--preset", "tiny.json", "--verbose"],
        &["train", &motion, "--preset", "tiny.json", "--out", &run],
        &["train", &motion, "--preset", "tiny.json", "--out", &run],
        &["train", "--resume", &run],
        &["runs"],
        &["plot", &run],
        &["eval", "--episodes", "2", "--seconds", "1", "--verbose"],
        &["plot"],
        &["eval", &missing],
        &["info", &file, &format!("--{name}")],
        &[&name],
        #[cfg(feature = "rerun")]
        &["replay", &motion, "--save", "a.rrd"],
        #[cfg(feature = "rerun")]
        &["replay", "--save", "b.rrd"],
    ] {
        shown(&bench, line);
        shown(&bench, &[line, &["--json"]].concat());
    }
    for drawing in [svg.as_str(), "sway-0-owned-31m--FAKE--100----txt.svg"] {
        if let Ok(text) = std::fs::read_to_string(bench.path(drawing)) {
            assert!(is_harmless(&text), "{drawing}");
        }
    }
}

/// A character's own names come from its MJCF file.
#[test]
fn and_those_of_bodies() {
    let bench = Workbench::with_clip();
    let humanoid = concat!(env!("CARGO_MANIFEST_DIR"), "/../skeletons/humanoid.xml");
    let text = std::fs::read_to_string(humanoid).expect("the character is there");
    // What XML can hold of it.
    let nasty = text.replace("left_foot", "left_foot\u{9b}31m,\u{202e}&#10;FAKE");
    assert_ne!(text, nasty);
    bench.write("mine.xml", nasty.as_bytes());
    let slots = humanoid.replace(".xml", ".json");
    let slots = std::fs::read_to_string(slots).expect("its slots are there");
    let slots = slots.replace("left_foot", "left_foot\u{9b}31m,\u{202e}\\nFAKE");
    bench.write("mine.json", slots.as_bytes());
    for line in [
        &["retarget", "sway.txt", "--skeleton", "mine.xml"][..],
        &["tracks", "sway.motion", "--skeleton", "mine.xml"],
        &[
            "tracks",
            "sway.txt",
            "--skeleton",
            "mine.xml",
            "--csv",
            "t.csv",
            "--plot",
            "t.svg",
        ],
    ] {
        shown(&bench, line);
        shown(&bench, &[line, &["--json"]].concat());
    }
}

/// The example that showed it first.
#[test]
fn an_example_of_others_is_shown_as_letters() {
    let name = "../cases/solid/gltf-escape-codes-in-take-and-joint-names.gltf";
    let Some(file) = mimic_test_support::foreign(name) else {
        return;
    };
    let bench = Workbench::new();
    let file = file.display().to_string();
    for line in [
        &["info", &file][..],
        &["import", &file, "--out", "a.clip", "--verbose"],
        &["info", "a.clip"],
        &["retarget", "a.clip", "--verbose"],
        &["tracks", "a.motion"],
    ] {
        shown(&bench, line);
        shown(&bench, &[line, &["--json"]].concat());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn paths_need_not_be_unicode() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let bench = Workbench::with_clip();
    let folder = bench.path(".").join(OsStr::from_bytes(b"caf\xe9"));
    std::fs::create_dir(&folder).expect("a folder can be made");
    let at = |name: &[u8]| folder.join(OsStr::from_bytes(name));
    let (input, clip) = (at(b"sw\xffay.txt"), at(b"sw\xffay.clip"));
    std::fs::copy(bench.path("sway.txt"), &input).expect("copied");
    let run = |verb: &str, file: &std::path::Path, more: &[(&str, Vec<u8>)]| {
        let mut command = bench.mimic(&[verb, "--json"]);
        command.arg(file);
        for (flag, name) in more {
            command.arg(flag).arg(at(name));
        }
        let output = command.output().expect("it runs");
        let code = output.status.code();
        let text = String::from_utf8(output.stdout).expect("JSON is UTF-8");
        serde_json::from_str::<Value>(&text).expect("one JSON object");
        code
    };
    assert_eq!(
        run("info", &input, &[("--write-map", b"m\xff.json".to_vec())]),
        Some(0)
    );
    assert_eq!(
        run("import", &input, &[("--out", b"sw\xffay.clip".to_vec())]),
        Some(0)
    );
    assert_eq!(
        run("retarget", &clip, &[("--out", b"sw\xffay.motion".to_vec())]),
        Some(0)
    );
    let motion = at(b"sw\xffay.motion");
    let tracks = [
        ("--csv", b"\xff.csv".to_vec()),
        ("--plot", b"\xff.svg".to_vec()),
    ];
    assert_eq!(run("tracks", &motion, &tracks), Some(0));
    assert_eq!(run("info", &at(b"no\xff.fbx"), &[]), Some(2));
    assert_eq!(run("eval", &at(b"no\xff"), &[]), Some(2));
    #[cfg(feature = "rerun")]
    assert_eq!(
        run("replay", &motion, &[("--save", b"\xff.rrd".to_vec())]),
        Some(0)
    );
}
