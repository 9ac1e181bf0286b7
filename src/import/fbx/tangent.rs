//! Slopes of cubic keys: automatic, TCB, and set by the user.
//!
//! Autodesk doesn't publish how automatic slopes are computed. The formulas and their constants here are those that ufbx found
//! (`ufbxi_solve_auto_tangent` in ufbx 0.11), with which all curves of the test files are compared.

use super::numbers::in_range;

const TANGENT_TCB: u32 = 0x200;
pub(super) const TANGENT_USER: u32 = 0x400;
const CLAMP: u32 = 0x1000;
const TIME_INDEPENDENT: u32 = 0x2000;
const CLAMP_PROGRESSIVE: u32 = 0x4000;
const WEIGHTED_RIGHT: u32 = 0x0100_0000;
const WEIGHTED_NEXT_LEFT: u32 = 0x0200_0000;

/// Weight of a tangent that isn't weighted: the Bézier handle ends at a third of the segment.
pub(super) const THIRD: f64 = 1.0 / 3.0;

/// What the file says about one key: flags and four 32-bit values whose meaning depends on them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attribute {
    pub flags: u32,
    pub data: [u32; 4],
}

impl Attribute {
    /// Whether a flag is set.
    pub fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }

    fn real(&self, index: usize) -> f64 {
        let value = f64::from(f32::from_bits(self.data[index & 3]));
        if in_range(value) { value } else { 0.0 }
    }

    /// Weight of the key's right tangent. Weights are two 16-bit counts of 1/10000 in the third value.
    pub fn right_weight(&self) -> f64 {
        let weight = f64::from(self.data[2] & 0xffff) * 1e-4;
        if self.has(WEIGHTED_RIGHT) {
            weight
        } else {
            THIRD
        }
    }

    /// Weight of the next key's left tangent.
    pub fn next_left_weight(&self) -> f64 {
        let weight = f64::from(self.data[2] >> 16) * 1e-4;
        if self.has(WEIGHTED_NEXT_LEFT) && !self.has(TANGENT_TCB) {
            weight
        } else {
            THIRD
        }
    }

    /// Slope on the left of the next key, units per second, or the next key's bias if it is automatic.
    fn next_left(&self) -> f64 {
        if self.has(TANGENT_TCB) {
            0.0
        } else {
            self.real(1)
        }
    }
}

/// The step to a neighbouring key.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Seconds, above 0.
    pub time: f64,
    /// Change of value.
    pub rise: f64,
    /// Weight of the key's tangent on this side.
    pub weight: f64,
}

impl Step {
    fn slope(&self) -> f64 {
        self.rise / self.time
    }
}

/// Slopes on the left and on the right of a cubic key, units per second, given the steps to its neighbours and what the key
/// before and the key itself state.
pub(super) fn slopes(
    before: Option<Step>,
    after: Option<Step>,
    previous: Option<Attribute>,
    own: Attribute,
) -> (f64, f64) {
    let left = previous.map_or(0.0, |attribute| attribute.next_left());
    let right = own.real(0);
    // TCB goes before the other kinds: its values are tension, continuity and bias instead of slopes.
    if own.has(TANGENT_TCB) {
        return kochanek_bartels(before, after, own);
    }
    if own.has(TANGENT_USER) {
        return (left, right);
    }
    match (before, after) {
        // The value that states a user's slope states an automatic key's bias, with the sign of time on the left.
        (Some(before), Some(after)) => (
            automatic(before, after, -left, own),
            automatic(before, after, right, own),
        ),
        (Some(before), None) => pair(at_end(before, -left, own)),
        (None, Some(after)) => pair(at_end(after, right, own)),
        (None, None) => (0.0, 0.0),
    }
}

fn pair(slope: f64) -> (f64, f64) {
    (slope, slope)
}

