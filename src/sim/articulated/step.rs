//! A control step of up to eight characters, from top to bottom.

use super::super::error::Diverged;
use super::super::settings::Settings;
use super::super::state::LinkState;
use super::contact::Contacts;
use super::dynamics::{Dynamics, Push};
use super::ground::Ground;
use super::lanes::{LANES, Lanes, Work, on_widest_lanes};
use super::pose::Pose;
use super::state::State;
use super::tree::Tree;
use std::any::Any;

/// How often a substep is solved at most, until no drive exceeds its torque limit. Chosen: each time a drive saturates, others
/// take over its load and may saturate too; what is left after the third pass the next substep starts from.
const MAX_PASSES: usize = 3;

/// A character in one lane of a step, and where its results go.
pub(super) struct Lane<'a> {
    pub state: &'a mut State,
    /// One per node.
    pub links: &'a mut [LinkState],
    /// One per node: whether it presses on the ground.
    pub contacts: &'a mut [bool],
    pub result: &'a mut Result<(), Diverged>,
}

/// Memory that steps reuse: a [`Batch`] of the kind of lanes that this machine has.
#[derive(Default)]
pub(super) struct Workspace(Option<Box<dyn Any + Send + Sync>>);

/// All that a step computes of eight characters.
struct Batch<L> {
    pose: Pose<L>,
    dynamics: Dynamics<L>,
    contacts: Contacts<L>,
    /// Impulses from outside that the next substep applies.
    pushes: Vec<Push>,
}

/// A control step as work for any kind of lanes.
struct ControlStep<'a, 'b> {
    workspace: &'a mut Workspace,
    tree: &'a Tree,
    settings: &'a Settings,
    lanes: &'a mut [Lane<'b>],
}

impl Workspace {
    /// Advances characters of one tree by a control step, on the widest lanes that the processor has.
    pub fn step(&mut self, tree: &Tree, settings: &Settings, lanes: &mut [Lane]) {
        on_widest_lanes(ControlStep {
            workspace: self,
            tree,
            settings,
            lanes,
        });
    }

    /// The same on a given kind of lanes.
    #[inline(always)]
    pub fn step_on<L: Lanes>(&mut self, tree: &Tree, settings: &Settings, lanes: &mut [Lane]) {
        self.batch::<L>(tree).step(tree, settings, lanes);
    }

    fn batch<L: Lanes>(&mut self, tree: &Tree) -> &mut Batch<L> {
        let made = self.0.get_or_insert_with(|| {
            Box::new(Batch::<L> {
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
        self.workspace
            .step_on::<L>(self.tree, self.settings, self.lanes);
    }
}

impl<L: Lanes> Batch<L> {
    /// A control step: `steps_per_control` physics steps of `substeps` each. The contacts that it reports are those of the last
    /// physics step.
    #[inline(always)]
    fn step(&mut self, tree: &Tree, settings: &Settings, lanes: &mut [Lane]) {
        self.gather(lanes);
        self.pose.forward_kinematics(tree);
        self.dynamics.update_bodies(tree, &self.pose);
        let ground = Ground {
            dt: (1.0 / settings.physics_hz()) as f32,
            time_constant: settings.contact_s as f32,
        };
        for _ in 0..settings.steps_per_control {
            for lane in lanes.iter_mut() {
                lane.contacts.fill(false);
            }
            for _ in 0..settings.substeps {
                self.substep(tree, &ground, lanes.len());
                for (index, lane) in lanes.iter_mut().enumerate() {
                    self.contacts.mark_pressing(index, lane.contacts);
                }
            }
        }
        self.scatter(lanes);
    }

    /// Reads the characters' states into the lanes.
    fn gather(&mut self, lanes: &mut [Lane]) {
        // Lanes without a character repeat the first one, because their numbers have to stay finite.
        for index in 0..LANES {
            let lane = lanes.get(index).unwrap_or(&lanes[0]);
            self.pose.gather(index, lane.state);
            self.dynamics.gather(index, lane.state);
        }
        self.pushes.clear();
        for (lane, one) in lanes.iter_mut().enumerate() {
            self.contacts.gather(lane, one.state);
            let pushes = one.state.pushes.drain(..);
            self.pushes.extend(pushes.map(|(node, impulse)| Push {
                lane,
                node,
                impulse,
            }));
        }
    }

    /// Writes the lanes back to the characters' states, and their results.
    fn scatter(&mut self, lanes: &mut [Lane]) {
        for (index, lane) in lanes.iter_mut().enumerate() {
            self.pose.scatter(index, lane.state);
            self.dynamics.scatter(index, lane.state);
            self.contacts.scatter(index, lane.state);
            *lane.result = if lane.state.velocity.iter().all(|v| v.is_finite()) {
                self.pose.read(&self.dynamics.velocities, index, lane.links);
                Ok(())
            } else {
                Err(Diverged)
            };
        }
    }

    /// One integration step of the first `lanes` characters.
    #[inline(always)]
    fn substep(&mut self, tree: &Tree, ground: &Ground, lanes: usize) {
        let Batch {
            pose,
            dynamics,
            contacts,
            pushes,
        } = self;
        // Mass matrix and bias forces in the present pose, and the points near the ground.
        let mut outside = dynamics.bias_forces(tree, pose, pushes, ground.dt);
        pushes.clear();
        contacts.detect(tree, pose, &dynamics.velocities, (ground, lanes));
        // Solve for the change of velocity. Lanes in which a drive turns out to exceed its torque limit stay open and are
        // solved again with that drive at its limit; the results of the others stand. Lanes without a character are accepted
        // in the first pass.
        let (used, mut open) = ((1 << lanes) - 1, (1 << LANES) - 1);
        for _ in 0..MAX_PASSES {
            dynamics.solve_first_half(tree, pose, ground.dt);
            contacts.solve_contacts(tree, pose, dynamics, open & used);
            open = dynamics.solve_second_half(tree, open, ground.dt) & used;
            if open == 0 {
                break;
            }
        }
        // Semi-implicit Euler: the new velocities move the coordinates. Then the momentum is made to have changed by the
        // impulses from outside alone.
        outside += contacts.impulse(pose);
        let momentum = dynamics.momentum_after(&outside);
        dynamics.apply_delta(pose);
        pose.integrate(tree, L::splat(ground.dt));
        pose.forward_kinematics(tree);
        dynamics.update_bodies(tree, pose);
        dynamics.correct_momentum(pose, &momentum);
    }
}
