//! The rapier engine. Nothing outside this folder uses rapier.
//!
//! Bodies are connected by rapier's impulse joints (maximal coordinates). For characters of this size they cost a tenth of
//! rapier's multibodies, and a spherical multibody joint cannot be driven by position. These are the parts that need care:
//! drives of ball joints ([`Rapier::set_targets`]), resets that forget the past ([`Rapier::reset`]), sleep, damping and speed
//! limits (all off), and bodies that rapier quarantines because they are no longer finite ([`Diverged`]).

mod build;
mod convert;

use super::character::Character;
use super::error::Diverged;
use super::settings::Settings;
use super::state::{LinkState, Target};
use crate::skeleton::GRAVITY;
use build::{Built, PhysicsState};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rapier3d::prelude::*;

/// A character that moves under its drives.
pub(super) struct Rapier {
    settings: Settings,
    parameters: IntegrationParameters,
    pipeline: PhysicsPipeline,
    /// As built.
    initial: PhysicsState,
    state: PhysicsState,
    multibodies: MultibodyJointSet,
    soft_bodies: SoftBodySet,
    ccd: CCDSolver,
    /// `[links]`.
    bodies: Vec<RigidBodyHandle>,
    /// `[links]`: the joint to the parent; `None` for the root.
    joints: Vec<Option<ImpulseJointHandle>>,
    /// `[links]`: rotations parent from link at rest, and link from joint frame.
    frames: Vec<(UnitQuaternion<f32>, UnitQuaternion<f32>)>,
    ground: ColliderHandle,
    /// `[links]`: centres of mass in the links' frames, metres.
    coms: Vec<Vector3<f32>>,
    /// `[links]`, as built: mass (kg), and inertia about the centre of mass (kg·m²).
    masses: Vec<(f32, Matrix3<f32>)>,
}

impl Rapier {
    pub fn new(character: &Character, settings: Settings) -> Self {
        let Built {
            state,
            bodies,
            joints,
            ground,
        } = build::build(character);
        Rapier {
            settings,
            parameters: build::parameters(&settings),
            pipeline: PhysicsPipeline::new(),
            initial: state.clone(),
            state,
            multibodies: MultibodyJointSet::new(),
            soft_bodies: SoftBodySet::new(),
            ccd: CCDSolver::new(),
            frames: character
                .links
                .iter()
                .map(|link| {
                    let axes = build::basis(&link.joint);
                    (link.rest.rotation.cast(), axes.cast())
                })
                .collect(),
            ground,
            coms: character.links.iter().map(|link| link.com.cast()).collect(),
            masses: character
                .links
                .iter()
                .map(|link| (link.mass as f32, link.inertia.cast()))
                .collect(),
            bodies,
            joints,
        }
    }

    /// Puts every link where `states` says, and forgets the past.
    ///
    /// rapier keeps islands, contact pairs and their order, and impulses of the last step, also when bodies were teleported
    /// in between. So a reset starts from a copy of the world as it was built, and gives the same bits as a new world.
    pub fn reset(&mut self, states: &[LinkState]) {
        self.state.clone_from(&self.initial);
        for (i, state) in states.iter().enumerate() {
            let body = &mut self.state.bodies[self.bodies[i]];
            // rapier's linear velocity is that of the centre of mass, ours that of the frame's origin.
            let arm = state.pose.rotation * self.coms[i];
            body.set_position(convert::pose(&state.pose), false);
            body.set_linvel(
                convert::vector(state.linear + state.angular.cross(&arm)),
                false,
            );
            body.set_angvel(convert::vector(state.angular), false);
        }
    }

    /// Until the next reset, multiplies all masses and inertias by `mass` and all friction coefficients by `friction`.
    pub fn vary(&mut self, mass: f32, friction: f32) {
        for ((handle, (own, inertia)), com) in self.bodies.iter().zip(&self.masses).zip(&self.coms)
        {
            let scaled = MassProperties::with_inertia_matrix(
                convert::vector(*com),
                own * mass,
                convert::matrix(&(inertia * mass)),
            );
            self.state.bodies[*handle].set_additional_mass_properties(scaled, false);
        }
        for (_, collider) in self.state.colliders.iter_mut() {
            collider.set_friction(collider.friction() * friction);
        }
    }

