//! Which parts of the character may touch the ground, and when: those that the reference has there.
//!
//! A body may touch while the reference's own is near the ground, a little before that and a little after. Feet always may,
//! for a step that saves is no fall.

use crate::clip::LoopMode;
use crate::sim::LinkState;
use crate::task::model::CharacterModel;

/// Height of a body's lowest point in the reference up to which the agent's may touch the ground, leg lengths.
const NEAR: f64 = 0.06;
/// Time before and after in which it still may, s.
const AROUND_S: f64 = 0.15;

/// `[f][contact]`: whether the agent may touch the ground with each of [`CharacterModel::contacts`] at frame `f` of the
/// reference's table, whose `frames` follow each other at `rate` Hz.
pub(super) fn may_touch(
    model: &CharacterModel,
    frames: &[Vec<LinkState>],
    rate: f64,
    loop_mode: LoopMode,
) -> Vec<Vec<bool>> {
    let near = (NEAR * model.skeleton.leg_length()) as f32;
    let reach = (AROUND_S * rate).round() as usize;
    let mut may = vec![Vec::with_capacity(model.contacts.len()); frames.len()];
    for contact in &model.contacts {
        let low: Vec<bool> = frames.iter().map(|f| contact.lowest(f) < near).collect();
        let widened = widen(&low, reach, loop_mode);
        for (row, near) in may.iter_mut().zip(widened) {
            row.push(contact.is_foot || near);
        }
    }
    may
}

/// Whether a flag is set within `reach` frames. The last frame of a motion that wraps is its first.
fn widen(flags: &[bool], reach: usize, loop_mode: LoopMode) -> Vec<bool> {
    let last = flags.len() - 1;
    let mut wide = vec![false; flags.len()];
    for at in (0..flags.len()).filter(|at| flags[*at]) {
        // From the first frame that this one reaches, counted in a cycle before where they go on.
        for near in at + last - reach.min(last)..=at + last + reach.min(last) {
            match loop_mode {
                LoopMode::Wrap => wide[near % last.max(1)] = true,
                LoopMode::Clamp => {
                    if let Some(wide) = near.checked_sub(last).and_then(|f| wide.get_mut(f)) {
                        *wide = true;
                    }
                }
            }
        }
    }
    if loop_mode == LoopMode::Wrap {
        wide[last] = wide[0];
    }
    wide
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_widen_in_time_and_over_the_seam() {
        let wide = |set: usize, mode| -> Vec<usize> {
            let flags: Vec<bool> = (0..8).map(|f| f == set).collect();
            let wide = widen(&flags, 2, mode);
            (0..8).filter(|f| wide[*f]).collect()
        };
        assert_eq!(wide(4, LoopMode::Clamp), [2, 3, 4, 5, 6]);
        assert_eq!(wide(0, LoopMode::Clamp), [0, 1, 2]);
        // Frame 7 is frame 0 of the next cycle.
        assert_eq!(wide(6, LoopMode::Wrap), [0, 1, 4, 5, 6, 7]);
        assert_eq!(wide(1, LoopMode::Wrap), [0, 1, 2, 3, 6, 7]);
    }
}
