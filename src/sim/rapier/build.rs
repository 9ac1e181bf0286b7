//! Builds the rapier world of a character, as it is before its first step.

use super::super::character::{Character, Link, LinkJoint, x_along};
use super::super::settings::Settings;
use super::convert;
use crate::skeleton::{Drive, Shape};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use rapier3d::prelude::*;

/// All of a rapier world that a step can change.
#[derive(Clone)]
pub(super) struct PhysicsState {
    pub islands: IslandManager,
    pub broad_phase: BroadPhaseBvh,
    pub narrow_phase: NarrowPhase,
    pub bodies: RigidBodySet,
    pub colliders: ColliderSet,
    pub joints: ImpulseJointSet,
}

/// A rapier world and the handles into it, in the order of the character's links.
pub(super) struct Built {
    pub state: PhysicsState,
    /// `[links]`.
    pub bodies: Vec<RigidBodyHandle>,
    /// `[links]`: the joint to the parent; `None` for the root.
    pub joints: Vec<Option<ImpulseJointHandle>>,
    pub ground: ColliderHandle,
}

/// Collision groups: the character meets the ground and never itself.
const CHARACTER: Group = Group::GROUP_1;
const GROUND: Group = Group::GROUP_2;

/// Solver settings that differ from rapier's defaults, each with its reason. All numbers were chosen by trying them on the
/// built-in characters.
pub(super) fn parameters(settings: &Settings) -> IntegrationParameters {
    IntegrationParameters {
        dt: (settings.control_dt() / f64::from(settings.steps_per_control)) as f32,
        num_solver_iterations: settings.substeps as usize,
        // Contacts that start from the last step's impulses throw a character with stiff drives off its feet: held in its
        // rest pose, it hops 4 cm. Started from zero they settle, given enough sweeps.
        warmstart_coefficient: 0.0,
        // Three sweeps are 4 % faster and train worse.
        num_internal_pgs_iterations: 4,
        // The stabilisation pass turns position errors of joints into spin: in flight, angular momentum drifts by 3 % per
        // second with it and by 0.4 % without.
        num_internal_stabilization_iterations: 0,
        // Coulomb friction at each contact point; the default lumps four points into one.
        friction_model: FrictionModel::Coulomb,
        // The ground is a half space: nothing can tunnel through it.
        max_ccd_substeps: 0,
        normalized_max_linear_velocity: f32::MAX,
        // A reference motion may start a little inside the ground, and has to be lifted out, not thrown out.
        normalized_max_corrective_velocity: 0.5,
        ..IntegrationParameters::default()
    }
}

/// The world of a character at rest: one rigid body per link, one joint per link but the root.
pub(super) fn build(character: &Character) -> Built {
    let mut state = PhysicsState {
        islands: IslandManager::new(),
        // For a dozen shapes, keeping the bounding-volume tree balanced costs more than it saves.
        broad_phase: BroadPhaseBvh::with_optimization_strategy(BvhOptimizationStrategy::None),
        narrow_phase: NarrowPhase::new(),
        bodies: RigidBodySet::new(),
        colliders: ColliderSet::new(),
        joints: ImpulseJointSet::new(),
    };
    let ground = state.colliders.insert(ground());
    let mut bodies = Vec::new();
    let mut joints = Vec::new();
    for (index, link) in character.links.iter().enumerate() {
        let handle = state.bodies.insert(body(link));
        for shape in &link.shapes {
            let collider = collider(shape, link.friction, index);
            state
                .colliders
                .insert_with_parent(collider, handle, &mut state.bodies);
        }
        let joint = link
            .parent
            .map(|p| state.joints.insert(bodies[p], handle, joint(link), false));
        bodies.push(handle);
        joints.push(joint);
    }
    Built {
        state,
        bodies,
        joints,
        ground,
    }
}

fn ground() -> ColliderBuilder {
    // The larger friction of the two counts, as in MuJoCo, and the ground has none, so that the character's holds.
    ColliderBuilder::halfspace(Unit::new_unchecked(Vector::Z))
        .friction(0.0)
        .friction_combine_rule(CoefficientCombineRule::Max)
        .collision_groups(InteractionGroups::new(
            GROUND,
            CHARACTER,
            InteractionTestMode::And,
        ))
}

