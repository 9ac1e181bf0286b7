//! What is asked for in an evaluation, step by step.

use crate::task::Wish;
use nalgebra::{Vector2, Vector3};

/// What a script asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Asks {
    /// To go and face a way.
    Wish(Wish),
    /// A push on the trunk in every step of a span, N·s each.
    Push(Vector3<f32>),
}

/// A script: what is asked for at which step, in order. Without one, the task's own player asks.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Script {
    pub asks: Vec<(usize, Asks)>,
    /// Control steps that it lasts.
    pub steps: usize,
}

impl Script {
    /// Goes in the direction of `angle` (radians) at `speed` (m/s) from `step` on.
    pub fn goes(mut self, step: usize, angle: f32, speed: f32) -> Script {
        let velocity = Vector2::new(angle.cos(), angle.sin()) * speed;
        let facing = None;
        self.asks
            .push((step, Asks::Wish(Wish { velocity, facing })));
        self
    }

    /// Pushes of `impulse`, N·s, over the `steps` after `step`, in the direction of `angle`.
    pub fn pushed(mut self, step: usize, steps: usize, angle: f32, impulse: f32) -> Script {
        let each = Vector3::new(angle.cos(), angle.sin(), 0.0) * (impulse / steps as f32);
        let span = step..step + steps;
        self.asks.extend(span.map(|step| (step, Asks::Push(each))));
        self
    }
}

/// An angle of a full circle, radians: number `n` of a sequence that covers it evenly however long it is (the golden angle).
pub(super) fn direction(n: usize) -> f32 {
    const GOLDEN: f64 = 2.399_963_229_728_653;
    (n as f64 * GOLDEN).rem_euclid(std::f64::consts::TAU) as f32
}
