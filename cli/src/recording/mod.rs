//! Recordings for the rerun viewer.
//!
//! A [`Recording`] holds in plain numbers who moves how; the room `rrd` turns it into what the viewer shows. Only the latter
//! needs the rerun crate and its dependencies, which a build without the feature `rerun` leaves out.

mod content;
mod performance;
#[cfg_attr(not(feature = "rerun"), path = "without.rs")]
mod rrd;
mod save;

pub use content::Recording;
pub use rrd::send;
pub use save::{bytes, save, save_to};

use crate::failure::{Failure, Outcome};

/// Whether this build can write recordings.
pub const AVAILABLE: bool = cfg!(feature = "rerun");

/// How to get a build that can.
pub const HOW_TO_GET: &str =
    "install one with the feature `rerun`: `cargo install --locked --path cli`";

/// Fails where this build can't write recordings, and says which one can.
pub fn require() -> Outcome {
    if AVAILABLE {
        return Ok(());
    }
    Err(Failure::work("this build of mimic cannot write recordings").with_remedy(HOW_TO_GET))
}