    /// Gives a link an impulse at its centre of mass, world axes, N·s. The mass by which it divides is that of the last step:
    /// rapier updates mass properties when it steps.
    pub fn push(&mut self, link: usize, impulse: Vector3<f32>) {
        let body = &mut self.state.bodies[self.bodies[link]];
        let mass = body.mass();
        if mass > 0.0 {
            let velocity = body.linvel() + convert::vector(impulse / mass);
            body.set_linvel(velocity, true);
        }
    }

    /// Sets the targets that the drives hold until the next call, one per link.
    ///
    /// rapier's motors measure the error of a ball joint axis by axis as 2·asin of the quaternion's imaginary part, which is
    /// wrong far from zero. So the joint's first frame is turned to the target and the motors hold zero: there the measure is
    /// exact to third order, and every ball is a spherical PD drive.
    pub fn set_targets(&mut self, targets: &[Target]) {
        for (i, target) in targets.iter().enumerate() {
            let Some(handle) = self.joints[i] else {
                continue;
            };
            let Some(joint) = self.state.joints.get_mut(handle, false) else {
                continue;
            };
            let (rest, axes) = self.frames[i];
            match target {
                Target::Free => {}
                // Parent from link at rest, then the target, then the joint's own axes.
                Target::Ball(turn) => {
                    joint.data.local_frame1.rotation = convert::rotation(rest * turn * axes);
                }
                Target::Hinge(angle) => {
                    joint.data.motors[JointAxis::AngX as usize].target_pos = *angle;
                }
            }
        }
    }

    /// Advances by one control step.
    ///
    /// # Errors
    /// [`Diverged`] when a body stopped being finite; the world then needs a reset.
    pub fn step(&mut self) -> Result<(), Diverged> {
        for _ in 0..self.settings.steps_per_control {
            // Joints, drives and contacts are integrated in substeps inside of this call.
            self.pipeline.step(
                Vector::new(0.0, 0.0, -GRAVITY as f32),
                &self.parameters,
                &mut self.state.islands,
                &mut self.state.broad_phase,
                &mut self.state.narrow_phase,
                &mut self.state.bodies,
                &mut self.state.colliders,
                &mut self.state.joints,
                &mut self.multibodies,
                &mut self.soft_bodies,
                &mut self.ccd,
                &(),
                &(),
            );
            if !self.pipeline.quarantine().bodies().is_empty() {
                return Err(Diverged);
            }
        }
        Ok(())
    }

    /// Writes the state of every link, and whether it presses on the ground.
    pub fn read(&self, states: &mut [LinkState], contacts: &mut [bool]) {
        self.read_states(states);
        self.read_contacts(contacts);
    }

    fn read_states(&self, states: &mut [LinkState]) {
        for ((state, handle), com) in states.iter_mut().zip(&self.bodies).zip(&self.coms) {
            let body = &self.state.bodies[*handle];
            state.pose = convert::from_pose(body.position());
            state.angular = convert::from_vector(body.angvel());
            let arm = state.pose.rotation * com;
            state.linear = convert::from_vector(body.linvel()) - state.angular.cross(&arm);
        }
    }

    fn read_contacts(&self, contacts: &mut [bool]) {
        contacts.fill(false);
        for pair in self.state.narrow_phase.contact_pairs_with(self.ground) {
            let other = if pair.collider1 == self.ground {
                pair.collider2
            } else {
                pair.collider1
            };
            // A pair is reported as soon as its bounding boxes meet; only one with an impulse presses.
            let pressed = pair.total_impulse_magnitude() > 0.0;
            if pressed && let Some(collider) = self.state.colliders.get(other) {
                contacts[collider.user_data as usize] = true;
            }
        }
    }
}