/// Slopes by tension, continuity and bias (Kochanek and Bartels, "Interpolating splines with local tension, continuity, and bias
/// control", 1984). A missing neighbour's share goes to the other one.
fn kochanek_bartels(before: Option<Step>, after: Option<Step>, own: Attribute) -> (f64, f64) {
    let [tension, continuity, bias] = [0, 1, 2].map(|i| own.real(i));
    // Two neighbours share the slope equally.
    let share = if before.is_some() && after.is_some() {
        0.5
    } else {
        1.0
    };
    let from_before =
        before.map_or(0.0, |step| step.slope()) * share * (1.0 - tension) * (1.0 + bias);
    let from_after =
        after.map_or(0.0, |step| step.slope()) * share * (1.0 - tension) * (1.0 - bias);
    (
        from_before * (1.0 - continuity) + from_after * (1.0 + continuity),
        from_before * (1.0 + continuity) + from_after * (1.0 - continuity),
    )
}

/// Automatic slope of a key between two others: the slope of the chord between the neighbours, or its mean with that of the
/// parabola through the three keys. `bias` is in percent; a positive one draws the slope towards the segment after.
fn automatic(before: Step, after: Step, bias: f64, own: Attribute) -> f64 {
    // A key as high as a neighbour stays flat, so that the curve doesn't overshoot it.
    if own.has(CLAMP) && (before.rise == 0.0 || after.rise == 0.0) {
        return 0.0;
    }
    let span = before.time + after.time;
    let chord = (before.rise + after.rise) / span;
    let slope = if own.has(TIME_INDEPENDENT) {
        chord
    } else {
        // The parabola's slope is the mean of both segments' slopes, weighted by the length of the other one.
        let share = before.time / span;
        let parabolic = before.slope() * (1.0 - share) + after.slope() * share;
        biased(0.5 * (chord + parabolic), before, after, bias)
    };
    if own.has(CLAMP_PROGRESSIVE) {
        clamped(slope, before, after)
    } else {
        slope
    }
}

/// The slope with its bias: drawn towards one of the segments, and steeper beyond 500 percent.
fn biased(slope: f64, before: Step, after: Step, bias: f64) -> f64 {
    let weight = bias.abs() / 100.0;
    // ufbx ignores biases below 0.01 percent.
    if weight <= 1e-4 {
        return slope;
    }
    let target = if bias > 0.0 {
        after.slope()
    } else {
        before.slope()
    };
    // The sign of the steepening: towards the target, or by the bias where the slope is already there.
    let towards = if (target - slope).abs() > 1e-5 {
        target - slope
    } else {
        bias
    };
    slope + (target - slope) * weight + steepening(bias).copysign(towards)
}

/// How much bias beyond 500 percent steepens a slope, units per second: 40 (bias / 100 − 5)².
fn steepening(bias: f64) -> f64 {
    let beyond = (bias.abs() / 100.0 - 5.0).max(0.0);
    40.0 * beyond * beyond
}

/// The slope limited so that both Bézier handles stay between the values of the key and of its neighbours.
fn clamped(slope: f64, before: Step, after: Step) -> f64 {
    let sign = 1f64.copysign(slope);
    let limit = |step: Step| {
        // A handle ends at key + slope × reach: it may not pass the neighbour's value.
        let reach = step.weight * step.time;
        if reach > 0.0 {
            (sign * step.rise / reach).max(0.0)
        } else {
            0.0
        }
    };
    sign * slope.abs().min(limit(before)).min(limit(after))
}

/// Automatic slope of the first or last key.
fn at_end(step: Step, bias: f64, own: Attribute) -> f64 {
    // Clamped curves start and end flat.
    if own.has(CLAMP_PROGRESSIVE) || own.has(CLAMP) && step.rise == 0.0 {
        return 0.0;
    }
    let extra = if own.has(TIME_INDEPENDENT) {
        0.0
    } else {
        steepening(bias).copysign(bias)
    };
    step.slope() + extra
}
