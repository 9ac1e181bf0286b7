//! Names that the parts of a recording and its layout agree on.

/// The application of the recording and of its layout: the viewer matches the two by it.
pub const APPLICATION: &str = "mimic";
/// The timeline in seconds from the first frame.
pub const TIMELINE: &str = "time";
/// The entity that the eye follows: the viewer frames its bounds.
pub const FOLLOWED: &str = "followed";
