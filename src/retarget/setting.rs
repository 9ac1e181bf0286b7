//! What lengths and times are measured by.

use super::limbs::FEET;
use crate::clip::{Clip, LoopMode};
use crate::skeleton::Skeleton;

/// Rate and loop of a clip, and sizes of the skeleton that it is carried onto. Thresholds of contact are in leg lengths and
/// seconds, so that they mean the same for every figure and rate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    /// Frames per second.
    pub fps: f64,
    /// Whether the clip repeats.
    pub loop_mode: LoopMode,
    /// The skeleton's leg length, metres.
    pub leg: f64,
    /// Height of the skeleton's ankles above its soles, metres.
    pub ankle: f64,
}

impl Setting {
    /// Measures clip and skeleton.
    pub fn new(clip: &Clip, skeleton: &Skeleton) -> Setting {
        Setting {
            fps: clip.fps,
            loop_mode: clip.loop_mode,
            leg: skeleton.leg_length(),
            ankle: ankle_height(skeleton),
        }
    }
}

/// Mean height of the skeleton's ankles above its soles in its rest pose, metres.
fn ankle_height(skeleton: &Skeleton) -> f64 {
    let rest = skeleton.forward(&skeleton.rest_qpos());
    let heights: Vec<f64> = FEET
        .iter()
        .filter_map(|slot| Some(rest[*skeleton.slots.get(slot)?].translation.z))
        .collect();
    heights.iter().sum::<f64>() / heights.len().max(1) as f64
}
