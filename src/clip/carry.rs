//! Moves over the ground: a turn about Z and a horizontal shift.

use nalgebra::{Isometry3, UnitQuaternion, Vector2, Vector3};

/// The move over the ground that brings the points `a` nearest to `b` in the least-squares sense (planar Procrustes). Both
/// have the same number of points, world axes, metres.
///
/// With both sets centred and their horizontal parts as complex numbers, the sum of |b − a·e^{iφ}|² is least where φ is the
/// angle of Σ ā·b: its real part is `dot`, its imaginary part `cross`.
pub(crate) fn carry(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Isometry3<f64> {
    let (from, to) = (centre(a), centre(b));
    let (mut cross, mut dot) = (0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        // Centred, so that the turn doesn't depend on where the origin is.
        let (a, b) = (a.xy() - from, b.xy() - to);
        cross += a.perp(&b);
        dot += a.dot(&b);
    }
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), f64::atan2(cross, dot));
    // The centres meet.
    let shift = to.push(0.0) - turn * from.push(0.0);
    Isometry3::from_parts(shift.into(), turn)
}

fn centre(places: &[Vector3<f64>]) -> Vector2<f64> {
    let sum: Vector2<f64> = places.iter().map(|p| p.xy()).sum();
    sum / places.len().max(1) as f64
}
