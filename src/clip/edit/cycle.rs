//! The best cycle of a long take: a part that comes back to where it starts.
//!
//! A coarse search compares poses at all pairs of evenly spaced frames and keeps, for every length, the best start. The
//! lengths that are better than their neighbours are then refined frame by frame.

use super::at_least;
use super::figure::{Figure, moving};
use super::look::{Look, landmarks};
use super::seam::{Seam, Side, carry_all, near};
use crate::clip::{Clip, Error, LoopMode, Problem};
use nalgebra::Isometry3;

/// Most pairs of frames that the coarse search compares. Chosen as a bound on its time.
const PAIRS: usize = 48_000_000;
/// Most frames that it compares. Chosen as a bound on its memory.
const MOST_LOOKS: usize = 40_000;
/// Longest step between these frames, seconds, where their number allows it. Chosen: poses stay alike for about as long.
const COARSE: f64 = 0.1;
/// About how many poses within a loop are compared with its start to see how far it moves. Chosen.
const BETWEEN: usize = 64;
/// Most lengths that are refined. Chosen.
const CANDIDATES: usize = 32;
/// A shorter cycle is as good as the best if its gap is wider by no more than this fraction of the motion. Chosen: several
/// strides close about as well as one, and one is wanted.
const TIE: f64 = 0.02;
/// Change of pose, relative to the figure's size, below which nothing happens that could repeat. Chosen: 2 mm in a metre.
const STILL: f64 = 0.002;
/// A gap wider than this fraction of the motion is worth a warning. Chosen.
const NOTICEABLE: f64 = 0.25;
/// A cycle that turns less than this goes straight, radians: 1°. Chosen: repeated, a smaller turn still bends the path into a
/// circle, where a straight one is meant.
const STRAIGHT: f64 = 0.0175;
/// Seconds on either side of the seam over which its gap is spread, and the largest fraction of the cycle that this may be.
/// Chosen: about half a step, so that each foot's contact is bent only once.
const SPREAD: f64 = 0.25;
const SHARE: f64 = 0.25;

/// A part of a clip that comes back to where it starts, by frames of the clip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loop {
    /// First frame.
    pub start: usize,
    /// Last frame: the first one of the next cycle.
    pub end: usize,
    /// How much pose and velocity differ between both, as a fraction of how much they change in between.
    pub gap: f64,
}

impl Clip {
    /// The part of the clip, `shortest` seconds or longer, whose end is most like its start in pose and velocity, wherever it
    /// is on the ground and whichever way it faces. Of about equally good parts it is the shortest.
    ///
    /// In clips of up to about a quarter of an hour all lengths are tried. In longer ones only the shorter lengths are, up to
    /// two minutes beyond `shortest` in an hour, so that the work doesn't grow with the square of the clip.
    ///
    /// # Errors
    /// An [`Error`] for a clip that is shorter than that or stands still, and for a `shortest` below 0.
    pub fn find_loop(&self, shortest: f64) -> Result<Loop, Error> {
        self.check()?;
        let shortest = at_least("a shortest cycle", shortest, 0.0, "seconds from 0 up")?;
        let search = Search::new(self);
        let candidates = search.coarse(shortest);
        let fine: Vec<Loop> = candidates
            .iter()
            .filter_map(|candidate| search.refine(candidate, shortest))
            .collect();
        let best = fine
            .iter()
            .map(|found| found.gap)
            .fold(f64::INFINITY, f64::min);
        // Of about equally good cycles the shortest, and of these the first.
        let ties = fine.into_iter().filter(|found| found.gap <= best + TIE);
        ties.min_by_key(|found| (found.end - found.start, found.start))
            .ok_or_else(|| {
                let duration = self.duration();
                if duration < shortest {
                    Error::TooShortForCycle { shortest, duration }
                } else {
                    Error::NoCycle { shortest, duration }
                }
            })
    }

    /// The best loop of at least `shortest` seconds, cut out and closed.
    ///
    /// # Errors
    /// As for [`Clip::find_loop`].
    pub fn cut_loop(&self, shortest: f64) -> Result<Clip, Error> {
        let found = self.find_loop(shortest)?;
        self.closed(&found)
    }

