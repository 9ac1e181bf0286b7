//! Where episodes of training start: some anywhere in the motions (reference state initialisation, Peng et al. 2018,
//! "DeepMimic", section 6), some where they fail within the next second.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;

/// A motion is cut into this many bins, or into more so that none is longer than [`LONGEST_BIN`]. Chosen, as are the numbers
/// below; `docs/notebook/adaptive-starts.md` has what they gain together.
const BINS: f64 = 10.0;
/// Longest bin, seconds.
const LONGEST_BIN: f64 = 1.0;
/// A start counts as the cause of failures within this many seconds.
const AHEAD: f64 = 1.0;
/// Time constant with which counts fade, samples, so that failures that were overcome are forgotten.
const MEMORY: f64 = 1e5;
/// Seconds of average failure that each bin is taken to have been seen for beforehand, so that chance doesn't decide about a bin
/// that is hardly ever visited.
const PRIOR: f64 = 10.0;

/// What [`StartDistribution`] needs to know of a motion. A task without motions has one span, of no length.
#[derive(Clone, Debug)]
pub struct Span {
    /// Seconds of a cycle.
    pub duration: f64,
    /// Latest start, seconds.
    pub last_start: f64,
    /// Whether it goes on with its first frame after its last.
    pub wraps: bool,
    /// Parts of it from which the ground can't give what is asked, seconds, in order.
    pub beyond_reach: Vec<[f64; 2]>,
}

impl Span {
    /// The share of a part of it, seconds, that is within reach.
    fn within_reach(&self, from: f64, length: f64) -> f64 {
        let beyond = |[begin, end]: &[f64; 2]| (end.min(from + length) - begin.max(from)).max(0.0);
        let beyond: f64 = self.beyond_reach.iter().map(beyond).sum();
        (1.0 - beyond / length).max(0.0)
    }
}

/// A moment of one of a task's motions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Number of the motion.
    pub motion: usize,
    /// Seconds from its first frame.
    pub time: f64,
}

/// Part of a motion.
#[derive(Clone, Debug)]
struct Bin {
    motion: usize,
    /// Seconds, as are the rest.
    from: f64,
    length: f64,
    /// Share of it that is within reach.
    within_reach: f64,
    /// Bins that a start here goes through within [`AHEAD`], with the time spent in each.
    ahead: Vec<(usize, f64)>,
}

/// What happened in each bin of a [`StartDistribution`].
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Control steps that were taken.
    pub steps: Vec<u32>,
    /// Episodes that failed.
    pub failures: Vec<u32>,
}

impl Tally {
    /// Begins to count anew, in so many bins.
    pub fn clear(&mut self, bins: usize) {
        for counts in [&mut self.steps, &mut self.failures] {
            counts.clear();
            counts.resize(bins, 0);
        }
    }
}

/// Draws where episodes begin. A share of them begins where failure is likely, in proportion to the failures within a
/// second of such a start and to the share of it that is within reach; all others begin in any motion, and anywhere in it. A long
/// motion counts like a short one.
#[derive(Clone, Debug)]
pub struct StartDistribution {
    bins: Vec<Bin>,
    /// Each motion, with the number of its first bin.
    motions: Vec<(Span, usize)>,
    anywhere: bool,
    share: f64,
    control_dt: f64,
    /// Control steps in each bin, fading with [`MEMORY`].
    steps: Vec<f32>,
    /// Failures in each bin, fading alike.
    failures: Vec<f32>,
    /// Likelihoods of each bin and those before it, summed.
    cumulative: Vec<f64>,
}

impl StartDistribution {
    /// Starts in motions of these spans, before anything has failed: at the first frame unless `anywhere`. A `share` of them,
    /// 0 to 1, leads to likely failures. A control step takes `control_dt` seconds.
    pub fn new(spans: &[Span], anywhere: bool, share: f64, control_dt: f64) -> Self {
        let (mut bins, mut motions) = (Vec::new(), Vec::new());
        for (motion, span) in spans.iter().enumerate() {
            motions.push((span.clone(), bins.len()));
            bins.extend(bins_of(motion, span, bins.len(), anywhere));
        }
        let mut starts = StartDistribution {
            steps: vec![0.0; bins.len()],
            failures: vec![0.0; bins.len()],
            cumulative: Vec::new(),
            bins,
            motions,
            anywhere,
            share,
            control_dt,
        };
        starts.update_weights();
        starts
    }

    /// Number of bins that all motions together are cut into.
    pub fn bins(&self) -> usize {
        self.bins.len()
    }

    /// The bin of a moment; later cycles count like the first.
    pub fn bin(&self, moment: Moment) -> usize {
        let (span, first) = &self.motions[moment.motion];
        let end = self.motions.get(moment.motion + 1);
        let count = end.map_or(self.bins.len(), |(_, next)| *next) - first;
        let within = if span.wraps {
            moment.time.rem_euclid(span.duration)
        } else {
            moment.time
        };
        let at = (within / self.bins[*first].length) as usize;
        first + at.min(count - 1)
    }

