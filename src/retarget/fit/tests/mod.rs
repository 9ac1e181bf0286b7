//! The cost, its solver, and the windows over which it solves.

mod gradient;
mod windows;

use super::*;
