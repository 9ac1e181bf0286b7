//! Which contact points of a limb stand in which frames.

use super::foothold::{Track, footholds};
use crate::clip::LoopMode;
use crate::motion::contact;
use crate::retarget::anchor::Anchor;
use crate::retarget::end_effector::EndEffector;
use crate::retarget::fade::ramp;
use crate::retarget::model::Model;
use crate::retarget::setting::Setting;
use nalgebra::Vector3;

/// Heights of a point of a foot's sole up to which it is held fully, and from which on not at all, leg lengths. Chosen: 1.4
/// and 4.5 cm for a leg of 0.9 m, within the heights at which [`contact`] takes a foot to stand.
const SOLE: [f64; 2] = [0.015, 0.05];
/// The same for hands. Chosen higher, for the source's wrists stay above the ground.
const HAND: [f64; 2] = [0.12, 0.2];
/// Height above a hand's lowest point up to which the hand stands on a point, metres. Chosen.
const PALM: f64 = 0.02;

/// A foot or hand over the whole timeline.
pub(super) struct Limb<'a> {
    /// The foot or hand.
    pub effector: &'a EndEffector,
    /// `paths[p][f]`: centre of its contact point `p`, world, metres.
    pub paths: Vec<Vec<Vector3<f64>>>,
    /// Whether the source's limb stands, where that is to be trusted.
    pub touches: Option<Vec<bool>>,
}

/// A contact point that stands in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    /// Index in [`Model::contact_points`].
    pub point: usize,
    /// Where the goals have it, world, metres.
    pub from: Vector3<f64>,
    /// Where it should be, world, metres.
    pub at: Vector3<f64>,
    /// As in [`Anchor`].
    pub weight: f64,
    /// As in [`Anchor`].
    pub hold: f64,
}

impl Held {
    /// What the solver holds the point by.
    pub fn anchor(&self) -> Anchor {
        Anchor {
            point: self.point,
            at: self.at,
            weight: self.weight,
            hold: self.hold,
            is_level: false,
        }
    }
}

/// The points of a limb that stand, by frame.
pub(super) fn held(model: &Model, limb: &Limb, setting: &Setting) -> Vec<Vec<Held>> {
    let frames = limb.paths.first().map_or(0, Vec::len);
    let mut held: Vec<Vec<Held>> = vec![Vec::new(); frames];
    for (k, (&point, path)) in limb.effector.points.iter().zip(&limb.paths).enumerate() {
        let weights = match limb.effector.is_foot {
            true => limb.sole_weights(model, k, setting),
            false => limb.hand_weights(model, k, setting),
        };
        // Each run of frames in which the point stands has one place on the ground.
        let track = Track {
            path,
            weights: &weights,
            radius: model.contact_points[point].radius,
            fps: setting.fps,
            leg: setting.leg,
        };
        for (f, foothold) in footholds(&track) {
            held[f].push(Held {
                point,
                from: path[f],
                at: foothold.at,
                weight: foothold.weight,
                // Goals lead hands down to the ground and up again, so a stance needn't take hold of them slowly.
                hold: match limb.effector.is_foot {
                    true => foothold.hold,
                    false => foothold.weight,
                },
            });
        }
    }
    held
}

impl Limb<'_> {
    /// Height of the lowest point of contact point `k` in a frame, metres.
    fn bottom(&self, model: &Model, k: usize, f: usize) -> f64 {
        self.paths[k][f].z - model.contact_points[self.effector.points[k]].radius
    }

    /// Whether the source's limb stands, where that is to be trusted.
    fn touches(&self, f: usize) -> bool {
        self.touches.as_ref().is_some_and(|touches| touches[f])
    }

    /// How near the ground a point of a foot stands, by frame: it rests low, or the source says so. NaN where it doesn't stand.
    fn sole_weights(&self, model: &Model, k: usize, setting: &Setting) -> Vec<f64> {
        let radius = model.contact_points[self.effector.points[k]].radius;
        let path = &self.paths[k];
        let sole = |p: &Vector3<f64>| vec![p - Vector3::z() * radius];
        let soles: Vec<Vec<Vector3<f64>>> = path.iter().map(sole).collect();
        let (fps, leg) = (setting.fps, setting.leg);
        // The timeline has a margin already, so it is judged as one that ends.
        let rests = contact::detect_above(&soles, 0.0, fps, leg, LoopMode::Clamp);
        let weight = |f: usize| match rests[f] || self.touches(f) {
            true => ramp(SOLE, self.bottom(model, k, f) / leg),
            false => f64::NAN,
        };
        (0..path.len()).map(weight).collect()
    }

    /// The same of a hand: it stands where the source's does, on its lowest points.
    fn hand_weights(&self, model: &Model, k: usize, setting: &Setting) -> Vec<f64> {
        let height = |k: usize, f: usize| self.bottom(model, k, f);
        let is_lowest = |f: usize| {
            let mut points = 0..self.paths.len();
            // A palm lies on several points; the back of the hand is no support.
            points.all(|other| height(k, f) < height(other, f) + PALM)
        };
        let weight = |f: usize| match self.touches(f) && is_lowest(f) {
            true => ramp(HAND, height(k, f) / setting.leg),
            false => f64::NAN,
        };
        (0..self.paths[k].len()).map(weight).collect()
    }
}
