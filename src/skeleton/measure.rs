//! Whole-body measures: mass, centre of mass, momentum, sizes, and the points that may touch the ground.

use super::coordinates::{store, store_quaternion};
use super::{JointKind, Shape, Skeleton, Twist};
use crate::humanoid::Slot;
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};

impl Skeleton {
    /// kg.
    pub fn total_mass(&self) -> f64 {
        self.bodies.iter().map(|b| b.mass).sum()
    }

    /// Whole-body centre of mass, world frame, metres.
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
    /// Robots 35, 2013), each body's own spin included.
    pub fn momentum(
        &self,
        poses: &[Isometry3<f64>],
        twists: &[Twist],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let com = self.com(poses);
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

    /// Coordinates of the rest pose: joints at zero, root above the world's origin in the orientation that the
    /// MJCF gives it, the lowest shape point on the ground.
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
        let sunk = self.lowest_point(&self.forward(&qpos));
        store(&mut qpos, 0, Vector3::z() * -sunk);
        qpos
    }

    /// Height of the hip joint above the ground in the rest pose, metres; without leg slots, of the root.
    pub fn leg_length(&self) -> f64 {
        let hip = [Slot::LeftUpperLeg, Slot::RightUpperLeg]
            .iter()
            .find_map(|slot| self.slots.get(slot).copied())
            .unwrap_or(0);
        let anchor = self.bodies[hip]
            .joints
            .first()
            .map_or_else(Vector3::zeros, |j| j.anchor);
        let poses = self.forward(&self.rest_qpos());
        (poses[hip] * Point3::from(anchor)).z
    }

    /// Height of the lowest point of all shapes, metres; of body origins if there are no shapes.
    pub fn lowest_point(&self, poses: &[Isometry3<f64>]) -> f64 {
        let all: Vec<usize> = (0..self.bodies.len()).collect();
        self.lowest_point_of(poses, &all)
    }

    /// The same over some bodies only. Infinite for no bodies at all.
    pub fn lowest_point_of(&self, poses: &[Isometry3<f64>], bodies: &[usize]) -> f64 {
        let shapes = bodies.iter().flat_map(|&b| {
            let pose = &poses[b];
            self.bodies[b].shapes.iter().map(|s| s.lowest(pose))
        });
        let lowest = shapes.fold(f64::INFINITY, f64::min);
        if lowest.is_finite() {
            return lowest;
        }
        let origins = bodies.iter().map(|&b| poses[b].translation.z);
        origins.fold(f64::INFINITY, f64::min)
    }

    /// Points of a body's shapes that can be lowest, in the world: corners of boxes, the lower pole of spheres
    /// and of both ends of capsules. The order is the same in every pose. The origin for a body without shapes.
    pub fn ground_points(&self, poses: &[Isometry3<f64>], body: usize) -> Vec<Vector3<f64>> {
        let pose = &poses[body];
        let shapes = &self.bodies[body].shapes;
        if shapes.is_empty() {
            return vec![pose.translation.vector];
        }
        shapes.iter().flat_map(|s| s.ground_points(pose)).collect()
    }
}

/// An inertia in the axes of `pose`, turned to world axes.
fn in_world(pose: &Isometry3<f64>, inertia: &Matrix3<f64>) -> Matrix3<f64> {
    let r = pose.rotation.to_rotation_matrix();
    r * inertia * r.transpose()
}

impl Shape {
    /// Height of the shape's lowest point with its body at `pose`; exact.
    pub fn lowest(&self, pose: &Isometry3<f64>) -> f64 {
        let points = self.ground_points(pose);
        points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min)
    }

    fn ground_points(&self, pose: &Isometry3<f64>) -> Vec<Vector3<f64>> {
        let pole = |p: &Vector3<f64>, radius: f64| {
            (pose * Point3::from(*p)).coords - Vector3::z() * radius
        };
        match self {
            Shape::Sphere { center, radius } => vec![pole(center, *radius)],
            Shape::Capsule { a, b, radius } => vec![pole(a, *radius), pole(b, *radius)],
            Shape::Box { pose: local, half } => {
                let placed = pose * local;
                (0..8)
                    .map(|corner| {
                        let sign = |axis: u32| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
                        let signs = Vector3::new(sign(0), sign(1), sign(2));
                        (placed * Point3::from(half.component_mul(&signs))).coords
                    })
                    .collect()
            }
        }
    }
}
