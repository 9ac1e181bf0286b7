//! The torques that a motion asks of the joints: inverse dynamics by the recursive Newton-Euler algorithm (Featherstone,
//! Rigid Body Dynamics Algorithms, 2008, chapter 5).
//!
//! Every body needs a force and a moment, which follow from its acceleration. The ground supplies some of them, and the
//! joint above the body the others; these are summed from the leaves to the root. What neither joints nor ground supply is
//! left to the root.

use super::Motion;
use super::timeline::Timeline;
use super::wrench::{self, Load, Standing, Support, Wrench};
use crate::skeleton::{GRAVITY, Joint, JointKind, Skeleton};
use nalgebra::{Isometry3, Point3, Vector3};

impl Motion {
    /// Torques of all joints, `[frames][nv]`, in the order of MuJoCo's `qfrc`: N·m about the axis of a hinge, N along that
    /// of a slide, N·m about the child's axes of a ball. They are zero for the root, which has no drive.
    ///
    /// # Panics
    /// If the motion is not one of `skeleton`'s (see [`Motion::check_skeleton`]).
    pub fn joint_torques(&self, skeleton: &Skeleton) -> Vec<Vec<f64>> {
        let timeline = self.timeline();
        let loads = self.loads(skeleton, &timeline);
        let needs = needs(self, skeleton, &timeline);
        (0..self.qpos.len())
            .map(|f| {
                torques(
                    skeleton,
                    (&self.qpos[f], &self.bodies[f]),
                    &needs[f],
                    &loads[f],
                )
            })
            .collect()
    }

    /// Which frame follows which.
    pub(super) fn timeline(&self) -> Timeline {
        Timeline {
            frames: self.qpos.len(),
            loop_mode: self.loop_mode,
            cycle: self.cycle,
        }
    }

    /// `[f]`: what the ground gives to which body.
    fn loads(&self, skeleton: &Skeleton, timeline: &Timeline) -> Vec<Vec<Load>> {
        let tracks = &self.tracks;
        let (com, spin, mass) = (&tracks.com, &tracks.angular_momentum, skeleton.total_mass());
        let required = wrench::required(com, spin, mass, self.fps, timeline);
        let support = Support {
            skeleton,
            leg: skeleton.leg_length(),
            bodies: &self.bodies,
            com,
            required: &required,
            standing: Standing {
                bodies: &self.contact_bodies,
                contact: &tracks.contact,
            },
            fps: self.fps,
            timeline,
        };
        (0..self.qpos.len()).map(|f| support.loads(f)).collect()
    }
}

/// `[f][b]`: force and moment about its centre of mass that body `b` needs besides gravity: m (c̈ − g) and the derivative
/// of its own angular momentum.
fn needs(motion: &Motion, skeleton: &Skeleton, timeline: &Timeline) -> Vec<Vec<Wrench>> {
    let twists: Vec<_> = motion
        .qpos
        .iter()
        .zip(&motion.qvel)
        .map(|(q, v)| skeleton.twists(q, v))
        .collect();
    let of = |f: usize, b: usize| {
        let body = &skeleton.bodies[b];
        let place = |n: i64, at: usize| {
            (timeline.cycle.offset(n) * motion.bodies[at][b] * Point3::from(body.com)).coords
        };
        let spin = |n: i64, at: usize| {
            let turn = motion.bodies[at][b].rotation;
            let local = turn.inverse() * twists[at][b].angular;
            timeline.cycle.offset(n).rotation * (turn * (body.inertia * local))
        };
        let (_, acceleration) = wrench::derivatives(f, motion.fps, timeline, place);
        let (moment, _) = wrench::derivatives(f, motion.fps, timeline, spin);
        Wrench {
            force: (acceleration + Vector3::z() * GRAVITY) * body.mass,
            moment,
        }
    };
    let frame = |f| (0..skeleton.bodies.len()).map(|b| of(f, b)).collect();
    (0..motion.qpos.len()).map(frame).collect()
}

/// Torques of the joints in one frame.
fn torques(
    skeleton: &Skeleton,
    (qpos, poses): (&[f64], &[Isometry3<f64>]),
    needs: &[Wrench],
    loads: &[Load],
) -> Vec<f64> {
    // Force and moment about the world's origin that the joint above a body passes on.
    let mut carried: Vec<(Vector3<f64>, Vector3<f64>)> = Vec::with_capacity(needs.len());
    for (b, need) in needs.iter().enumerate() {
        let com = (poses[b] * Point3::from(skeleton.bodies[b].com)).coords;
        let (mut force, mut moment) = (need.force, need.moment + com.cross(&need.force));
        for load in loads.iter().filter(|load| load.body == b) {
            force -= load.force;
            moment -= load.point.cross(&load.force);
        }
        carried.push((force, moment));
    }
    // From the leaves to the root, for bodies stand behind their parents: a body's joint carries what the body itself needs
    // and what the joints below it carry.
    let mut torques = vec![0.0; skeleton.nv];
    for (b, body) in skeleton.bodies.iter().enumerate().rev() {
        let (force, moment) = carried[b];
        if let Some(parent) = body.parent {
            carried[parent].0 += force;
            carried[parent].1 += moment;
        }
        // The body's joints from the last to the first, each undone to find the axes of the one before.
        let mut after = poses[b];
        for joint in body.joints.iter().rev() {
            let anchor = (after * Point3::from(joint.anchor)).coords;
            along(
                joint,
                &after,
                force,
                moment - anchor.cross(&force),
                &mut torques,
            );
            after = joint.undo(&after, qpos);
        }
    }
    torques
}

/// The part along a joint's axes of a force and a moment about its anchor.
fn along(
    joint: &Joint,
    body: &Isometry3<f64>,
    force: Vector3<f64>,
    moment: Vector3<f64>,
    torques: &mut [f64],
) {
    match joint.kind {
        JointKind::Free => {}
        JointKind::Ball => {
            let local = body.rotation.inverse() * moment;
            torques[joint.dof..joint.dof + 3].copy_from_slice(local.as_slice());
        }
        JointKind::Hinge(axis) => torques[joint.dof] = (body.rotation * axis).dot(&moment),
        JointKind::Slide(axis) => torques[joint.dof] = (body.rotation * axis).dot(&force),
    }
}
