//! glTF files with sound motion and faults elsewhere, and GLB containers with wrong lengths.

use super::gltf_made::{base64, synthetic};
use mimic::clip::Clip;
use mimic::import::{self, Options};
use mimic_test_support::foreign;
use serde_json::{Value, json};

fn read(bytes: &[u8]) -> Result<Clip, import::Error> {
    import::read(bytes, "a", None, &Options::default())
}

fn refusal(bytes: &[u8]) -> String {
    read(bytes).expect_err("refused").to_string()
}

/// A GLB with these chunks and the length that its header should have.
fn glb(chunks: &[(&[u8], &[u8])]) -> Vec<u8> {
    let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, chunk) in chunks {
        bytes.extend(u32::to_le_bytes(chunk.len() as u32));
        bytes.extend(*kind);
        bytes.extend(*chunk);
    }
    let length = u32::to_le_bytes(bytes.len() as u32);
    bytes[8..12].copy_from_slice(&length);
    bytes
}

#[test]
fn what_does_not_move_a_joint_does_not_block_the_motion() {
    let plain = read(synthetic(|_| {}).as_bytes()).expect("it imports");
    let oddities: [&dyn Fn(&mut Value); 7] = [
        &|f| f["materials"] = json!([{ "pbrMetallicRoughness": "shiny" }]),
        &|f| f["meshes"] = json!({ "primitives": -1 }),
        &|f| f["textures"] = json!("none"),
        &|f| f["cameras"] = json!([null]),
        // `extras` may be of any type.
        &|f| f["nodes"][0]["extras"] = json!("a note"),
        &|f| f["skins"][0]["extras"] = json!([1, { "extras": null }]),
        &|f| {
            let channels = &mut f["animations"][0]["channels"];
            let pointer = json!({ "sampler": 0, "target": { "path": "pointer" } });
            channels.as_array_mut().expect("channels").push(pointer);
        },
    ];
    for (number, oddity) in oddities.into_iter().enumerate() {
        let clip = read(synthetic(oddity).as_bytes());
        let clip = clip.unwrap_or_else(|e| panic!("oddity {number}: {e}"));
        assert_eq!(
            (clip.joints, clip.frames),
            (plain.joints.clone(), plain.frames.clone())
        );
    }
}

#[test]
fn an_unknown_interpolation_is_refused_in_its_place() {
    let text = synthetic(|f| f["animations"][0]["samplers"][0]["interpolation"] = json!("WARP"));
    let error = refusal(text.as_bytes());
    assert!(
        error.contains("`turn`") && error.contains("unknown interpolation"),
        "{error}"
    );
}

#[test]
fn containers_are_taken_apart_or_refused() {
    let text = synthetic(|f| {
        let _ = f["buffers"][0]
            .as_object_mut()
            .expect("a buffer")
            .remove("uri");
    });
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let floats = [0.0_f32, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half];
    let bin: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    let whole = glb(&[
        (b"JSON", text.as_bytes()),
        (b"BIN\0", &bin),
        (b"MORE", b"more"),
    ]);
    let plain = read(synthetic(|_| {}).as_bytes()).expect("it imports");
    assert_eq!(read(&whole).expect("it imports").frames, plain.frames);

    let header = |at: usize, word: u32| {
        let mut bytes = whole.clone();
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        refusal(&bytes)
    };
    assert!(header(4, 1).contains("version 1"));
    for short in [0, 11] {
        assert!(header(8, short).contains("cut off"));
    }
    assert!(header(8, u32::MAX).contains("are left"));
    assert!(header(12, u32::MAX).contains("are left"));
    assert!(refusal(&whole[..10]).contains("cut off"));
    assert!(refusal(&glb(&[(b"BIN\0", &bin)])).contains("broken GLB"));
    assert!(refusal(&glb(&[(b"JSON", text.as_bytes())])).contains("no bytes"));
}

#[test]
fn a_few_bytes_cannot_ask_for_millions_of_transforms() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let floats = [0.0_f32, 40_000.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half];
    let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    let uri = format!("data:;base64,{}", base64(&bytes));
    let text = synthetic(|f| f["buffers"][0]["uri"] = json!(uri));
    let error = refusal(text.as_bytes());
    assert!(
        error.contains("`turn`") && error.contains("keep a part"),
        "{error}"
    );
}

/// 2³² isn't the first entry of a list.
#[test]
fn indices_beyond_any_list_are_refused() {
    let places = [
        ("node", "/animations/0/channels/0/target/node"),
        ("sampler", "/animations/0/channels/0/sampler"),
        ("input", "/animations/0/samplers/0/input"),
        ("bufferView", "/accessors/0/bufferView"),
    ];
    for (key, place) in places {
        let text = synthetic(|f| {
            *f.pointer_mut(place).expect("it is there") = json!(1_u64 << 32);
        });
        let error = read(text.as_bytes()).expect_err(key).to_string();
        assert!(error.contains(&format!("`{key}` is 4294967296")), "{error}");
    }
    let text = synthetic(|f| f["nodes"][0]["children"] = json!([1_u64 << 32]));
    let error = read(text.as_bytes()).expect_err("refused").to_string();
    assert!(error.contains("`children` is 4294967296"), "{error}");
    let Some(path) = foreign("../cases/solid/gltf-index-2pow32-wraps-to-0.gltf") else {
        return;
    };
    let error = import::load(path, &Options::default()).expect_err("refused");
    assert!(
        error.to_string().contains("`node` is 4294967296"),
        "{error}"
    );
}
