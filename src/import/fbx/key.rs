//! A key of a curve, and how the curve runs from one key to the next.

use super::tangent::THIRD;

#[derive(Clone, Copy, Debug)]
pub(super) struct Key {
    pub tick: f64,
    pub value: f64,
    /// How the curve runs from this key to the next.
    pub segment: Segment,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Segment {
    Hold,
    HoldNext,
    Line,
    Cubic { leave: Handle, arrive: Handle },
}

/// A Bezier handle, seen from its key towards the inside of the segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Handle {
    /// Fraction of the segment's time.
    pub weight: f64,
    /// Value of the curve that the tangent gains over the handle's time, in the direction of time.
    pub rise: f64,
}

/// What a curve does before its first or after its last key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Beyond {
    Hold,
    Slope,
    Cycle {
        repeats: Option<f64>,
        mirror: bool,
        climb: bool,
    },
}

/// Units per tick with which the curve leaves `key` towards `next`.
pub(super) fn leaving_slope(key: &Key, next: &Key) -> f64 {
    let length = next.tick - key.tick;
    match key.segment {
        Segment::Cubic { leave, .. } => ratio(leave.rise, leave.weight * length),
        Segment::Line => ratio(next.value - key.value, length),
        _ => 0.0,
    }
}

/// Units per tick with which the curve arrives at `next` from `key`.
pub(super) fn arriving_slope(key: &Key, next: &Key) -> f64 {
    let length = next.tick - key.tick;
    match key.segment {
        Segment::Cubic { arrive, .. } => ratio(arrive.rise, arrive.weight * length),
        Segment::Line => ratio(next.value - key.value, length),
        _ => 0.0,
    }
}

fn ratio(rise: f64, run: f64) -> f64 {
    if run > 0.0 { rise / run } else { 0.0 }
}

/// The curve at `tick`, which lies after `key` and before `next`.
pub(super) fn between(key: &Key, next: &Key, tick: f64) -> f64 {
    let s = (tick - key.tick) / (next.tick - key.tick);
    match key.segment {
        Segment::Hold => key.value,
        Segment::HoldNext => next.value,
        Segment::Line => key.value * (1.0 - s) + next.value * s,
        Segment::Cubic { leave, arrive } => {
            let t = bezier_parameter(leave.weight, 1.0 - arrive.weight, s);
            let controls = [
                key.value,
                key.value + leave.rise,
                next.value - arrive.rise,
                next.value,
            ];
            bernstein(controls, t)
        }
    }
}

fn bernstein([p0, p1, p2, p3]: [f64; 4], t: f64) -> f64 {
    let u = 1.0 - t;
    u * u * u * p0 + 3.0 * u * t * (u * p1 + t * p2) + t * t * t * p3
}

/// Parameter at which a Bezier curve with controls 0, `x1`, `x2`, 1 reaches `x`, by Newton's method kept inside a
/// shrinking bracket. With both handles at a third, parameter and time are the same.
fn bezier_parameter(x1: f64, x2: f64, x: f64) -> f64 {
    if x1 == THIRD && x2 == 1.0 - THIRD {
        return x;
    }
    let (mut low, mut high, mut t) = (0.0, 1.0, x);
    for _ in 0..60 {
        let error = bernstein([0.0, x1, x2, 1.0], t) - x;
        if error.abs() < 1e-15 {
            break;
        }
        if error > 0.0 {
            high = t
        } else {
            low = t
        }
        let u = 1.0 - t;
        let speed = 3.0 * (u * u * x1 + 2.0 * u * t * (x2 - x1) + t * t * (1.0 - x2));
        let newton = t - error / speed;
        t = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
    }
    t
}
