//! Broken, truncated and hostile bytes give an error or a scene, but never a panic, a hang or an endless allocation.

use super::{FbxError, read, synthetic};
use crate::import::scene::Scene;
use fbxcel::low::FbxVersion;
use fbxcel::low::v7400::ArrayAttributeEncoding;
use fbxcel::writer::v7400::binary::Writer;
use mimic_test_support::foreign;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::io::Cursor;
use std::time::{Duration, Instant};

/// Reads bytes and, if that works, samples the scene. Fails the test if it takes long.
fn survives(bytes: &[u8]) {
    let start = Instant::now();
    if let Ok(scene) = read(bytes) {
        scene.world(None);
        for (index, take) in scene.takes().iter().enumerate() {
            assert!(
                take.start.is_finite()
                    && take.end >= take.start
                    && (1.0..=1000.0).contains(&take.fps)
            );
            scene.world(Some((index, take.start)));
            scene.world(Some((index, take.end)));
        }
    }
    assert!(
        start.elapsed() < Duration::from_secs(5),
        "it took {:?}",
        start.elapsed()
    );
}

fn mutate(bytes: &mut [u8], random: &mut ChaCha8Rng) {
    for _ in 0..1 + random.next_u32() % 8 {
        let at = random.next_u32() as usize % bytes.len();
        match random.next_u32() % 4 {
            0 => bytes[at] ^= 1 << (random.next_u32() % 8),
            1 => bytes[at] = random.next_u32() as u8,
            2 => bytes[at..].iter_mut().take(4).for_each(|byte| *byte = 0xff),
            _ => bytes[at..].iter_mut().take(8).for_each(|byte| *byte = 0),
        }
    }
}

#[test]
fn mutations_of_synthetic_scenes_survive() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let scenes: Vec<_> = (0..8).map(synthetic::scene).collect();
    for round in 0..4000 {
        let mut bytes = scenes[round % 8].clone();
        mutate(&mut bytes, &mut random);
        survives(&bytes);
    }
}

#[test]
fn mutations_of_a_real_file_survive() {
    let Some(path) = foreign("torture-fbx/maya_anim_layers_7500_binary.fbx") else {
        return;
    };
    let original = std::fs::read(path).expect("the file can be read");
    let mut random = ChaCha8Rng::seed_from_u64(8);
    for _ in 0..2000 {
        let mut bytes = original.clone();
        mutate(&mut bytes, &mut random);
        survives(&bytes);
    }
}

#[test]
fn truncation_is_an_error() {
    // The last record's end marker is followed by a footer that isn't read.
    let bytes = synthetic::scene(1);
    let footer = 16 + 16 + 4 + 4 + 120 + 16;
    for len in (0..bytes.len() - footer).step_by(5) {
        assert!(
            read(&bytes[..len]).is_err(),
            "the first {len} bytes of {} were read",
            bytes.len()
        );
    }
}

#[test]
fn other_formats_are_named() {
    assert!(matches!(read(b""), Err(FbxError::NotFbx)));
    assert!(matches!(read(b"glTF\x02\0\0\0"), Err(FbxError::NotFbx)));
    assert!(matches!(
        read(b"; FBX 7.5.0 project file\n"),
        Err(FbxError::Ascii)
    ));
    let header = |order: u8, version: u32| {
        [
            b"Kaydara FBX Binary  \0\x1a".as_slice(),
            &[order],
            &version.to_le_bytes(),
        ]
        .concat()
    };
    assert!(matches!(
        read(&header(0, 6100)),
        Err(FbxError::Version { found: 6100 })
    ));
    assert!(matches!(read(&header(1, 7400)), Err(FbxError::BigEndian)));
}

