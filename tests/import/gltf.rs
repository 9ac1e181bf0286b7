//! glTF files against an evaluation straight from their JSON and bytes with plain 4 × 4 matrices (Y up, facing +Z).

use super::data;
use mimic::clip::{Clip, LoopMode};
use mimic::import::{self, Options};
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::path::Path;

type Matrix = [[f64; 4]; 4];

const IDENTITY: Matrix = [
    [1., 0., 0., 0.],
    [0., 1., 0., 0.],
    [0., 0., 1., 0.],
    [0., 0., 0., 1.],
];

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|r| std::array::from_fn(|c| (0..4).map(|k| a[r][k] * b[k][c]).sum()))
}

/// A glTF file with 32-bit float accessors that aren't interleaved, and no sparse ones.
struct Reference {
    json: Value,
    buffers: Vec<Vec<u8>>,
}

impl Reference {
    fn open(path: &Path) -> Self {
        let bytes = std::fs::read(path).expect("the file opens");
        if !bytes.starts_with(b"glTF") {
            let json: Value = serde_json::from_slice(&bytes).expect("JSON");
            let beside = |buffer: &Value| {
                let uri = buffer["uri"].as_str().expect("an address");
                std::fs::read(path.with_file_name(uri)).expect("the buffer opens")
            };
            let buffers = json["buffers"]
                .as_array()
                .expect("buffers")
                .iter()
                .map(beside)
                .collect();
            return Self { json, buffers };
        }
        let word =
            |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("4 bytes")) as usize;
        let json_end = 20 + word(12);
        let bin = bytes[json_end + 8..json_end + 8 + word(json_end)].to_vec();
        let json = serde_json::from_slice(&bytes[20..json_end]).expect("JSON");
        Self {
            json,
            buffers: vec![bin],
        }
    }

    fn floats(&self, accessor: &Value) -> Vec<f64> {
        let about = &self.json["accessors"][index(accessor)];
        let view = &self.json["bufferViews"][index(&about["bufferView"])];
        assert_eq!(about["componentType"], 5126);
        let width = match about["type"].as_str() {
            Some("VEC4") => 4,
            Some("VEC3") => 3,
            _ => 1,
        };
        let start = number(&view["byteOffset"]) + number(&about["byteOffset"]);
        let bytes = &self.buffers[index(&view["buffer"])][start..];
        let count = index(&about["count"]) * width;
        bytes
            .chunks_exact(4)
            .take(count)
            .map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])))
            .collect()
    }

    fn take(&self, name: &str) -> &Value {
        let takes = self.json["animations"].as_array().expect("animations");
        takes
            .iter()
            .find(|take| take["name"] == name)
            .expect("the take")
    }

    /// First and last key of a take.
    fn span(&self, take: &Value) -> (f64, f64) {
        let samplers = take["samplers"].as_array().expect("samplers");
        let times: Vec<f64> = samplers
            .iter()
            .flat_map(|s| self.floats(&s["input"]))
            .collect();
        (
            times.iter().copied().fold(f64::MAX, f64::min),
            times.iter().copied().fold(f64::MIN, f64::max),
        )
    }

    /// World matrices of all nodes at `time` of `take`.
    fn world(&self, take: &Value, time: f64) -> Vec<Matrix> {
        let nodes = self.json["nodes"].as_array().expect("nodes");
        let mut parts: Vec<[Option<Vec<f64>>; 3]> = nodes
            .iter()
            .map(|node| ["translation", "rotation", "scale"].map(|key| list(&node[key])))
            .collect();
        for channel in take["channels"].as_array().expect("channels") {
            let path = match channel["target"]["path"].as_str() {
                Some("translation") => 0,
                Some("rotation") => 1,
                Some("scale") => 2,
                _ => continue,
            };
            let sampler = &take["samplers"][index(&channel["sampler"])];
            parts[index(&channel["target"]["node"])][path] =
                Some(self.value(sampler, path == 1, time));
        }
        let local: Vec<Matrix> = nodes
            .iter()
            .zip(&parts)
            .map(|(node, parts)| local(list(&node["matrix"]), parts))
            .collect();
        let parent = self.parents();
        let climb = |node: usize| {
            let mut world = local[node];
            let mut above = parent[node];
            while let Some(at) = above {
                world = multiply(&local[at], &world);
                above = parent[at];
            }
            world
        };
        (0..nodes.len()).map(climb).collect()
    }

    fn parents(&self) -> Vec<Option<usize>> {
        let nodes = self.json["nodes"].as_array().expect("nodes");
        let mut parent = vec![None; nodes.len()];
        for (at, node) in nodes.iter().enumerate() {
            for child in node["children"].as_array().into_iter().flatten() {
                parent[index(child)] = Some(at);
            }
        }
        parent
    }

    /// Names of every node and those above it.
    fn paths(&self) -> Vec<String> {
        let parents = self.parents();
        let name = |node: usize| self.json["nodes"][node]["name"].as_str().expect("a name");
        let path = |mut node: usize| {
            let mut path = format!("/{}", name(node));
            while let Some(parent) = parents[node] {
                node = parent;
                path = format!("/{}{path}", name(node));
            }
            path
        };
        (0..parents.len()).map(path).collect()
    }

    fn value(&self, sampler: &Value, turns: bool, time: f64) -> Vec<f64> {
        let (times, values) = (
            self.floats(&sampler["input"]),
            self.floats(&sampler["output"]),
        );
        let kind = sampler["interpolation"].as_str().unwrap_or("LINEAR");
        let blocks = if kind == "CUBICSPLINE" { 3 } else { 1 };
        let width = values.len() / times.len() / blocks;
        let block = |key: usize, block: usize| &values[(key * blocks + block) * width..][..width];
        let key_value = |key: usize| block(key, blocks / 2).to_vec();
        let last = times.len() - 1;
        if time <= times[0] || time >= times[last] {
            return key_value(if time <= times[0] { 0 } else { last });
        }
        let b = times
            .iter()
            .position(|&key| key > time)
            .expect("a later key");
        let (a, gap) = (b - 1, times[b] - times[b - 1]);
        let t = (time - times[a]) / gap;
        match kind {
            // Frames fall on keys only up to the 32 bits that key times are rounded to.
            "STEP" => key_value(if times[b] - time < 1e-6 { b } else { a }),
            "LINEAR" if turns => slerp(&key_value(a), &key_value(b), t),
            "LINEAR" => mix(&[(1. - t, &key_value(a)), (t, &key_value(b))]),
            _ => mix(&[
                (2. * t.powi(3) - 3. * t.powi(2) + 1., block(a, 1)),
                (gap * (t.powi(3) - 2. * t.powi(2) + t), block(a, 2)),
                (-2. * t.powi(3) + 3. * t.powi(2), block(b, 1)),
                (gap * (t.powi(3) - t.powi(2)), block(b, 0)),
            ]),
        }
    }
}

