//! Stage 5, stance: finds which points of feet and hands stand on the ground, when and where, and moves the goals of feet and
//! hands along.
//!
//! Feet stand where they are low and slow themselves, hands where the source's do. A point that stands becomes an [`Anchor`]
//! in each frame of its stance, at one place on the ground. The limb's targets are moved so that its standing points are
//! there.

mod foothold;
mod held;
mod shift;
mod timeline;

use super::anchor::{Anchor, SourceContact};
use super::end_effector::{EndEffector, end_effectors, paths};
use super::goals::Goals;
use super::model::Model;
use super::seam::Seam;
use super::setting::Setting;
use held::{Held, Limb};
use timeline::Timeline;

/// Goals with feet and hands where they stand.
pub(super) struct Planted {
    /// What the skeleton should look like.
    pub goals: Goals,
    /// The points that stand, by frame.
    pub anchors: Vec<Vec<Anchor>>,
    /// The feet and hands that have goals.
    pub effectors: Vec<EndEffector>,
}

/// Finds which points stand on the ground, which is at z = 0, and moves goals along.
pub(super) fn plant(
    mut goals: Goals,
    seam: Option<&Seam>,
    contacts: &[SourceContact],
    model: &Model,
    setting: &Setting,
) -> Planted {
    let effectors = end_effectors(model, &goals);
    let timeline = Timeline::new(goals.frames(), seam.map(|seam| &seam.cycle));
    let mut anchors = vec![Vec::new(); goals.frames()];
    let paths = paths(model, &goals, &effectors);
    for (effector, paths) in effectors.iter().zip(paths) {
        let limb = Limb {
            effector,
            paths: paths.iter().map(|path| timeline.extend(path)).collect(),
            touches: trusted(contacts, effector, seam).map(|flags| timeline.repeat(&flags)),
        };
        let held = held::held(model, &limb, setting);
        // From the points that stand to how the whole limb moves, and back to the frames of the goals.
        let own: Vec<_> = goals.points.iter().map(|p| p[effector.keypoint]).collect();
        let shifts = shift::shifts(&held, &timeline.extend(&own), setting.fps);
        let own = held.iter().zip(&shifts).skip(timeline.margin);
        for (f, (frame, (held, by))) in anchors.iter_mut().zip(own).enumerate() {
            frame.extend(held.iter().map(Held::anchor));
            goals.shift_limb(f, effector.keypoint, by);
        }
    }
    Planted {
        goals,
        anchors,
        effectors,
    }
}

/// The source's contact of a limb as far as it decides when the limb stands, by frame: a hand's everywhere; a foot's only
/// where closing a seam moved the foot so far that its own speed means nothing.
fn trusted(
    contacts: &[SourceContact],
    effector: &EndEffector,
    seam: Option<&Seam>,
) -> Option<Vec<bool>> {
    let contact = contacts.iter().find(|c| c.slot == effector.slot)?;
    let hidden = |f: usize| seam.is_some_and(|seam| seam.hides_stance(effector.keypoint, f));
    let trusts = |(f, touches): (usize, &bool)| *touches && (!effector.is_foot || hidden(f));
    Some(contact.touches.iter().enumerate().map(trusts).collect())
}
