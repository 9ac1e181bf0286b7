//! Damaged copies of our own clips: reading them ends soon and takes no more memory than their size allows.
//!
//! One test alone in its program, as it counts what the whole program allocates.

#[path = "import/damage.rs"]
mod damage;

use damage::Damage;
use mimic::import::{self, Error, Options};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// The system's allocator with a count of the bytes in use and the most there were.
struct Counting {
    used: AtomicUsize,
    peak: AtomicUsize,
}

#[global_allocator]
static HEAP: Counting = Counting {
    used: AtomicUsize::new(0),
    peak: AtomicUsize::new(0),
};

// SAFETY: every call is handed on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let used = self.used.fetch_add(layout.size(), Relaxed) + layout.size();
        self.peak.fetch_max(used, Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        self.used.fetch_sub(layout.size(), Relaxed);
        // SAFETY: `at` came from `System` with this layout.
        unsafe { System.dealloc(at, layout) }
    }
}

impl Counting {
    /// What `work` returns, and the most bytes it had in use at once.
    fn peak_of<T>(&self, work: impl FnOnce() -> T) -> (T, usize) {
        let before = self.used.load(Relaxed);
        self.peak.store(before, Relaxed);
        let result = work();
        (result, self.peak.load(Relaxed) - before)
    }
}

const PER_BYTE: usize = 64;
const CONSTANT: usize = 256 << 10;
/// Bytes for a sampled transform: seven numbers in world space, seven in the parent's, and the lists that hold them.
const PER_TRANSFORM: usize = 160;
/// Transforms that any file may be sampled to.
const FREE_TRANSFORMS: usize = 1 << 20;
const ROUNDS: usize = 2000;
const SOON: Duration = Duration::from_secs(20);

fn deepmimic() -> Vec<u8> {
    let pose = ["1.0", "0.0", "0.0", "0.0"];
    let numbers: Vec<&str> = ["0.0333", "0.0", "0.9", "0.0"]
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

/// Reads damaged copies of `bytes`; how many of them could be read still.
fn survived(name: &str, bytes: &[u8], rounds: usize) -> usize {
    let mut damage = Damage::new();
    let mut survived = 0;
    for round in 0..rounds {
        let mut damaged = bytes.to_vec();
        damage.apply(&mut damaged, bytes.len());
        let start = Instant::now();
        let read = || import::read(&damaged, name, None, &Options::default());
        let (clip, peak) = HEAP.peak_of(read);
        assert!(
            start.elapsed() < SOON,
            "{name}, round {round}: {:?}",
            start.elapsed()
        );
        let transforms = match &clip {
            Ok(clip) => clip.frames.len() * clip.joints.len(),
            Err(Error::NotFinite { .. }) => FREE_TRANSFORMS,
            Err(_) => 0,
        };
        survived += usize::from(clip.is_ok());
        let most = PER_BYTE * damaged.len() + PER_TRANSFORM * transforms + CONSTANT;
        assert!(
            peak < most,
            "{name}, round {round}: {peak} bytes for {}",
            damaged.len()
        );
    }
    survived
}

#[test]
fn damaged_clips_cost_no_more_than_their_size_allows() {
    let clip = |name: &str| {
        let path = format!("{}/clips/{name}", env!("CARGO_MANIFEST_DIR"));
        std::fs::read(path).expect("our own clip")
    };
    let files = [
        ("kick.fbx", clip("kick.fbx")),
        ("walk.glb", clip("walk.glb")),
        ("a.txt", deepmimic()),
    ];
    for (name, bytes) in files {
        let survived = survived(name, &bytes, ROUNDS);
        assert!(
            (1..ROUNDS).contains(&survived),
            "{name}: {survived} of {ROUNDS} could be read"
        );
    }
}
