//! What the importer keeps of a glTF file, and which notes it makes about the rest.

use super::gltf_made::{base64, synthetic};
use mimic::clip::Clip;
use mimic::import::{self, Inspection, Options};
use serde_json::{Value, json};

fn read(text: &str, take: Option<&str>) -> Result<Clip, import::Error> {
    let options = Options {
        take: take.map(str::to_owned),
        ..Options::default()
    };
    import::read(text.as_bytes(), "a.gltf", None, &options)
}

fn inspect(text: &str) -> Inspection {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, text).expect("it is written");
    import::inspect(path).expect("it opens")
}

fn list<'a>(file: &'a mut Value, key: &str) -> &'a mut Vec<Value> {
    file[key].as_array_mut().expect("a list")
}

/// Adds an accessor with these numbers, and returns its index.
fn numbers(file: &mut Value, kind: &str, width: usize, numbers: &[f32]) -> usize {
    let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    let uri = format!("data:;base64,{}", base64(&bytes));
    let buffer = list(file, "buffers").len();
    list(file, "buffers").push(json!({ "byteLength": bytes.len(), "uri": uri }));
    let view = list(file, "bufferViews").len();
    list(file, "bufferViews").push(json!({ "buffer": buffer, "byteLength": bytes.len() }));
    list(file, "accessors").push(json!({
        "bufferView": view, "componentType": 5126, "count": numbers.len() / width, "type": kind
    }));
    list(file, "accessors").len() - 1
}

/// Puts keys into the only curve of [`synthetic`], of a hip's `path`.
fn keyed(file: &mut Value, path: &str, way: &str, times: &[f32], values: &[f32]) {
    let input = numbers(file, "SCALAR", 1, times);
    let (kind, width) = if path == "rotation" {
        ("VEC4", 4)
    } else {
        ("VEC3", 3)
    };
    let output = numbers(file, kind, width, values);
    let take = &mut file["animations"][0];
    take["samplers"][0] = json!({ "input": input, "output": output, "interpolation": way });
    take["channels"][0]["target"]["path"] = json!(path);
}

fn told<'a>(clip: &'a Clip, id: &str) -> Option<&'a str> {
    let problem = clip.problems.iter().find(|problem| problem.id == id);
    problem.map(|problem| problem.message.as_str())
}

#[test]
fn what_a_take_moves_is_a_joint_beside_the_bones() {
    let text = synthetic(|f| {
        f["skins"][0]["joints"] = json!([0]);
        f["nodes"][0]["children"] = json!([1, 2, 4]);
        f["nodes"][1]["children"] = json!([3]);
        list(f, "nodes").push(json!({ "name": "shell", "mesh": 0 }));
        list(f, "nodes").push(json!({ "name": "toe", "translation": [0.0, 1.0, 0.0] }));
        list(f, "nodes").push(json!({ "name": "visor", "mesh": 0 }));
        f["animations"][0]["channels"] = json!([
            { "sampler": 0, "target": { "node": 1, "path": "rotation" } },
            { "sampler": 0, "target": { "node": 2, "path": "rotation" } }
        ]);
    });
    let clip = read(&text, None).expect("it imports");
    let names: Vec<&str> = clip
        .joints
        .iter()
        .map(|joint| joint.name.as_str())
        .collect();
    assert_eq!(names, ["hip", "knee", "toe"]);
    let left = told(&clip, "moving-nodes-left-out").expect("a note");
    assert!(
        left.contains("`shell`") && !left.contains("visor"),
        "{left}"
    );
}

#[test]
fn a_broken_take_leaves_the_others() {
    let text = synthetic(|f| {
        let mut broken = f["animations"][0].clone();
        broken["name"] = json!("broken");
        broken["samplers"][0]["input"] = json!(9);
        list(f, "animations").insert(0, broken);
    });
    assert_eq!(read(&text, None).expect("it imports").source.take, "turn");
    let error = read(&text, Some("broken"))
        .expect_err("refused")
        .to_string();
    assert!(
        error.starts_with("`a.gltf`: take `broken`, accessor 9: ") && error.contains("; export"),
        "{error}"
    );
    let look = inspect(&text);
    assert_eq!((look.takes.len(), look.default_take), (2, Some(1)));
    let problem = look
        .problems
        .iter()
        .find(|problem| problem.id == "broken-take");
    assert!(problem.is_some_and(|problem| problem.message.contains("accessor 9")));
}

