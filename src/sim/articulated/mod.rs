//! Our own engine: a character in reduced coordinates on a plane.
//!
//! Joints can't come apart, as they are the coordinates. A step is semi-implicit: drives and the ends of ranges are taken
//! at its end, so that they are stable at any stiffness, and contacts are solved over the inertia of the whole
//! character. All state is in [`Pose`], but for what a step hands to the next: contact impulses and drives at their limit.

mod contact;
mod dynamics;
mod matrix;
mod pose;
mod spatial;
mod tree;

use super::world::{LinkState, Target};
use super::{Character, Diverged, Settings};
use contact::{Contacts, Ground};
use dynamics::Dynamics;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use pose::Pose;
use spatial::Force;
use tree::Tree;

/// How often a step is taken at most, until no drive is beyond its limit.
const MOST_PASSES: usize = 3;

pub(super) struct Articulated {
    tree: Tree,
    pose: Pose,
    dynamics: Dynamics,
    contacts: Contacts,
    /// Per node; of a hinge the real part is its angle.
    targets: Vec<UnitQuaternion<f32>>,
    settings: Settings,
    mass: f32,
    friction: f32,
}

impl Articulated {
    pub fn new(character: &Character, settings: Settings) -> Self {
        let tree = Tree::new(character);
        Articulated {
            pose: Pose::new(&tree),
            dynamics: Dynamics::new(&tree),
            contacts: Contacts::new(&tree),
            targets: vec![UnitQuaternion::identity(); tree.nodes.len()],
            tree,
            settings,
            mass: 1.0,
            friction: 1.0,
        }
    }

    pub fn reset(&mut self, states: &[LinkState]) {
        self.pose.set(&self.tree, states);
        self.dynamics.reset(&self.tree, &self.pose);
        self.contacts.reset();
        (self.mass, self.friction) = (1.0, 1.0);
    }

    pub fn vary(&mut self, mass: f32, friction: f32) {
        (self.mass, self.friction) = (mass, friction);
        self.dynamics.survey(&self.tree, &self.pose, mass);
    }

    pub fn push(&mut self, node: usize, impulse: Vector3<f32>) {
        self.dynamics.push(node, impulse);
    }

    pub fn set_targets(&mut self, targets: &[Target]) {
        for (own, target) in self.targets.iter_mut().zip(targets) {
            match target {
                Target::Free => {}
                Target::Ball(turn) => *own = *turn,
                Target::Hinge(angle) => {
                    *own = UnitQuaternion::new_unchecked(Quaternion::from_real(*angle))
                }
            }
        }
    }

    pub fn step(&mut self, contacts: &mut [bool]) -> Result<(), Diverged> {
        let substeps = self.settings.substeps;
        let dt = (1.0 / self.settings.physics_hz()) as f32;
        for _ in 0..self.settings.steps_per_control {
            contacts.fill(false);
            for _ in 0..substeps {
                self.substep(dt, contacts);
            }
            if !self.pose.velocity.iter().all(|v| v.is_finite().all()) {
                return Err(Diverged);
            }
        }
        Ok(())
    }

    pub fn read(&self, states: &mut [LinkState]) {
        self.pose.read(&self.dynamics.motions, states);
    }

    fn substep(&mut self, dt: f32, contacts: &mut [bool]) {
        let Articulated {
            tree,
            pose,
            dynamics,
            ..
        } = self;
        let ground = Ground {
            dt,
            friction: self.friction,
            yielding: self.settings.contact_s as f32,
        };
        let mut outside = Force::default();
        for _ in 0..MOST_PASSES {
            outside = dynamics.accelerate(tree, pose, &self.targets, dt);
            self.contacts.resolve(tree, pose, dynamics, &ground);
            if !dynamics.finish(tree, dt) {
                break;
            }
        }
        outside += self.contacts.report(pose, contacts);
        let momentum = dynamics.momentum_after(&outside);
        dynamics.apply(pose);
        pose.advance(tree, dt);
        dynamics.survey(tree, pose, self.mass);
        dynamics.conserve(pose, &momentum);
    }
}
