//! How fast a standing body slides over the ground.

use crate::skeleton::{Shape, Twist};
use nalgebra::{Isometry3, Point3, Vector3};

/// Points at most this far above the lowest one touch the ground with it, metres. Chosen: half of what standing feet may
/// float.
const TOUCHING: f64 = 0.005;

/// Horizontal speed at which a body slides over the ground, m/s, given its world pose and velocity.
///
/// It is the speed of the body's lowest point. If several points touch the ground together, the slowest of them counts, so
/// that a foot that pivots doesn't skate. A body without shapes slides with its origin.
pub fn sole_speed(shapes: &[Shape], pose: &Isometry3<f64>, twist: &Twist) -> f64 {
    let speed = |p: &Vector3<f64>| twist.at(pose, p).linear.xy().norm();
    let points: Vec<Vector3<f64>> = shapes.iter().flat_map(|s| ground_points(s, pose)).collect();
    let lowest = points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let touching = points.iter().filter(|p| p.z < lowest + TOUCHING);
    let slowest = touching.map(speed).min_by(f64::total_cmp);
    slowest.unwrap_or_else(|| speed(&pose.translation.vector))
}

/// The points of a shape that can be its lowest, world, metres.
fn ground_points(shape: &Shape, pose: &Isometry3<f64>) -> Vec<Vector3<f64>> {
    let pole =
        |p: &Vector3<f64>, radius: f64| (pose * Point3::from(*p)).coords - Vector3::z() * radius;
    match shape {
        Shape::Sphere { center, radius } => vec![pole(center, *radius)],
        Shape::Capsule { a, b, radius } => vec![pole(a, *radius), pole(b, *radius)],
        Shape::Box { pose: local, half } => (0..8)
            .map(|corner: u32| {
                let sign = |axis: u32| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
                let signs = Vector3::new(sign(0), sign(1), sign(2));
                (pose * local * Point3::from(half.component_mul(&signs))).coords
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURNING: Twist = Twist {
        linear: Vector3::new(1.0, 0.0, 0.0),
        angular: Vector3::new(0.0, 2.0, 0.0),
    };

    /// A wheel rolls without sliding when its centre moves at ω r.
    #[test]
    fn rolling_is_no_skating() {
        let ball = [Shape::Sphere {
            center: Vector3::zeros(),
            radius: 0.5,
        }];
        let pose = Isometry3::translation(3.0, 0.0, 0.5);
        assert!(sole_speed(&ball, &pose, &TURNING) < 1e-12);
        let still = Twist {
            angular: Vector3::zeros(),
            ..TURNING
        };
        assert!((sole_speed(&ball, &pose, &still) - 1.0).abs() < 1e-12);
    }

    /// A box that turns about the vertical through a corner of its sole rests there; lifted, that corner doesn't count.
    #[test]
    fn a_pivot_rests() {
        let half = Vector3::new(0.1, 0.05, 0.02);
        let sole = [Shape::Box {
            pose: Isometry3::identity(),
            half,
        }];
        let angular = Vector3::z();
        let turning = Twist {
            linear: angular.cross(&-half),
            angular,
        };
        let flat = Isometry3::translation(0.0, 0.0, 0.02);
        assert!(sole_speed(&sole, &flat, &turning) < 1e-12);
        let heel_up = Isometry3::rotation(Vector3::y() * -0.5);
        assert!(sole_speed(&sole, &heel_up, &turning) > 0.05);
    }
}