#[test]
fn a_clip_has_the_problems_of_its_own_take() {
    let text = synthetic(|f| {
        let none = numbers(f, "SCALAR", 1, &[]);
        let mut other = f["animations"][0].clone();
        other["name"] = json!("other");
        list(&mut other, "samplers").push(json!({ "input": none, "output": 1 }));
        let empty = json!({ "sampler": 1, "target": { "node": 1, "path": "rotation" } });
        list(&mut other, "channels").push(empty);
        list(f, "animations").push(other);
    });
    let clip = |take| read(&text, Some(take)).expect("it imports");
    assert_eq!(told(&clip("turn"), "curve-without-keys"), None);
    let told = told(&clip("other"), "curve-without-keys").map(str::to_owned);
    assert!(told.is_some_and(|told| told.contains("`other`")));
}

#[test]
fn faults_in_extensions_do_not_block_the_motion() {
    let plain = read(&synthetic(|_| {}), None).expect("it imports");
    let bone = |node: i64| json!({ "VRM": { "humanoid": { "humanBones": [{ "node": node }] } } });
    let cases = [
        (json!({ "VRM": { "humanoid": null } }), true),
        (json!({ "VRMC_vrm": 7 }), true),
        (json!(null), true),
        (bone(-1), false),
        (bone(99), false),
    ];
    for (extensions, noted) in cases {
        let text = synthetic(|f| f["extensions"] = extensions.clone());
        let clip = read(&text, None).unwrap_or_else(|e| panic!("{extensions}: {e}"));
        assert_eq!(clip.frames, plain.frames);
        let note = told(&clip, "extension-unreadable");
        assert_eq!(note.is_some(), noted, "{extensions}");
    }
    let pointer = synthetic(|f| {
        let channel = json!({ "sampler": 0, "target": {
            "path": "pointer",
            "extensions": { "KHR_animation_pointer": { "pointer": "/nodes/1/rotation" } }
        } });
        list(&mut f["animations"][0], "channels").push(channel);
    });
    let clip = read(&pointer, None).expect("it imports");
    let note = told(&clip, "pointer-curves-left-out").expect("a note");
    assert!(note.contains("`turn` has 1 "), "{note}");
}

#[test]
fn equal_cycles_are_motion() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // Eight swings in a second, and a single one in half of it.
    let swings = |count: u16| -> (Vec<f32>, Vec<f32>) {
        let times = (0..=2 * count).map(|key| f32::from(key) / 16.0).collect();
        let turn = |key: u16| {
            [
                0.0,
                0.0,
                f32::from(key % 2) * half,
                1.0 - f32::from(key % 2) * (1.0 - half),
            ]
        };
        (times, (0..=2 * count).flat_map(turn).collect())
    };
    let text = synthetic(|f| {
        let (times, turns) = swings(4);
        keyed(f, "rotation", "LINEAR", &times, &turns);
        let mut many = f["animations"][0].clone();
        let (times, turns) = swings(8);
        keyed(f, "rotation", "LINEAR", &times, &turns);
        std::mem::swap(&mut f["animations"][0], &mut many);
        many["name"] = json!("many");
        list(f, "animations").push(many);
    });
    assert_eq!(read(&text, None).expect("it imports").source.take, "many");
}

#[test]
fn every_interpolation_follows_its_formula() {
    // The file's z is X.
    let hip = |way: &str, times: &[f32], values: &[f32]| -> Vec<f64> {
        let text = synthetic(|f| keyed(f, "translation", way, times, values));
        let clip = read(&text, None).expect("it imports");
        (0..clip.frames.len())
            .map(|f| clip.world(f)[0].translation.x)
            .collect()
    };
    let steps = hip(
        "STEP",
        &[0.0, 0.5, 1.0],
        &[0., 0., 1., 0., 0., 2., 0., 0., 3.],
    );
    assert_eq!(steps.len(), 31);
    for (frame, x) in steps.iter().enumerate() {
        let expected = if frame < 15 {
            1.0
        } else if frame < 30 {
            2.0
        } else {
            3.0
        };
        assert_eq!(*x, expected, "frame {frame}");
    }
    // From 0 to 1 in two seconds, leaving with 3 and arriving with −1 per second: p(s) for s = t/2 is
    // 2·3·(s³ − 2s² + s) + (3s² − 2s³) − 2·(s³ − s²) = 2s³ − 7s² + 6s.
    let keys = [
        0., 0., 9., 0., 0., 0., 0., 0., 3., 0., 0., -1., 0., 0., 1., 0., 0., 9.,
    ];
    let spline = hip("CUBICSPLINE", &[0.0, 2.0], &keys);
    assert_eq!(spline.len(), 61);
    for (frame, x) in spline.iter().enumerate() {
        let s = frame as f64 / 60.0;
        let expected = 2.0 * s.powi(3) - 7.0 * s.powi(2) + 6.0 * s;
        assert!(
            (x - expected).abs() < 1e-6,
            "frame {frame}: {x}, not {expected}"
        );
    }
}

