//! What the import options do, and what is said of files that can't be imported.

use crate::workbench::Workbench;
use serde_json::{Value, json};

/// A glTF file with the takes `up`, a second long, and `down`, two seconds: a hip that rises and sinks.
pub fn with_two_takes() -> Workbench {
    let bench = Workbench::new();
    let floats = [0.0_f32, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    bench.write("two.bin", &bytes);
    let take = |name: &str, times: usize| {
        json!({
            "name": name,
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
            "samplers": [{ "input": times, "output": 2 }]
        })
    };
    let file = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "name": "hip", "children": [1] }, { "name": "knee", "translation": [0.0, 1.0, 0.0] }],
        "skins": [{ "joints": [0, 1] }],
        "buffers": [{ "byteLength": 36, "uri": "two.bin" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 12 }, { "buffer": 0, "byteOffset": 12, "byteLength": 24 }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR" },
            { "bufferView": 0, "byteOffset": 4, "componentType": 5126, "count": 2, "type": "SCALAR" },
            { "bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3" }
        ],
        "animations": [take("up", 0), take("down", 1)]
    });
    bench.write("two.gltf", file.to_string().as_bytes());
    bench
}

#[test]
fn a_take_is_chosen_by_name_or_number() {
    let bench = with_two_takes();
    for (wanted, clip) in [("up", "two-up.clip"), ("1", "two-1.clip")] {
        let import = bench.json(&["import", "two.gltf", "--take", wanted]);
        assert_eq!(import["clip"], clip);
        let info = bench.json(&["info", clip]);
        assert_eq!(info["takes"][0]["name"], "up");
    }
    let said = bench.complaint(&["import", "two.gltf", "--take", "sideways"], 2);
    assert!(
        said.contains("`sideways`") && said.contains("down"),
        "{said}"
    );
}

#[test]
fn a_trim_keeps_a_part() {
    let bench = Workbench::with_clip();
    let whole = bench.json(&["import", "sway.txt"]);
    let part = bench.json(&["import", "sway.txt", "--trim", "0.2..0.6"]);
    let frames = |import: &Value| import["frames"].as_u64();
    assert_eq!((frames(&whole), frames(&part)), (Some(31), Some(13)));
    let open = bench.json(&["import", "sway.txt", "--trim", "0.5.."]);
    assert_eq!(frames(&open), Some(16));
    let said = bench.complaint(&["import", "sway.txt", "--trim", "5..6"], 2);
    assert!(
        said.contains("sway.txt") && said.contains("choose a part within"),
        "{said}"
    );
}

#[test]
fn a_clip_loops_or_ends_as_it_is_told() {
    let bench = Workbench::with_clip();
    for mode in ["wrap", "clamp"] {
        let import = bench.json(&["import", "sway.txt", "--loop", mode]);
        assert_eq!(import["loop"], mode);
    }
    bench
        .mimic(&["import", "sway.txt", "--loop", "maybe"])
        .assert()
        .code(2);
}

#[test]
fn a_unit_scales_the_figure() {
    let bench = Workbench::with_clip();
    let height = |unit: &str| {
        bench
            .mimic(&["import", "sway.txt", "--unit", unit])
            .assert()
            .success();
        let clip = std::fs::read(bench.path("sway.clip")).expect("the clip is there");
        hip_height(&clip)
    };
    let (metres, feet) = (height("1"), height("0.3048"));
    assert!((metres - 0.86).abs() < 1e-6, "as the file has it: {metres}");
    assert!((feet - 0.86 * 0.3048).abs() < 1e-6, "{feet}");
}

/// The z of the first joint in the first frame: a number of the tensor `local_translation`.
fn hip_height(clip: &[u8]) -> f64 {
    let (length, rest) = clip.split_at(8);
    let length = u64::from_le_bytes(length.try_into().expect("eight bytes")) as usize;
    let header: Value = serde_json::from_slice(&rest[..length]).expect("a header");
    let start = &header["local_translation"]["data_offsets"][0];
    let start = length + start.as_u64().expect("an offset") as usize + 8;
    let bytes = rest[start..start + 4].try_into().expect("four bytes");
    f64::from(f32::from_le_bytes(bytes))
}