fn index(value: &Value) -> usize {
    usize::try_from(value.as_u64().expect("an index")).expect("an index")
}

fn number(value: &Value) -> usize {
    value
        .as_u64()
        .map_or(0, |n| usize::try_from(n).expect("a size"))
}

fn list(value: &Value) -> Option<Vec<f64>> {
    value.as_array().map(|items| {
        items
            .iter()
            .map(|x| x.as_f64().expect("a number"))
            .collect()
    })
}

fn mix(terms: &[(f64, &[f64])]) -> Vec<f64> {
    (0..terms[0].1.len())
        .map(|k| terms.iter().map(|(weight, v)| weight * v[k]).sum())
        .collect()
}

fn slerp(a: &[f64], b: &[f64], t: f64) -> Vec<f64> {
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let b: Vec<f64> = b.iter().map(|x| x * dot.signum()).collect();
    let angle = dot.abs().min(1.0).acos();
    if angle < 1e-7 {
        return a.to_vec();
    }
    mix(&[
        (((1. - t) * angle).sin() / angle.sin(), a),
        ((t * angle).sin() / angle.sin(), &b),
    ])
}

/// Matrix of a node, from its own sixteen numbers (by columns) or its three parts.
fn local(
    matrix: Option<Vec<f64>>,
    [translation, rotation, scale]: &[Option<Vec<f64>>; 3],
) -> Matrix {
    if let Some(m) = matrix {
        return std::array::from_fn(|r| std::array::from_fn(|c| m[4 * c + r]));
    }
    let mut local = IDENTITY;
    if let Some(q) = rotation {
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        let [x, y, z, w] = [0, 1, 2, 3].map(|k| q[k] / norm);
        local[0][..3].copy_from_slice(&[
            1. - 2. * (y * y + z * z),
            2. * (x * y - w * z),
            2. * (x * z + w * y),
        ]);
        local[1][..3].copy_from_slice(&[
            2. * (x * y + w * z),
            1. - 2. * (x * x + z * z),
            2. * (y * z - w * x),
        ]);
        local[2][..3].copy_from_slice(&[
            2. * (x * z - w * y),
            2. * (y * z + w * x),
            1. - 2. * (x * x + y * y),
        ]);
    }
    for row in 0..3 {
        for column in 0..3 {
            local[row][column] *= scale.as_ref().map_or(1.0, |s| s[column]);
        }
        local[row][3] = translation.as_ref().map_or(0.0, |t| t[row]);
    }
    local
}

