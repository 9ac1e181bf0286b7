//! What happens around a part that was cut out of a longer take.

use super::{Clip, LoopMode};
use nalgebra::Isometry3;
use std::borrow::Cow;
use std::ops::Range;

/// Seconds that are kept before and after a part. Chosen: a stance of walking lasts about 0.6 s, so that only someone who
/// stands still stands longer.
const MOST: f64 = 2.0;
/// A step between frames faster than this is a cut, not motion: root mean square over the joints, in figure sizes (the largest
/// distance of a joint from the first, about a metre in an adult) per second. Chosen: only a
/// sprint is as fast.
const CUT: f64 = 8.0;

/// Frames around those of a clip, at the clip's rate. They aren't part of the motion, but show what its ends belong to: a foot
/// on the ground in the first frame stays where it came down before. So a part of a take becomes the same motion as that
/// part of the whole take.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Margin {
    /// Frames that lead to the first, in order of time: local transforms, as in [`Clip::frames`].
    pub before: Vec<Vec<Isometry3<f64>>>,
    /// Frames that go on from the last.
    pub after: Vec<Vec<Isometry3<f64>>>,
}

impl Margin {
    /// How many frames are kept as a margin of `duration` seconds. A millionth of a frame makes up for rounding.
    pub(crate) fn frames(duration: f64, fps: f64) -> usize {
        (duration.clamp(0.0, MOST) * fps + 1e-6) as usize
    }

    /// All transforms, to be changed.
    pub(crate) fn transforms_mut(&mut self) -> impl Iterator<Item = &mut Isometry3<f64>> {
        self.before.iter_mut().chain(&mut self.after).flatten()
    }
}

impl Clip {
    /// The clip with its margins as frames, and which frames are its own. A margin ends at a cut in it. A clip that loops goes
    /// on with itself, so that what was around it doesn't matter.
    pub(crate) fn with_margins(&self) -> (Cow<'_, Clip>, Range<usize>) {
        let own = self.frames.len();
        let (Some(first), Some(last)) = (self.frames.first(), self.frames.last()) else {
            return (Cow::Borrowed(self), 0..0);
        };
        let before = self.joined(first, self.margin.before.iter().rev());
        let after = self.joined(last, self.margin.after.iter());
        if self.loop_mode == LoopMode::Wrap || before + after == 0 {
            return (Cow::Borrowed(self), 0..own);
        }
        let before_from = self.margin.before.len() - before;
        let frames = [
            &self.margin.before[before_from..],
            &self.frames,
            &self.margin.after[..after],
        ];
        let clip = self.with_frames(frames.concat(), self.fps, self.loop_mode);
        (Cow::Owned(clip), before..before + own)
    }

    /// How many frames of `margin` continue `end`, and each other, without a cut.
    fn joined<'a>(
        &'a self,
        end: &'a [Isometry3<f64>],
        margin: impl Iterator<Item = &'a Vec<Isometry3<f64>>>,
    ) -> usize {
        let mut here = self.world_from(end);
        let from_first = |at: &Isometry3<f64>| {
            let first = here[0].translation.vector;
            (at.translation.vector - first).norm()
        };
        // The figure's size in the pose at the end.
        let size = here.iter().map(from_first).fold(0.0, f64::max);
        let goes_on = |frame: &&Vec<Isometry3<f64>>| {
            if frame.len() != self.joints.len() {
                return false;
            }
            let next = self.world_from(frame);
            let step = |(a, b): (&Isometry3<f64>, &Isometry3<f64>)| {
                (a.translation.vector - b.translation.vector).norm_squared()
            };
            let sum: f64 = here.iter().zip(&next).map(step).sum();
            // Root mean square speed of all joints from one frame to the next.
            let speed = (sum / next.len().max(1) as f64).sqrt() * self.fps;
            here = next;
            speed < CUT * size
        };
        margin.take_while(goes_on).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::{Joint, Source};

    /// A figure that moves along X at 1 m/s, 30 frames a second.
    fn walk(frames: usize) -> Clip {
        let source = Source {
            file: String::new(),
            sha256: String::new(),
            format: "bvh".to_owned(),
            take: String::new(),
            fps: 30.0,
            up_axis: "+Z".to_owned(),
            unit_m: 1.0,
        };
        let joint = |name: &str, parent| Joint {
            name: name.to_owned(),
            parent,
            bone: None,
            rest: Isometry3::identity(),
        };
        Clip {
            name: "walk".to_owned(),
            fps: 30.0,
            loop_mode: LoopMode::Clamp,
            joints: vec![joint("hips", None), joint("head", Some(0))],
            frames: (0..frames).map(|f| at(f as f64 / 30.0)).collect(),
            margin: Margin::default(),
            source,
            problems: Vec::new(),
        }
    }

    fn at(x: f64) -> Vec<Isometry3<f64>> {
        let head = Isometry3::translation(0.0, 0.0, 1.0);
        vec![Isometry3::translation(x, 0.0, 0.0), head]
    }

    #[test]
    fn a_part_of_a_clip_knows_what_was_around_it() {
        let whole = walk(301);
        let part = whole.trim(1.0, 2.0).expect("a part");
        assert_eq!(part.frames, whole.frames[30..=60]);
        assert_eq!(part.margin.before, whole.frames[..30]);
        assert_eq!(part.margin.after, whole.frames[61..=120]);
        let (clip, own) = part.with_margins();
        assert_eq!(
            (clip.frames.as_slice(), own),
            (&whole.frames[..=120], 30..61)
        );
        // A part of a part knows as much, and the whole of a part no less.
        let again = part.trim(0.5, 1.0).expect("a part");
        assert_eq!(again.margin.before, whole.frames[..45]);
        assert_eq!(again.margin.after, whole.frames[61..=120]);
        assert_eq!(part.trim(0.0, 1.0).expect("all of it"), part);
    }

    #[test]
    fn a_margin_ends_where_it_was_cut() {
        let mut part = walk(301).trim(1.0, 2.0).expect("a part");
        part.margin.before[20] = at(-3.0);
        part.margin.after[5] = at(9.0);
        let (clip, own) = part.with_margins();
        assert_eq!((clip.frames.len(), own), (9 + 31 + 5, 9..40));
    }

    #[test]
    fn what_loops_needs_no_margin() {
        let mut part = walk(301).trim(1.0, 2.0).expect("a part");
        part.loop_mode = LoopMode::Wrap;
        assert_eq!(part.with_margins().1, 0..31);
    }
}
