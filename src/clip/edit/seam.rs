//! Seams: two poses that are to become one, and the frames around them, which are bent until they do.
//!
//! The gap between both poses, and between their velocities, is halved. The end moves forward by one half and the start back
//! by the other, fading out over a window with cubic Hermite weights, so that pose and velocity run on.

use super::figure::Figure;
use crate::clip::Clip;
use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};

type Pose = Vec<Isometry3<f64>>;

/// Seconds on either side of a seam that show how much velocity usually changes there. Chosen: about one stride.
const NEAR: f64 = 1.0;
/// Velocity may change at a seam by this many times the largest change from frame to frame around it, because a foot that
/// lands stops at once. Only what exceeds that is smoothed. Chosen.
const USUAL: f64 = 1.5;

/// How many frames of `clip` on either side of a seam are examined.
pub(super) fn near(clip: &Clip) -> usize {
    ((NEAR * clip.fps).ceil() as usize).max(2)
}

/// A joint's shift in its parent's axes, metres, and its turn in its own axes, a rotation vector in radians.
type Step = Vector6<f64>;

/// What is missing from one joint's end to its start.
struct Gap {
    /// From its pose to the start's.
    pose: Step,
    /// From its velocity to the start's, per frame.
    rate: Step,
}

/// Moves poses of `clip` over the ground, by changing its carriers only.
pub(super) fn carry_all(clip: &Clip, figure: &Figure, carry: &Isometry3<f64>, poses: &mut [Pose]) {
    for (joint, footing) in figure.footings(clip) {
        let local = footing.inverse() * carry * footing;
        for pose in poses.iter_mut() {
            pose[joint] = local * pose[joint];
        }
    }
}

/// The step from one transform to another.
fn step(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Step {
    let shift = to.translation.vector - from.translation.vector;
    let turn = (from.rotation.inverse() * to.rotation).scaled_axis();
    Step::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Velocity of joint `j` at pose `at`, per frame, by differences of second order: central where there are poses on both
/// sides, else one-sided over two poses, else over the one there is.
fn rate(poses: &[Pose], at: usize, j: usize) -> Step {
    let to = |f: usize| step(&poses[at][j], &poses[f][j]);
    let ahead = poses.len() - 1 - at;
    match (at, ahead) {
        (0, 0) => Step::zeros(),
        (0, 1) => to(1),
        (1, 0) => -to(0),
        (0, _) => (4.0 * to(1) - to(2)) / 2.0,
        (_, 0) => (to(at - 2) - 4.0 * to(at - 1)) / 2.0,
        _ => (to(at + 1) - to(at - 1)) / 2.0,
    }
}

/// Largest change of velocity of joint `j` from frame to frame: of its shift, and of its turn.
fn bends(poses: &[Pose], j: usize) -> (f64, f64) {
    let bend = |w: &[Pose]| step(&w[1][j], &w[2][j]) - step(&w[0][j], &w[1][j]);
    let bends = poses.windows(3).map(bend);
    bends.fold((0.0, 0.0), |(shift, turn), bend| {
        (
            shift.max(bend.fixed_rows::<3>(0).norm()),
            turn.max(bend.fixed_rows::<3>(3).norm()),
        )
    })
}

/// The part of a jump in velocity that exceeds `usual`.
fn excess(jump: Vector3<f64>, usual: f64) -> Vector3<f64> {
    let size = jump.norm();
    if size > usual {
        jump * (1.0 - usual / size)
    } else {
        Vector3::zeros()
    }
}

/// One side of a seam: poses, and the index of the one that meets the other side.
#[derive(Clone, Copy)]
pub(super) struct Side<'a> {
    pub poses: &'a [Pose],
    pub at: usize,
}

impl Side<'_> {
    fn gap(&self, start: &Side, j: usize) -> Gap {
        let pose = step(&self.poses[self.at][j], &start.poses[start.at][j]);
        let before = rate(self.poses, self.at, j);
        let after = rate(start.poses, start.at, j);
        // Both angular velocities in the axes of the rotation halfway between the sides, where they meet.
        let half = UnitQuaternion::from_scaled_axis(0.5 * pose.fixed_rows::<3>(3));
        let shifting = after.fixed_rows::<3>(0) - before.fixed_rows::<3>(0);
        let turning = half * after.fixed_rows::<3>(3) - half.inverse() * before.fixed_rows::<3>(3);
        // How much velocity changes anyway, on either side.
        let (here, there) = (bends(self.poses, j), bends(start.poses, j));
        let shifting = excess(shifting, USUAL * here.0.max(there.0));
        let turning = excess(turning, USUAL * here.1.max(there.1));
        let mut rate = Step::zeros();
        rate.fixed_rows_mut::<3>(0).copy_from(&shifting);
        rate.fixed_rows_mut::<3>(3).copy_from(&turning);
        Gap { pose, rate }
    }
}

/// The gaps between two sides of a seam, joint by joint.
pub(super) struct Seam(Vec<Gap>);

impl Seam {
    /// Between the side that ends and the side that starts.
    pub fn between(end: Side, start: Side) -> Self {
        let joints = 0..end.poses[end.at].len();
        Self(joints.map(|j| end.gap(&start, j)).collect())
    }

    /// The seam without the gaps in velocity.
    pub fn of_poses(self) -> Self {
        let still = |gap: Gap| Gap {
            rate: Step::zeros(),
            ..gap
        };
        Self(self.0.into_iter().map(still).collect())
    }

    /// Bends the last `window` of these poses: the very last one moves forward by half of the gap.
    pub fn bend_end(&self, poses: &mut [Pose], window: usize) {
        for (away, pose) in poses.iter_mut().rev().take(window).enumerate() {
            let (whole, rate) = fade(away, window);
            self.bend(pose, 0.5 * whole, -0.5 * rate);
        }
    }

    /// Bends the first `window` of these poses: the very first one moves back by half of the gap.
    pub fn bend_start(&self, poses: &mut [Pose], window: usize) {
        for (away, pose) in poses.iter_mut().take(window).enumerate() {
            let (whole, rate) = fade(away, window);
            self.bend(pose, -0.5 * whole, -0.5 * rate);
        }
    }

    fn bend(&self, pose: &mut Pose, whole: f64, rate: f64) {
        for (at, gap) in pose.iter_mut().zip(&self.0) {
            // A shift adds in the parent's axes; a turn multiplies from the right, in the joint's own.
            let by = gap.pose * whole + gap.rate * rate;
            at.translation.vector += by.fixed_rows::<3>(0);
            at.rotation *= UnitQuaternion::from_scaled_axis(by.fixed_rows::<3>(3).into_owned());
        }
    }
}

/// Cubic Hermite weights of a pose and of a velocity, `away` frames from the seam, where s = away / window: 1 − s²(3 − 2s) is
/// 1 with slope 0 at the seam, and away · (1 − s)² is 0 with slope 1 there; both are 0 with slope 0 at the window's end.
fn fade(away: usize, window: usize) -> (f64, f64) {
    let s = away as f64 / window.max(1) as f64;
    (
        1.0 - s * s * (3.0 - 2.0 * s),
        away as f64 * (1.0 - s) * (1.0 - s),
    )
}
