//! Hands go where the source puts them down, not where the skeleton's own arms would end in the air.

use super::footing::{Move, apply};
use super::goals::Goals;
use super::ground::Ground;
use super::source::Source;
use super::stance::Contacts;
use nalgebra::Vector3;

/// Time before and after a contact in which a hand goes over to its place on the ground, s.
const FADE: f64 = 0.25;

/// Moves the goals of a hand to the scaled source's wrist while that rests on the ground; `stands` tells when.
pub(super) fn set_down(
    goals: &mut Goals,
    source: &Source,
    (hand, stands): &Contacts,
    ground: &Ground,
    fps: f64,
) {
    let Some(key) = goals.keys.iter().position(|key| key.slot == *hand) else {
        return;
    };
    let weights = fade(stands, FADE * fps);
    for (f, weight) in weights.into_iter().enumerate().filter(|(_, w)| *w > 0.0) {
        let Some(wrist) = source.at(*hand, f) else {
            continue;
        };
        // The goals are still as high as the source's ankles; hands aren't lifted with the soles.
        let wrist = wrist + Vector3::z() * ground.lift;
        let by = Move {
            shift: (wrist - goals.points[f][key]) * weight,
            turn: 0.0,
        };
        apply(goals, f, key, &by);
    }
}

/// 1 in contact, fading smoothly over `reach` frames around it.
fn fade(stands: &[bool], reach: f64) -> Vec<f64> {
    let away = |order: &mut dyn Iterator<Item = usize>| {
        let mut last: Option<usize> = None;
        let mut away = vec![f64::INFINITY; stands.len()];
        for (step, f) in order.enumerate() {
            last = if stands[f] { Some(step) } else { last };
            away[f] = last.map_or(f64::INFINITY, |at| (step - at) as f64);
        }
        away
    };
    let before = away(&mut (0..stands.len()));
    let after = away(&mut (0..stands.len()).rev());
    let near = before.iter().zip(&after).map(|(a, b)| a.min(*b));
    near.map(|frames| {
        let t = (1.0 - frames / reach.max(1.0)).max(0.0);
        t * t * (3.0 - 2.0 * t)
    })
    .collect()
}
