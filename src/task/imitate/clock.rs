//! How fast a motion is played: at its own pace, except just after a transition into it and just before one out of it.
//!
//! A pace is a playback speed factor: seconds of the motion per second. In `docs/notebook/transitions.md` an agent performs 32
//! instead of 24 of 56 pairs of motions because of it.

/// Seconds in which the pace at which a motion begins becomes its own. Chosen.
pub(super) const EASE_IN_S: f64 = 1.0;
/// Seconds in which a motion that is about to be left comes to another pace. Chosen.
const RAMP_S: f64 = 1.0;
/// Slowest and fastest pace. Chosen: half the speed of a run is a quick walk, and beyond one and a half times its own speed a
/// motion needs forces that nobody recorded it with.
const PACE_RANGE: [f64; 2] = [0.5, 1.5];

/// The time of a motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// Where the motion begins, seconds of it.
    begins: f64,
    /// Its pace there, minus 1.
    entering: f64,
    /// What is added to the pace since it was last asked to slow down.
    ramp: Ramp,
}

/// What is added to the pace from the moment `since` on (seconds since the motion began): it changes evenly from one value to
/// another within [`RAMP_S`].
#[derive(Clone, Copy, Debug, Default)]
struct Ramp {
    since: f64,
    from: f64,
    to: f64,
    /// Seconds of the motion that earlier ramps had added by then.
    gained: f64,
}

impl Ramp {
    fn at(&self, passed: f64) -> f64 {
        let share = ((passed - self.since) / RAMP_S).clamp(0.0, 1.0);
        self.from + (self.to - self.from) * share
    }

    /// The integral of [`Ramp::at`]: a parabola within the ramp, a straight line after it.
    fn gained(&self, passed: f64) -> f64 {
        let share = ((passed - self.since) / RAMP_S).max(0.0);
        let within = share.min(1.0);
        let turning = self.from * within + (self.to - self.from) * within * within / 2.0;
        self.gained + RAMP_S * (turning + self.to * (share - within))
    }
}

impl Clock {
    /// The clock of a motion that begins at its time `begins`, seconds, at this `pace` or the nearest one allowed.
    pub fn new(begins: f64, pace: f64) -> Self {
        Clock {
            begins,
            entering: pace.clamp(PACE_RANGE[0], PACE_RANGE[1]) - 1.0,
            ramp: Ramp::default(),
        }
    }

    /// Time in the motion when so many seconds have `passed` since it began. With p the pace at which it begins and τ the share of [`EASE_IN_S`]
    /// that has passed, it runs at 1 + (p − 1) (1 − τ)², and so has gained (p − 1) E/3 (1 − (1 − τ)³).
    pub fn time(&self, passed: f64) -> f64 {
        let entered = self.entering * EASE_IN_S / 3.0 * (1.0 - left(passed).powi(3));
        self.begins + passed + entered + self.ramp.gained(passed)
    }

    /// The pace when so many seconds have `passed`.
    pub fn pace(&self, passed: f64) -> f64 {
        1.0 + self.entering * left(passed).powi(2) + self.ramp.at(passed)
    }

    /// From so many seconds `passed` on, slows down to `pace`, or to its own pace if that is slower: a motion needn't hurry to be left.
    pub fn slow(&mut self, passed: f64, pace: f64) {
        self.ramp = Ramp {
            since: passed,
            from: self.ramp.at(passed),
            to: pace.clamp(PACE_RANGE[0], 1.0) - 1.0,
            gained: self.ramp.gained(passed),
        };
    }

    /// How many seconds will pass, after so many have `passed`, until the motion is at `time`.
    pub fn until(&self, time: f64, passed: f64) -> f64 {
        // Time never goes backward, so bisection finds the moment. No pace is below the slowest, which bounds the wait.
        let left = time - self.time(passed);
        let longest = left / PACE_RANGE[0];
        let (mut low, mut high) = (0.0_f64, longest.max(0.0));
        if self.pace(passed) == 1.0 && self.ramp.to == 0.0 {
            return left;
        }
        // Fifty halvings leave less than 1e-9 s of any wait below a million seconds.
        for _ in 0..50 {
            let middle = (low + high) / 2.0;
            match self.time(passed + middle) < time {
                true => low = middle,
                false => high = middle,
            }
        }
        high
    }
}

/// The share of [`EASE_IN_S`] that is left.
pub(super) fn left(passed: f64) -> f64 {
    (1.0 - passed / EASE_IN_S).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However often it is asked to slow down, the pace goes on from where it is, and time is its integral.
    #[test]
    fn time_is_the_integral_of_the_pace() {
        let mut clock = Clock::new(0.3, 0.6);
        let (mut time, step) = (0.3, 1e-4);
        let mut before = clock.pace(0.0);
        assert!((before - 0.6).abs() < 1e-9);
        for i in 0..30_000 {
            let passed = f64::from(i) * step;
            for (told, pace) in [(4_000, 0.5), (7_000, 0.8), (12_000, 2.0)] {
                if i == told {
                    clock.slow(passed, pace);
                }
            }
            let pace = clock.pace(passed);
            assert!((pace - before).abs() < 1e-3, "{pace} after {before}");
            assert!((0.3..=1.0).contains(&pace));
            before = pace;
            assert!((clock.time(passed) - time).abs() < 1e-4, "at {passed}");
            time += step * clock.pace(passed + step / 2.0);
        }
        assert_eq!(clock.pace(3.0), 1.0);
    }

    #[test]
    fn until_finds_when_a_time_is_reached() {
        for (pace, passed) in [(0.5, 0.0), (1.5, 0.0), (0.7, 0.4), (1.0, 0.2)] {
            let mut clock = Clock::new(0.3, pace);
            for slowed in [false, true] {
                let wait = clock.until(2.0, passed);
                let reached = clock.time(passed + wait);
                assert!((reached - 2.0).abs() < 1e-9, "{reached}");
                assert!(slowed || pace >= 1.0 || wait > 2.0 - clock.time(passed));
                clock.slow(passed, 0.5);
            }
        }
    }
}
