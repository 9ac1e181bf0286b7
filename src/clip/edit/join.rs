//! Several clips of one figure, played one after another.

use super::at_least;
use super::figure::{Figure, moving};
use super::seam::{Seam, Side, near};
use crate::clip::{Clip, Error, Joint, LoopMode, MOST_TRANSFORMS, Problem, length_flaw};
use nalgebra::Isometry3;
use std::collections::BTreeMap;

/// A joint whose rest transform differs by more than this, in metres or radians, is worth a warning. Chosen.
const OTHER_REST: f64 = 0.01;

impl Clip {
    /// The clips one after another, at the rate and with the rest pose of the first. Each begins where the one before it ends:
    /// the last frame of one and the first of the next are the same instant, at the same place on the ground and with the
    /// same heading. The difference of poses and velocities there is spread over `blend` seconds, half before and half
    /// after, so that neither jumps.
    ///
    /// # Errors
    /// An [`Error`] for no clips, for clips whose joints don't have the same names and parents, for more frames than a clip
    /// may have, and for a `blend` below 0.
    pub fn join(clips: &[Clip], blend: f64) -> Result<Clip, Error> {
        let blend = at_least("a blend", blend, 0.0, "seconds from 0 up")?;
        let (first, others) = clips.split_first().ok_or(Error::NoClips)?;
        first.check()?;
        let mut joined = first.clone();
        let mut piece = first.frames.len();
        let mut moves = moving(first);
        for clip in others {
            let next = first.like(clip)?;
            first.check_room(joined.frames.len() + next.frames.len())?;
            let length = next.frames.len();
            for (moves, next) in moves.iter_mut().zip(moving(&next)) {
                *moves |= next;
            }
            let figure = Figure::new(&first.joints, &moves);
            joined.follow(next, &figure, piece, blend);
            piece = length;
            joined.loop_mode = LoopMode::Clamp;
        }
        Ok(joined)
    }

    /// Appends `next` to this clip, whose last piece has `piece` frames: a blend reaches no farther than the middle of either.
    fn follow(&mut self, mut next: Clip, figure: &Figure, piece: usize, blend: f64) {
        // The next clip's first pose goes where this one's last pose is.
        let carry = figure.carry(&next.world(0), &self.world(self.frames.len() - 1));
        let theirs: Vec<(usize, Isometry3<f64>)> = figure.footings(&next).collect();
        let mut coming = std::mem::take(&mut next.frames);
        self.set_on(figure, &theirs, &carry, &mut coming);
        let half = |frames: usize| frames.saturating_sub(1) / 2;
        // Half of the blend on either side, but not beyond the middle of a piece, where another seam's blend may begin.
        let window = (0.5 * blend * self.fps).round() as usize;
        let window = window.min(half(piece)).min(half(coming.len()));
        // Velocities at the seam come from the frames around it, of the last piece and of the next clip alone.
        let near = near(self);
        let end = Side {
            poses: &self.frames[self.frames.len() - piece.min(near + 1)..],
            at: piece.min(near + 1) - 1,
        };
        let start = Side {
            poses: &coming[..coming.len().min(near + 1)],
            at: 0,
        };
        let seam = Seam::between(end, start);
        seam.bend_end(&mut self.frames, window);
        seam.bend_start(&mut coming, window);
        // Both poses at the seam are one instant now.
        self.frames.extend(coming.into_iter().skip(1));
        self.add_problems(next.problems);
    }

    /// Moves `poses` of another clip, with the footings `theirs`, over the ground and onto this clip's own footings: what stands
    /// still above the carriers may be elsewhere in the other clip.
    fn set_on(
        &self,
        figure: &Figure,
        theirs: &[(usize, Isometry3<f64>)],
        carry: &Isometry3<f64>,
        poses: &mut [Vec<Isometry3<f64>>],
    ) {
        let parent = |joint: &usize| self.joints[*joint].parent;
        for ((joint, ours), (_, theirs)) in figure.footings(self).zip(theirs) {
            // From the other clip's footing, moved over the ground, into this clip's.
            let local = ours.inverse() * carry * theirs;
            let above: Vec<usize> = std::iter::successors(parent(&joint), parent).collect();
            for pose in poses.iter_mut() {
                pose[joint] = local * pose[joint];
                above.iter().for_each(|p| pose[*p] = self.frames[0][*p]);
            }
        }
    }

