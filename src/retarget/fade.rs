//! Weights that fade between 0 and 1.

/// 1 up to the value `full`, 0 from `none` on, a straight line in between.
pub(super) fn ramp([full, none]: [f64; 2], value: f64) -> f64 {
    ((none - value) / (none - full)).clamp(0.0, 1.0)
}

/// 3t² − 2t³: rises from 0 at t = 0 to 1 at t = 1 and is level at both ends, so that whatever it fades begins and ends
/// without a jump of velocity. `t` is between 0 and 1.
pub(super) fn smoothstep(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fade_is_level_at_both_ends() {
        assert_eq!(
            (smoothstep(0.0), smoothstep(0.5), smoothstep(1.0)),
            (0.0, 0.5, 1.0)
        );
        let slope = |t: f64| (smoothstep(t + 1e-6) - smoothstep(t - 1e-6)) / 2e-6;
        assert!(slope(0.0).abs() < 1e-5 && slope(1.0).abs() < 1e-5);
        // The derivative 6t − 6t² is greatest in the middle.
        assert!((slope(0.5) - 1.5).abs() < 1e-9);
    }

    #[test]
    fn a_ramp_is_straight_between_its_ends() {
        let at = |value| ramp([1.0, 3.0], value);
        assert_eq!(
            [at(0.0), at(1.0), at(2.0), at(3.0), at(9.0)],
            [1.0, 1.0, 0.5, 0.0, 0.0]
        );
    }
}
