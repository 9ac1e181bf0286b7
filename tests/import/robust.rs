//! Files that were cut, overwritten or flipped never bring the importer down.

use super::data;
use mimic::import::{self, Options};

/// A small linear congruential generator (Knuth's MMIX constants), so that every run sees the same damage.
struct Damage(u64);

impl Damage {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % limit.max(1)
    }

    /// Cuts the end off, flips bits, or overwrites a few bytes with a length that is wrong.
    fn apply(&mut self, bytes: &mut Vec<u8>, head: usize) {
        match self.below(4) {
            0 => bytes.truncate(self.below(bytes.len())),
            1 => {
                for _ in 0..=self.below(8) {
                    let at = self.below(bytes.len());
                    bytes[at] ^= 1 << self.below(8);
                }
            }
            2 => {
                let at = self.below(bytes.len().min(head));
                let lengths: [u32; 5] = [0, 1, 0x7fff_ffff, 0xffff_ffff, 0x10_0000];
                let length = lengths[self.below(lengths.len())].to_le_bytes();
                let end = (at + 4).min(bytes.len());
                bytes[at..end].copy_from_slice(&length[..end - at]);
            }
            _ => {
                // A digit of a text, so that the JSON stays whole and its numbers go wrong.
                let digits: Vec<usize> = (0..bytes.len().min(head))
                    .filter(|&at| bytes[at].is_ascii_digit())
                    .collect();
                for _ in 0..=self.below(3) {
                    if let Some(&at) = digits.get(self.below(digits.len())) {
                        bytes[at] = b"0123456789"[self.below(10)];
                    }
                }
            }
        }
    }
}

/// Damages `bytes` many times; reading may fail but must return, and what is returned must be whole.
fn survives(name: &str, bytes: &[u8], rounds: usize) {
    let mut damage = Damage(0x006d_696d_6963);
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
                assert!(error.to_string().starts_with(name), "{error}");
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
        ("torture-gltf/SimpleSkin.gltf", 2000),
        ("torture-gltf/singleBlendshapeCube_sparse.glb", 2000),
        ("vrm/test.vrma", 2000),
        ("kenney/kenney_character.glb", 400),
        ("raylib/greenman.glb", 300),
    ];
    for (name, rounds) in files {
        let Some(path) = data(name) else {
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