    /// Draws where an episode starts: two numbers of `rng`, or one where all start at first frames.
    pub fn draw(&self, rng: &mut ChaCha8Rng) -> Moment {
        let total = self.cumulative[self.bins.len() - 1];
        let at = uniform(rng) * total;
        let index = self.cumulative.partition_point(|&sum| sum <= at);
        let index = index.min(self.bins.len() - 1);
        let Bin {
            motion,
            from,
            length,
            ..
        } = self.bins[index];
        let time = if self.anywhere {
            (from + uniform(rng) * length).min(self.motions[motion].0.last_start)
        } else {
            0.0
        };
        Moment { motion, time }
    }

    /// Takes in the tallies of an iteration.
    pub fn update<'a>(&mut self, tallies: impl Iterator<Item = &'a Tally>) {
        let (mut steps, mut failures) = (vec![0_u32; self.bins()], vec![0_u32; self.bins()]);
        for tally in tallies {
            for (sums, counts) in [(&mut steps, &tally.steps), (&mut failures, &tally.failures)] {
                sums.iter_mut().zip(counts).for_each(|(sum, c)| *sum += c);
            }
        }
        let samples: u32 = steps.iter().sum();
        let kept = (MEMORY / (MEMORY + f64::from(samples))) as f32;
        for (sums, counts) in [(&mut self.steps, steps), (&mut self.failures, failures)] {
            let fade = |(sum, count): (&mut f32, u32)| *sum = kept * *sum + count as f32;
            sums.iter_mut().zip(counts).for_each(fade);
        }
        self.update_weights();
    }

    /// Steps, then failures, of each bin.
    pub fn state(&self) -> Vec<f32> {
        [&self.steps[..], &self.failures].concat()
    }

    /// Goes on from the [`StartDistribution::state`] of the same motions.
    ///
    /// # Panics
    /// If the state has another number of bins.
    pub fn restore(&mut self, state: &[f32]) {
        let (steps, failures) = state.split_at(self.bins());
        self.steps.copy_from_slice(steps);
        self.failures.copy_from_slice(failures);
        self.update_weights();
    }

    /// Failures per second in each bin: counts and the prior's [`PRIOR`] seconds at the mean rate of all bins.
    fn hazards(&self) -> Vec<f64> {
        let sum = |values: &[f32]| values.iter().map(|&v| f64::from(v)).sum::<f64>();
        let seconds = sum(&self.steps) * self.control_dt;
        let mean = sum(&self.failures) / (seconds + PRIOR);
        let hazard = |(steps, failures): (&f32, &f32)| {
            let seconds = f64::from(*steps) * self.control_dt;
            (f64::from(*failures) + PRIOR * mean) / (seconds + PRIOR)
        };
        self.steps.iter().zip(&self.failures).map(hazard).collect()
    }

    /// Computes how likely each bin is as a start: (1 − share) × evenly over motions and their time, and share × evenly weighted
    /// by the failures that are expected ahead.
    fn update_weights(&mut self) {
        let hazards = self.hazards();
        let expected = |bin: &Bin| -> f64 {
            let ahead = bin.ahead.iter();
            ahead.map(|&(j, seconds)| hazards[j] * seconds).sum()
        };
        // A long motion has many bins, so each of them counts for less: motions are drawn equally often.
        let even = |bin: &Bin| {
            let reach = start_range(&self.motions[bin.motion].0);
            bin.length / (reach * self.motions.len() as f64)
        };
        // More practice can't mend failures from starts beyond reach.
        let likely = |bin: &Bin| even(bin) * expected(bin) * bin.within_reach;
        let likely: Vec<f64> = self.bins.iter().map(likely).collect();
        let all: f64 = likely.iter().sum();
        // Nothing within reach has failed yet: all starts are even.
        let share = if all > 0.0 { self.share } else { 0.0 };
        let mut sum = 0.0;
        self.cumulative.clear();
        for (bin, likely) in self.bins.iter().zip(likely) {
            sum += (1.0 - share) * even(bin) + share * likely / all.max(f64::MIN_POSITIVE);
            self.cumulative.push(sum);
        }
    }
}

/// Uniform in [0, 1), from the upper 53 bits: as many as an `f64` can tell apart.
pub(super) fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Seconds of a motion in which episodes begin.
fn start_range(span: &Span) -> f64 {
    span.last_start.max(f64::MIN_POSITIVE)
}

/// The bins of a motion, the first of which has number `first`.
fn bins_of(motion: usize, span: &Span, first: usize, anywhere: bool) -> Vec<Bin> {
    let count = match anywhere {
        true => (start_range(span) / LONGEST_BIN).ceil().max(BINS) as usize,
        false => 1,
    };
    let length = start_range(span) / count as f64;
    let bin = |i: usize| Bin {
        motion,
        from: i as f64 * length,
        length,
        within_reach: match anywhere {
            true => span.within_reach(i as f64 * length, length),
            false => 1.0,
        },
        ahead: ahead(i, count, length, anywhere, span.wraps)
            .into_iter()
            .map(|(j, seconds)| (first + j, seconds))
            .collect(),
    };
    (0..count).map(bin).collect()
}

