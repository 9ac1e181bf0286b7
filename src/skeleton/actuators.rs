//! What actuators say, checked before it is believed.

use super::error::{Defect, SkeletonError};
use mjcf_rs::Model;
use mjcf_rs::extras::Actuator;
use std::collections::BTreeSet;

/// Checks that the actuators of `skeleton` drive joints of the file, with gains and ranges that can be.
pub(super) fn check(skeleton: &str, model: &Model) -> Result<(), SkeletonError> {
    let bodies = model.bodies.iter().map(|entry| &entry.body);
    let joints = bodies.flat_map(|body| &body.joints);
    let names: BTreeSet<&str> = joints.filter_map(|joint| joint.name.as_deref()).collect();
    for actuator in &model.actuators {
        check_one(actuator, &names)
            .map_err(|defect| SkeletonError::mjcf(skeleton, Some(place(actuator)), defect))?;
    }
    Ok(())
}

fn place(actuator: &Actuator) -> String {
    match (&actuator.name, &actuator.joint) {
        (Some(name), _) => format!("actuator `{name}`"),
        (None, Some(joint)) => format!("actuator of joint `{joint}`"),
        (None, None) => "an actuator without a name".to_owned(),
    }
}

fn check_one(actuator: &Actuator, joints: &BTreeSet<&str>) -> Result<(), Defect> {
    if let Some(joint) = actuator.joint.as_deref()
        && !joints.contains(joint)
    {
        return Err(Defect::new(
            format!("it drives joint `{joint}`, which the file doesn't have"),
            "give it the name of one of the file's joints",
        ));
    }
    for (name, gain) in [("kp", actuator.kp), ("kv", actuator.kv)] {
        if gain.is_some_and(|gain| gain < 0.0) {
            let cause = format!("its `{name}` is negative");
            return Err(Defect::new(cause, "write 0 or a positive number"));
        }
    }
    let ranges = [
        ("ctrlrange", actuator.ctrl_range),
        ("forcerange", actuator.force_range),
    ];
    for (name, range) in ranges {
        if let Some([low, high]) = range
            && low > high
        {
            let cause = format!("its `{name}` {low} to {high} is empty");
            return Err(Defect::new(cause, "write the lower end first"));
        }
    }
    // A drive here pulls both ways.
    if let Some([low, high]) = actuator.force_range
        && !(low <= 0.0 && high >= 0.0)
    {
        let cause = format!("its `forcerange` {low} to {high} doesn't hold 0");
        return Err(Defect::new(cause, "write a range from below 0 to above 0"));
    }
    Ok(())
}
