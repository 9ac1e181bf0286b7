//! Drives and ranges of a joint's coordinates, from its actuators or, where it has none, from the joint itself.

use super::error::{Defect, SkeletonError};
use super::{Body, Drive, Joint, JointKind, Skeleton};
use mjcf_rs::body::Joint as MjcfJoint;
use mjcf_rs::extras::{Actuator, ActuatorKind};
use mjcf_rs::{Model, Tristate};
use std::f64::consts::PI;

/// Stiffness of a joint that only a torque motor drives, per N·m of the motor's limit, 1/rad. Chosen: the drive reaches its
/// limit a quarter of a radian from the target, about as the drives of the built-in humanoid do.
const KP_PER_FORCE: f64 = 4.0;
/// Damping per stiffness of such a joint, s. It is the ratio of the built-in humanoid's drives.
const KD_PER_KP: f64 = 0.1;

/// Largest stiffness and damping of a drive. Chosen: a million times those of the built-in humanoid.
const MOST_GAIN: f64 = 1e9;

/// What one actuator does to one coordinate, in terms of that coordinate (its gear is resolved).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Servo {
    /// Which of the joint's degrees of freedom it drives.
    axis: usize,
    /// Stiffness and damping of a position actuator; `None` for a torque motor.
    gains: Option<(f64, f64)>,
    /// N·m (N for a slide); infinite without a limit.
    force_limit: f64,
    /// Range of its targets, if that is limited.
    range: Option<[f64; 2]>,
}

/// Drives and ranges, one for each degree of freedom; none for a free joint.
///
/// A position actuator (`<position>`, or `<general>` with affine bias) states stiffness and damping itself. Where only a
/// torque motor acts, the joint's own `stiffness` and `damping` make the drive if that spring reaches the motor's limit
/// within a radian: some models note the gains of their controller there. Otherwise the gains follow from the limit.
pub(super) fn drives(
    joint: &MjcfJoint,
    kind: JointKind,
    model: &Model,
) -> Result<(Vec<Drive>, Vec<[f64; 2]>), Defect> {
    check_passive(joint)?;
    let dofs = match kind {
        JointKind::Free => 0,
        JointKind::Ball => 3,
        JointKind::Hinge(_) | JointKind::Slide(_) => 1,
    };
    let autolimits = model.compiler.autolimits;
    let servos = model
        .actuators
        .iter()
        .filter(|a| a.joint.is_some() && a.joint == joint.name && is_servo(a))
        .map(|a| servo(a, dofs, autolimits))
        .collect::<Result<Vec<_>, _>>()?;
    let mut drives = Vec::with_capacity(dofs);
    let mut limits = Vec::with_capacity(dofs);
    for axis in 0..dofs {
        // A position actuator says more than a motor on the same coordinate.
        let servo = servos
            .iter()
            .filter(|s| s.axis == axis)
            .max_by_key(|s| s.gains.is_some());
        drives.push(checked(drive(joint, servo))?);
        limits.push(limit(joint, kind, servo, model)?);
    }
    Ok((drives, limits))
}

impl Skeleton {
    /// The first joint of a character none of whose joints is driven, and its body: there is no position actuator, no motor
    /// with a limit, and no stiffness of a joint. A policy can't move such a character. Single joints may swing freely.
    pub fn undriven(&self) -> Option<(&Body, &Joint)> {
        let is_driven = |drive: &Drive| drive.kp != 0.0 && drive.force_limit != 0.0;
        let joints = || {
            let bodies = self.bodies.iter();
            bodies.flat_map(|body| body.joints.iter().map(move |joint| (body, joint)))
        };
        let mut drives = joints().flat_map(|(_, joint)| joint.drives.iter());
        match drives.any(is_driven) {
            true => None,
            false => joints().find(|(_, joint)| !joint.drives.is_empty()),
        }
    }

    /// The skeleton, if its joints have motors.
    ///
    /// A character that is read from a file is to perform what is retargeted to it. Without motors it can't, and hours of
    /// training would tell that late.
    pub(super) fn with_motors(self) -> Result<Self, SkeletonError> {
        let Some((body, joint)) = self.undriven() else {
            return Ok(self);
        };
        let place = format!("joint `{}` of body `{}`", joint.name, body.name);
        let defect = Defect::new(
            "no actuator drives it or any other joint, and none has stiffness of its own",
            "add a <position> actuator for each axis of the joints, or a <motor> with a `ctrlrange`",
        );
        Err(SkeletonError::mjcf(&self.name, Some(place), defect))
    }
}

/// Whether an actuator can be part of a position drive. The control of others is a velocity, or the pull of a muscle.
fn is_servo(actuator: &Actuator) -> bool {
    use ActuatorKind::{General, Motor, Position};
    matches!(actuator.kind, Motor | Position | General)
}

/// Checks what a joint does by itself.
fn check_passive(joint: &MjcfJoint) -> Result<(), Defect> {
    let numbers = [
        ("stiffness", joint.stiffness),
        ("damping", joint.damping),
        ("armature", joint.armature),
        ("frictionloss", joint.frictionloss),
    ];
    match numbers
        .iter()
        .find(|(_, number)| number.is_nan() || *number < 0.0)
    {
        Some((name, number)) => Err(Defect::new(
            format!("its `{name}` of {number} is negative"),
            "write 0 or a positive number",
        )),
        None => Ok(()),
    }
}

/// The drive, if its gains are numbers that can be.
fn checked(drive: Drive) -> Result<Drive, Defect> {
    let Drive { kp, kd, .. } = drive;
    match [kp, kd].iter().all(|gain| (0.0..=MOST_GAIN).contains(gain)) {
        true => Ok(drive),
        false => Err(Defect::new(
            format!(
                "its drive has the stiffness {kp} and the damping {kd}, which are negative or too large"
            ),
            format!("write gains that come to 0 to {MOST_GAIN:e} with the actuator's `gear`"),
        )),
    }
}

