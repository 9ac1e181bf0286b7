//! Drives and coordinate ranges of a joint, from its actuators or, failing those, from the joint itself.

use super::{Drive, JointKind};
use mjcf_rs::Model;
use mjcf_rs::body::Joint as MjcfJoint;
use mjcf_rs::extras::{Actuator, ActuatorKind};
use std::f64::consts::PI;

/// Gain of a joint that only a torque motor drives, per N·m of the motor's limit: the torque limit is reached a
/// quarter of a radian from the target, as for the drives of the built-in humanoid.
const KP_PER_FORCE: f64 = 4.0;
/// Damping per gain in the same case, s.
const KD_PER_KP: f64 = 0.1;

/// One actuator's part in one coordinate, gear resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Servo {
    axis: usize,
    /// Gains of a position servo; `None` for a torque motor.
    gains: Option<(f64, f64)>,
    force_limit: f64,
    range: Option<[f64; 2]>,
}

/// Drives and ranges, one per degree of freedom; none for a free joint.
///
/// A position servo (`<position>`, or `<general>` with affine bias) says it all. Where only a torque motor acts, the joint's own `stiffness` and `damping` are the drive if that spring reaches the motor's
/// limit within a radian (some models note their gains so); otherwise gains are scaled from the limit.
pub(super) fn drives(
    joint: &MjcfJoint,
    kind: JointKind,
    model: &Model,
) -> Result<(Vec<Drive>, Vec<[f64; 2]>), String> {
    let dofs = match kind {
        JointKind::Free => 0,
        JointKind::Ball => 3,
        JointKind::Hinge(_) | JointKind::Slide(_) => 1,
    };
    let autolimits = model.compiler.autolimits;
    let servos = model
        .actuators
        .iter()
        .filter(|a| a.joint.is_some() && a.joint == joint.name)
        .map(|a| servo(a, dofs, autolimits))
        .collect::<Result<Vec<_>, _>>()?;
    let mut drives = Vec::with_capacity(dofs);
    let mut limits = Vec::with_capacity(dofs);
    for axis in 0..dofs {
        let servo = servos
            .iter()
            .filter(|s| s.axis == axis)
            .max_by_key(|s| s.gains.is_some());
        drives.push(drive(joint, servo));
        limits.push(limit(joint, kind, servo, model)?);
    }
    Ok((drives, limits))
}

/// An actuator with gear g sees g·q: in terms of q, gains scale with g², force with g, targets with 1/g.
fn servo(actuator: &Actuator, dofs: usize, autolimits: bool) -> Result<Servo, String> {
    let gears = actuator.gear.iter().take(dofs).enumerate();
    let mut along = gears.filter(|(_, g)| **g != 0.0);
    let (Some((axis, &gear)), None) = (along.next(), along.next()) else {
        return Err("an actuator's `gear` has to point along one axis of the joint".into());
    };
    let limited = |state: mjcf_rs::Tristate, range: Option<[f64; 2]>| {
        range.filter(|_| state.resolve(autolimits, true))
    };
    let ctrl = limited(actuator.ctrl_limited, actuator.ctrl_range);
    let force = limited(actuator.force_limited, actuator.force_range);
    let largest = |r: [f64; 2]| r[0].abs().max(r[1].abs());
    let gains = servo_gains(actuator);
    let mut force_limit = force.map_or(f64::INFINITY, largest);
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

fn ordered(a: f64, b: f64) -> [f64; 2] {
    [a.min(b), a.max(b)]
}

fn drive(joint: &MjcfJoint, servo: Option<&Servo>) -> Drive {
    let force_limit = servo.map_or(f64::INFINITY, |s| s.force_limit);
    if let Some((kp, kd)) = servo.and_then(|s| s.gains) {
        return Drive {
            kp,
            kd: kd + joint.damping,
            force_limit,
        };
    }
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

/// The joint's range where it is limited, else the servo's, else a full turn.
fn limit(
    joint: &MjcfJoint,
    kind: JointKind,
    servo: Option<&Servo>,
    model: &Model,
) -> Result<[f64; 2], String> {
    let compiler = &model.compiler;
    let range = joint
        .range
        .filter(|_| joint.limited.resolve(compiler.autolimits, true));
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
    let free = match kind {
        JointKind::Slide(_) => [f64::NEG_INFINITY, f64::INFINITY],
        _ => [-PI, PI],
    };
    let [low, high] = chosen.unwrap_or(free);
    if low < high {
        Ok([low, high])
    } else {
        Err(format!("its range {low} to {high} is empty"))
    }
}
