//! Edits: each takes a clip and returns another one.
//!
//! Several edits keep the meaning of their numbers in this order: trim, mirror, join, cut the best loop, warp time, take
//! travel out, put travel in, resample. The seconds of a trim are then those of the source, and the speed of travel is that of
//! the result.

mod cycle;
mod figure;
mod join;
mod look;
mod mirror;
mod seam;
#[cfg(test)]
mod tests;
mod travel;
mod warp;

pub use cycle::Loop;
pub use mirror::Plane;

use super::sampling::rate_flaw;
use super::{Clip, Error, Problem};

impl Clip {
    /// Checks what every edit relies on. A clip that was made by hand may lack it.
    pub(super) fn check(&self) -> Result<(), Error> {
        let unusable = |reason| {
            Err(Error::Unusable {
                name: self.name.clone(),
                reason,
            })
        };
        let count = self.joints.len();
        let mut joints = self.joints.iter().enumerate();
        if self.frames.is_empty() || count == 0 {
            return unusable("it has no frames or no joints");
        }
        if !self.frames.iter().all(|frame| frame.len() == count) {
            return unusable("a frame has more or fewer joints than the clip");
        }
        if !joints.all(|(j, joint)| joint.parent.is_none_or(|p| p < j)) {
            return unusable("a joint comes before its parent");
        }
        if rate_flaw(self.fps).is_some() {
            return unusable("its frame rate isn't a number from 0.1 to 10000");
        }
        Ok(())
    }

    /// Adds problems, each once.
    fn add_problems(&mut self, problems: impl IntoIterator<Item = Problem>) {
        for problem in problems {
            if !self.problems.contains(&problem) {
                self.problems.push(problem);
            }
        }
    }
}

/// `value` if it is finite and not below `least`. `what` and `wanted` describe it in the error.
fn at_least(
    what: &'static str,
    value: f64,
    least: f64,
    wanted: &'static str,
) -> Result<f64, Error> {
    if value.is_finite() && value >= least {
        Ok(value)
    } else {
        Err(Error::Number {
            what,
            value,
            wanted,
        })
    }
}
