//! The figures of steered episodes.

use super::take::{Shot, Take};
use crate::task::mean;
use nalgebra::Vector2;
use serde::Serialize;

/// Seconds after a change of input from which on a character counts as settled.
const SETTLED_S: f64 = 2.5;
/// Slowest wish that has a heading, m/s.
const SLOWEST: f64 = 0.3;
/// Share of the wished speed that is reached when a start counts as done: 1 − 1/e.
const RISEN: f64 = 0.632;
/// How near to the new heading a turn has to come, degrees.
const TURNED_DEG: f64 = 20.0;
/// Seconds after a turn in which the character has to stay up.
const STAYS_S: f64 = 5.0;
/// Shares of the tries of which rises and turns are told.
const MOST: f64 = 0.95;

/// The agent's or the animated character's part of a take.
pub(super) type Of = fn(&Take) -> &[Shot];

/// Mean and 95th percentile.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// The mean.
    pub mean: f64,
    /// What 95 % are at most.
    pub p95: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Spread {
        values.sort_by(f64::total_cmp);
        Spread {
            mean: if values.is_empty() {
                f64::NAN
            } else {
                mean(values.iter().copied())
            },
            p95: quantile(&values, 0.95),
        }
    }
}

/// Turns by 180° while walking.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Turn {
    /// Share of the tries in which facing and velocity came within 20° of the new heading and the character stayed up.
    pub success: f64,
    /// Seconds that 95 % of all tries took at most; not a number if fewer came there.
    pub seconds: f64,
}

/// Episodes in which the character is pushed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pushed {
    /// Impulse of a push on the trunk, N·s.
    pub impulse_ns: f64,
    /// Share of the episodes without a fall.
    pub survival: f64,
}

/// How well a character follows its player.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Angle between the wished velocity and the mean velocity of a gait cycle, settled, degrees.
    pub heading_error_deg: Spread,
    /// Angle between where the character should face and where it does in the mean of a gait cycle, settled, degrees.
    pub facing_error_deg: Spread,
    /// Difference of the speed along the wish from the wished speed, in the mean of a gait cycle, settled, m/s.
    pub speed_error_m_s: f64,
    /// Seconds from the wish to walk until 63 % of the wished velocity, of 95 % of the starts at most.
    pub rise_s: f64,
    /// Turns by 180° while walking.
    pub turn_180: Turn,
    /// Farthest that the centre of mass strays in 60 s of standing, metres.
    pub idle_drift_m: f64,
    /// How far a standing foot slides in the mean of a stance while walking, metres.
    pub slide_per_stance_m: f64,
}

/// Figures of random input.
pub(super) struct Random {
    pub heading: Spread,
    pub facing: Spread,
    pub speed: f64,
    pub slide: f64,
}

/// Measures settled gait cycles, from one coming down of the animated character's left foot to the next.
pub(super) fn random(takes: &[Take], of: Of, hz: f64) -> Random {
    let (mut heading, mut facing, mut speed) = (Vec::new(), Vec::new(), Vec::new());
    for take in takes {
        for (from, to) in settled_cycles(take, hz) {
            let wish = take.wishes[from];
            let wished = wish.velocity.cast::<f64>();
            let shots = &of(take)[from..to];
            let count = shots.len() as f64;
            let velocity = shots.iter().map(|s| s.velocity).sum::<Vector2<f64>>() / count;
            let faces = shots.iter().map(|s| s.facing).sum::<Vector2<f64>>();
            let should = wish.facing.map_or(wished, |a| {
                Vector2::new(f64::from(a).cos(), f64::from(a).sin())
            });
            let each = to - from;
            heading.extend(std::iter::repeat_n(degrees(&velocity, &wished), each));
            facing.extend(std::iter::repeat_n(degrees(&faces, &should), each));
            let along = velocity.dot(&wished) / wished.norm();
            speed.extend(std::iter::repeat_n((along - wished.norm()).abs(), each));
        }
    }
    Random {
        heading: Spread::of(heading),
        facing: Spread::of(facing),
        speed: Spread::of(speed).mean,
        slide: mean(
            takes
                .iter()
                .flat_map(|take| slides(of(take)))
                .filter(|s| *s > 0.0),
        ),
    }
}