#[test]
fn spline_rotations_are_normalised() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let rest = [0.0; 4];
    let keys = [
        rest,
        [0., 0., 0., 1.],
        rest,
        rest,
        [0., 0., half, half],
        rest,
    ];
    let text = synthetic(|f| keyed(f, "rotation", "CUBICSPLINE", &[0.0, 1.0], &keys.concat()));
    let clip = read(&text, None).expect("it imports");
    // Half way between two quaternions lies half the angle, at any length.
    let turn = clip.world(15)[0].rotation;
    assert!((turn.angle() - std::f64::consts::FRAC_PI_4).abs() < 1e-6);
    assert!((turn.norm() - 1.0).abs() < 1e-6);
}

#[test]
fn a_matrix_places_a_node_shear_and_all() {
    // By columns: a quarter about z, one up; and y leaning to x, one up.
    let turned = [
        0., 1., 0., 0., -1., 0., 0., 0., 0., 0., 1., 0., 0., 1., 0., 1.,
    ];
    let sheared = [
        1., 0., 0., 0., 0.5, 1., 0., 0., 0., 0., 1., 0., 0., 1., 0., 1.,
    ];
    // X, Y, Z are the file's z, x, y; the toe is one along the knee's y.
    for (matrix, toe) in [(turned, [0.0, -1.0, 1.0]), (sheared, [0.0, 0.5, 2.0])] {
        let text = synthetic(|f| {
            f["nodes"][1] = json!({ "name": "knee", "matrix": matrix, "children": [2] });
            list(f, "nodes").push(json!({ "name": "toe", "translation": [0.0, 1.0, 0.0] }));
            f["skins"][0]["joints"] = json!([0, 1, 2]);
        });
        let clip = read(&text, None).expect("it imports");
        for world in [clip.rest_world(), clip.world(0)] {
            let found = world[2].translation.vector;
            assert!(
                (found - nalgebra::Vector3::from(toe)).norm() < 1e-6,
                "{found}"
            );
        }
    }
}

#[test]
fn times_that_no_clip_can_hold_are_counted_and_refused() {
    let text = synthetic(|f| {
        let far = numbers(f, "SCALAR", 1, &[0.0, 1e30]);
        f["animations"][0]["samplers"][0]["input"] = json!(far);
    });
    let take = inspect(&text).takes.remove(0);
    assert_eq!(take.frames, usize::MAX);
    assert!(
        read(&text, None)
            .expect_err("refused")
            .to_string()
            .contains("keep a part")
    );
}

#[test]
fn the_shortest_part_can_be_saved() {
    let options = Options {
        trim: Some((0.5, 0.500_01)),
        ..Options::default()
    };
    let text = synthetic(|_| {});
    let clip = import::read(text.as_bytes(), "a.gltf", None, &options).expect("it imports");
    assert_eq!((clip.frames.len(), clip.fps), (1, 30.0));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.clip");
    clip.save(&path).expect("it is written");
    assert_eq!(Clip::load(&path).expect("it is read"), clip);
}

#[test]
fn buffers_beside_the_file_allow_as_much_as_those_in_it() {
    // 3,500 s at 172 Hz of two joints are more than any file may ask for: a megabyte allows it.
    let text = synthetic(|f| {
        f["buffers"] = json!([{ "byteLength": 2_000_000, "uri": "a.bin" }]);
    });
    let mut bytes: Vec<u8> = [0.0_f32, 3_500.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, text).expect("it is written");
    let load = |bytes: &[u8]| {
        std::fs::write(folder.path().join("a.bin"), bytes).expect("it is written");
        let options = Options {
            fps: Some(172.0),
            ..Options::default()
        };
        import::load(&path, &options)
    };
    assert!(load(&bytes).is_err());
    bytes.resize(2_000_000, 0);
    assert_eq!(load(&bytes).expect("it imports").frames.len(), 602_001);
}

#[test]
fn long_lists_of_takes_are_cut() {
    let text = synthetic(|f| {
        let takes = vec![f["animations"][0].clone(); 20];
        f["animations"] = json!(takes);
    });
    let note = told(&read(&text, None).expect("it imports"), "several-takes").map(str::to_owned);
    assert!(note.is_some_and(|note| note.contains("8 `turn`, … and 12 more")));
    let error = read(&text, Some("none")).expect_err("refused").to_string();
    assert!(error.contains("and 12 more"), "{error}");
}