fn load(path: &Path, take: &str) -> Clip {
    let options = Options {
        take: Some(take.to_owned()),
        ..Options::default()
    };
    import::load(path, &options).expect("it imports")
}

/// Farthest that a joint is from its place by `reference`, metres.
///
/// The clip must be one that wasn't turned: X, Y, Z are the file's z, x, y.
fn farthest(clip: &Clip, reference: &Reference, take: &str) -> f64 {
    let about = reference.take(take);
    let (start, end) = reference.span(about);
    // Names may repeat (a mesh called like its bone), paths from the root don't.
    let node_paths = reference.paths();
    let mut paths: Vec<String> = Vec::new();
    for joint in &clip.joints {
        let above = joint.parent.map_or("", |parent| &paths[parent]);
        paths.push(format!("{above}/{}", joint.name));
    }
    let node_of: Vec<usize> = paths
        .iter()
        .map(|path| {
            node_paths
                .iter()
                .position(|node| node == path)
                .expect("the joint's node")
        })
        .collect();
    let last = (clip.frames.len() - 1).max(1) as f64;
    let mut farthest: f64 = 0.0;
    for f in 0..clip.frames.len() {
        let expected = reference.world(about, start + (end - start) * f as f64 / last);
        for (at, &node) in clip.world(f).iter().zip(&node_of) {
            let [x, y, z] = [0, 1, 2].map(|row| expected[node][row][3]);
            farthest = farthest.max((at.translation.vector - Vector3::new(z, x, y)).norm());
        }
    }
    farthest
}

#[test]
fn xbot_walks_as_its_file_says() {
    let Some(path) = data("mixamo/Xbot.glb") else {
        return;
    };
    let clip = load(&path, "Walk");
    assert_eq!((clip.fps, clip.source.take.as_str()), (30.0, "walk"));
    assert!(clip.joints.len() >= 67);
    assert_eq!(clip.loop_mode, LoopMode::Wrap);
    let off = farthest(&clip, &Reference::open(&path), "walk");
    assert!(off < 1e-4, "{off} m");
}

#[test]
fn real_rigs_are_in_their_places() {
    let files = [
        ("mixamo/Xbot.glb", "run"),
        ("mixamo/animations-mixamo-default.glb", "Walking"),
        (
            "kaykit/Med_CombatMelee.glb",
            "Rig_Medium|Melee_1H_Attack_Chop",
        ),
        (
            "quaternius/cyberpunk_Character.glb",
            "CharacterArmature|Kick_Left",
        ),
        ("quaternius/RobotExpressive.glb", "Punch"),
        ("ue-mannequin-like/mannequiny.glb", "fight_kick_root.001"),
        ("rigify/human-addon-animations.glb", "YMCA"),
        ("raylib/greenman.glb", "3_attack"),
        ("bitmoji/bitmoji_jump-flip.glb", "Take 001"),
        ("khronos/Fox.glb", "Run"),
        ("kenney/kenney_character.glb", "walk"),
    ];
    for (name, take) in files {
        let Some(path) = data(name) else {
            return;
        };
        let clip = load(&path, take);
        let turned = clip
            .problems
            .iter()
            .find(|problem| problem.id == "turned-to-forward");
        assert_eq!(turned, None, "{name}");
        let off = farthest(&clip, &Reference::open(&path), take);
        let size = clip
            .rest_world()
            .iter()
            .map(|at| at.translation.vector.norm())
            .fold(1.0, f64::max);
        assert!(off < 1e-4 * size, "{name}: {off} m");
    }
}