    /// A part of the clip as a loop without a jump in pose or velocity at its seam. What its end and its start differ by, apart
    /// from travel over the ground, is spread over the frames around the seam.
    ///
    /// # Errors
    /// An [`Error`] for a loop that isn't a part of this clip.
    pub fn closed(&self, part: &Loop) -> Result<Clip, Error> {
        self.check()?;
        let (start, end) = (part.start, part.end);
        if start >= end || end >= self.frames.len() {
            let seconds = |frame: usize| frame as f64 / self.fps;
            return Err(Error::EmptyTrim {
                from: seconds(start),
                to: seconds(end),
                duration: self.duration(),
            });
        }
        let figure = Figure::new(&self.joints, &moving(self));
        let carry = figure.carry_straight(&self.world(start), &self.world(end), STRAIGHT);
        let mut frames = self.frames[start..=end].to_vec();
        self.close(&figure, &carry, start, &mut frames);
        let mut clip = self.with_frames(frames, self.fps, LoopMode::Wrap);
        clip.add_problems(gap_problem(part));
        Ok(clip)
    }

    /// Bends both ends of `frames`, which begin at frame `start` of the clip, until the last is the first moved by `carry`.
    fn close(
        &self,
        figure: &Figure,
        carry: &Isometry3<f64>,
        start: usize,
        frames: &mut [Vec<Isometry3<f64>>],
    ) {
        let last = frames.len() - 1;
        // At least one frame is bent, and at most half of the cycle from either end.
        let window = (SPREAD * self.fps).min(SHARE * last as f64).round() as usize;
        let window = window.clamp(1, last.div_ceil(2));
        // Velocities are differences of frames on both sides of each end, where the take has such frames.
        let (next, at) = self.around(start);
        let mut next = next.to_vec();
        carry_all(self, figure, carry, &mut next);
        let (poses, end) = self.around(start + last);
        let seam = Seam::between(Side { poses, at: end }, Side { poses: &next, at });
        // A clip that loops already has the velocities that it should have.
        let loops_already = self.loop_mode == LoopMode::Wrap && frames.len() == self.frames.len();
        // Poses still differ by what the file rounds.
        let seam = if loops_already { seam.of_poses() } else { seam };
        // The beginning is bent where the end leads to, so that both halves of the gap are measured in one place.
        seam.bend_end(frames, window);
        let coming = &mut next[at..];
        seam.bend_start(coming, window);
        carry_all(self, figure, &carry.inverse(), coming);
        for (frame, bent) in frames.iter_mut().zip(coming).take(window) {
            frame.clone_from(bent);
        }
    }

    /// The frames around a frame, and its index among them.
    fn around(&self, frame: usize) -> (&[Vec<Isometry3<f64>>], usize) {
        let away = near(self);
        let from = frame.saturating_sub(away);
        let to = (frame + away).min(self.frames.len() - 1);
        (&self.frames[from..=to], frame - from)
    }
}

fn gap_problem(part: &Loop) -> Option<Problem> {
    (part.gap > NOTICEABLE).then(|| {
        Problem::warning(
            "cycle-gap",
            format!(
                "even the best cycle doesn't close: pose and velocity at its ends differ by {:.0} % of how far they change; \
                 choose a part of the take that repeats",
                100.0 * part.gap
            ),
        )
    })
}

/// A loop between frames of the coarse search, and how far its pose gets from its start, metres.
struct Candidate {
    found: Loop,
    range: f64,
}

struct Search<'a> {
    clip: &'a Clip,
    /// Joints that represent a pose.
    landmarks: Vec<usize>,
    /// Frames of the clip from one look to the next.
    stride: usize,
    looks: Vec<Look>,
    /// Change of pose below which nothing happens, metres.
    still: f64,
}

impl<'a> Search<'a> {
    fn new(clip: &'a Clip) -> Self {
        let figure = Figure::new(&clip.joints, &moving(clip));
        let landmarks = landmarks(clip, &figure);
        let frames = clip.frames.len();
        // n frames make n² / 2 pairs.
        let all_pairs = frames.div_ceil((2 * PAIRS).isqrt());
        let coarse = (COARSE * clip.fps) as usize;
        let stride = all_pairs
            .min(coarse)
            .max(frames.div_ceil(MOST_LOOKS))
            .max(1);
        let look = |f| Look::new(clip, &landmarks, f);
        let looks: Vec<Look> = (0..frames).step_by(stride).map(look).collect();
        let still = STILL * size(clip, &landmarks);
        Self {
            clip,
            stride,
            looks,
            still,
            landmarks,
        }
    }