/// A file with one curve whose arrays `write` writes, connected to a node.
fn file(write: impl FnOnce(&mut Writer<Cursor<Vec<u8>>>)) -> Vec<u8> {
    let mut writer =
        Writer::new(Cursor::new(Vec::new()), FbxVersion::V7_4).expect("a known version");
    let w = &mut writer;
    w.new_node("Objects").expect("memory");
    for (id, class) in [
        (1, "Model"),
        (2, "AnimationStack"),
        (3, "AnimationLayer"),
        (4, "AnimationCurveNode"),
    ] {
        w.new_node(class)
            .expect("memory")
            .append_i64(id)
            .expect("memory");
        w.close_node().expect("open");
    }
    w.new_node("AnimationCurve")
        .expect("memory")
        .append_i64(5)
        .expect("memory");
    write(w);
    w.close_node().expect("open");
    w.close_node().expect("open");
    w.new_node("Connections").expect("memory");
    for (child, parent, property) in [
        (3, 2, ""),
        (4, 3, ""),
        (4, 1, "Lcl Translation"),
        (5, 4, "d|X"),
        (1, 1, ""),
        (2, 2, ""),
        (4, 4, ""),
    ] {
        let mut link = w.new_node("C").expect("memory");
        link.append_string_direct(if property.is_empty() { "OO" } else { "OP" })
            .expect("memory");
        link.append_i64(child).expect("memory");
        link.append_i64(parent).expect("memory");
        link.append_string_direct(property).expect("memory");
        w.close_node().expect("open");
    }
    w.close_node().expect("open");
    writer
        .finalize(&Default::default())
        .expect("memory")
        .into_inner()
}

fn curve(count: usize) -> Vec<u8> {
    file(|w| {
        let zlib = Some(ArrayAttributeEncoding::Zlib);
        let mut times = w.new_node("KeyTime").expect("memory");
        times
            .append_arr_i64_from_iter(zlib, (0..count as i64).map(|_| 0))
            .expect("memory");
        w.close_node().expect("open");
        let mut values = w.new_node("KeyValueFloat").expect("memory");
        values
            .append_arr_f32_from_iter(zlib, (0..count).map(|_| 0.0))
            .expect("memory");
        w.close_node().expect("open");
    })
}

/// Whether the only take can't be used.
fn is_refused(bytes: &[u8]) -> bool {
    let scene = read(bytes).expect("a broken take doesn't block the others");
    scene.takes()[0].fault.is_some()
}

#[test]
fn circles_are_cut() {
    let scene = read(&curve(3)).expect("a circle isn't fatal");
    assert_eq!(scene.nodes().len(), 1);
    assert!(
        scene
            .contents()
            .problems
            .iter()
            .any(|problem| problem.id == "circular-nodes")
    );
}

#[test]
fn a_small_file_can_not_fill_the_memory() {
    // 12 million keys take 144 MB and compress to about 150 kB.
    let bytes = curve(12_000_000);
    assert!(bytes.len() < 400_000);
    assert!(is_refused(&bytes));
}

#[test]
fn arrays_must_hold_what_they_claim() {
    let honest = curve(1000);
    assert!(!is_refused(&honest));
    let at = honest
        .windows(7)
        .position(|window| window == b"KeyTime")
        .expect("it was written")
        + 8;
    for claim in [0u32, 999, 1001, 1_000_000, u32::MAX] {
        let mut bytes = honest.clone();
        bytes[at..at + 4].copy_from_slice(&claim.to_le_bytes());
        assert!(is_refused(&bytes), "a claim of {claim} was believed");
    }
}

#[test]
fn deep_nesting_is_an_error() {
    let mut writer =
        Writer::new(Cursor::new(Vec::new()), FbxVersion::V7_4).expect("a known version");
    for _ in 0..10_000 {
        writer.new_node("Deep").expect("memory");
    }
    for _ in 0..10_000 {
        writer.close_node().expect("open");
    }
    let bytes = writer
        .finalize(&Default::default())
        .expect("memory")
        .into_inner();
    assert!(matches!(read(&bytes), Err(FbxError::Broken { .. })));
}
