//! How to retarget.

use super::error::{MOST_WEIGHT, RetargetError};
use crate::humanoid::{HumanoidMap, Slot};
use std::collections::BTreeMap;

/// How to retarget. The default finds the joint map itself and stays as near to the source as the skeleton can.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Which joint of the clip stands for which slot. Left out, [`crate::humanoid::map`] finds it.
    pub map: Option<HumanoidMap>,
    /// Multiplies how much the position and orientation of a slot count in the fit: 0 to 100. A slot that is left out counts
    /// once. Feet and hands that stand on the ground are held in place whatever their weight.
    pub weights: BTreeMap<Slot, f64>,
    /// Whether a simulated body will perform the motion. The motion is then a little farther from its source and nearer to
    /// what a body can do: flights begin as early and end as late as they can, so that the last push from the ground already
    /// has the spin of the flight; and a flight that would need more than 0.5 rad of turning to spin freely, which is
    /// otherwise left as it is, is turned by 0.3 rad.
    pub to_perform: bool,
}

/// Refuses weights out of range.
///
/// # Errors
/// [`RetargetError::Weight`] for the first slot whose weight isn't within 0 to [`MOST_WEIGHT`].
pub(super) fn check_weights(weights: &BTreeMap<Slot, f64>) -> Result<(), RetargetError> {
    let wrong = weights
        .iter()
        .find(|(_, weight)| !(0.0..=MOST_WEIGHT).contains(*weight));
    match wrong {
        Some((&slot, &weight)) => Err(RetargetError::Weight { slot, weight }),
        None => Ok(()),
    }
}
