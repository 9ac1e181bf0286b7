//! When a training session has to end, by the clock.

use std::time::{Duration, Instant};

/// A session's time. It should end between rounds, where it can go on; a round that doesn't fit is cut between iterations.
pub struct Clock {
    begun: Instant,
    /// How long the command may take in all.
    limit: Option<Duration>,
    round: Lap,
    iteration: Lap,
}

/// How long something takes that is done again and again.
struct Lap {
    begun: Instant,
    took: Duration,
}

impl Lap {
    fn new() -> Self {
        Self {
            begun: Instant::now(),
            took: Duration::ZERO,
        }
    }

    fn end(&mut self) {
        let now = Instant::now();
        self.took = now - self.begun;
        self.begun = now;
    }
}

impl Clock {
    /// For a command that began at `begun` and may take until `limit`.
    pub fn new(begun: Instant, limit: Option<Duration>) -> Self {
        Self {
            begun,
            limit,
            round: Lap::new(),
            iteration: Lap::new(),
        }
    }

    /// Ends an iteration. Returns whether there is no time for another one and then for the `ending` of the session.
    pub fn end_iteration(&mut self, ending: Duration) -> bool {
        self.iteration.end();
        self.is_over_after(self.iteration.took, ending)
    }

    /// The same for a round, of which the iteration has been ended.
    pub fn end_round(&mut self, ending: Duration) -> bool {
        self.round.end();
        self.is_over_after(self.round.took, ending)
    }

    /// Time to the limit, if there is one.
    pub fn left(&self) -> Option<Duration> {
        Some(self.limit?.saturating_sub(self.begun.elapsed()))
    }

    /// Share of the time that is over, from 0 to 1; 0 without a limit.
    pub fn share(&self) -> f64 {
        let limit = self
            .limit
            .map_or(f64::INFINITY, |limit| limit.as_secs_f64());
        (self.begun.elapsed().as_secs_f64() / limit).min(1.0)
    }

    /// The next iteration or round is taken to last as long as the one before. Of the time, at most a quarter is kept for the
    /// ending: how long it takes is a guess, and something should be learned.
    fn is_over_after(&self, next: Duration, ending: Duration) -> bool {
        let Some(limit) = self.limit else {
            return false;
        };
        let ending = ending.min(limit / 4);
        self.begun.elapsed() + next + ending > limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    /// A clock of a command that began ten seconds ago, its round five and its iteration one.
    fn clock(limit: Option<u64>) -> Clock {
        let now = Instant::now();
        let before = |s| {
            now.checked_sub(seconds(s))
                .expect("the system runs for longer")
        };
        let lap = |s| Lap {
            begun: before(s),
            ..Lap::new()
        };
        Clock {
            round: lap(5),
            iteration: lap(1),
            ..Clock::new(before(10), limit.map(seconds))
        }
    }

    #[test]
    fn what_comes_next_and_the_ending_have_to_fit() {
        assert!(!clock(None).end_round(Duration::MAX));
        assert!(!clock(None).end_iteration(Duration::MAX));
        for (limit, ending, [iteration, round]) in [
            (11, 0, [true, true]),
            (12, 0, [false, true]),
            (12, 1000, [true, true]),
            (16, 0, [false, false]),
            (16, 2, [false, true]),
            (19, 3, [false, false]),
            (40, 1000, [false, false]),
            (16, 1000, [false, true]),
        ] {
            let mut clock = clock(Some(limit));
            assert_eq!(clock.end_iteration(seconds(ending)), iteration, "{limit}");
            assert_eq!(clock.end_round(seconds(ending)), round, "{limit}");
        }
    }

    #[test]
    fn the_time_left_ends_with_the_limit() {
        assert_eq!(clock(Some(5)).left(), Some(Duration::ZERO));
        let left = clock(Some(60)).left();
        assert!(left.is_some_and(|left| (49..=50).contains(&left.as_secs())));
        assert_eq!(clock(None).left(), None);
        assert_eq!((clock(Some(5)).share(), clock(None).share()), (1.0, 0.0));
        let half = clock(Some(20)).share();
        assert!((0.5..0.6).contains(&half), "{half}");
    }
}
