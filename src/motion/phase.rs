//! The phase track: how far a motion has come, as imitation learning uses it (Peng et al., DeepMimic, 2018).

/// Phase of each of `frames` frames: 0 at the first, 1 at the last, linear in time; 0 for a single frame.
pub(crate) fn phase(frames: usize) -> Vec<f64> {
    let last = frames.saturating_sub(1).max(1) as f64;
    (0..frames).map(|f| f as f64 / last).collect()
}
