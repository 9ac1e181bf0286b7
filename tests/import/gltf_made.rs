//! Small glTF files, each made to show one thing, with expected values worked out by hand.

use mimic::clip::{Clip, LoopMode};
use mimic::import::{self, Options};
use nalgebra::Vector3;
use serde_json::{Value, json};

/// A file with two joints and one take, as text, after `change`.
pub fn synthetic(change: impl Fn(&mut Value)) -> String {
    // Times 0, 1 and two turns: none, and a quarter about z.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let floats = [0.0_f32, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half];
    let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    let mut file = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "name": "hip", "children": [1] }, { "name": "knee", "translation": [0.0, 1.0, 0.0] }],
        "skins": [{ "joints": [0, 1] }],
        "buffers": [{ "byteLength": 40, "uri": format!("data:application/octet-stream;base64,{}", base64(&bytes)) }],
        "bufferViews": [{ "buffer": 0, "byteLength": 8 }, { "buffer": 0, "byteOffset": 8, "byteLength": 32 }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR" },
            { "bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC4" }
        ],
        "animations": [{
            "name": "turn",
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "rotation" } }],
            "samplers": [{ "input": 0, "output": 1 }]
        }]
    });
    change(&mut file);
    file.to_string()
}

pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let word =
            group.iter().fold(0u32, |word, &b| word << 8 | u32::from(b)) << (8 * (3 - group.len()));
        for letter in 0..=group.len() {
            text.push(char::from(
                LETTERS[(word >> (18 - 6 * letter) & 63) as usize],
            ));
        }
    }
    text
}

#[test]
fn percent_encoded_buffers_are_read_as_base64_ones_are() {
    let of = |uri: &dyn Fn(&[u8]) -> String| {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let floats = [0.0_f32, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half];
        let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
        read(&synthetic(|file| {
            file["buffers"][0]["uri"] = uri(&bytes).into();
        }))
    };
    let coded = |bytes: &[u8]| {
        bytes
            .iter()
            .map(|b| format!("%{b:02X}"))
            .collect::<String>()
    };
    let clip = of(&|bytes| format!("data:,{}", coded(bytes))).expect("it imports");
    let same = of(&|bytes| format!("data:;base64,{}", base64(bytes))).expect("it imports");
    assert_eq!(clip.frames, same.frames);
    let error = of(&|bytes| format!("data:,{}%", coded(bytes))).expect_err("it is cut");
    assert!(
        error
            .to_string()
            .contains("buffer 0: its data URI has a `%`"),
        "{error}"
    );
}

pub(super) fn synthetic_file() -> String {
    synthetic(|_| {})
}

fn read(text: &str) -> Result<Clip, import::Error> {
    import::read(text.as_bytes(), "a.gltf", None, &Options::default())
}

#[test]
fn a_turn_about_the_forward_axis_lays_the_joint_to_its_side() {
    let clip = read(&synthetic(|_| {})).expect("it imports");
    assert_eq!(
        (clip.frames.len(), clip.fps, clip.loop_mode),
        (31, 30.0, LoopMode::Clamp)
    );
    let knee = |f: usize| clip.world(f)[1].translation.vector;
    // About the file's z, y turns to −x: up turns to the right, −Y.
    assert!((knee(0) - Vector3::z()).norm() < 1e-7);
    let mid = std::f64::consts::FRAC_PI_4;
    assert!((knee(15) - Vector3::new(0.0, -mid.sin(), mid.cos())).norm() < 1e-7);
    assert!((knee(30) + Vector3::y()).norm() < 1e-7);
}

