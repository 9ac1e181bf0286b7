//! A control step of up to eight characters, from top to bottom.

use super::super::error::Diverged;
use super::super::settings::Settings;
use super::Stepped;
use super::contact::Contacts;
use super::dynamics::Dynamics;
use super::ground::Ground;
use super::lanes::{LANES, Lanes, Work, on_widest};
use super::pose::Pose;
use super::tree::Tree;
use nalgebra::Vector3;
use std::any::Any;
use std::sync::Arc;

/// How often a step is taken at most, until no drive is beyond its limit.
const MOST_PASSES: usize = 3;

/// What a step works in, of the kind of lanes that this machine has.
#[derive(Default)]
pub(super) struct Workspace(Option<Box<dyn Any + Send + Sync>>);

struct Room<L> {
    pose: Pose<L>,
    dynamics: Dynamics<L>,
    contacts: Contacts<L>,
    /// Lane, node and impulse of what the next step gives.
    pushes: Vec<(usize, usize, Vector3<f32>)>,
}

struct ControlStep<'a, 'b> {
    workspace: &'a mut Workspace,
    stepped: &'a mut [Stepped<'b>],
}

impl Workspace {
    pub fn step(&mut self, stepped: &mut [Stepped]) {
        on_widest(ControlStep {
            workspace: self,
            stepped,
        });
    }

    #[inline(always)]
    pub fn step_on<L: Lanes>(&mut self, stepped: &mut [Stepped]) {
        let tree = Arc::clone(&stepped[0].mover.tree);
        let settings = stepped[0].mover.settings;
        self.of::<L>(&tree).advance(&tree, &settings, stepped);
    }

    fn of<L: Lanes>(&mut self, tree: &Tree) -> &mut Room<L> {
        let made = self.0.get_or_insert_with(|| {
            Box::new(Room::<L> {
                pose: Pose::new(tree),
                dynamics: Dynamics::new(tree),
                contacts: Contacts::new(tree),
                pushes: Vec::new(),
            })
        });
        made.downcast_mut()
            .expect("a machine has one kind of lanes")
    }
}

impl Work for ControlStep<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.workspace.step_on::<L>(self.stepped);
    }
}

impl<L: Lanes> Room<L> {
    #[inline(always)]
    fn advance(&mut self, tree: &Tree, settings: &Settings, stepped: &mut [Stepped]) {
        self.take(stepped);
        self.pose.place(tree);
        self.dynamics.survey(tree, &self.pose);
        let ground = Ground {
            dt: (1.0 / settings.physics_hz()) as f32,
            yielding: settings.contact_s as f32,
        };
        for _ in 0..settings.steps_per_control {
            for one in stepped.iter_mut() {
                one.contacts.fill(false);
            }
            for _ in 0..settings.substeps {
                self.substep(tree, &ground, stepped.len());
                for (lane, one) in stepped.iter_mut().enumerate() {
                    self.contacts.mark(lane, one.contacts);
                }
            }
        }
        self.give(stepped);
    }

    fn take(&mut self, stepped: &mut [Stepped]) {
        // Lanes that nobody is in start as the first does: they need numbers that stay finite.
        for lane in 0..LANES {
            let one = stepped.get(lane).unwrap_or(&stepped[0]);
            self.pose.take(lane, &one.mover.state);
            self.dynamics.take(lane, &one.mover.state);
        }
        self.pushes.clear();
        for (lane, one) in stepped.iter_mut().enumerate() {
            let state = &mut one.mover.state;
            self.contacts.take(lane, state);
            let pushes = state.pushes.drain(..);
            self.pushes
                .extend(pushes.map(|(node, push)| (lane, node, push)));
        }
    }

    fn give(&mut self, stepped: &mut [Stepped]) {
        for (lane, one) in stepped.iter_mut().enumerate() {
            let state = &mut one.mover.state;
            self.pose.give(lane, state);
            self.dynamics.give(lane, state);
            self.contacts.give(lane, state);
            *one.result = if state.velocity.iter().all(|v| v.is_finite()) {
                self.pose.read(&self.dynamics.motions, lane, one.states);
                Ok(())
            } else {
                Err(Diverged)
            };
        }
    }

    #[inline(always)]
    fn substep(&mut self, tree: &Tree, ground: &Ground, lanes: usize) {
        let Room {
            pose,
            dynamics,
            contacts,
            pushes,
        } = self;
        let mut outside = dynamics.load(tree, pose, pushes, ground.dt);
        pushes.clear();
        contacts.find(tree, pose, &dynamics.motions, (ground, lanes));
        // Lanes that nobody is in settle for the first pass.
        let (used, mut open) = ((1 << lanes) - 1, (1 << LANES) - 1);
        for _ in 0..MOST_PASSES {
            dynamics.accelerate(tree, pose, ground.dt);
            contacts.resolve(tree, pose, dynamics, open & used);
            open = dynamics.finish(tree, open, ground.dt) & used;
            if open == 0 {
                break;
            }
        }
        outside += contacts.impulse(pose);
        let momentum = dynamics.momentum_after(&outside);
        dynamics.apply(pose);
        pose.advance(tree, L::splat(ground.dt));
        pose.place(tree);
        dynamics.survey(tree, pose);
        dynamics.conserve(pose, &momentum);
    }
}
