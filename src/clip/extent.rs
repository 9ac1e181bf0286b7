//! The size of a set of points.

use nalgebra::Vector3;

/// Longest side of the box around these points, along the axes of their coordinates, in their unit; 0 without points.
pub(crate) fn extent(places: impl Iterator<Item = Vector3<f64>> + Clone) -> f64 {
    let side = |axis: usize| {
        let along = places.clone().map(|place| place[axis]);
        let (low, high) = along.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
        high - low
    };
    (0..3).map(side).fold(0.0, f64::max)
}