#[test]
fn every_interpolation_of_every_property_is_exact() {
    let Some(path) = data("khronos/interpolation_test.gltf") else {
        return;
    };
    let reference = Reference::open(&path);
    for kind in ["Step", "Linear", "CubicSpline"] {
        for property in ["Scale", "Rotation", "Translation"] {
            let take = format!("{kind} {property}");
            let clip = load(&path, &take);
            let off = farthest(&clip, &reference, &take);
            assert!(off < 1e-4, "{take}: {off} m");
        }
    }
}

#[test]
fn rotations_are_the_files_own() {
    let Some(path) = data("torture-gltf/01_cs_rotate.gltf") else {
        return;
    };
    let reference = Reference::open(&path);
    let clip = load(&path, "CubeAction");
    let (start, end) = reference.span(reference.take("CubeAction"));
    let joint = clip
        .joints
        .iter()
        .position(|joint| joint.name == "Cube")
        .expect("the cube");
    let nodes = reference.json["nodes"].as_array().expect("nodes");
    let node = nodes
        .iter()
        .position(|node| node["name"] == "Cube")
        .expect("the cube");
    for f in 0..clip.frames.len() {
        let time = start + (end - start) * f as f64 / (clip.frames.len() - 1) as f64;
        let matrix = reference.world(reference.take("CubeAction"), time)[node];
        let turn = clip.world(f)[joint].rotation.to_rotation_matrix();
        // Axes X, Y, Z are the file's z, x, y, for rows and columns alike.
        for (row, from_row) in [2, 0, 1].into_iter().enumerate() {
            let length = (0..3).map(|r| matrix[r][0].powi(2)).sum::<f64>().sqrt();
            for (column, from_column) in [2, 0, 1].into_iter().enumerate() {
                let off = turn[(row, column)] - matrix[from_row][from_column] / length;
                assert!(off.abs() < 1e-6, "frame {f}: {off}");
            }
        }
    }
}

#[test]
fn odd_files_are_read_or_refused_with_a_reason() {
    let folder = [
        "torture-gltf",
        "khronos",
        "vrm",
        "kaykit",
        "quaternius",
        "mixamo",
        "nonhumanoid",
    ];
    let mut read = 0;
    for folder in folder {
        let Some(folder) = data(folder) else {
            return;
        };
        for entry in std::fs::read_dir(folder).expect("the folder opens") {
            let path = entry.expect("an entry").path();
            let name = path
                .file_name()
                .expect("a name")
                .to_string_lossy()
                .into_owned();
            if ![".gltf", ".glb", ".vrm", ".vrma"]
                .iter()
                .any(|end| name.ends_with(end))
            {
                continue;
            }
            match import::load(&path, &Options::default()) {
                Ok(clip) => {
                    read += 1;
                    let joints = clip.joints.len();
                    assert!(
                        joints > 0 && clip.frames.iter().all(|frame| frame.len() == joints),
                        "{name}"
                    );
                }
                Err(error) => {
                    let error = error.to_string();
                    let told = ["holds no animation", "holds no joints"]
                        .iter()
                        .any(|told| error.contains(told));
                    assert!(told && error.starts_with(&name), "{error}");
                }
            }
        }
    }
    assert!(read > 20, "{read}");
}

#[test]
fn a_take_is_found_by_name_or_number_and_unknown_ones_list_the_others() {
    let Some(path) = data("mixamo/Xbot.glb") else {
        return;
    };
    let look = import::inspect(&path).expect("it opens");
    let names: Vec<&str> = look.takes.iter().map(|take| take.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "agree",
            "headShake",
            "idle",
            "run",
            "sad_pose",
            "sneak_pose",
            "walk"
        ]
    );
    assert_eq!(load(&path, "7").source.take, "walk");
    assert_eq!(load(&path, "HEADSHAKE").source.take, "headShake");
    let options = Options {
        take: Some("jump".to_owned()),
        ..Options::default()
    };
    let error = import::load(&path, &options)
        .expect_err("no such take")
        .to_string();
    assert!(
        error.contains("Xbot.glb") && error.contains("`jump`") && error.contains("7 `walk`"),
        "{error}"
    );
}

/// A two-joint file, in text, whose take is as `change` leaves it.
fn synthetic(change: impl Fn(&mut Value)) -> String {
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

fn base64(bytes: &[u8]) -> String {
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
    let cases: [(&dyn Fn(&mut Value), &str); 16] = [
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
            error.starts_with("a.gltf") && error.contains(reason),
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
}
