//! The only room that knows rapier.
//!
//! Bodies are joined by rapier's impulse joints (maximal coordinates): on the characters that mimic is made for
//! they cost a tenth of its multibodies, and a spherical multibody joint cannot be driven by position. What needs
//! care is handled here and nowhere else:
//! the drive frame of ball joints ([`Rapier::set_targets`]), resets without a memory ([`Rapier::reset`]), sleeping,
//! damping and speed caps (off), and quarantined bodies ([`Diverged`]).

mod build;
mod convert;

use super::character::Character;
use super::error::Diverged;
use super::settings::Settings;
use super::state::{LinkState, Target};
use crate::skeleton::GRAVITY;
use build::{Built, Scene};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rapier3d::prelude::*;

/// A character that moves under its drives.
pub(super) struct Rapier {
    settings: Settings,
    parameters: IntegrationParameters,
    pipeline: PhysicsPipeline,
    pristine: Scene,
    scene: Scene,
    multibodies: MultibodyJointSet,
    soft_bodies: SoftBodySet,
    ccd: CCDSolver,
    bodies: Vec<RigidBodyHandle>,
    joints: Vec<Option<ImpulseJointHandle>>,
    /// Per link: rotation of the joint's first frame at rest, in the parent's frame, and the joint's own axes.
    frames: Vec<(UnitQuaternion<f32>, UnitQuaternion<f32>)>,
    ground: ColliderHandle,
    coms: Vec<Vector3<f32>>,
    /// Per link, as built: mass and inertia about the centre of mass.
    masses: Vec<(f32, Matrix3<f32>)>,
}

impl Rapier {
    pub fn new(character: &Character, settings: Settings) -> Self {
        let Built {
            scene,
            bodies,
            joints,
            ground,
        } = build::build(character);
        Rapier {
            settings,
            parameters: build::parameters(&settings),
            pipeline: PhysicsPipeline::new(),
            pristine: scene.clone(),
            scene,
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

    /// Puts every link where `states` says, with nothing left of the past.
    ///
    /// rapier starts a step's contacts from the impulses of the step before, also when the bodies were teleported
    /// in between, and keeps islands, contact pairs and their order. So a reset works on a copy of the world as it
    /// was built, and gives the same bits as a new one.
    pub fn reset(&mut self, states: &[LinkState]) {
        self.scene.clone_from(&self.pristine);
        for (i, state) in states.iter().enumerate() {
            let body = &mut self.scene.bodies[self.bodies[i]];
            let arm = state.pose.rotation * self.coms[i];
            body.set_position(convert::pose(&state.pose), false);
            body.set_linvel(
                convert::vector(state.linear + state.angular.cross(&arm)),
                false,
            );
            body.set_angvel(convert::vector(state.angular), false);
        }
    }

    /// Until the next reset all masses and inertias are `mass` times what they are, and friction `friction` times.
    pub fn vary(&mut self, mass: f32, friction: f32) {
        for ((handle, (own, inertia)), com) in self.bodies.iter().zip(&self.masses).zip(&self.coms)
        {
            let scaled = MassProperties::with_inertia_matrix(
                convert::vector(*com),
                own * mass,
                convert::matrix(&(inertia * mass)),
            );
            self.scene.bodies[*handle].set_additional_mass_properties(scaled, false);
        }
        for (_, collider) in self.scene.colliders.iter_mut() {
            collider.set_friction(collider.friction() * friction);
        }
    }

    /// Gives a link an impulse at its centre of mass, world axes, N·s. Its mass is that of the last step.
    pub fn push(&mut self, link: usize, impulse: Vector3<f32>) {
        let body = &mut self.scene.bodies[self.bodies[link]];
        let mass = body.mass();
        if mass > 0.0 {
            let velocity = body.linvel() + convert::vector(impulse / mass);
            body.set_linvel(velocity, true);
        }
    }

    /// Sets what the drives hold until the next call; one target per link.
    ///
    /// rapier's motors measure a ball joint's error axis by axis as 2·asin of the quaternion's imaginary part, which
    /// is wrong far from zero. So the joint's first frame is turned to the target, and the motors hold zero: there
    /// the measure is exact to third order, and every ball is a true spherical PD drive.
    pub fn set_targets(&mut self, targets: &[Target]) {
        for (i, target) in targets.iter().enumerate() {
            let Some(handle) = self.joints[i] else {
                continue;
            };
            let Some(joint) = self.scene.joints.get_mut(handle, false) else {
                continue;
            };
            let (rest, axes) = self.frames[i];
            match target {
                Target::Free => {}
                Target::Ball(turn) => {
                    joint.data.local_frame1.rotation = convert::rotation(rest * turn * axes)
                }
                Target::Hinge(angle) => {
                    joint.data.motors[JointAxis::AngX as usize].target_pos = *angle
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
            self.pipeline.step(
                Vector::new(0.0, 0.0, -GRAVITY as f32),
                &self.parameters,
                &mut self.scene.islands,
                &mut self.scene.broad_phase,
                &mut self.scene.narrow_phase,
                &mut self.scene.bodies,
                &mut self.scene.colliders,
                &mut self.scene.joints,
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

    pub fn read(&self, states: &mut [LinkState], contacts: &mut [bool]) {
        self.read_states(states);
        self.read_contacts(contacts);
    }

    fn read_states(&self, states: &mut [LinkState]) {
        for ((state, handle), com) in states.iter_mut().zip(&self.bodies).zip(&self.coms) {
            let body = &self.scene.bodies[*handle];
            state.pose = convert::from_pose(body.position());
            state.angular = convert::from_vector(body.angvel());
            let arm = state.pose.rotation * com;
            state.linear = convert::from_vector(body.linvel()) - state.angular.cross(&arm);
        }
    }

    fn read_contacts(&self, contacts: &mut [bool]) {
        contacts.fill(false);
        for pair in self.scene.narrow_phase.contact_pairs_with(self.ground) {
            let other = if pair.collider1 == self.ground {
                pair.collider2
            } else {
                pair.collider1
            };
            let pressed = pair.total_impulse_magnitude() > 0.0;
            if pressed && let Some(collider) = self.scene.colliders.get(other) {
                contacts[collider.user_data as usize] = true;
            }
        }
    }
}
