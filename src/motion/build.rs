//! A motion with all its tracks, from coordinates alone.

use super::carry::{Carried, twists};
use super::timeline::Timeline;
use super::wrench::{Standing, Support};
use super::{Cycle, Motion, MotionError, Tracks, contact, momentum, phase, velocity, wrench};
use crate::clip::LoopMode;
use crate::skeleton::Skeleton;
use nalgebra::Vector3;

/// Height of a body's lowest point up to which it touches the ground, leg lengths. Chosen: just below 1 cm with legs of 0.87 m.
pub(crate) const TOUCHING: f64 = 0.0114;

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
    /// Indices of the bodies that may touch the ground: [`Skeleton::contact_bodies`], or none for a motion without a ground.
    pub contact_bodies: Vec<usize>,
    /// `contact[f][c]`: whether each contact body stands. If it is `None`, that is found from the poses, with the ground at
    /// z = 0. What carries the motion without standing still is found besides.
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
        let mut motion = Self {
            name: draft.name,
            fps: draft.fps,
            loop_mode: draft.loop_mode,
            cycle: draft.cycle,
            skeleton_name: skeleton.name.clone(),
            skeleton_sha256: skeleton.sha256.clone(),
            body_names: skeleton.bodies.iter().map(|b| b.name.clone()).collect(),
            contact_bodies: draft.contact_bodies,
            tracks: Tracks {
                phase: phase::phase(draft.qpos.len()),
                com: whole.com,
                com_velocity: whole.com_velocity,
                linear_momentum: whole.linear_momentum,
                angular_momentum: whole.angular_momentum,
                contact: Vec::new(),
                root_wrench_residual: Vec::new(),
            },
            qpos: draft.qpos,
            qvel,
            bodies,
            report: None,
            source: None,
        };
        let stands = draft.contact.unwrap_or_else(|| motion.stances(skeleton));
        motion.put_on_ground(skeleton, stands);
        motion
    }

    /// The same motion with contacts of all bodies of its character, for one that an older version made: those had the feet's,
    /// and the hands' where the clip puts them down. A motion without a ground stays one.
    ///
    /// # Panics
    /// If the motion was made for another skeleton (see [`Motion::check_skeleton`]).
    pub fn with_all_contacts(mut self, skeleton: &Skeleton) -> Self {
        let bodies = skeleton.contact_bodies();
        if self.contact_bodies.is_empty() || self.contact_bodies == bodies {
            return self;
        }
        let column = |body: &usize| self.contact_bodies.iter().position(|b| b == body);
        let columns: Vec<Option<usize>> = bodies.iter().map(column).collect();
        let widen = |row: &Vec<bool>| columns.iter().map(|c| c.is_some_and(|c| row[c])).collect();
        let stands = self.tracks.contact.iter().map(widen).collect();
        self.contact_bodies = bodies;
        self.put_on_ground(skeleton, stands);
        self
    }

    /// Sets the contacts to what stands, which is known, and what carries besides; and the residual of the root's wrench.
    fn put_on_ground(&mut self, skeleton: &Skeleton, mut stands: Vec<Vec<bool>>) {
        let (leg, timeline) = (skeleton.leg_length(), self.timeline());
        let (com, spin) = (&self.tracks.com, &self.tracks.angular_momentum);
        let mass = skeleton.total_mass();
        let required = wrench::required(com, spin, mass, self.fps, &timeline);
        let carried = Carried {
            skeleton,
            bodies: &self.bodies,
            twists: &twists(skeleton, &self.qpos, &self.qvel),
            com,
            required: &required,
            fps: self.fps,
            timeline: &timeline,
        };
        let reach = vec![TOUCHING * leg; self.contact_bodies.len()];
        let carries = carried.by(&self.contact_bodies, &reach);
        // Short gaps between loads were closed, and in them a body may be above the ground.
        for (f, (row, carries)) in stands.iter_mut().zip(carries).enumerate() {
            for (c, carries) in carries.into_iter().enumerate() {
                let body = self.contact_bodies[c];
                let lowest = skeleton.lowest_point_of(&self.bodies[f], &[body]);
                row[c] |= carries && lowest <= TOUCHING * leg;
            }
        }
        let support = Support {
            skeleton,
            leg,
            bodies: &self.bodies,
            com,
            required: &required,
            standing: Standing {
                bodies: &self.contact_bodies,
                contact: &stands,
            },
            fps: self.fps,
            timeline: &timeline,
        };
        let residual = (0..self.bodies.len()).map(|f| support.residual(f));
        self.tracks.root_wrench_residual = residual.collect();
        self.tracks.contact = stands;
    }

    /// `[f][c]`: whether each contact body stands on the ground at z = 0.
    fn stances(&self, skeleton: &Skeleton) -> Vec<Vec<bool>> {
        let leg = skeleton.leg_length();
        let of = |body: &usize| {
            let points = |poses: &Vec<_>| skeleton.ground_points(poses, *body);
            let points: Vec<Vec<Vector3<f64>>> = self.bodies.iter().map(points).collect();
            contact::detect_above(&points, 0.0, self.fps, leg, self.loop_mode)
        };
        let tracks: Vec<Vec<bool>> = self.contact_bodies.iter().map(of).collect();
        let row = |f: usize| tracks.iter().map(|track| track[f]).collect();
        (0..self.bodies.len()).map(row).collect()
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
