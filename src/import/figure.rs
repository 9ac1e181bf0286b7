//! Whether a file's figure is a humanoid, for guesses about its axes.

use crate::clip::Joint;
use crate::humanoid::{self, HumanoidMap};

/// No humanoid is looked for among more joints than this. Chosen: the search would take long, and no rig of one has as many.
const MOST_JOINTS: usize = 4096;

/// The joint map of a humanoid; `None` for other figures.
pub(crate) fn humanoid(joints: &[Joint]) -> Option<HumanoidMap> {
    (joints.len() <= MOST_JOINTS).then(|| humanoid::map(joints).ok())?
}
