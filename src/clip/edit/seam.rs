//! Seams: two poses that are to be one, and the frames around them that are bent until they are.

use super::figure::Figure;
use crate::clip::Clip;
use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};

type Pose = Vec<Isometry3<f64>>;

/// How far from a seam it is looked for what is usual there, s.
const NEAR: f64 = 1.0;
/// Velocity may change at a seam by so many times what it does from frame to frame around it: a foot that lands stops.
const USUAL: f64 = 1.5;

/// Frames of `clip` that are looked at on either side of a seam.
pub(super) fn near(clip: &Clip) -> usize {
    ((NEAR * clip.fps).ceil() as usize).max(2)
}

/// A joint's shift in its parent's axes and its turn in its own, as a rotation vector.
type Step = Vector6<f64>;

/// What one joint's end lacks to be the beginning.
struct Gap {
    pose: Step,
    /// The same of the velocity, per frame.
    rate: Step,
}

/// Moves poses of `clip` over the ground: only its carriers know of that.
pub(super) fn carry_all(clip: &Clip, figure: &Figure, carry: &Isometry3<f64>, poses: &mut [Pose]) {
    for (joint, footing) in figure.footings(clip) {
        let local = footing.inverse() * carry * footing;
        for pose in poses.iter_mut() {
            pose[joint] = local * pose[joint];
        }
    }
}

fn step(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Step {
    let shift = to.translation.vector - from.translation.vector;
    let turn = (from.rotation.inverse() * to.rotation).scaled_axis();
    Step::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Velocity of joint `j` at pose `at`, per frame, from as many poses around it as there are: second-order differences.
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

/// Greatest change of velocity of joint `j` from frame to frame: of its shift, and of its turn.
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

/// What of a jump in velocity is more than `usual`.
fn excess(jump: Vector3<f64>, usual: f64) -> Vector3<f64> {
    let size = jump.norm();
    if size > usual {
        jump * (1.0 - usual / size)
    } else {
        Vector3::zeros()
    }
}

/// One side of a seam: poses, and which of them meets the other side.
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
        // Both angular velocities in the axes of the rotation halfway, where the sides meet.
        let half = UnitQuaternion::from_scaled_axis(0.5 * pose.fixed_rows::<3>(3));
        let shifting = after.fixed_rows::<3>(0) - before.fixed_rows::<3>(0);
        let turning = half * after.fixed_rows::<3>(3) - half.inverse() * before.fixed_rows::<3>(3);
        let (here, there) = (bends(self.poses, j), bends(start.poses, j));
        let shifting = excess(shifting, USUAL * here.0.max(there.0));
        let turning = excess(turning, USUAL * here.1.max(there.1));
        let mut rate = Step::zeros();
        rate.fixed_rows_mut::<3>(0).copy_from(&shifting);
        rate.fixed_rows_mut::<3>(3).copy_from(&turning);
        Gap { pose, rate }
    }
}

/// What was found missing between two sides of a seam, joint by joint.
pub(super) struct Seam(Vec<Gap>);

impl Seam {
    /// Between the side that ends and the side that starts.
    pub fn between(end: Side, start: Side) -> Self {
        let joints = 0..end.poses[end.at].len();
        Self(joints.map(|j| end.gap(&start, j)).collect())
    }

    /// The seam with the velocities as they are.
    pub fn of_poses(self) -> Self {
        let still = |gap: Gap| Gap {
            rate: Step::zeros(),
            ..gap
        };
        Self(self.0.into_iter().map(still).collect())
    }

    /// Bends the last `window` of these poses: half of the gap is added to the very last one.
    pub fn bend_end(&self, poses: &mut [Pose], window: usize) {
        for (away, pose) in poses.iter_mut().rev().take(window).enumerate() {
            let (whole, rate) = fade(away, window);
            self.bend(pose, 0.5 * whole, -0.5 * rate);
        }
    }

    /// Bends the first `window` of these poses: half of the gap is taken from the very first one.
    pub fn bend_start(&self, poses: &mut [Pose], window: usize) {
        for (away, pose) in poses.iter_mut().take(window).enumerate() {
            let (whole, rate) = fade(away, window);
            self.bend(pose, -0.5 * whole, -0.5 * rate);
        }
    }

    fn bend(&self, pose: &mut Pose, whole: f64, rate: f64) {
        for (at, gap) in pose.iter_mut().zip(&self.0) {
            let by = gap.pose * whole + gap.rate * rate;
            at.translation.vector += by.fixed_rows::<3>(0);
            at.rotation *= UnitQuaternion::from_scaled_axis(by.fixed_rows::<3>(3).into_owned());
        }
    }
}

/// Cubic Hermite weights of a pose and of a velocity (in frames) `away` frames from the seam: 1 with slope 0, and 0 with
/// slope 1, at the seam; both 0 with slope 0 at the end of the window.
fn fade(away: usize, window: usize) -> (f64, f64) {
    let s = away as f64 / window.max(1) as f64;
    (
        1.0 - s * s * (3.0 - 2.0 * s),
        away as f64 * (1.0 - s) * (1.0 - s),
    )
}