    fn check_room(&self, frames: usize) -> Result<(), Error> {
        let duration = frames as f64 / self.fps;
        if length_flaw(duration).is_some() {
            return Err(Error::TooSlow { duration });
        }
        if frames.saturating_mul(self.joints.len()) <= MOST_TRANSFORMS {
            return Ok(());
        }
        Err(Error::TooLong {
            duration,
            fps: self.fps,
        })
    }

    /// `other` at this clip's rate, with its joints in this clip's order.
    fn like(&self, other: &Clip) -> Result<Clip, Error> {
        other.check()?;
        let order = order(&self.joints, &other.joints).map_err(|reason| Error::OtherJoints {
            name: other.name.clone(),
            first: self.name.clone(),
            reason,
        })?;
        let same_rate = (other.fps - self.fps).abs() <= 1e-9 * self.fps;
        let resampled = if same_rate {
            None
        } else {
            Some(other.resample(self.fps)?)
        };
        let other = resampled.as_ref().unwrap_or(other);
        let ordered = |frame: &Vec<_>| order.iter().map(|&j| frame[j]).collect();
        let frames = other.frames.iter().map(ordered).collect();
        let mut like = self.with_frames(Vec::new(), self.fps, LoopMode::Clamp);
        like.frames = frames;
        like.problems = other.problems.clone();
        like.problems.extend(other_rest(self, other, &order));
        Ok(like)
    }
}

/// For each joint, the index of its namesake in `theirs`.
fn order(ours: &[Joint], theirs: &[Joint]) -> Result<Vec<usize>, String> {
    let same = |(a, b): (&Joint, &Joint)| a.name == b.name && a.parent == b.parent;
    if ours.len() == theirs.len() && ours.iter().zip(theirs).all(same) {
        return Ok((0..ours.len()).collect());
    }
    let (here, there) = (named(ours)?, named(theirs)?);
    if let Some(extra) = there.keys().find(|name| !here.contains_key(*name)) {
        return Err(format!("it has a joint `{extra}` of its own"));
    }
    let find = |joint: &Joint| match there.get(joint.name.as_str()) {
        Some(&found) if parent(theirs, found) == joint.parent.map(|p| &*ours[p].name) => Ok(found),
        Some(_) => Err(format!("its joint `{}` has another parent", joint.name)),
        None => Err(format!("it has no joint `{}`", joint.name)),
    };
    ours.iter().map(find).collect()
}

fn parent(joints: &[Joint], joint: usize) -> Option<&str> {
    joints[joint].parent.map(|p| &*joints[p].name)
}

fn named(joints: &[Joint]) -> Result<BTreeMap<&str, usize>, String> {
    let mut named = BTreeMap::new();
    for (j, joint) in joints.iter().enumerate() {
        if named.insert(joint.name.as_str(), j).is_some() {
            return Err(format!("several joints are called `{}`", joint.name));
        }
    }
    Ok(named)
}

fn other_rest(ours: &Clip, theirs: &Clip, order: &[usize]) -> Option<Problem> {
    let differs = |(joint, other): &(&Joint, &usize)| {
        let (a, b) = (&joint.rest, &theirs.joints[**other].rest);
        (a.translation.vector - b.translation.vector).norm() > OTHER_REST
            || a.rotation.angle_to(&b.rotation) > OTHER_REST
    };
    let (joint, _) = ours.joints.iter().zip(order).find(differs)?;
    Some(Problem::warning(
        "other-rest",
        format!(
            "joint `{}` rests differently in `{}` and `{}`, so they may be figures of different size: the rest pose of the \
             first was kept",
            joint.name, ours.name, theirs.name
        ),
    ))
}
