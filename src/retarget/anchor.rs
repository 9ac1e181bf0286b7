//! What touches the ground: contacts of the source, and the points of the skeleton that are held in place for them.

use crate::humanoid::Slot;
use nalgebra::Vector3;

/// A contact point of the skeleton that should be at a place, or at a height, in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor {
    /// Index in [`super::model::Model::contact_points`].
    pub point: usize,
    /// Where the point's centre should be, world, metres.
    pub at: Vector3<f64>,
    /// How near the ground it stands: 0 to 1.
    pub weight: f64,
    /// How firmly it is held there: 0 to 1, rising where a stance begins and falling where it ends.
    pub hold: f64,
    /// Whether only its height counts: what rolls or slides over the ground isn't held in place.
    pub is_level: bool,
}

/// Weight from which on an anchor counts as contact. Chosen: half.
const CONTACT: f64 = 0.5;

impl Anchor {
    /// Whether the point is in contact with the ground.
    pub fn is_contact(&self) -> bool {
        self.weight >= CONTACT
    }
}

/// In which frames a foot or hand of the source is on the ground.
#[derive(Clone, Debug)]
pub(super) struct SourceContact {
    /// The foot or hand.
    pub slot: Slot,
    /// By frame.
    pub touches: Vec<bool>,
}
