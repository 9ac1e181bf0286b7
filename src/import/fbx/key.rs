//! A key of a curve, and how the curve runs from one key to the next.

use super::tangent::THIRD;

/// A key and the segment after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Key {
    /// Time, in ticks of the file's clock.
    pub tick: f64,
    /// Degrees of a rotation, the file's units of a translation.
    pub value: f64,
    /// How the curve runs from this key to the next.
    pub segment: Segment,
}

/// The curve between two keys.
#[derive(Clone, Copy, Debug)]
pub(super) enum Segment {
    /// The first key's value.
    Hold,
    /// The second key's value.
    HoldNext,
    /// A straight line.
    Line,
    /// A cubic Bézier curve with these handles.
    Cubic { leave: Handle, arrive: Handle },
}

/// A Bézier handle, from its key towards the inside of the segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Handle {
    /// Fraction of the segment's time.
    pub weight: f64,
    /// How much the tangent rises over the handle's time, forward in time.
    pub rise: f64,
}

/// What a curve does before its first or after its last key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Beyond {
    /// It keeps the key's value.
    Hold,
    /// It goes straight on.
    Slope,
    /// It repeats.
    Cycle {
        /// How often; without end where nothing is said.
        repeats: Option<f64>,
        /// Every second repetition runs backward.
        mirror: bool,
        /// Each repetition starts where the one before ended.
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

/// The curve at `tick`, which is after `key` and before `next`.
pub(super) fn between(key: &Key, next: &Key, tick: f64) -> f64 {
    let s = (tick - key.tick) / (next.tick - key.tick);
    match key.segment {
        Segment::Hold => key.value,
        Segment::HoldNext => next.value,
        Segment::Line => key.value * (1.0 - s) + next.value * s,
        Segment::Cubic { leave, arrive } => {
            // The curve is given as time and value over a parameter: first the parameter of this time, then its value.
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

/// A cubic in Bernstein form at `t`.
fn bernstein([p0, p1, p2, p3]: [f64; 4], t: f64) -> f64 {
    let u = 1.0 - t;
    u * u * u * p0 + 3.0 * u * t * (u * p1 + t * p2) + t * t * t * p3
}

/// The parameter at which a Bézier curve with the control times 0, `x1`, `x2`, 1 reaches the time `x`, by Newton's method inside
/// a shrinking bracket. With both handles at a third, parameter and time are the same. Sixty halvings of the bracket would
/// be enough for the last bit of a double.
fn bezier_parameter(x1: f64, x2: f64, x: f64) -> f64 {
    // Unweighted tangents, which almost all curves have: no solving needed.
    if x1 == THIRD && x2 == 1.0 - THIRD {
        return x;
    }
    let (mut low, mut high, mut t) = (0.0, 1.0, x);
    for _ in 0..60 {
        let error = bernstein([0.0, x1, x2, 1.0], t) - x;
        if error.abs() < 1e-15 {
            break;
        }
        // The bracket shrinks to the side where the root is.
        if error > 0.0 {
            high = t;
        } else {
            low = t;
        }
        let u = 1.0 - t;
        // Derivative of the time by the parameter.
        let speed = 3.0 * (u * u * x1 + 2.0 * u * t * (x2 - x1) + t * t * (1.0 - x2));
        let newton = t - error / speed;
        // A step out of the bracket, as near a flat spot, becomes a halving.
        t = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
    }
    t
}
