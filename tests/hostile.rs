//! Small files made to cost much time or memory, and damaged copies of our own clips. The test `fuzz` damages real files of
//! every format.

#[path = "import/damage.rs"]
mod damage;
#[path = "fuzz/heap.rs"]
mod heap;

use damage::Damage;
use mimic::clip::Clip;
use mimic::explain::{Explain, Parameter};
use mimic::import::{self, Error, ErrorKind, Options};
use std::time::{Duration, Instant};

const PER_BYTE: usize = 64;
const CONSTANT: usize = 256 << 10;
/// Bytes for a sampled transform: seven numbers in world space, seven in the parent's, and the lists that hold them.
const PER_TRANSFORM: usize = 120;
/// Transforms that any file may be sampled to.
const FREE_TRANSFORMS: usize = 1 << 18;
/// Bytes of memory that reading any file may take, whatever is in it: for the longest lists allowed, of the shortest entries.
const FREE: usize = 32 << 20;
const ROUNDS: usize = 2000;
const SOON: Duration = Duration::from_secs(10);

/// A DeepMimic motion that stands still, in which every frame lasts `seconds`.
fn deepmimic(seconds: &str) -> Vec<u8> {
    let pose = ["1.0", "0.0", "0.0", "0.0"];
    let numbers: Vec<&str> = [seconds, "0.0", "0.9", "0.0"]
        .into_iter()
        .chain(pose.into_iter().cycle().take(40))
        .collect();
    let frame = format!("[{}]", numbers.join(", "));
    format!(
        r#"{{"Loop": "wrap", "Frames": [{}]}}"#,
        vec![frame; 30].join(",\n")
    )
    .into_bytes()
}

/// Inspects `bytes` in a file, and checks what that cost and that what it says about takes is possible.
fn inspected(name: &str, bytes: &[u8]) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    std::fs::write(&path, bytes).expect("it is written");
    let start = Instant::now();
    let (look, peak) = heap::peak_of(|| import::inspect(&path));
    let seconds = start.elapsed();
    assert!(seconds < SOON, "{name}: {seconds:?}");
    let most = PER_BYTE * bytes.len() + CONSTANT;
    assert!(peak < most, "{name}: {peak} bytes for {}", bytes.len());
    for take in look.iter().flat_map(|look| &look.takes) {
        assert!((1.0..=10_000.0).contains(&take.fps), "{name}: {take:?}");
        assert!(
            (0.0..f64::INFINITY).contains(&take.duration_s),
            "{name}: {take:?}"
        );
        // Two frames of any motion, one of none; a count that overflowed would be less than the seconds.
        let least = take.duration_s.min(1e15) as usize;
        assert!(take.frames > least, "{name}: {take:?}");
    }
}

/// Reads `bytes` and checks what that cost, by their size. Returns how many transforms the clip has.
fn frugal(name: &str, bytes: &[u8]) -> Result<usize, Error> {
    inspected(name, bytes);
    let start = Instant::now();
    let (clip, peak) = heap::peak_of(|| import::read(bytes, name, None, &Options::default()));
    let seconds = start.elapsed();
    assert!(seconds < SOON, "{name}: {seconds:?}");
    let transforms = match &clip {
        Ok(clip) => clip.frames.len() * clip.joints.len(),
        Err(error) if matches!(error.kind, ErrorKind::NotFinite { .. }) => FREE_TRANSFORMS,
        Err(_) => 0,
    };
    let most = PER_BYTE * bytes.len() + PER_TRANSFORM * transforms + CONSTANT;
    assert!(peak < most, "{name}: {peak} bytes for {}", bytes.len());
    clip.map(|_| transforms)
}

/// Reads `bytes`, which may take as much memory as any file may.
fn bearable(name: &str, bytes: &[u8]) -> Result<Clip, Error> {
    let (clip, peak) = heap::peak_of(|| import::read(bytes, name, None, &Options::default()));
    assert!(peak < FREE + PER_BYTE * bytes.len(), "{name}: {peak} bytes");
    clip
}