/// The gait cycles in which one wish to walk has stood for long enough.
fn settled_cycles(take: &Take, hz: f64) -> Vec<(usize, usize)> {
    let count = take.agent.len();
    let mut since = vec![0usize; count];
    for f in 1..count {
        since[f] = match take.wishes[f] == take.wishes[f - 1] {
            true => since[f - 1] + 1,
            false => 0,
        };
    }
    let strikes: Vec<usize> = (0..count).filter(|f| take.strikes[*f]).collect();
    let settled = |pair: &&[usize]| {
        let (from, to) = (pair[0], pair[1]);
        let walks = f64::from(take.wishes[from].velocity.norm()) > SLOWEST;
        walks && since[from] as f64 >= SETTLED_S * hz && since[to] > since[from]
    };
    let cycles = strikes.windows(2).filter(settled);
    cycles.map(|pair| (pair[0], pair[1])).collect()
}

/// How far feet slid in each of their stances, metres.
fn slides(shots: &[Shot]) -> Vec<f64> {
    let mut all = Vec::new();
    for foot in 0..2 {
        let mut sum: Option<f64> = None;
        for shot in shots {
            match shot.slide[foot] {
                Some(by) => sum = Some(sum.unwrap_or(0.0) + by),
                None => all.extend(sum.take()),
            }
        }
    }
    all
}

/// Seconds from the wish at `step` to 63 % of it, of 95 % of the takes at most; not a number if fewer came there.
pub(super) fn rise(takes: &[Take], of: Of, hz: f64, step: usize) -> f64 {
    let time = |take: &Take| {
        let wished = take.wishes.get(step)?.velocity.cast::<f64>();
        let shots = of(take).iter().skip(step);
        let along = |shot: &Shot| shot.velocity.dot(&wished) / wished.norm_squared();
        shots.map(along).position(|share| share >= RISEN)
    };
    let times: Vec<f64> = takes
        .iter()
        .map(|take| time(take).map_or(f64::INFINITY, |f| (f + 1) as f64 / hz))
        .collect();
    finite(quantile_of(times, MOST))
}

/// Turns by 180°: the second wish of each take.
pub(super) fn turns(takes: &[Take], of: Of, hz: f64) -> Turn {
    let time = |take: &Take| {
        let changes = |f: &usize| take.wishes[*f] != take.wishes[*f - 1];
        let at = (1..take.wishes.len()).find(changes)?;
        let wished = take.wishes[at].velocity.cast::<f64>();
        let is_there = |shot: &Shot| {
            degrees(&shot.velocity, &wished) < TURNED_DEG
                && degrees(&shot.facing, &wished) < TURNED_DEG
        };
        let after = of(take).iter().skip(at).position(is_there)?;
        let stays = take.agent.len() as f64 >= (at + after) as f64 + STAYS_S * hz;
        (stays && !take.fell).then_some((after + 1) as f64 / hz)
    };
    let times: Vec<f64> = takes
        .iter()
        .map(|take| time(take).unwrap_or(f64::INFINITY))
        .collect();
    let done = times.iter().filter(|t| t.is_finite()).count();
    Turn {
        success: done as f64 / times.len().max(1) as f64,
        seconds: finite(quantile_of(times, MOST)),
    }
}

/// Farthest from the place of the first second, metres; not a number if the character fell.
pub(super) fn standing(takes: &[Take], of: Of) -> f64 {
    let drift = |take: &Take| {
        let shots = of(take);
        let first = shots.first().map(|shot| shot.place)?;
        let far = shots.iter().map(|shot| (shot.place - first).norm());
        (!take.fell).then(|| far.fold(0.0, f64::max))
    };
    takes
        .iter()
        .map(|take| drift(take).unwrap_or(f64::NAN))
        .fold(0.0, f64::max)
}

/// The angle between two vectors, degrees.
fn degrees(a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
    a.angle(b).to_degrees()
}

fn quantile_of(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    quantile(&values, share)
}

/// The value that this share of sorted values doesn't exceed.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = (sorted.len() as f64 * share).ceil() as usize;
    sorted
        .get(at.saturating_sub(1))
        .copied()
        .unwrap_or(f64::NAN)
}

/// Not a number in place of infinity.
fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { f64::NAN }
}
