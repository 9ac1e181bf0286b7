//! Files that were cut off, overwritten or had bits flipped never make the importer panic.

use super::damage::Damage;
use mimic::import::{self, Options};
use mimic_test_support::foreign;

/// Damages `bytes` many times. Reading may fail, but must return, and a clip that it returns must be whole.
fn survives(name: &str, bytes: &[u8], rounds: usize) {
    let mut damage = Damage::new();
    let mut refused = 0;
    for _ in 0..rounds {
        let mut damaged = bytes.to_vec();
        damage.apply(&mut damaged, 30_000);
        match import::read(&damaged, name, None, &Options::default()) {
            Ok(clip) => {
                let joints = clip.joints.len();
                assert!(clip.frames.iter().all(|frame| frame.len() == joints));
                let finite =
                    |t: &nalgebra::Isometry3<f64>| t.to_homogeneous().iter().all(|x| x.is_finite());
                assert!(clip.frames.iter().flatten().all(finite), "{name}");
            }
            Err(error) => {
                refused += 1;
                assert!(
                    error.to_string().starts_with(&format!("`{name}`: ")),
                    "{error}"
                );
            }
        }
    }
    assert!(
        refused > 0,
        "{name}: nothing was refused, so the damage did nothing"
    );
}

#[test]
fn damaged_synthetic_files() {
    survives(
        "a.gltf",
        super::gltf_made::synthetic_file().as_bytes(),
        4000,
    );
}

#[test]
fn damaged_real_files() {
    let files = [
        ("deepmimic/humanoid3d_backflip.txt", 800),
        ("deepmimic/humanoid3d_run.txt", 400),
        ("poser-bvh/run.bvh", 400),
        ("torture-gltf/SimpleSkin.gltf", 2000),
        ("torture-gltf/singleBlendshapeCube_sparse.glb", 2000),
        ("vrm/test.vrma", 2000),
        ("kenney/kenney_character.glb", 400),
        ("raylib/greenman.glb", 300),
    ];
    for (name, rounds) in files {
        let Some(path) = foreign(name) else {
            return;
        };
        let bytes = std::fs::read(&path).expect("the file opens");
        survives(name, &bytes, rounds);
    }
}

#[test]
fn no_bytes_and_all_cuts_of_a_small_file() {
    let text = super::gltf_made::synthetic_file();
    for end in 0..text.len() {
        let cut = import::read(&text.as_bytes()[..end], "a.gltf", None, &Options::default());
        assert!(cut.is_err(), "cut at {end}");
    }
}
