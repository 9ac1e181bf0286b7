//! How the targets of a foot or hand move so that its standing points are where they stand.
//!
//! In a stance the move is fitted to the points; before and after it fades out over time, so that nothing jumps when a
//! stance begins or ends.

use super::held::Held;
use crate::retarget::fade::smoothstep;
use crate::retarget::goals::LimbShift;
use crate::retarget::rotation::exp;
use nalgebra::Vector3;

// All chosen.

/// Sum of its points' weights from which on a limb counts as standing.
const STANDS: f64 = 0.25;
/// Root mean square distance of standing points from their mean above which they determine a turn, metres.
const APART: f64 = 0.03;
/// Largest turn, radians: more would be a foot that has turned, not one that was carried over wrongly.
const LARGEST_TURN: f64 = 0.4;
/// Time over which a move fades before and after a stance, s.
const FADE: f64 = 0.3;
/// Half width of the window over which moves are averaged, s.
const WINDOW: f64 = 0.05;

/// The move of every frame, for a limb whose keypoint is at `keypoints[f]` and whose points `held[f]` stand.
pub(super) fn shifts(held: &[Vec<Held>], keypoints: &[Vector3<f64>], fps: f64) -> Vec<LimbShift> {
    let fitted: Vec<Option<LimbShift>> = held
        .iter()
        .zip(keypoints)
        .map(|(held, key)| fit(held, key))
        .collect();
    smooth(
        &bridge(&fitted, FADE * fps),
        (WINDOW * fps).round() as usize,
    )
}

/// The turn about Z and the shift that bring the standing points nearest to their footholds; `None` if hardly any stands.
///
/// Weighted least squares in the plane: the means coincide, and the turn is atan2(Σ w a × b, Σ w a · b) with a and b seen
/// from the means, the planar case of Kabsch's solution (Acta Crystallographica A 32, 1976).
fn fit(held: &[Held], key: &Vector3<f64>) -> Option<LimbShift> {
    let total: f64 = held.iter().map(|h| h.weight).sum();
    if total < STANDS {
        return None;
    }
    let mean = |of: fn(&Held) -> Vector3<f64>| {
        held.iter().map(|h| of(h) * h.weight).sum::<Vector3<f64>>() / total
    };
    let (from, to) = (mean(|h| h.from), mean(|h| h.at));
    let (mut cos, mut sin, mut spread) = (0.0, 0.0, 0.0);
    for h in held {
        let (a, b) = ((h.from - from).xy(), (h.at - to).xy());
        cos += h.weight * a.dot(&b);
        sin += h.weight * a.perp(&b);
        spread += h.weight * a.norm_squared();
    }
    // Points on one spot don't determine a turn.
    let tells = spread > total * APART * APART;
    let turn = if tells {
        sin.atan2(cos).clamp(-LARGEST_TURN, LARGEST_TURN)
    } else {
        0.0
    };
    let moved = to + exp(&(Vector3::z() * turn)) * (key - from);
    Some(LimbShift {
        shift: moved - key,
        turn,
    })
}

/// Fills the frames outside of stances with the moves of the stances before and after, each fading with time.
fn bridge(fitted: &[Option<LimbShift>], fade: f64) -> Vec<LimbShift> {
    let ahead = nearest(fitted.iter().rev());
    let around = nearest(fitted.iter())
        .into_iter()
        .zip(ahead.into_iter().rev());
    let fading = |away: usize| smoothstep((1.0 - away as f64 / fade).max(0.0));
    let part = |found: Option<(usize, LimbShift)>| {
        found.map_or((0.0, LimbShift::NONE), |(away, by)| (fading(away), by))
    };
    let bridged = around.map(|(before, after)| {
        let ((a, before), (b, after)) = (part(before), part(after));
        // Between two stances that are near, both count in proportion; beside one alone, the rest is no move.
        let total = (a + b).max(1.0);
        LimbShift {
            shift: (before.shift * a + after.shift * b) / total,
            turn: (before.turn * a + after.turn * b) / total,
        }
    });
    bridged.collect()
}

/// For every frame the last move so far, and how many frames ago it was.
fn nearest<'a>(
    fitted: impl Iterator<Item = &'a Option<LimbShift>>,
) -> Vec<Option<(usize, LimbShift)>> {
    // Going through the frames in order, a move that was found is 0 frames old, and one frame older in each frame after it.
    let mut last = None;
    let mut step = |found: &Option<LimbShift>| {
        last = found
            .map(|by| (0, by))
            .or(last.map(|(away, by)| (away + 1, by)));
        last
    };
    fitted.map(&mut step).collect()
}

/// Mean over a triangular window of `half` frames on either side.
fn smooth(shifts: &[LimbShift], half: usize) -> Vec<LimbShift> {
    let mean = |f: usize| {
        let (mut sum, mut total) = (LimbShift::NONE, 0.0);
        let from = f.saturating_sub(half);
        for (g, by) in shifts
            .iter()
            .enumerate()
            .skip(from)
            .take(f + half + 1 - from)
        {
            // At the ends of the clip the window is cut, and the mean divides by what is left.
            let weight = (half + 1 - f.abs_diff(g)) as f64;
            sum.shift += by.shift * weight;
            sum.turn += by.turn * weight;
            total += weight;
        }
        LimbShift {
            shift: sum.shift / total,
            turn: sum.turn / total,
        }
    };
    (0..shifts.len()).map(mean).collect()
}
