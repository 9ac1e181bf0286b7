//! Critically damped springs: the fastest way to a goal that doesn't overshoot, whatever the length of a step.

use nalgebra::Vector2;

/// A value that follows a goal: x″ = (goal − x)/τ² − 2 x′/τ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Spring<T> {
    /// The value.
    pub at: T,
    /// Its rate of change, per second.
    pub rate: T,
}

impl Spring<Vector2<f32>> {
    /// Goes on for `dt` seconds toward `goal`, with time constant `tau`, s, changing by at most `fastest` a second.
    ///
    /// Exact for a goal that stays: x(t) = goal + (d + (x′ + d/τ) t) e^(−t/τ), with d = x − goal.
    pub fn follow(&mut self, goal: &Vector2<f32>, tau: f32, fastest: f32, dt: f32) {
        let before = self.at;
        let off = self.at - goal;
        let push = self.rate + off / tau;
        let decay = (-dt / tau).exp();
        self.at = goal + (off + push * dt) * decay;
        self.rate = (self.rate - push * (dt / tau)) * decay;
        // Past what is allowed it goes on at the highest rate, and forgets that it wanted more.
        let step = self.at - before;
        let longest = fastest * dt;
        if step.norm() > longest {
            self.at = before + step * (longest / step.norm());
            self.rate *= fastest / self.rate.norm().max(fastest);
        }
    }
}

impl Spring<f32> {
    /// The same for a number.
    pub fn follow(&mut self, goal: f32, tau: f32, fastest: f32, dt: f32) {
        let line = |x: f32| Vector2::new(x, 0.0);
        let mut both = Spring {
            at: line(self.at),
            rate: line(self.rate),
        };
        both.follow(&line(goal), tau, fastest, dt);
        *self = Spring {
            at: both.at.x,
            rate: both.rate.x,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_arrives_without_overshoot_at_any_step() {
        for dt in [0.001, 0.01, 0.1, 1.0] {
            let mut spring = Spring {
                at: 0.0_f32,
                rate: 0.0,
            };
            let mut highest = 0.0_f32;
            for _ in 0..(3.0 / dt) as usize {
                spring.follow(1.0, 0.2, f32::INFINITY, dt);
                highest = highest.max(spring.at);
            }
            assert!(
                (spring.at - 1.0).abs() < 1e-3 && highest < 1.0 + 1e-6,
                "{dt}"
            );
        }
    }

    /// 1 − (1 + t/τ) e^(−t/τ) is 63 % at t = 2.146 τ.
    #[test]
    fn its_response_is_that_of_the_formula() {
        let mut spring = Spring {
            at: 0.0_f32,
            rate: 0.0,
        };
        for _ in 0..1073 {
            spring.follow(1.0, 0.2, f32::INFINITY, 0.0004);
        }
        assert!((spring.at - 0.632).abs() < 1e-3, "{}", spring.at);
    }

    #[test]
    fn it_changes_no_faster_than_allowed() {
        let mut spring = Spring {
            at: Vector2::zeros(),
            rate: Vector2::zeros(),
        };
        for _ in 0..300 {
            let before = spring.at;
            spring.follow(&Vector2::new(3.0, 4.0), 0.1, 5.0, 0.01);
            assert!((spring.at - before).norm() <= 0.05 + 1e-6);
        }
        assert!((spring.at - Vector2::new(3.0, 4.0)).norm() < 1e-3);
    }
}