#[test]
fn of_several_files_the_failed_are_listed() {
    let bench = Workbench::with_clip();
    bench.write("empty.fbx", b"");
    let failed = |files: &[&str]| {
        let output = bench
            .mimic(&["import", "--json", "--quiet"])
            .args(files)
            .assert()
            .code(2);
        let output = output.get_output();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            said.contains("error: `empty.fbx`: "),
            "also when quiet: {said}"
        );
        serde_json::from_slice::<Value>(&output.stdout).expect("the output is JSON")
    };
    let report = failed(&["sway.txt", "empty.fbx"]);
    assert_eq!(report["clips"][0]["clip"], "sway.clip");
    assert_eq!(report["failures"][0]["file"], "empty.fbx");
    assert_eq!(report["failures"][0]["exit"], 2);
    let message = report["failures"][0]["message"].as_str();
    assert!(
        message.is_some_and(|m| m.contains("an empty file")),
        "{report}"
    );
    assert!(report["failures"][0]["remedy"].is_string(), "{report}");
    let message = report["error"]["message"].as_str();
    assert!(message.is_some_and(|m| m.contains("1 of 2")), "{report}");
    bench.write("half.fbx", b"Kaydara FBX Binary  \0\x1a\0");
    let report = failed(&["half.fbx", "empty.fbx"]);
    assert_eq!(report["clips"], json!([]));
    assert_eq!(report["failures"].as_array().map(Vec::len), Some(2));
}

#[test]
fn our_own_files_are_sent_where_they_belong() {
    let bench = Workbench::with_clip();
    bench.mimic(&["retarget", "sway.txt"]).assert().success();
    for verb in ["info", "import"] {
        let error = bench.error_about("sway.motion", &[verb, "sway.motion"], 2);
        let said = |part: &str| error[part].as_str().unwrap_or_default().to_owned();
        assert!(said("message").contains("this is a motion"), "{error}");
        assert!(said("remedy").contains("`mimic tracks`"), "{error}");
    }
}

#[test]
fn a_name_in_the_library_finds_upper_case_extensions() {
    let bench = Workbench::with_clip();
    std::fs::create_dir(bench.path("clips")).expect("a folder can be made");
    std::fs::rename(bench.path("sway.txt"), bench.path("clips/sway.TXT"))
        .expect("a file can be moved");
    assert_eq!(bench.json(&["info", "sway"])["file"], "clips/sway.TXT");
}

#[test]
fn a_map_is_written_for_the_rigs_that_need_one() {
    let bench = with_two_takes();
    let line = ["info", "two.gltf", "--write-map", "map.json"];
    let output = bench.mimic(&line).assert().success();
    let said = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
    assert!(
        said.contains("`map.json` needs joints for hips, "),
        "{said}"
    );
    let text = std::fs::read(bench.path("map.json")).expect("the map is there");
    let map: Value = serde_json::from_slice(&text).expect("the map is JSON");
    assert_eq!(
        map.as_object().map(|map| map.len()),
        Some(21),
        "a line per slot"
    );
    assert_eq!(map["left-foot"], Value::Null);
    let line = ["retarget", "two.gltf", "--map", "map.json"];
    let error = bench.error_about("map.json", &line, 2);
    assert_eq!(error["place"], "slot `hips`", "null is read: {error}");
}

#[test]
fn every_take_becomes_a_clip() {
    let bench = with_two_takes();
    let said = bench.json(&["import", "two.gltf", "--take", "all", "--out", "takes/"]);
    let clips = said["clips"].as_array().expect("a list");
    for (clip, (path, take)) in clips
        .iter()
        .zip([("takes/two-up.clip", "up"), ("takes/two-down.clip", "down")])
    {
        assert_eq!(clip["clip"], path);
        assert_eq!(bench.json(&["info", path])["takes"][0]["name"], take);
    }
    assert_eq!(clips.len(), 2);
    let said = bench.complaint(
        &["import", "two.gltf", "--take", "all", "--out", "x.clip"],
        2,
    );
    assert!(said.contains("name a folder"), "{said}");
}
