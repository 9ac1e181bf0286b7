//! One character of our own engine, as [`crate::sim::World`] uses it.

use super::super::character::Character;
use super::super::error::Diverged;
use super::super::settings::Settings;
use super::super::state::{LinkState, Target};
use super::state::State;
use super::step::{Lane, Workspace};
use super::tree::Tree;
use nalgebra::Vector3;
use std::sync::Arc;

/// A character: its model, which clones share, and its state.
pub(in crate::sim) struct Articulated {
    tree: Arc<Tree>,
    state: State,
    settings: Settings,
    /// Of characters that step together, the first one's is used.
    workspace: Workspace,
}

/// A character that takes part in a step, and where the step writes its results.
pub(in crate::sim) struct Stepped<'a> {
    pub engine: &'a mut Articulated,
    /// One per link.
    pub states: &'a mut [LinkState],
    /// One per link: whether it presses on the ground.
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

    /// Puts every link where `states` says, and forgets the past.
    pub fn reset(&mut self, states: &[LinkState]) {
        self.state.reset(&self.tree, states);
    }

    /// Scales masses and friction until the next reset.
    pub fn vary(&mut self, mass: f32, friction: f32) {
        (self.state.mass, self.state.friction) = (mass, friction);
    }

    /// Gives a link an impulse at its centre of mass, world axes, N·s, in the next substep.
    pub fn push(&mut self, link: usize, impulse: Vector3<f32>) {
        self.state.pushes.push((link, impulse));
    }

    /// Sets the targets of the drives, one per link.
    pub fn set_targets(&mut self, targets: &[Target]) {
        self.state.set_targets(targets);
    }

    /// Advances up to [`super::LANES`] characters of one tree and one setting by a control step.
    ///
    /// # Panics
    /// If they have different settings, or trees of different sizes.
    pub fn step(stepped: &mut [Stepped]) {
        let Some((first, others)) = stepped.split_first_mut() else {
            return;
        };
        let of_a_kind = |other: &Stepped| first.engine.is_like(other.engine);
        assert!(
            others.iter().all(of_a_kind),
            "characters of different kinds step together"
        );
        let (tree, settings) = (Arc::clone(&first.engine.tree), first.engine.settings);
        let mut workspace = std::mem::take(&mut first.engine.workspace);
        let mut lanes: Vec<Lane> = stepped.iter_mut().map(Stepped::lane).collect();
        workspace.step(&tree, &settings, &mut lanes);
        stepped[0].engine.workspace = workspace;
    }

    fn is_like(&self, other: &Self) -> bool {
        let size = |tree: &Tree| (tree.nodes.len(), tree.coordinates.len(), tree.points());
        self.settings == other.settings && size(&self.tree) == size(&other.tree)
    }
}

impl Stepped<'_> {
    fn lane(&mut self) -> Lane<'_> {
        Lane {
            state: &mut self.engine.state,
            links: self.states,
            contacts: self.contacts,
            result: self.result,
        }
    }
}
