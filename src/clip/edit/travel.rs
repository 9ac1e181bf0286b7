//! Travel: the steady part of a figure's path over the ground.

use super::figure::{Figure, moving};
use crate::clip::{Clip, Error};
use nalgebra::{Vector2, Vector3};

impl Clip {
    /// Mean horizontal velocity of the figure from the first frame to the last, m/s.
    ///
    /// # Errors
    /// An [`Error`] for a clip that contradicts itself.
    pub fn mean_velocity(&self) -> Result<Vector2<f64>, Error> {
        self.check()?;
        let figure = Figure::new(&self.joints, &moving(self));
        let last = self.frames.len() - 1;
        if last == 0 {
            return Ok(Vector2::zeros());
        }
        let place = |frame| self.world_of(figure.traveller, frame).translation.vector;
        Ok((place(last) - place(0)).xy() / self.duration())
    }

    /// The clip on the spot: without its mean horizontal velocity, but with its sway.
    ///
    /// # Errors
    /// As for [`Clip::mean_velocity`].
    pub fn in_place(&self) -> Result<Clip, Error> {
        self.travel(-self.mean_velocity()?)
    }

    /// The clip with `velocity` over the ground (world X and Y, m/s) added to its motion.
    ///
    /// # Errors
    /// An [`Error`] for a velocity that isn't finite.
    pub fn travel(&self, velocity: Vector2<f64>) -> Result<Clip, Error> {
        self.check()?;
        if !(velocity.norm() * self.duration()).is_finite() {
            return Err(Error::Number {
                what: "a travel",
                value: velocity.norm(),
                wanted: "two numbers of metres per second",
            });
        }
        let figure = Figure::new(&self.joints, &moving(self));
        let mut clip = self.clone();
        for (joint, footing) in figure.footings(self) {
            // The velocity in the axes of the carrier's parent, per frame.
            let step: Vector3<f64> = footing.rotation.inverse() * velocity.push(0.0) / self.fps;
            for (f, frame) in clip.frames.iter_mut().enumerate() {
                frame[joint].translation.vector += step * f as f64;
            }
        }
        Ok(clip)
    }
}