#[test]
fn files_that_point_nowhere_are_refused_with_a_reason() {
    type Change<'a> = &'a dyn Fn(&mut Value);
    let cases: [(Change<'_>, &str); 16] = [
        (&|f| f["asset"]["version"] = json!("1.0"), "version 1.0"),
        (
            &|f| f["nodes"][1]["children"] = json!([0]),
            "its own ancestor",
        ),
        (
            &|f| f["nodes"][0]["children"] = json!([1, 1]),
            "several parents",
        ),
        (
            &|f| f["nodes"][0]["children"] = json!([9]),
            "isn't in the file",
        ),
        (
            &|f| f["skins"][0]["joints"] = json!([9]),
            "isn't in the file",
        ),
        (
            &|f| f["animations"][0]["channels"][0]["target"]["node"] = json!(9),
            "isn't in the file",
        ),
        (
            &|f| f["animations"][0]["channels"][0]["sampler"] = json!(9),
            "no sampler 9",
        ),
        (
            &|f| f["animations"][0]["samplers"][0]["input"] = json!(9),
            "no such accessor",
        ),
        (
            &|f| f["animations"][0]["samplers"][0]["input"] = json!(1),
            "VEC4 where SCALAR",
        ),
        (
            &|f| f["accessors"][0]["count"] = json!(1),
            "1 keys with 8 numbers",
        ),
        (&|f| f["accessors"][1]["count"] = json!(3), "don't fit"),
        (
            &|f| f["accessors"][1]["byteOffset"] = json!(u64::MAX),
            "don't fit",
        ),
        (
            &|f| f["accessors"][1]["count"] = json!(u64::MAX),
            "too many elements",
        ),
        (
            &|f| f["bufferViews"][1]["byteStride"] = json!(u64::MAX),
            "don't fit",
        ),
        (
            &|f| f["bufferViews"][1]["byteLength"] = json!(33),
            "longer than its buffer",
        ),
        (
            &|f| f["buffers"][0]["uri"] = json!("../../secret.bin"),
            "isn't at hand",
        ),
    ];
    for (change, reason) in cases {
        let error = read(&synthetic(change)).expect_err(reason).to_string();
        assert!(
            error.starts_with("`a.gltf`: ") && error.contains(reason),
            "{error}"
        );
    }
    let asks = |count: u64| {
        synthetic(|f| {
            f["accessors"][1] = json!({ "componentType": 5126, "count": count, "type": "VEC4" });
        })
    };
    assert!(
        read(&asks(1 << 40))
            .expect_err("too much")
            .to_string()
            .contains("more than")
    );
    assert!(
        read(&asks(2))
            .expect_err("zero turns")
            .to_string()
            .contains("zero")
    );
}

#[test]
fn sparse_and_normalised_accessors_mean_what_they_say() {
    // The second turn, given sparsely over zeros and first, by 16-bit integers: a quarter about z.
    let words: [i16; 8] = [0, 0, 0, 32767, 0, 0, 23170, 23170];
    let bytes: Vec<u8> = [0, 0, 1, 0]
        .into_iter()
        .chain(words.iter().flat_map(|x| x.to_le_bytes()))
        .collect();
    let text = synthetic(|f| {
        f["buffers"].as_array_mut().expect("buffers").push(json!({
            "byteLength": bytes.len(),
            "uri": format!("data:application/octet-stream;base64,{}", base64(&bytes))
        }));
        let views = f["bufferViews"].as_array_mut().expect("views");
        views.push(json!({ "buffer": 1, "byteLength": 4 }));
        views.push(json!({ "buffer": 1, "byteOffset": 4, "byteLength": 16 }));
        f["accessors"][1] = json!({
            "componentType": 5122, "normalized": true, "count": 2, "type": "VEC4",
            "sparse": {
                "count": 2,
                "indices": { "bufferView": 2, "componentType": 5123 },
                "values": { "bufferView": 3 }
            }
        });
    });
    let clip = read(&text).expect("it imports");
    assert!((clip.world(30)[1].translation.vector + Vector3::y()).norm() < 1e-4);
    assert!((clip.world(0)[1].translation.vector - Vector3::z()).norm() < 1e-12);
    // Two quaternion parts, 23170 each, read as indices.
    let far = text.replace(
        r#""indices":{"bufferView":2"#,
        r#""indices":{"bufferView":3,"byteOffset":12"#,
    );
    assert!(
        read(&far)
            .expect_err("an index too far")
            .to_string()
            .contains("out of range")
    );
    let many = text.replace(r#""sparse":{"count":2"#, r#""sparse":{"count":3"#);
    assert!(
        read(&many)
            .expect_err("too many")
            .to_string()
            .contains("3 sparse values")
    );
}

#[test]
fn scale_of_any_kind_leaves_joints_in_their_places() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // A quarter about the file's z takes (0, 3, 0) to (−3, 0, 0): canonical Y is the file's x.
    for (scale, place) in [
        ([2.0, 3.0, 1.0], Vector3::new(0.0, -3.0, 0.0)),
        ([2.0, -3.0, 1.0], Vector3::new(0.0, 3.0, 0.0)),
        ([-1.0, -1.0, -1.0], Vector3::new(0.0, 1.0, 0.0)),
        ([0.0, 0.0, 0.0], Vector3::zeros()),
    ] {
        let text = synthetic(|f| {
            f["nodes"][0]["scale"] = json!(scale);
            f["nodes"][0]["rotation"] = json!([0.0, 0.0, half, half]);
            f["nodes"][1]["rotation"] = json!([half, 0.0, 0.0, half]);
            f["animations"][0]["channels"][0]["target"]["node"] = json!(1);
        });
        let clip = read(&text).expect("it imports");
        for f in 0..clip.frames.len() {
            let knee = clip.world(f)[1].translation.vector;
            // Clips hold single precision.
            assert!((knee - place).norm() < 1e-6, "{scale:?} frame {f}: {knee}");
        }
    }
}

#[test]
fn up_axis_and_unit_can_be_set_right() {
    let text = synthetic(|f| f["nodes"][1]["translation"] = json!([0.0, 0.0, 100.0]));
    let options = Options {
        up: Some("z".parse().expect("an axis")),
        unit_m: Some(0.01),
        ..Options::default()
    };
    let clip = import::read(text.as_bytes(), "a.gltf", None, &options).expect("it imports");
    assert!((clip.rest_world()[1].translation.vector - Vector3::z()).norm() < 1e-12);
    assert_eq!(
        (clip.source.up_axis.as_str(), clip.source.unit_m),
        ("+Z", 0.01)
    );
    for unit_m in [0.0, -1.0, f64::NAN] {
        let options = Options {
            unit_m: Some(unit_m),
            ..Options::default()
        };
        assert!(
            import::read(text.as_bytes(), "a.gltf", None, &options).is_err(),
            "{unit_m}"
        );
    }
}

#[test]
fn a_part_of_a_take_is_read_at_any_rate() {
    let text = synthetic(|_| {});
    let read = |options: &Options| import::read(text.as_bytes(), "a.gltf", None, options);
    let part = Options {
        trim: Some((0.25, 0.5)),
        fps: Some(120.0),
        ..Options::default()
    };
    let clip = read(&part).expect("it imports");
    assert_eq!((clip.frames.len(), clip.fps), (31, 120.0));
    let knee = clip.world(30)[1].translation.vector;
    let eighth = std::f64::consts::FRAC_PI_4;
    assert!((knee - Vector3::new(0.0, -eighth.sin(), eighth.cos())).norm() < 1e-7);
    let forced = Options {
        loop_mode: Some(LoopMode::Wrap),
        ..Options::default()
    };
    assert_eq!(read(&forced).expect("it imports").loop_mode, LoopMode::Wrap);
    for trim in [(2.0, 3.0), (0.5, 0.2), (f64::NAN, 1.0)] {
        let error = read(&Options {
            trim: Some(trim),
            ..Options::default()
        })
        .expect_err("nothing left");
        assert!(
            error.to_string().contains("take `turn`: the part from"),
            "{error}"
        );
    }
    for fps in [0.0, -30.0, f64::NAN, 1e6] {
        assert!(
            read(&Options {
                fps: Some(fps),
                ..Options::default()
            })
            .is_err(),
            "{fps}"
        );
    }
    let long = synthetic(|f| {
        f["accessors"][0]["sparse"] = json!({
            "count": 1,
            "indices": { "bufferView": 2, "componentType": 5121 },
            "values": { "bufferView": 2, "byteOffset": 1 }
        });
        let bytes: Vec<u8> = [1].into_iter().chain(3e9_f32.to_le_bytes()).collect();
        let uri = format!("data:application/octet-stream;base64,{}", base64(&bytes));
        f["buffers"]
            .as_array_mut()
            .expect("buffers")
            .push(json!({ "byteLength": 5, "uri": uri }));
        f["bufferViews"]
            .as_array_mut()
            .expect("views")
            .push(json!({ "buffer": 1, "byteLength": 5 }));
    });
    let error = self::read(&long).expect_err("a century").to_string();
    assert!(
        error.contains("frames of 2 nodes") && error.contains("keep a part"),
        "{error}"
    );
}

#[test]
fn an_empty_first_take_loses_and_the_choice_is_told() {
    let text =
        synthetic(|f| {
            let mut still = f["animations"][0].clone();
            still["name"] = json!("still");
            still["samplers"][0]["output"] = json!(2);
            f["accessors"].as_array_mut().expect("accessors").push(json!({
            "bufferView": 1, "byteOffset": 16, "componentType": 5126, "count": 1, "type": "VEC4"
        }));
            still["samplers"][0]["input"] = json!(3);
            f["accessors"]
                .as_array_mut()
                .expect("accessors")
                .push(json!({
                    "bufferView": 0, "componentType": 5126, "count": 1, "type": "SCALAR"
                }));
            let takes = f["animations"].as_array_mut().expect("takes");
            takes.insert(
                0,
                json!({ "name": "Take 001", "channels": [], "samplers": [] }),
            );
            takes.insert(1, still);
        });
    let clip = read(&text).expect("it imports");
    assert_eq!(clip.source.take, "turn");
    let told = clip
        .problems
        .iter()
        .find(|problem| problem.id == "several-takes")
        .expect("a note");
    assert!(
        told.message.contains("1 `Take 001`, 2 `still`, 3 `turn`"),
        "{}",
        told.message
    );
    let named = |take: &str| {
        let options = Options {
            take: Some(take.to_owned()),
            ..Options::default()
        };
        import::read(text.as_bytes(), "a.gltf", None, &options)
    };
    let still = named("still").expect("it imports");
    assert_eq!(still.frames.len(), 1);
    assert!(
        still
            .problems
            .iter()
            .any(|problem| problem.id == "still-take")
    );
    assert!(named("0").is_err() && named("4").is_err());
}
