//! The frame rate of a glTF animation, which the format doesn't state: that of its keys.

use std::collections::BTreeMap;

/// Rates that animations are made at, in Hz.
const USUAL: [f64; 7] = [24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 120.0];
/// A rate within this fraction of a usual one is meant to be that one. Chosen: it takes 29.97 for 30.
const NEAR: f64 = 0.01;
/// Rate of takes whose keys say nothing, Hz. Chosen.
const DEFAULT: f64 = 30.0;
/// Lowest and highest rate that keys can say, Hz. Chosen: keys that are farther apart are poses set by hand, and keys that are
/// nearer are rounding.
const SLOWEST: f64 = 10.0;
const FASTEST: f64 = 1000.0;
/// Spacings within this many seconds of each other count as equal. Chosen above the rounding of key times to 32 bits.
const RESOLUTION: f64 = 1e-4;

/// Frame rate, Hz, by the most common spacing of the keys. `curves` are the key times of every curve, seconds.
pub(super) fn rate<'a>(curves: impl Iterator<Item = &'a [f64]>) -> f64 {
    // Number and sum of equal spacings.
    let mut spacings: BTreeMap<u64, (usize, f64)> = BTreeMap::new();
    for times in curves {
        for pair in times.windows(2) {
            let spacing = pair[1] - pair[0];
            if spacing >= 1.0 / FASTEST {
                let alike = spacings
                    .entry((spacing / RESOLUTION).round() as u64)
                    .or_default();
                *alike = (alike.0 + 1, alike.1 + spacing);
            }
        }
    }
    // Of equally common spacings the shortest wins: it comes first.
    let most = spacings.values().fold(
        (0, 1.0),
        |most, alike| if alike.0 > most.0 { *alike } else { most },
    );
    let rate = most.0 as f64 / most.1;
    match USUAL
        .iter()
        .find(|usual| (rate - **usual).abs() < NEAR * **usual)
    {
        Some(usual) => *usual,
        None if rate >= SLOWEST => rate,
        None => DEFAULT,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(times: &[f64]) -> f64 {
        rate([times].into_iter())
    }

    #[test]
    fn key_spacing_tells_the_rate() {
        let keys = |fps: f64| -> Vec<f64> {
            (0..40)
                .map(|k| f64::from((f64::from(k) / fps) as f32))
                .collect()
        };
        for fps in [12.0, 24.0, 25.0, 30.0, 48.0, 60.0, 90.0, 120.0] {
            assert!((of(&keys(fps)) - fps).abs() < 0.01 * fps, "{fps}");
        }
        assert_eq!(of(&keys(30.0)), 30.0);
        assert_eq!(of(&keys(29.97)), 30.0);
    }

    #[test]
    fn sparse_keys_leave_the_default() {
        assert_eq!(of(&[]), 30.0);
        assert_eq!(of(&[1.0]), 30.0);
        assert_eq!(of(&[0.0, 2.0, 4.0]), 30.0);
        assert_eq!(of(&[1.0, 1.0, 1.0]), 30.0);
    }
}
