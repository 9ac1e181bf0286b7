//! Whole-body measures: mass, centre of mass, momentum, sizes, and the points that may touch the ground.

use super::coordinates::{store, store_quaternion};
use super::{JointKind, Shape, Skeleton, Twist};
use crate::humanoid::Slot;
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use std::f64::consts::PI;

impl Skeleton {
    /// Mass of all bodies together, kg.
    pub fn total_mass(&self) -> f64 {
        self.bodies.iter().map(|b| b.mass).sum()
    }

    /// Centre of mass of the whole body, world frame, metres. `poses` is world from body, `[bodies]`.
    pub fn com(&self, poses: &[Isometry3<f64>]) -> Vector3<f64> {
        let moment: Vector3<f64> = self
            .bodies
            .iter()
            .zip(poses)
            .map(|(body, pose)| (pose * Point3::from(body.com)).coords * body.mass)
            .sum();
        moment / self.total_mass()
    }

    /// Linear momentum (kg·m/s) and angular momentum about the centre of mass (kg·m²/s), world axes.
    ///
    /// L = Σ R I Rᵀ ω + m (r − c) × (v − ċ): the centroidal momentum of Orin, Goswami and Lee (Autonomous
    /// Robots 35, 2013), each body's own spin included. `poses` is world from body and `twists` are the velocities, both
    /// `[bodies]`.
    pub fn momentum(
        &self,
        poses: &[Isometry3<f64>],
        twists: &[Twist],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let com = self.com(poses);
        // Each body's centre of mass and the velocity there.
        let parts: Vec<_> = self
            .bodies
            .iter()
            .zip(poses.iter().zip(twists))
            .map(|(body, (pose, twist))| {
                let center = (pose * Point3::from(body.com)).coords;
                (body, pose, center, twist.at(pose, &center))
            })
            .collect();
        let linear: Vector3<f64> = parts.iter().map(|(b, .., t)| t.linear * b.mass).sum();
        let mean = linear / self.total_mass();
        let angular = parts
            .iter()
            .map(|(body, pose, center, twist)| {
                let inertia = in_world(pose, &body.inertia);
                inertia * twist.angular + (center - com).cross(&(twist.linear - mean)) * body.mass
            })
            .sum();
        (linear, angular)
    }

    /// Coordinates of the rest pose, `[nq]`: joints at zero, the root above the world's origin in the orientation that the
    /// MJCF gives it, the lowest point of all shapes on the ground.
    pub fn rest_qpos(&self) -> Vec<f64> {
        let mut qpos = vec![0.0; self.nq];
        for body in &self.bodies {
            for joint in &body.joints {
                let at = joint.qpos;
                match joint.kind {
                    JointKind::Free => store_quaternion(&mut qpos, at + 3, &body.rest.rotation),
                    JointKind::Ball => {
                        store_quaternion(&mut qpos, at, &UnitQuaternion::identity());
                    }
                    JointKind::Hinge(_) | JointKind::Slide(_) => {}
                }
            }
        }
        // With the root at the origin, part of the character is below the ground by this much.
        let sunk = self.lowest_point(&self.forward(&qpos));
        store(&mut qpos, 0, Vector3::z() * -sunk);
        qpos
    }

    /// Distance from the hip joint to the sole along the leg in the rest pose, metres. For a character whose rest pose stands
    /// it is the height of the hip. Without slots for a leg and its foot it is the height of the root.
    pub fn leg_length(&self) -> f64 {
        let poses = self.forward(&self.rest_qpos());
        let height = poses[0].translation.z;
        let slot = |slot: Slot| self.slots.get(&slot).copied();
        let sides = [
            (Slot::LeftUpperLeg, Slot::LeftFoot),
            (Slot::RightUpperLeg, Slot::RightFoot),
        ];
        let leg = sides
            .into_iter()
            .find_map(|(hip, foot)| Some((slot(hip)?, slot(foot)?)));
        leg.map_or(height, |(hip, foot)| self.length_along(&poses, hip, foot))
    }

    /// Height of `upper`'s first joint over the lowest point of `lower`, after the whole pose is turned so that the line
    /// between them is upright: a rest pose need not stand.
    fn length_along(&self, poses: &[Isometry3<f64>], upper: usize, lower: usize) -> f64 {
        let joint = self.bodies[upper].joints.first();
        let anchor = joint.map_or_else(Vector3::zeros, |j| j.anchor);
        let top = poses[upper] * Point3::from(anchor);
        let down = poses[lower].translation.vector - top.coords;
        // A leg that points straight up has no unique rotation; half a turn about X serves.
        let upright = UnitQuaternion::rotation_between(&down, &-Vector3::z())
            .unwrap_or_else(|| UnitQuaternion::from_scaled_axis(Vector3::x() * PI));
        let turned: Vec<Isometry3<f64>> = poses.iter().map(|pose| upright * pose).collect();
        (upright * top).z - self.lowest_point_of(&turned, &[lower])
    }

