//! A motion with all its tracks, from coordinates alone.

use super::timeline::Timeline;
use super::wrench::{Standing, Support};
use super::{Cycle, Motion, MotionError, Tracks, contact, momentum, phase, velocity, wrench};
use crate::clip::LoopMode;
use crate::skeleton::Skeleton;
use nalgebra::{Isometry3, Vector3};

/// What a motion is made from: coordinates and what they don't say themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// Name of the motion.
    pub name: String,
    /// Frames per second.
    pub fps: f64,
    /// Whether the motion repeats. If it does, its last frame has to be its first one moved by `cycle`.
    pub loop_mode: LoopMode,
    /// Where the next cycle of a motion that repeats begins; [`Cycle::NONE`] for one that ends.
    pub cycle: Cycle,
    /// `qpos[f]`: coordinates of every frame in MuJoCo's order, as long as the skeleton's `nq`.
    pub qpos: Vec<Vec<f64>>,
    /// Indices of the bodies that may stand on the ground.
    pub contact_bodies: Vec<usize>,
    /// `contact[f][c]`: whether each contact body stands. If it is `None`, that is found from the poses, with the ground at
    /// z = 0.
    pub contact: Option<Vec<Vec<bool>>>,
}

impl Motion {
    /// The motion of a draft, with velocities, body poses and all tracks.
    ///
    /// # Panics
    /// If a frame of `qpos` is not of length [`Skeleton::nq`], `contact` has another shape than frames × contact
    /// bodies, or a contact body is not one of the skeleton's.
    pub fn from_poses(skeleton: &Skeleton, draft: Draft) -> Self {
        let timeline = Timeline {
            frames: draft.qpos.len(),
            loop_mode: draft.loop_mode,
            cycle: draft.cycle,
        };
        let qvel = velocity::qvel(skeleton, &draft.qpos, draft.fps, &timeline);
        let bodies: Vec<_> = draft.qpos.iter().map(|q| skeleton.forward(q)).collect();
        let whole = momentum::whole_body(skeleton, &draft.qpos, &qvel, &bodies);
        let contact = draft
            .contact
            .clone()
            .unwrap_or_else(|| contacts(skeleton, &bodies, &draft));
        let required = wrench::required(
            &whole.com,
            &whole.angular_momentum,
            skeleton.total_mass(),
            draft.fps,
            &timeline,
        );
        let support = Support {
            skeleton,
            leg: skeleton.leg_length(),
            bodies: &bodies,
            com: &whole.com,
            required: &required,
            standing: Standing {
                bodies: &draft.contact_bodies,
                contact: &contact,
            },
            fps: draft.fps,
            timeline: &timeline,
        };
        let residual = (0..bodies.len()).map(|f| support.residual(f)).collect();
        let tracks = Tracks {
            phase: phase::phase(draft.qpos.len()),
            com: whole.com,
            com_velocity: whole.com_velocity,
            linear_momentum: whole.linear_momentum,
            angular_momentum: whole.angular_momentum,
            contact,
            root_wrench_residual: residual,
        };
        Self {
            name: draft.name,
            fps: draft.fps,
            loop_mode: draft.loop_mode,
            cycle: draft.cycle,
            skeleton_name: skeleton.name.clone(),
            skeleton_sha256: skeleton.sha256.clone(),
            body_names: skeleton.bodies.iter().map(|b| b.name.clone()).collect(),
            contact_bodies: draft.contact_bodies,
            qpos: draft.qpos,
            qvel,
            bodies,
            tracks,
            report: None,
            source: None,
        }
    }

    /// Checks that this motion was made for `skeleton`.
    ///
    /// # Errors
    /// [`MotionError::OtherSkeleton`] if its skeleton has another file or other bodies, or its coordinates have other lengths.
    pub fn check_skeleton(&self, skeleton: &Skeleton) -> Result<(), MotionError> {
        let fits = |rows: &[Vec<f64>], n: usize| rows.iter().all(|r| r.len() == n);
        let same = self.skeleton_sha256 == skeleton.sha256
            && self.body_names.len() == skeleton.bodies.len()
            && fits(&self.qpos, skeleton.nq)
            && fits(&self.qvel, skeleton.nv);
        if same {
            return Ok(());
        }
        Err(MotionError::OtherSkeleton {
            motion: self.name.clone(),
            made_for: self.skeleton_name.clone(),
            skeleton: skeleton.name.clone(),
        })
    }
}

/// `[f][c]`: whether each contact body stands on the ground at z = 0.
fn contacts(skeleton: &Skeleton, bodies: &[Vec<Isometry3<f64>>], draft: &Draft) -> Vec<Vec<bool>> {
    let leg = skeleton.leg_length();
    let per_body: Vec<Vec<bool>> = draft
        .contact_bodies
        .iter()
        .map(|&body| {
            let points: Vec<Vec<Vector3<f64>>> = bodies
                .iter()
                .map(|poses| skeleton.ground_points(poses, body))
                .collect();
            contact::detect_above(&points, 0.0, draft.fps, leg, draft.loop_mode)
        })
        .collect();
    (0..bodies.len())
        .map(|f| per_body.iter().map(|track| track[f]).collect())
        .collect()
}
