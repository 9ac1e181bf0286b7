//! What a caller can ask of the importer.

use super::axes::UpAxis;
use crate::clip::LoopMode;

/// How to read a file, where the file itself shouldn't decide.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Name of the take, or its number counted from 1. Default: the take with the most motion.
    pub take: Option<String>,
    /// Frames per second to sample at, above 0 and up to 10,000. Default: the take's own rate.
    pub fps: Option<f64>,
    /// Part of the take to keep, seconds from its start. Default: the whole take, except for a first frame that is a pose
    /// apart from the motion.
    pub trim: Option<(f64, f64)>,
    /// Whether the clip repeats. Default: as the format says, else whether the last frame joins the first.
    pub loop_mode: Option<LoopMode>,
    /// Up axis of the file's data, where its header is wrong.
    pub up: Option<UpAxis>,
    /// Metres per unit of the file's data, above 0, where its header is wrong.
    pub unit_m: Option<f64>,
    /// Whether left and right change places.
    pub mirror: bool,
}
