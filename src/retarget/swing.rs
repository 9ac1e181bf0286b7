//! Feet in the air.
//!
//! A foot stands where the scaled source's does, or steps would slide. A leg of other proportions gets there by bending
//! otherwise, the more so the further it is folded. In the air nothing asks for that: there a foot hangs on the
//! skeleton's own leg, whose bones have the source's directions.

use super::goals::{Goals, LEGS};
use super::stance::ramp;

/// Heights of an ankle above where it stands between which its foot goes over to the leg, leg lengths.
const ALOFT: [f64; 2] = [0.1, 0.5];

/// Moves the goals of the ankles that are higher above the ground, z = 0, than the `ankle` of a foot that stands.
pub(super) fn hang(goals: &mut Goals, ankle: f64, leg: f64) {
    for (side, [.., foot]) in LEGS.iter().enumerate() {
        let Some(key) = goals.keys.iter().position(|key| key.slot == *foot) else {
            continue;
        };
        for (points, hanging) in goals.points.iter_mut().zip(&goals.hanging) {
            let flies = 1.0 - ramp(ALOFT, (points[key].z - ankle) / leg);
            points[key] += hanging[side] * (flies * flies * (3.0 - 2.0 * flies));
        }
    }
}