/// Reads damaged copies of `bytes`, and returns how many of them could still be read.
fn survived(name: &str, bytes: &[u8]) -> usize {
    let mut damage = Damage::new();
    let damaged = |round| {
        let mut damaged = bytes.to_vec();
        damage.apply(&mut damaged, bytes.len());
        frugal(&format!("{name}, round {round}"), &damaged).is_ok()
    };
    (0..ROUNDS).map(damaged).filter(|read| *read).count()
}

/// Many animations of many nodes: comparing all of them would cost their product.
fn many_takes() -> Vec<u8> {
    let channel = r#"{"sampler":0,"target":{"node":0,"path":"translation"}}"#;
    let take = format!(r#"{{"channels":[{channel}],"samplers":[{{"input":0,"output":1}}]}}"#);
    let nodes = vec![r#"{"name":"a node"}"#; 10_000].join(",");
    let floats: Vec<u8> = [0.0_f32, 1.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    // Zeros and a one as 32-bit floats, in base64.
    assert_eq!(floats, [0, 0, 0, 0, 0, 0, 128, 63]);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"animations":[{}],
        "buffers":[{{"byteLength":8,"uri":"data:;base64,AAAAAAAAgD8="}}],
        "bufferViews":[{{"buffer":0,"byteLength":8}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR"}},
        {{"componentType":5126,"count":2,"type":"VEC3"}}]}}"#,
        vec![take; 10_000].join(",")
    )
    .into_bytes()
}

/// A rotation whose accessor has no bytes behind it, which means zeros, however many.
fn many_zeros() -> Vec<u8> {
    br#"{"asset":{"version":"2.0"},"nodes":[{}],
    "animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"rotation"}}],"samplers":[{"input":0,"output":1}]}],
    "accessors":[{"componentType":5126,"count":9000000,"type":"SCALAR"},{"componentType":5126,"count":9000000,"type":"VEC4"}]}"#
        .to_vec()
}

/// A glTF file of these nodes, skins and takes, whose accessors are zeros.
fn gltf(nodes: &str, skins: &str, takes: &str) -> Vec<u8> {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"skins":[{skins}],"animations":[{takes}],
        "buffers":[{{"byteLength":8,"uri":"data:;base64,AAAAAAAAyEc="}}],
        "bufferViews":[{{"buffer":0,"byteLength":8}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR"}},
        {{"componentType":5126,"count":2,"type":"VEC3"}},{{"componentType":5126,"count":1,"type":"MAT4"}}]}}"#
    )
    .into_bytes()
}

fn many_nodes(count: usize) -> Vec<u8> {
    gltf(&vec!["{}"; count].join(","), "", "")
}

/// Many skins of many nodes.
fn many_skins() -> Vec<u8> {
    let skin = r#"{"joints":[0],"inverseBindMatrices":2}"#;
    let node = r#"{"name":"a node of some length"}"#;
    gltf(&[node; 20_000].join(","), &[skin; 20_000].join(","), "")
}

