//! Forward kinematics and the velocities of bodies, in the order of operations of MuJoCo's `mj_kinematics`.

use super::{Joint, JointKind, Skeleton, Twist};
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

/// Unit quaternion at `qpos[at..at + 4]`, scalar first.
///
/// The caller has checked the length of `qpos`. A quaternion that is zero stands for no rotation, as in MuJoCo.
pub(super) fn quaternion(qpos: &[f64], at: usize) -> UnitQuaternion<f64> {
    let q = Quaternion::new(qpos[at], qpos[at + 1], qpos[at + 2], qpos[at + 3]);
    Unit::try_new(q, 1e-12).unwrap_or_else(UnitQuaternion::identity)
}

/// Vector at `values[at..at + 3]`.
pub(super) fn vector(values: &[f64], at: usize) -> Vector3<f64> {
    Vector3::new(values[at], values[at + 1], values[at + 2])
}

impl Joint {
    /// Rotation that the joint's coordinates make, in the child's frame; for a free joint, its orientation in the world.
    pub(super) fn rotation(&self, qpos: &[f64]) -> UnitQuaternion<f64> {
        match self.kind {
            JointKind::Free => quaternion(qpos, self.qpos + 3),
            JointKind::Ball => quaternion(qpos, self.qpos),
            JointKind::Hinge(axis) => {
                UnitQuaternion::from_axis_angle(&Unit::new_unchecked(axis), qpos[self.qpos])
            }
            JointKind::Slide(_) => UnitQuaternion::identity(),
        }
    }

    /// World from body after this joint, from world from body before it.
    fn apply(&self, before: &Isometry3<f64>, qpos: &[f64]) -> Isometry3<f64> {
        match self.kind {
            JointKind::Free => Isometry3::from_parts(
                Translation3::from(vector(qpos, self.qpos)),
                self.rotation(qpos),
            ),
            JointKind::Slide(axis) => before * Translation3::from(axis * qpos[self.qpos]),
            JointKind::Ball | JointKind::Hinge(_) => {
                let turn = self.rotation(qpos);
                // The anchor stays where it is, so the frame's origin moves about it.
                let shift = self.anchor - turn * self.anchor;
                before * Isometry3::from_parts(shift.into(), turn)
            }
        }
    }
}

impl Joint {
    /// World from body before this joint, from world from body after it; the identity before a free joint.
    pub(crate) fn undo(&self, after: &Isometry3<f64>, qpos: &[f64]) -> Isometry3<f64> {
        let own = self.apply(&Isometry3::identity(), qpos);
        after * own.inverse()
    }
}

impl Skeleton {
    /// World from body of every body at `qpos`, `[bodies]`: forward kinematics (MuJoCo's `xpos` and `xquat`).
    ///
    /// # Panics
    /// If `qpos` is shorter than [`Skeleton::nq`].
    pub fn forward(&self, qpos: &[f64]) -> Vec<Isometry3<f64>> {
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(self.bodies.len());
        // Parents come before their children, so each pose follows from one that is known.
        for body in &self.bodies {
            let parent = body.parent.map_or_else(Isometry3::identity, |p| world[p]);
            let at = body
                .joints
                .iter()
                .fold(parent * body.rest, |at, joint| joint.apply(&at, qpos));
            world.push(at);
        }
        world
    }

    /// Velocity of every body at `qpos` and `qvel`, `[bodies]`.
    ///
    /// From the root outwards: each body moves with its parent and adds what its own joints do. Several joints of one body
    /// act one after the other, so each turns in the frame that the joints before it have left.
    ///
    /// # Panics
    /// If `qpos` is shorter than [`Skeleton::nq`] or `qvel` than [`Skeleton::nv`].
    pub fn twists(&self, qpos: &[f64], qvel: &[f64]) -> Vec<Twist> {
        let world = self.forward(qpos);
        let mut twists: Vec<Twist> = Vec::with_capacity(self.bodies.len());
        for (index, body) in self.bodies.iter().enumerate() {
            let origin = world[index].translation.vector;
            let (mut at, mut twist) = match body.parent {
                Some(p) => (world[p], twists[p].at(&world[p], &origin)),
                None => (Isometry3::identity(), Twist::default()),
            };
            // The joints act in turn, and each adds the velocity of the body's final origin about its own anchor.
            at *= body.rest;
            for joint in &body.joints {
                let next = joint.apply(&at, qpos);
                joint.add_velocity(&at, &next, &origin, qvel, &mut twist);
                at = next;
            }
            twists.push(twist);
        }
        twists
    }
}

impl Joint {
    /// Adds the velocity that the joint's rate gives to the body whose origin is `origin` after all its joints.
    fn add_velocity(
        &self,
        before: &Isometry3<f64>,
        after: &Isometry3<f64>,
        origin: &Vector3<f64>,
        qvel: &[f64],
        twist: &mut Twist,
    ) {
        let angular = match self.kind {
            JointKind::Free => {
                twist.linear += vector(qvel, self.dof);
                twist.angular += after.rotation * vector(qvel, self.dof + 3);
                return;
            }
            JointKind::Slide(axis) => {
                twist.linear += before.rotation * axis * qvel[self.dof];
                return;
            }
            // A ball's velocity is in the child's frame, a hinge's axis doesn't move when it turns.
            JointKind::Ball => after.rotation * vector(qvel, self.dof),
            JointKind::Hinge(axis) => before.rotation * axis * qvel[self.dof],
        };
        // A rotation about the anchor: v = ω × (origin − anchor). The joint leaves its anchor where it was.
        let anchor = before * nalgebra::Point3::from(self.anchor);
        twist.angular += angular;
        twist.linear += angular.cross(&(origin - anchor.coords));
    }
}

impl Default for Twist {
    /// At rest.
    fn default() -> Self {
        Self {
            linear: Vector3::zeros(),
            angular: Vector3::zeros(),
        }
    }
}

impl Twist {
    /// The same motion with its linear part taken at the world point `point` instead of the origin of `body` (world from
    /// body): v + ω × r.
    pub fn at(&self, body: &Isometry3<f64>, point: &Vector3<f64>) -> Self {
        let arm = point - body.translation.vector;
        Self {
            linear: self.linear + self.angular.cross(&arm),
            angular: self.angular,
        }
    }
}
