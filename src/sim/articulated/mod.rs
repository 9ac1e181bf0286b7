//! Our own engine: a character in reduced coordinates on a plane.
//!
//! Joints can't come apart, as they are the coordinates. A step is semi-implicit: drives and the ends of ranges are taken
//! at its end, so that they are stable at any stiffness, and contacts are solved over the inertia of the whole
//! character. Up to eight characters take a step together, each number of theirs in a lane of a vector; what a character
//! does depends on neither the others nor its lane.

mod algebra;
mod contact;
mod dynamics;
mod ground;
mod lanes;
mod matrix;
mod pose;
mod solve;
mod spatial;
mod state;
mod step;
#[cfg(test)]
mod tests;
mod tree;

use super::character::Character;
use super::error::Diverged;
use super::settings::Settings;
use super::state::{LinkState, Target};
use nalgebra::Vector3;
use state::State;
use std::sync::Arc;
use step::Workspace;
use tree::Tree;

pub use lanes::LANES;

pub(super) struct Articulated {
    tree: Arc<Tree>,
    state: State,
    settings: Settings,
    /// Of those that step together the first has it.
    workspace: Workspace,
}

/// One of the characters of a step, and where it leaves what came of it.
pub(super) struct Stepped<'a> {
    pub mover: &'a mut Articulated,
    pub states: &'a mut [LinkState],
    pub contacts: &'a mut [bool],
    pub result: &'a mut Result<(), Diverged>,
}

impl Articulated {
    pub fn new(character: &Character, settings: Settings) -> Self {
        let tree = Arc::new(Tree::new(character));
        Articulated {
            state: State::new(&tree),
            workspace: Workspace::default(),
            tree,
            settings,
        }
    }

    pub fn reset(&mut self, states: &[LinkState]) {
        self.state.reset(&self.tree, states);
    }

    pub fn vary(&mut self, mass: f32, friction: f32) {
        (self.state.mass, self.state.friction) = (mass, friction);
    }

    pub fn push(&mut self, node: usize, impulse: Vector3<f32>) {
        self.state.pushes.push((node, impulse));
    }

    pub fn set_targets(&mut self, targets: &[Target]) {
        self.state.aim(targets);
    }

    /// Advances up to [`LANES`] characters of one tree and one setting by a control step.
    ///
    /// # Panics
    /// If they aren't of one setting, or their trees differ in size.
    pub fn step(stepped: &mut [Stepped]) {
        let Some((first, others)) = stepped.split_first_mut() else {
            return;
        };
        let of_a_kind = |other: &Stepped| first.mover.is_like(other.mover);
        assert!(
            others.iter().all(of_a_kind),
            "characters of different kinds step together"
        );
        let mut workspace = std::mem::take(&mut first.mover.workspace);
        workspace.step(stepped);
        stepped[0].mover.workspace = workspace;
    }

    fn is_like(&self, other: &Self) -> bool {
        let size = |tree: &Tree| (tree.nodes.len(), tree.coordinates.len(), tree.points());
        self.settings == other.settings && size(&self.tree) == size(&other.tree)
    }
}