/// A bone that moves for `seconds`, which are more than an hour, in a file of two keys.
fn long_take(seconds: f32) -> Vec<u8> {
    let take = r#"{"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}],"samplers":[{"input":0,"output":1}]}"#;
    let file = String::from_utf8(gltf("{}", r#"{"joints":[0]}"#, take)).expect("a text");
    let codes = seconds.to_le_bytes().map(|byte| format!("%{byte:02x}"));
    let key = format!("data:,%00%00%00%00{}", codes.concat());
    file.replace("data:;base64,AAAAAAAAyEc=", &key).into_bytes()
}

/// A bone that moves for 28 hours among many meshes: its frames are few enough to keep, but every node has to be placed in each.
fn long_take_of_many_meshes() -> Vec<u8> {
    assert_eq!(102_400_f32.to_le_bytes(), [0, 0, 200, 71]);
    let take = r#"{"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}],"samplers":[{"input":0,"output":1}]}"#;
    let nodes = format!(
        "{{}}{}",
        r#",{"mesh":0,"name":"a mesh of some length"}"#.repeat(20_000)
    );
    gltf(&nodes, r#"{"joints":[0]}"#, take)
}

/// Appends an FBX 7.4 record whose values are integers or texts and whose children `inside` appends.
fn record(
    out: &mut Vec<u8>,
    name: &str,
    integers: &[i64],
    texts: &[&str],
    inside: impl FnOnce(&mut Vec<u8>),
) {
    let start = out.len();
    let mut values = Vec::new();
    let put_text = |values: &mut Vec<u8>, text: &str| {
        values.push(b'S');
        values.extend(u32::to_le_bytes(text.len() as u32));
        values.extend(text.as_bytes());
    };
    // Connections have their kind before the two ids.
    let (before, after) = texts.split_at(usize::from(name == "C"));
    before.iter().for_each(|text| put_text(&mut values, text));
    for integer in integers {
        values.push(b'L');
        values.extend(integer.to_le_bytes());
    }
    after.iter().for_each(|text| put_text(&mut values, text));
    out.extend([0; 4]);
    out.extend(u32::to_le_bytes((integers.len() + texts.len()) as u32));
    out.extend(u32::to_le_bytes(values.len() as u32));
    out.push(name.len() as u8);
    out.extend(name.as_bytes());
    out.extend(values);
    let children = out.len();
    inside(out);
    if out.len() > children {
        out.extend([0; 13]);
    }
    let end = u32::to_le_bytes(out.len() as u32);
    out[start..start + 4].copy_from_slice(&end);
}

/// An FBX file of these records.
fn fbx(objects: impl FnOnce(&mut Vec<u8>), connections: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = b"Kaydara FBX Binary  \0\x1a\0".to_vec();
    out.extend(u32::to_le_bytes(7400));
    objects(&mut out);
    record(&mut out, "Connections", &[], &[], connections);
    out.extend([0; 13]);
    out
}

/// An FBX file in which one curve node has `many` curves and moves as many models.
fn shared_curve_node(many: i64) -> Vec<u8> {
    let (model, curve) = (|k| 1_000_000 + k, |k| 2_000_000 + k);
    let objects = |out: &mut Vec<u8>| {
        record(out, "AnimationStack", &[1], &["s", ""], |_| {});
        record(out, "AnimationLayer", &[2], &["l", ""], |_| {});
        record(out, "AnimationCurveNode", &[3], &["T", ""], |_| {});
        for k in 0..many {
            record(out, "Model", &[model(k)], &["m", "LimbNode"], |_| {});
            record(out, "AnimationCurve", &[curve(k)], &["", ""], |_| {});
        }
    };
    let connections = |out: &mut Vec<u8>| {
        record(out, "C", &[2, 1], &["OO"], |_| {});
        record(out, "C", &[3, 2], &["OO"], |_| {});
        for k in 0..many {
            record(out, "C", &[3, model(k)], &["OP", "Lcl Translation"], |_| {});
            record(out, "C", &[curve(k), 3], &["OP", "d|X"], |_| {});
        }
    };
    fbx(|out| record(out, "Objects", &[], &[], objects), connections)
}

/// An FBX file with one curve of `keys` keys, which are the same and so take next to no bytes.
fn packed_keys(keys: usize) -> Vec<u8> {
    let array = |out: &mut Vec<u8>, name: &str, letter: u8, bytes: usize| {
        let packed = miniz_oxide::deflate::compress_to_vec_zlib(&vec![0; bytes], 9);
        let lengths = [keys as u32, 1, packed.len() as u32].map(u32::to_le_bytes);
        let values = [&[letter][..], &lengths.concat(), &packed].concat();
        let end = (out.len() + 13 + name.len() + values.len()) as u32;
        out.extend([end, 1, values.len() as u32].map(u32::to_le_bytes).concat());
        out.push(name.len() as u8);
        out.extend(name.as_bytes());
        out.extend(values);
    };
    let curve = |out: &mut Vec<u8>| {
        array(out, "KeyTime", b'l', 8 * keys);
        array(out, "KeyValueFloat", b'f', 4 * keys);
    };
    let objects = |out: &mut Vec<u8>| {
        record(out, "AnimationStack", &[1], &["s", ""], |_| {});
        record(out, "AnimationLayer", &[2], &["l", ""], |_| {});
        record(out, "AnimationCurveNode", &[3], &["T", ""], |_| {});
        record(out, "Model", &[4], &["m", "LimbNode"], |_| {});
        record(out, "AnimationCurve", &[5], &["", ""], curve);
    };
    let connections = |out: &mut Vec<u8>| {
        record(out, "C", &[2, 1], &["OO"], |_| {});
        record(out, "C", &[3, 2], &["OO"], |_| {});
        record(out, "C", &[3, 4], &["OP", "Lcl Translation"], |_| {});
        record(out, "C", &[5, 3], &["OP", "d|X"], |_| {});
    };
    fbx(|out| record(out, "Objects", &[], &[], objects), connections)
}

/// An FBX file of `many` models whose template has as many properties.
fn long_template(many: i64) -> Vec<u8> {
    let property = |out: &mut Vec<u8>| record(out, "P", &[], &["a name", "", "", ""], |_| {});
    let properties = |out: &mut Vec<u8>| (0..many).for_each(|_| property(out));
    let list = |out: &mut Vec<u8>| record(out, "Properties70", &[], &[], properties);
    let template = |out: &mut Vec<u8>| record(out, "PropertyTemplate", &[], &[], list);
    let kind = |out: &mut Vec<u8>| record(out, "ObjectType", &[], &["Model"], template);
    let model = |out: &mut Vec<u8>, k| record(out, "Model", &[k], &["m", "LimbNode"], |_| {});
    let models = |out: &mut Vec<u8>| (0..many).for_each(|k| model(out, k));
    let records = |out: &mut Vec<u8>| {
        record(out, "Definitions", &[], &[], kind);
        record(out, "Objects", &[], &[], models);
    };
    fbx(records, |_| {})
}

/// An FBX file of `stacks` takes that share one layer, which moves `models` models.
fn shared_layer(stacks: i64, models: i64) -> Vec<u8> {
    let (model, curve_node) = (|k| 1_000_000 + k, |k| 2_000_000 + k);
    let objects = |out: &mut Vec<u8>| {
        record(out, "AnimationLayer", &[0], &["l", ""], |_| {});
        for k in 1..=stacks {
            record(out, "AnimationStack", &[k], &["s", ""], |_| {});
        }
        for k in 0..models {
            record(out, "Model", &[model(k)], &["m", "LimbNode"], |_| {});
            record(
                out,
                "AnimationCurveNode",
                &[curve_node(k)],
                &["T", ""],
                |_| {},
            );
        }
    };
    let connections = |out: &mut Vec<u8>| {
        for k in 1..=stacks {
            record(out, "C", &[0, k], &["OO"], |_| {});
        }
        for k in 0..models {
            record(out, "C", &[curve_node(k), 0], &["OO"], |_| {});
            let property = ["OP", "Lcl Translation"];
            record(out, "C", &[curve_node(k), model(k)], &property, |_| {});
        }
    };
    fbx(|out| record(out, "Objects", &[], &[], objects), connections)
}

/// A take of more frames than its file may have is refused with the advice to trim it.
fn assert_too_long(error: &Error) {
    let remedy = error.explain().remedy.expect("a remedy");
    assert_eq!(remedy.parameter, Some(Parameter::Trim), "{error}");
}

#[test]
fn reading_costs_no_more_than_the_size_allows() {
    let clip = |name: &str| {
        let path = format!("{}/clips/{name}", env!("CARGO_MANIFEST_DIR"));
        std::fs::read(path).expect("our own clip")
    };
    let files = [
        ("kick.fbx", clip("kick.fbx")),
        ("walk.glb", clip("walk.glb")),
        ("a.txt", deepmimic("0.0333")),
    ];
    for (name, bytes) in files {
        let survived = survived(name, &bytes);
        assert!(
            (1..ROUNDS).contains(&survived),
            "{name}: {survived} of {ROUNDS} could be read"
        );
    }
    assert!(frugal("takes.gltf", &many_takes()).is_ok());
    let refusal = |name: &str, bytes: &[u8]| {
        let error = frugal(name, bytes).expect_err("refused");
        error.to_string()
    };
    assert!(refusal("zeros.gltf", &many_zeros()).contains("more than"));
    assert!(frugal("tiny.txt", &deepmimic("1e-300")).is_ok());
    let many = bearable("nodes.gltf", &many_nodes(200_000)).expect_err("refused");
    assert!(many.to_string().contains("at most"), "{many}");
    let few = bearable("nodes.gltf", &many_nodes(32_768)).expect_err("refused");
    assert!(few.to_string().contains("no animation"), "{few}");
    let takes = vec!["{}"; 131_072].join(",");
    let still = bearable("takes.gltf", &gltf("{}", "", &takes)).expect("it imports");
    assert_eq!(still.frames.len(), 1);
    assert!(refusal("skins.gltf", &many_skins()).contains("no animation"));
    let meshes = frugal("meshes.gltf", &long_take_of_many_meshes()).expect_err("refused");
    assert_too_long(&meshes);
    assert!(frugal("curves.fbx", &shared_curve_node(20_000)).is_ok());
    assert!(refusal("template.fbx", &long_template(20_000)).contains("no animation"));
    // Keys have twelve bytes each, of three MiB that any file may unpack.
    assert!(bearable("keys.fbx", &packed_keys(250_000)).is_ok());
    let error = bearable("keys.fbx", &packed_keys(280_000)).expect_err("refused");
    assert!(error.to_string().contains("implausibly large"), "{error}");
    let long = bearable("long.gltf", &long_take(3584.0)).expect("it imports");
    assert_eq!(long.frames.len(), 107_521);
    let longer = bearable("long.gltf", &long_take(16_384.0)).expect_err("refused");
    assert_too_long(&longer);
    assert!(frugal("one.fbx", &shared_layer(1, 1000)).is_ok());
    assert!(refusal("shared.fbx", &shared_layer(4000, 1000)).contains("implausibly often"));
}

/// A BVH file of one joint with one channel, whose frames are zeros.
fn zeros(frames: usize) -> Vec<u8> {
    let head = "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n}\nMOTION\n";
    let rows = "0\n".repeat(frames);
    format!("{head}Frames: {frames}\nFrame Time: 0.01\n{rows}").into_bytes()
}

/// The shortest rows that a text can have ask for the most memory per byte.
#[test]
fn a_text_takes_less_memory_than_a_binary_file() {
    let rows = |row: &str, count: usize| {
        format!(
            r#"{{"Loop":"wrap","Frames":[{}]}}"#,
            vec![row; count].join(",")
        )
        .into_bytes()
    };
    let row = format!("[1{}]", ",0".repeat(43));
    let still = String::from_utf8(deepmimic("1")).expect("a text");
    let start = still.find("[[").expect("it has frames") + 1;
    let end = still.find(']').expect("a frame ends") + 1;
    let files = [
        ("zeros.bvh", zeros(4 << 20)),
        ("some.bvh", zeros(300_000)),
        ("empty.txt", rows("[]", 2 << 20)),
        ("one.txt", rows("[0]", 2 << 20)),
        ("zero.txt", rows(&row, 80_000)),
        ("still.txt", rows(&still[start..end], 40_000)),
    ];
    for (name, bytes) in files {
        let start = Instant::now();
        let (_, peak) = heap::peak_of(|| import::read(&bytes, name, None, &Options::default()));
        let most = 16 * bytes.len() + FREE;
        assert!(peak < most, "{name}: {peak} bytes for {}", bytes.len());
        let soon = SOON + Duration::from_secs(bytes.len() as u64 >> 20);
        assert!(start.elapsed() < soon, "{name}: {:?}", start.elapsed());
    }
    let long = import::read(&zeros(4 << 20), "zeros.bvh", None, &Options::default());
    assert_too_long(&long.expect_err("refused"));
}
