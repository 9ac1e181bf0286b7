//! Drawings as SVG files: the tracks of a motion, and the learning curves of runs.

pub mod curves;
mod svg;
mod tracks;

pub use tracks::tracks;
