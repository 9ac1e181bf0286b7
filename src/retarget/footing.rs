//! Goals of feet and hands are moved to where they stand, and the move fades in and out around the stance, so that nothing jumps when a stance begins or ends.

use super::goals::Goals;
use super::rotation::exp;
use super::stance::Held;
use crate::humanoid::Slot;
use nalgebra::Vector3;

/// How a limb's goal is moved: a shift of its key point and a turn about Z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Move {
    pub shift: Vector3<f64>,
    pub turn: f64,
}

const NONE: Move = Move {
    shift: Vector3::new(0.0, 0.0, 0.0),
    turn: 0.0,
};

/// Sum of weights from which on a limb counts as standing.
const STANDS: f64 = 0.25;
/// Distance between standing points from which on they say something about the turn, metres.
const APART: f64 = 0.03;
/// Largest turn, radians.
const LARGEST_TURN: f64 = 0.4;
/// Time in which a move fades after or before a stance, s.
const FADE: f64 = 0.3;
/// Half width of the window over which moves are averaged, s.
const WINDOW: f64 = 0.05;

/// The move of every frame, for a limb whose key is at `keys[f]` and whose knobs `held[f]` stand.
pub(super) fn moves(held: &[Vec<Held>], keys: &[Vector3<f64>], fps: f64) -> Vec<Move> {
    let fitted: Vec<Option<Move>> = held
        .iter()
        .zip(keys)
        .map(|(held, key)| fit(held, key))
        .collect();
    smooth(
        &bridge(&fitted, FADE * fps),
        (WINDOW * fps).round() as usize,
    )
}

/// The turn about Z and shift that bring the standing knobs nearest to their anchors (weighted least squares).
fn fit(held: &[Held], key: &Vector3<f64>) -> Option<Move> {
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
    let tells = spread > total * APART * APART;
    let turn = if tells {
        sin.atan2(cos).clamp(-LARGEST_TURN, LARGEST_TURN)
    } else {
        0.0
    };
    let moved = to + exp(&(Vector3::z() * turn)) * (key - from);
    Some(Move {
        shift: moved - key,
        turn,
    })
}

/// Fills the frames outside of stances with the moves of the stances before and after, each fading with time.
fn bridge(fitted: &[Option<Move>], fade: f64) -> Vec<Move> {
    let ahead = nearest(fitted.iter().rev());
    let around = nearest(fitted.iter())
        .into_iter()
        .zip(ahead.into_iter().rev());
    let fading = |away: usize| {
        let t = (1.0 - away as f64 / fade).max(0.0);
        t * t * (3.0 - 2.0 * t)
    };
    let part =
        |found: Option<(usize, Move)>| found.map_or((0.0, NONE), |(away, by)| (fading(away), by));
    let bridged = around.map(|(before, after)| {
        let ((a, before), (b, after)) = (part(before), part(after));
        let total = (a + b).max(1.0);
        Move {
            shift: (before.shift * a + after.shift * b) / total,
            turn: (before.turn * a + after.turn * b) / total,
        }
    });
    bridged.collect()
}

/// For every frame the last move so far, and how many frames ago it was.
fn nearest<'a>(fitted: impl Iterator<Item = &'a Option<Move>>) -> Vec<Option<(usize, Move)>> {
    let mut last = None;
    let mut step = |found: &Option<Move>| {
        last = found
            .map(|by| (0, by))
            .or(last.map(|(away, by)| (away + 1, by)));
        last
    };
    fitted.map(&mut step).collect()
}

/// Mean over a triangular window.
fn smooth(moves: &[Move], half: usize) -> Vec<Move> {
    let mean = |f: usize| {
        let (mut sum, mut total) = (NONE, 0.0);
        let from = f.saturating_sub(half);
        for (g, by) in moves
            .iter()
            .enumerate()
            .skip(from)
            .take(f + half + 1 - from)
        {
            let weight = (half + 1 - f.abs_diff(g)) as f64;
            sum.shift += by.shift * weight;
            sum.turn += by.turn * weight;
            total += weight;
        }
        Move {
            shift: sum.shift / total,
            turn: sum.turn / total,
        }
    };
    (0..moves.len()).map(mean).collect()
}

/// Moves a limb's goals at frame `f`: the key whole, the knee or elbow above it half.
pub(super) fn apply(goals: &mut Goals, f: usize, key: usize, by: &Move) {
    let body = goals.keys[key].body;
    goals.points[f][key] += by.shift;
    let bend = match goals.keys[key].slot {
        Slot::LeftFoot => Some(Slot::LeftLowerLeg),
        Slot::RightFoot => Some(Slot::RightLowerLeg),
        Slot::LeftHand => Some(Slot::LeftLowerArm),
        Slot::RightHand => Some(Slot::RightLowerArm),
        _ => None,
    };
    if let Some(k) = goals.keys.iter().position(|key| Some(key.slot) == bend) {
        goals.points[f][k] += by.shift / 2.0;
    }
    if let Some(t) = goals.turns.iter().position(|turn| turn.body == body) {
        goals.rotations[f][t] = exp(&(Vector3::z() * by.turn)) * goals.rotations[f][t];
    }
}