    /// Which bodies are a hand or a foot, or hang on one. All are where the skeleton has no such slots.
    pub fn hands_and_feet(&self) -> Vec<bool> {
        use Slot::{LeftFoot, LeftHand, RightFoot, RightHand};
        let slots = [LeftFoot, RightFoot, LeftHand, RightHand].into_iter();
        let tops: Vec<usize> = slots
            .filter_map(|slot| self.slots.get(&slot).copied())
            .collect();
        let mut ends = vec![tops.is_empty(); self.bodies.len()];
        // Parents stand before their children.
        for (b, body) in self.bodies.iter().enumerate() {
            ends[b] |= tops.contains(&b) || body.parent.is_some_and(|p| ends[p]);
        }
        ends
    }

    /// The bodies that can touch the ground: those with shapes, ascending.
    pub fn contact_bodies(&self) -> Vec<usize> {
        let bodies = self.bodies.iter().enumerate();
        let shaped = bodies.filter(|(_, body)| !body.shapes.is_empty());
        shaped.map(|(b, _)| b).collect()
    }

    /// Height of the lowest point of all shapes, metres; of the bodies' origins if there are no shapes. `poses` is world from
    /// body, `[bodies]`.
    pub fn lowest_point(&self, poses: &[Isometry3<f64>]) -> f64 {
        self.lowest(poses, 0..self.bodies.len())
    }

    /// The same for some bodies only, given by index; infinite for none.
    pub fn lowest_point_of(&self, poses: &[Isometry3<f64>], bodies: &[usize]) -> f64 {
        self.lowest(poses, bodies.iter().copied())
    }

    fn lowest(&self, poses: &[Isometry3<f64>], bodies: impl Iterator<Item = usize> + Clone) -> f64 {
        // Without any shape the fold stays infinite, and the origins of the bodies count instead.
        let shapes = bodies.clone().flat_map(|b| {
            let pose = &poses[b];
            self.bodies[b].shapes.iter().map(|s| s.lowest(pose))
        });
        let lowest = shapes.fold(f64::INFINITY, f64::min);
        if lowest.is_finite() {
            return lowest;
        }
        let origins = bodies.map(|b| poses[b].translation.z);
        origins.fold(f64::INFINITY, f64::min)
    }

    /// Points of a body's shapes that can be the lowest, world frame, metres: the corners of boxes, and the lower poles of
    /// spheres and of both ends of capsules. Their order is the same in every pose. A body without shapes has its origin.
    pub fn ground_points(&self, poses: &[Isometry3<f64>], body: usize) -> Vec<Vector3<f64>> {
        let pose = &poses[body];
        let shapes = &self.bodies[body].shapes;
        if shapes.is_empty() {
            return vec![pose.translation.vector];
        }
        shapes.iter().flat_map(|s| s.ground_points(pose)).collect()
    }
}

/// An inertia about a body's centre of mass, turned from the body's axes to the world's: R I Rᵀ.
fn in_world(pose: &Isometry3<f64>, inertia: &Matrix3<f64>) -> Matrix3<f64> {
    let r = pose.rotation.to_rotation_matrix();
    r * inertia * r.transpose()
}

impl Shape {
    /// Height of the shape's lowest point, metres, with its body at `pose` (world from body). It is exact.
    pub fn lowest(&self, pose: &Isometry3<f64>) -> f64 {
        let height = |p: &Vector3<f64>| (pose * Point3::from(*p)).z;
        match self {
            Shape::Sphere { center, radius } => height(center) - radius,
            Shape::Capsule { a, b, radius } => height(a).min(height(b)) - radius,
            Shape::Box { pose: own, half } => {
                let turn = (pose.rotation * own.rotation).to_rotation_matrix();
                // Half-extent of the box along world Z (its support function): Σ |Rzi| hi.
                let reach: f64 = (0..3).map(|i| turn[(2, i)].abs() * half[i]).sum();
                height(&own.translation.vector) - reach
            }
        }
    }

    fn ground_points(&self, pose: &Isometry3<f64>) -> Vec<Vector3<f64>> {
        let pole = |(at, radius): (Point3<f64>, f64)| (pose * at).coords - Vector3::z() * radius;
        self.hull_balls().into_iter().map(pole).collect()
    }

    /// Balls whose convex hull is the shape, as centre in the body's frame and radius, metres: the sphere itself, the two ends
    /// of a capsule, the eight corners of a box with radius 0. On flat ground, no other points can be the lowest.
    pub(crate) fn hull_balls(&self) -> Vec<(Point3<f64>, f64)> {
        match self {
            Shape::Sphere { center, radius } => vec![(Point3::from(*center), *radius)],
            Shape::Capsule { a, b, radius } => [a, b].map(|p| (Point3::from(*p), *radius)).into(),
            Shape::Box { pose, half } => (0..8)
                .map(|corner| {
                    let sign = |axis: u32| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
                    let signs = Vector3::new(sign(0), sign(1), sign(2));
                    (pose * Point3::from(half.component_mul(&signs)), 0.0)
                })
                .collect(),
        }
    }
}