    /// The best start for every length, of those lengths that are better than their neighbours.
    fn coarse(&self, shortest: f64) -> Vec<Candidate> {
        let step = self.stride as f64 / self.clip.fps;
        let most = self.looks.len().saturating_sub(1);
        let least = ((shortest / step - 1e-6) as usize).clamp(1, most.max(1));
        // Only as many lengths as the limit on pairs allows.
        let longest = (least + PAIRS / self.looks.len().max(1)).min(most);
        let mut best: Vec<Option<Candidate>> = (0..=longest).map(|_| None).collect();
        for start in 0..self.looks.len() {
            self.try_start(start, least, &mut best);
        }
        let gap = |length: usize| {
            let found = best.get(length).and_then(Option::as_ref);
            found.map_or(f64::INFINITY, |candidate| candidate.found.gap)
        };
        // A length that is worse than its neighbours lies on the slope of a better one.
        let dips = |length: &usize| {
            gap(*length) <= gap(length.wrapping_sub(1)) && gap(*length) <= gap(length + 1)
        };
        let dips: Vec<usize> = (0..=longest).filter(dips).collect();
        let mut candidates: Vec<Candidate> = dips
            .into_iter()
            .filter_map(|length| best[length].take())
            .collect();
        candidates.sort_by(|a, b| a.found.gap.total_cmp(&b.found.gap));
        candidates.truncate(CANDIDATES);
        candidates
    }

    /// Updates the best loop of each length with those that start at look `start`. The range of the motion grows along the way:
    /// poses before `least` count for it, too.
    fn try_start(&self, start: usize, least: usize, best: &mut [Option<Candidate>]) {
        let mut range = 0.0_f64;
        // Shorter lengths than wanted only count for the range of the motion, so a sample of them is enough.
        let between = (1..least).step_by((least / BETWEEN).max(1));
        for length in between.chain(least..best.len()) {
            let Some(look) = self.looks.get(start + length) else {
                break;
            };
            let best = &mut best[length];
            let distance = self.looks[start].distance(look);
            range = range.max(distance);
            // Relative to the motion: a small gap in a small motion is no cycle.
            let gap = distance / range;
            let better = best.as_ref().is_none_or(|best| gap < best.found.gap);
            if length >= least && range > self.still && better {
                let found = Loop {
                    start: start * self.stride,
                    end: (start + length) * self.stride,
                    gap,
                };
                *best = Some(Candidate { found, range });
            }
        }
    }

    /// The best loop of at least `shortest` seconds among the frames that the coarse search left out around a candidate.
    fn refine(&self, candidate: &Candidate, shortest: f64) -> Option<Loop> {
        let last = self.clip.frames.len() - 1;
        let least = ((shortest * self.clip.fps - 1e-6).ceil() as usize).max(1);
        let around = |frame: usize| {
            let from = frame.saturating_sub(self.stride);
            let frames = from..=(frame + self.stride).min(last);
            frames
                .map(|f| (f, Look::new(self.clip, &self.landmarks, f)))
                .collect()
        };
        let starts: Vec<(usize, Look)> = around(candidate.found.start);
        let ends: Vec<(usize, Look)> = around(candidate.found.end);
        let mut best: Option<Loop> = None;
        for (start, from) in &starts {
            for (end, to) in ends
                .iter()
                .filter(|(end, _)| end.saturating_sub(*start) >= least)
            {
                let gap = from.distance(to) / candidate.range;
                if best.is_none_or(|best| gap < best.gap) {
                    let (start, end) = (*start, *end);
                    best = Some(Loop { start, end, gap });
                }
            }
        }
        best
    }
}

/// Greatest distance of a landmark from the first, metres.
fn size(clip: &Clip, landmarks: &[usize]) -> f64 {
    let world = clip.world(0);
    let place = |j: usize| world[j].translation.vector;
    let centre = landmarks.first().map(|&j| place(j));
    let away = |&j: &usize| centre.map_or(0.0, |centre| (place(j) - centre).norm());
    landmarks.iter().map(away).fold(0.0, f64::max)
}