/// An actuator in terms of the coordinate q that it drives.
///
/// An actuator with gear g has length g·q and gives q the force g·f (MuJoCo, "Computation", "Transmission"), so in terms of
/// q its gains scale with g², its force limit with g and its targets with 1/g.
fn servo(actuator: &Actuator, dofs: usize, autolimits: bool) -> Result<Servo, Defect> {
    if dofs == 0 {
        return Err(Defect::new(
            "an actuator drives it, but nothing can push the root from outside",
            "remove the actuator",
        ));
    }
    let gears = actuator.gear.iter().take(dofs).enumerate();
    let mut along = gears.filter(|(_, g)| **g != 0.0);
    let (Some((axis, &gear)), None) = (along.next(), along.next()) else {
        return Err(Defect::new(
            "an actuator's `gear` points along none or several of the joint's axes",
            "give each axis an actuator of its own",
        ));
    };
    let limited = |state, range| limited(state, range, autolimits);
    let ctrl = limited(actuator.ctrl_limited, actuator.ctrl_range);
    let force = limited(actuator.force_limited, actuator.force_range);
    let largest = |r: [f64; 2]| r[0].abs().max(r[1].abs());
    let gains = servo_gains(actuator);
    let mut force_limit = force.map_or(f64::INFINITY, largest);
    // The control of a torque motor is its force, so that a control range limits the force too.
    if let (None, Some(ctrl)) = (gains, ctrl) {
        force_limit = force_limit.min(largest(ctrl));
    }
    Ok(Servo {
        axis,
        gains: gains.map(|(kp, kd)| (kp * gear * gear, kd * gear * gear)),
        force_limit: force_limit * gear.abs(),
        range: ctrl
            .filter(|_| gains.is_some())
            .map(|[a, b]| ordered(a / gear, b / gear)),
    })
}

/// Stiffness and damping of a position actuator, before its gear. In MuJoCo an affine bias is
/// `biasprm[0] + biasprm[1]·length + biasprm[2]·velocity`, so a position servo has −kp and −kv there.
fn servo_gains(actuator: &Actuator) -> Option<(f64, f64)> {
    match actuator.kind {
        ActuatorKind::Position => Some((actuator.kp.unwrap_or(1.0), actuator.kv.unwrap_or(0.0))),
        ActuatorKind::General if actuator.bias_type.as_deref() == Some("affine") => {
            let bias = |i: usize| -actuator.biasprm.get(i).copied().unwrap_or(0.0);
            Some((bias(1), bias(2)))
        }
        _ => None,
    }
}

/// A range, if it limits anything. In MuJoCo a range from 0 to 0 is one that isn't stated.
fn limited(state: Tristate, range: Option<[f64; 2]>, autolimits: bool) -> Option<[f64; 2]> {
    let states = |range: &[f64; 2]| state == Tristate::True || *range != [0.0, 0.0];
    range
        .filter(states)
        .filter(|_| state.resolve(autolimits, true))
}

fn ordered(a: f64, b: f64) -> [f64; 2] {
    [a.min(b), a.max(b)]
}

/// The drive of one coordinate. A joint without a motor, or with one of unlimited force, is driven by its own spring.
fn drive(joint: &MjcfJoint, servo: Option<&Servo>) -> Drive {
    let force_limit = servo.map_or(f64::INFINITY, |s| s.force_limit);
    if let Some((kp, kd)) = servo.and_then(|s| s.gains) {
        return Drive {
            kp,
            kd: kd + joint.damping,
            force_limit,
        };
    }
    // Without a motor, or with one of unlimited torque, there is no limit to scale gains from.
    let passive = servo.is_none() || !force_limit.is_finite();
    let (kp, kd) = if passive || joint.stiffness >= force_limit {
        (joint.stiffness, joint.damping)
    } else {
        let kp = KP_PER_FORCE * force_limit;
        (kp, KD_PER_KP * kp)
    };
    Drive {
        kp,
        kd,
        force_limit,
    }
}

/// The joint's range where it is limited, else the range of the servo's targets, else a full turn.
///
/// MuJoCo limits the rotation angle of a ball joint as a whole, while our ranges are those of its exponential-map
/// coordinates. So the ranges of the three servos, which are given by axis, come first there.
fn limit(
    joint: &MjcfJoint,
    kind: JointKind,
    servo: Option<&Servo>,
    model: &Model,
) -> Result<[f64; 2], Defect> {
    let compiler = &model.compiler;
    let range = limited(joint.limited, joint.range, compiler.autolimits);
    let own = match (kind, range) {
        (JointKind::Ball, Some([_, angle])) => {
            let unit = if compiler.angle_is_degree {
                PI / 180.0
            } else {
                1.0
            };
            Some([-angle * unit, angle * unit])
        }
        (_, range) => range,
    };
    let servo = servo.and_then(|s| s.range);
    let chosen = match kind {
        JointKind::Ball => servo.or(own),
        _ => own.or(servo),
    };
    // Neither limited: a slide may go anywhere, everything else through a full turn.
    let free = match kind {
        JointKind::Slide(_) => [f64::NEG_INFINITY, f64::INFINITY],
        _ => [-PI, PI],
    };
    let [low, high] = chosen.unwrap_or(free);
    if low < high {
        Ok([low, high])
    } else {
        Err(Defect::new(
            format!("its range {low} to {high} is empty"),
            "write the lower end of `range` first",
        ))
    }
}