/// A rigid body that nothing damps, slows or puts to sleep.
fn body(link: &Link) -> RigidBody {
    let mass = MassProperties::with_inertia_matrix(
        convert::vector(link.com.cast()),
        link.mass as f32,
        convert::matrix(&link.inertia.cast()),
    );
    RigidBodyBuilder::dynamic()
        .additional_mass_properties(mass)
        .linear_damping(0.0)
        .angular_damping(0.0)
        .can_sleep(false)
        .allow_fast_rotation(true)
        .build()
}

fn collider(shape: &Shape, friction: f64, link: usize) -> Collider {
    let vector = |v: &Vector3<f64>| convert::vector(v.cast());
    let builder = match shape {
        Shape::Sphere { center, radius } => {
            ColliderBuilder::ball(*radius as f32).translation(vector(center))
        }
        Shape::Capsule { a, b, radius } => {
            ColliderBuilder::capsule_from_endpoints(vector(a), vector(b), *radius as f32)
        }
        Shape::Box { pose, half } => {
            ColliderBuilder::cuboid(half.x as f32, half.y as f32, half.z as f32)
                .position(convert::pose(&pose.cast()))
        }
    };
    // The link has its mass from the skeleton, so shapes add none.
    builder
        .density(0.0)
        .friction(friction as f32)
        .friction_combine_rule(CoefficientCombineRule::Max)
        .collision_groups(InteractionGroups::new(
            CHARACTER,
            GROUND,
            InteractionTestMode::And,
        ))
        .user_data(link as u128)
        .build()
}

/// The joint between a link and its parent, with the motors of its drives.
fn joint(link: &Link) -> GenericJoint {
    let parent_anchor = link.rest * nalgebra::Point3::from(link.anchor);
    let frame = |at: Vector3<f64>, turn: UnitQuaternion<f64>| {
        convert::pose(&Isometry3::from_parts(Translation3::from(at), turn).cast())
    };
    let axes = basis(&link.joint);
    let locked = match &link.joint {
        LinkJoint::Hinge { .. } => JointAxesMask::LOCKED_REVOLUTE_AXES,
        _ => JointAxesMask::LOCKED_SPHERICAL_AXES,
    };
    let mut joint = GenericJointBuilder::new(locked)
        .local_frame1(frame(parent_anchor.coords, link.rest.rotation * axes))
        .local_frame2(frame(link.anchor, axes))
        .contacts_enabled(false)
        .build();
    for (axis, drive) in drives(&link.joint) {
        // A motor without gains would be a rigid brake in rapier, instead of a joint that swings freely.
        if drive.kp > 0.0 || drive.kd > 0.0 {
            joint
                .set_motor_model(axis, MotorModel::ForceBased)
                .set_motor_position(axis, 0.0, drive.kp as f32, drive.kd as f32)
                .set_motor_max_force(axis, drive.force_limit.min(f64::from(f32::MAX)) as f32);
        }
    }
    if let LinkJoint::Hinge { axis, .. } = &link.joint
        && axis.is_limited()
    {
        joint.set_limits(JointAxis::AngX, axis.limit.map(|end| end as f32));
    }
    joint
}

/// Link from joint frame: the rotation. A hinge's axis is the joint frame's X.
pub(super) fn basis(joint: &LinkJoint) -> UnitQuaternion<f64> {
    match joint {
        LinkJoint::Hinge { axis, .. } => x_along(&axis.direction),
        _ => UnitQuaternion::identity(),
    }
}

/// The drives of a joint with the axes of the joint frame along which they act.
fn drives(joint: &LinkJoint) -> Vec<(JointAxis, Drive)> {
    let axes = [JointAxis::AngX, JointAxis::AngY, JointAxis::AngZ];
    match joint {
        LinkJoint::Free => Vec::new(),
        LinkJoint::Hinge { drive, .. } => vec![(JointAxis::AngX, *drive)],
        LinkJoint::Ball { drives, .. } | LinkJoint::Hinges { drives, .. } => {
            axes.into_iter().zip(*drives).collect()
        }
    }
}
