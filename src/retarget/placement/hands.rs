//! Hands go down where the source's do. The end of the skeleton's own arm would be in the air there, or in the ground.

use super::ground::Ground;
use crate::retarget::anchor::SourceContact;
use crate::retarget::fade::smoothstep;
use crate::retarget::goals::{Goals, LimbShift};
use crate::retarget::source::Source;
use nalgebra::Vector3;

/// Time before and after a contact in which a hand goes over to its place on the ground, s. Chosen: about what a hand takes
/// to reach down.
const FADE: f64 = 0.25;

/// Moves a hand's targets to the scaled source's wrist while that is on the ground.
pub(super) fn set_down(
    mut goals: Goals,
    source: &Source,
    hand: &SourceContact,
    ground: &Ground,
    fps: f64,
) -> Goals {
    let Some(key) = goals.keypoint(hand.slot) else {
        return goals;
    };
    let weights = fade(&hand.touches, FADE * fps);
    for (f, weight) in weights.into_iter().enumerate().filter(|(_, w)| *w > 0.0) {
        let Some(wrist) = source.at(hand.slot, f) else {
            continue;
        };
        // All goals will be lowered by the ground's lift, which is that of the soles. A hand is on the ground without it.
        let wrist = wrist + Vector3::z() * ground.lift;
        let by = LimbShift {
            shift: (wrist - goals.points[f][key]) * weight,
            turn: 0.0,
        };
        goals.shift_limb(f, key, &by);
    }
    goals
}

/// 1 in contact, fading smoothly over `reach` frames on either side.
fn fade(touches: &[bool], reach: f64) -> Vec<f64> {
    // Frames since the last contact, going through the frames in this order.
    let away = |order: &mut dyn Iterator<Item = usize>| {
        let mut last: Option<usize> = None;
        let mut away = vec![f64::INFINITY; touches.len()];
        for (step, f) in order.enumerate() {
            last = if touches[f] { Some(step) } else { last };
            away[f] = last.map_or(f64::INFINITY, |at| (step - at) as f64);
        }
        away
    };
    let since = away(&mut (0..touches.len()));
    let until = away(&mut (0..touches.len()).rev());
    let near = since.iter().zip(&until).map(|(a, b)| a.min(*b));
    let weight = |frames: f64| smoothstep((1.0 - frames / reach.max(1.0)).max(0.0));
    near.map(weight).collect()
}
