//! The animated character that a simulated one follows, with velocities.

use super::gaits::Gaits;
use super::walker::{Scratch, Walker};
use crate::sim::LinkState;
use crate::task::step::Wish;
use nalgebra::{Isometry3, Vector2};
use std::sync::Arc;

/// An animated character that goes where it is asked to.
pub(super) struct Guide {
    gaits: Arc<Gaits>,
    walker: Walker,
    scratch: Scratch,
    /// Where the links were before the last step, and are after it.
    before: Vec<Isometry3<f32>>,
    now: Vec<Isometry3<f32>>,
}

impl Guide {
    /// One that stands at the origin and faces along X.
    pub fn new(gaits: Arc<Gaits>) -> Guide {
        let mut scratch = Scratch::new(&gaits);
        let walker = Walker::new(&gaits, &mut scratch);
        Guide {
            walker,
            before: scratch.links.clone(),
            now: scratch.links.clone(),
            gaits,
            scratch,
        }
    }

    /// Moves it along the ground, metres.
    pub fn shift(&mut self, by: &Vector2<f32>) {
        self.walker.shift(by);
        for link in self.before.iter_mut().chain(&mut self.now) {
            link.translation.vector += by.push(0.0);
        }
    }

    /// Goes on for `dt` seconds, and writes the state of its links. Velocities are those from the step before to the step after, if
    /// the wish stays: means over a step on either side, as those of a reference of imitation.
    pub fn advance(&mut self, wish: &Wish, dt: f32, links: &mut [LinkState]) {
        std::mem::swap(&mut self.before, &mut self.now);
        self.walker
            .advance(wish, dt, &self.gaits, &mut self.scratch);
        self.now.copy_from_slice(&self.scratch.links);
        let mut next = self.walker;
        next.advance(wish, dt, &self.gaits, &mut self.scratch);
        let around = self.before.iter().zip(&self.scratch.links);
        for ((link, pose), (before, after)) in links.iter_mut().zip(&self.now).zip(around) {
            let turn = after.rotation * before.rotation.inverse();
            *link = LinkState {
                pose: *pose,
                linear: (after.translation.vector - before.translation.vector) / (2.0 * dt),
                angular: turn.scaled_axis() / (2.0 * dt),
            };
        }
    }

    /// Writes about where the links will be `seconds` after the last step, and returns which feet will stand.
    pub fn preview(&mut self, wish: &Wish, seconds: f32, links: &mut [LinkState]) -> [bool; 2] {
        let scratch = &mut self.scratch;
        let stands = self.walker.preview(wish, seconds, &self.gaits, scratch);
        for (link, pose) in links.iter_mut().zip(&scratch.links) {
            link.pose = *pose;
        }
        stands
    }

    /// Velocity over the ground, m/s.
    #[cfg(test)]
    pub fn velocity(&self) -> Vector2<f32> {
        self.walker.velocity.at
    }

    /// Which feet stand, left and right.
    pub fn stands(&self) -> [bool; 2] {
        self.walker.feet.stand()
    }
}
