//! The exponential map of rotations and its derivatives (Solà, Deray, Atchuthan, "A micro Lie theory for state estimation in
//! robotics", 2018, arXiv:1812.01537). A rotation vector is the axis times the angle, radians.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// The rotation of a rotation vector.
pub(super) fn exp(v: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(*v)
}

/// The rotation vector of a rotation, no longer than π.
pub(super) fn log(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    // q and −q are the same rotation; the one with w ≥ 0 has the shorter vector.
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    let (w, v) = (q.w * sign, q.imag() * sign);
    let sine = v.norm();
    // atan(s/w)/s → 1/w for small angles.
    let factor = if sine < 1e-9 {
        2.0 / w
    } else {
        2.0 * sine.atan2(w) / sine
    };
    v * factor
}

/// J with log(exp(v) exp(δ)) = v + J δ + O(δ²): I + ½[v]× + (1/θ² − (1 + cos θ)/(2θ sin θ)) [v]×², θ = ‖v‖. The
/// last factor is (1 − (θ/2)/tan(θ/2))/θ², and tends to 1/12.
pub(super) fn right_jacobian_inverse(v: &Vector3<f64>) -> Matrix3<f64> {
    let cross = v.cross_matrix();
    let angle = v.norm();
    let half = 0.5 * angle;
    let factor = if angle < 1e-4 {
        1.0 / 12.0
    } else {
        (1.0 - half / half.tan()) / (angle * angle)
    };
    Matrix3::identity() + cross * 0.5 + cross * cross * factor
}

/// J with log(exp(δ) exp(v)) = v + J δ + O(δ²).
pub(super) fn left_jacobian_inverse(v: &Vector3<f64>) -> Matrix3<f64> {
    right_jacobian_inverse(&-v)
}

/// The angle about +Z of the rotation about Z that is nearest to this one, radians, −π to π.
pub(super) fn heading(q: &UnitQuaternion<f64>) -> f64 {
    let angle = 2.0 * q.k.atan2(q.w);
    angle - (angle / std::f64::consts::TAU).round() * std::f64::consts::TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_undoes_exp_and_the_jacobians_are_its_derivatives() {
        for v in [
            Vector3::new(0.3, -0.8, 1.1),
            Vector3::new(2.0, 1.0, -1.9),
            Vector3::new(1e-7, 0.0, -2e-7),
        ] {
            assert!((log(&exp(&v)) - v).norm() < 1e-12);
            let step = 1e-6;
            for i in 0..3 {
                let d = Vector3::ith(i, step);
                let right = (log(&(exp(&v) * exp(&d))) - log(&(exp(&v) * exp(&-d)))) / (2.0 * step);
                let left = (log(&(exp(&d) * exp(&v))) - log(&(exp(&-d) * exp(&v)))) / (2.0 * step);
                assert!((right - right_jacobian_inverse(&v).column(i)).norm() < 1e-7);
                assert!((left - left_jacobian_inverse(&v).column(i)).norm() < 1e-7);
            }
        }
    }

    #[test]
    fn heading_is_the_turn_about_z() {
        let turn = exp(&Vector3::new(0.0, 0.0, 2.5));
        assert!((heading(&turn) - 2.5).abs() < 1e-12);
        assert!((heading(&exp(&Vector3::new(0.0, 0.7, 0.0)))).abs() < 1e-12);
    }
}
