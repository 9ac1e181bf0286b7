//! Names of the files in a run's folder.

use crate::file::LOCK;
use std::ffi::OsStr;

/// Everything that decides what the run learns; every run has it, from its first moment.
pub const CONFIG: &str = "config.json";
/// What each iteration did, a line of JSON each.
pub const METRICS: &str = "metrics.jsonl";
/// All that a resumed run needs to go on.
pub const CHECKPOINT: &str = "checkpoint.safetensors";
/// All that the policy needs to act.
pub const POLICY: &str = "policy.safetensors";
/// How well the finished run performs, with the default options.
pub const EVALUATION: &str = "eval.json";
/// The finished run's agent beside its reference, for the rerun viewer.
pub const RECORDING: &str = "replay.rrd";
/// The physics character, as MJCF.
pub const SKELETON: &str = "skeleton.xml";
/// Which body of the character is which slot of the humanoid.
pub const SLOTS: &str = "skeleton.json";

/// The motion number `index`, which the run learns.
pub fn reference(index: usize) -> String {
    format!("reference-{index}.motion")
}

/// Whether a run writes files of this name.
pub fn is_own(name: &OsStr) -> bool {
    let fixed = [
        CONFIG, METRICS, CHECKPOINT, POLICY, EVALUATION, RECORDING, LOCK,
    ];
    let is_fixed = fixed.iter().any(|own| name == *own);
    is_fixed || is_made_first(name) || crate::file::is_temporary(&name.to_string_lossy())
}

/// Whether files of this name are made before the folder is a run.
pub(super) fn is_made_first(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    let number = name
        .strip_prefix("reference-")
        .and_then(|rest| rest.strip_suffix(".motion"));
    let is_reference = number.is_some_and(|number| number.parse::<usize>().is_ok());
    is_reference || [SKELETON, SLOTS].contains(&&*name)
}
