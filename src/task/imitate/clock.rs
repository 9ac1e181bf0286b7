//! How time goes in a motion: at its own pace, but where it is led into or about to be left.

/// Seconds in which the pace at which a motion begins becomes its own.
pub(super) const EASES: f64 = 1.0;
/// Seconds in which a motion that is to be left comes to another pace.
const TURNS: f64 = 1.0;
/// Slowest and fastest pace, of a motion's own: half a run is a quick walk, and more than half as fast again asks for
/// forces that it was never seen with.
const PACES: [f64; 2] = [0.5, 1.5];

/// The time of a motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// Where the motion begins, seconds of it.
    begins: f64,
    /// What its pace is more than its own there.
    entering: f64,
    ramp: Ramp,
}

/// What the pace is more than a motion's own, from `since` on, seconds passed: evenly from one to another.
#[derive(Clone, Copy, Debug, Default)]
struct Ramp {
    since: f64,
    from: f64,
    to: f64,
    /// Seconds that were gained before.
    gained: f64,
}

impl Ramp {
    fn at(&self, passed: f64) -> f64 {
        let share = ((passed - self.since) / TURNS).clamp(0.0, 1.0);
        self.from + (self.to - self.from) * share
    }

    /// The integral of [`Ramp::at`].
    fn gained(&self, passed: f64) -> f64 {
        let share = ((passed - self.since) / TURNS).max(0.0);
        let within = share.min(1.0);
        let turning = self.from * within + (self.to - self.from) * within * within / 2.0;
        self.gained + TURNS * (turning + self.to * (share - within))
    }
}

impl Clock {
    /// Of a motion that begins at `begins` seconds of it at a `pace` of its own, or as near to that as is allowed.
    pub fn new(begins: f64, pace: f64) -> Self {
        Clock {
            begins,
            entering: pace.clamp(PACES[0], PACES[1]) - 1.0,
            ramp: Ramp::default(),
        }
    }

    /// Seconds of the motion when so many have `passed`. With p the pace at which it begins and τ the share of [`EASES`]
    /// that has passed, it runs at 1 + (p − 1) (1 − τ)², and so has gained (p − 1) E/3 (1 − (1 − τ)³).
    pub fn time(&self, passed: f64) -> f64 {
        let entered = self.entering * EASES / 3.0 * (1.0 - left(passed).powi(3));
        self.begins + passed + entered + self.ramp.gained(passed)
    }

    /// Seconds of the motion in a second, when so many have `passed`.
    pub fn pace(&self, passed: f64) -> f64 {
        1.0 + self.entering * left(passed).powi(2) + self.ramp.at(passed)
    }

    /// From so many seconds `passed` on, comes to `pace` of the motion's own; but it never goes faster for that.
    pub fn slow(&mut self, passed: f64, pace: f64) {
        self.ramp = Ramp {
            since: passed,
            from: self.ramp.at(passed),
            to: pace.clamp(PACES[0], 1.0) - 1.0,
            gained: self.ramp.gained(passed),
        };
    }

    /// How many seconds will pass, after so many have `passed`, until the motion is at `time`.
    pub fn until(&self, time: f64, passed: f64) -> f64 {
        let left = time - self.time(passed);
        let longest = left / PACES[0];
        let (mut low, mut high) = (0.0_f64, longest.max(0.0));
        if self.pace(passed) == 1.0 && self.ramp.to == 0.0 {
            return left;
        }
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

/// The share of [`EASES`] that is left.
pub(super) fn left(passed: f64) -> f64 {
    (1.0 - passed / EASES).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Told twice, and back again, the pace goes on from where it is, and time is its integral.
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
    fn it_is_known_how_long_a_motion_lasts() {
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
