//! What retargeting says about the motion that it made.

use crate::clip::Problem;
use crate::humanoid::Slot;
use serde::{Deserialize, Serialize};

/// How near a retargeted motion comes to its source, how its feet and hands meet the ground, and which joints it was made
/// from. [`retarget`](crate::retarget::retarget) fills it in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RetargetReport {
    /// Frames of the motion.
    pub frames: usize,
    /// Distance of hips, shoulders, elbows, wrists, knees and ankles from the source's, which is scaled limb by limb,
    /// metres.
    pub keypoint_error_m: Spread,
    /// Mean horizontal speed of feet and hands while the source's stand, each at the point on the ground that moves
    /// least, m/s.
    pub foot_skate_m_s: f64,
    /// Depth of the lowest point below the ground, per frame, metres.
    pub penetration_m: Spread,
    /// Mean height above the ground of feet and hands while the source's stand, metres.
    pub float_m: f64,
    /// Share of the frames of every foot and hand, all taken together, in which it stands and the source's doesn't, or
    /// the other way round. The first motion files didn't have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_disagreement: Option<f64>,
    /// Coordinates outside of their limits, summed over frames.
    pub joint_limit_violations: usize,
    /// Which joint of the source was used for which slot.
    pub map: Vec<MappedJoint>,
    /// What was found in the clip and while retargeting it.
    pub problems: Vec<Problem>,
}

/// Mean and greatest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The mean; zero where there are no values.
    pub mean: f64,
    /// The greatest value; zero where there are no values.
    pub max: f64,
}

/// The joint used for a slot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MappedJoint {
    /// The slot.
    pub slot: Slot,
    /// Name of the source's joint.
    pub joint: String,
    /// From 0 (a guess) to 1 (certain).
    pub confidence: f64,
    /// How the joint was found.
    pub reason: String,
}

impl Spread {
    /// Mean and greatest of values that aren't negative.
    pub(crate) fn of(values: impl Iterator<Item = f64>) -> Spread {
        let (mut sum, mut max, mut count) = (0.0, 0.0_f64, 0_usize);
        for value in values {
            sum += value;
            max = max.max(value);
            count += 1;
        }
        Spread {
            mean: sum / count.max(1) as f64,
            max,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// The report in a motion file from before contacts were compared with the source's.
    fn first() -> serde_json::Value {
        json!({
            "frames": 2,
            "keypoint_error_m": { "mean": 0.25, "max": 0.5 },
            "foot_skate_m_s": 0.125,
            "penetration_m": { "mean": 0.0, "max": 0.0 },
            "float_m": 0.0,
            "joint_limit_violations": 0,
            "map": [{ "slot": "hips", "joint": "Hips", "confidence": 1.0, "reason": "its name" }],
            "problems": [],
        })
    }

    #[test]
    fn the_reports_of_the_first_files_are_read() {
        let report: RetargetReport = serde_json::from_value(first()).expect("it is read");
        assert_eq!(report.contact_disagreement, None);
        assert_eq!(report.map[0].slot, Slot::Hips);
        assert_eq!(json!(report), first());
    }

    #[test]
    fn a_field_that_is_missing_is_named() {
        let mut renamed = first();
        renamed["float"] = renamed["float_m"].take();
        renamed
            .as_object_mut()
            .expect("an object")
            .remove("float_m");
        let error = serde_json::from_value::<RetargetReport>(renamed).expect_err("refused");
        assert!(error.to_string().contains("float_m"), "{error}");
    }
}