/// The bins that an episode passes within [`AHEAD`] seconds, and how many seconds it spends in each: from the middle of bin `i`
/// on, or from its start where not `middle`.
fn ahead(i: usize, count: usize, length: f64, middle: bool, wraps: bool) -> Vec<(usize, f64)> {
    let mut seconds = vec![0.0; count];
    let (mut left, mut here) = (AHEAD, if middle { length / 2.0 } else { length });
    for j in i.. {
        if left <= 0.0 || (j >= count && !wraps) {
            break;
        }
        let spent = here.min(left);
        seconds[j % count] += spent;
        left -= spent;
        here = length;
    }
    let passed = seconds.into_iter().enumerate();
    passed.filter(|(_, seconds)| *seconds > 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::rand_core::SeedableRng;

    const DT: f64 = 1.0 / 30.0;

    fn span(duration: f64, wraps: bool) -> Span {
        Span {
            duration,
            last_start: duration,
            wraps,
            beyond_reach: Vec::new(),
        }
    }

    fn draws(starts: &StartDistribution, count: usize) -> Vec<Moment> {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        (0..count).map(|_| starts.draw(&mut rng)).collect()
    }

    fn share(moments: &[Moment], inside: impl Fn(&Moment) -> bool) -> f64 {
        moments.iter().filter(|p| inside(p)).count() as f64 / moments.len() as f64
    }

    /// All bins seen for a minute, and `failures` in the bin of `moment`.
    fn failing(starts: &mut StartDistribution, moment: Moment, failures: u32) {
        let mut tally = Tally::default();
        tally.clear(starts.bins());
        tally.steps.fill(1800);
        tally.failures[starts.bin(moment)] = failures;
        starts.update(std::iter::once(&tally));
    }

    #[test]
    fn without_failures_starts_are_even() {
        let starts = StartDistribution::new(&[span(2.0, true), span(6.0, false)], true, 0.5, DT);
        let moments = draws(&starts, 20_000);
        assert!((share(&moments, |p| p.motion == 0) - 0.5).abs() < 0.02);
        let early = |p: &Moment| p.motion == 1 && p.time < 1.5;
        assert!((share(&moments, early) - 0.125).abs() < 0.01);
        assert!(moments.iter().all(|p| p.time <= 6.0));
    }

    /// Failures beyond reach lead to no more starts; even ones remain.
    #[test]
    fn what_is_beyond_reach_is_no_goal() {
        let spans = [Span {
            beyond_reach: vec![[5.0, 7.0]],
            ..span(10.0, false)
        }];
        let mut starts = StartDistribution::new(&spans, true, 0.5, DT);
        let moment = Moment {
            motion: 0,
            time: 6.5,
        };
        failing(&mut starts, moment, 1000);
        let near = share(&draws(&starts, 20_000), |p| (5.0..7.0).contains(&p.time));
        assert!((near - 0.5 * 0.2).abs() < 0.01, "{near}");
    }

    #[test]
    fn half_of_the_starts_lead_to_the_failures() {
        let mut starts = StartDistribution::new(&[span(10.0, false)], true, 0.5, DT);
        let moment = Moment {
            motion: 0,
            time: 6.5,
        };
        failing(&mut starts, moment, 1000);
        let moments = draws(&starts, 20_000);
        // The bin from 6 to 7 s and the one before it are a fifth of the motion, and lead to all but the prior's failures.
        let near = share(&moments, |p| (5.0..7.0).contains(&p.time));
        assert!(near > 0.1 + 0.5 * 0.8, "{near}");
        let far = share(&moments, |p| p.time < 5.0 || p.time >= 7.0);
        assert!(far > 0.5 * 0.8, "{far}");
    }

    #[test]
    fn what_leads_over_the_seam_counts() {
        let mut starts = StartDistribution::new(&[span(20.0, true)], true, 1.0, DT);
        let moment = Moment {
            motion: 0,
            time: 40.3,
        };
        assert_eq!(starts.bin(moment), 0);
        failing(&mut starts, moment, 1000);
        let moments = draws(&starts, 10_000);
        assert!(share(&moments, |p| p.time >= 19.0) > 0.2);
    }

    #[test]
    fn the_motion_that_fails_is_drawn_oftener() {
        let spans = [span(30.0, true), span(1.0, false)];
        let moment = Moment {
            motion: 1,
            time: 0.4,
        };
        for anywhere in [false, true] {
            let mut starts = StartDistribution::new(&spans, anywhere, 0.5, DT);
            failing(&mut starts, moment, 1000);
            let moments = draws(&starts, 10_000);
            assert!(share(&moments, |p| p.motion == 1) > 0.65);
            assert!(anywhere || moments.iter().all(|p| p.time == 0.0));
        }
    }

    #[test]
    fn a_state_comes_back() {
        let mut starts = StartDistribution::new(&[span(3.0, true)], true, 0.5, DT);
        let fresh = starts.clone();
        let moment = Moment {
            motion: 0,
            time: 1.0,
        };
        failing(&mut starts, moment, 5);
        let mut back = fresh;
        back.restore(&starts.state());
        assert_eq!(draws(&back, 100), draws(&starts, 100));
    }
}
