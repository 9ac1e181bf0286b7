//! What the ground asks of a point that comes near it.

use nalgebra::Vector3;

/// Points nearer to the ground than this at the end of a step are looked at, metres.
pub(super) const NEAR: f32 = 0.005;
/// Share of a depth that is taken back in one step (the error reduction parameter), and the fastest that it may be, m/s.
const ERROR_REDUCTION: f32 = 0.2;
const FASTEST: f32 = 0.5;
/// Added to a hard point's own response, as a share of it (constraint force mixing): of redundant points, each bears its
/// part.
const FORCE_MIXING: f32 = 1e-3;
/// Of soft contacts, as MuJoCo's have it: how much of its acceleration a point is given at the surface, and below this
/// depth, metres.
const IMPEDANCE: [f32; 2] = [0.9, 0.95];
const SURFACE: f32 = 0.001;

/// What the ground is to one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ground {
    /// Seconds of the step.
    pub dt: f32,
    /// Seconds in which it yields; 0 where it is hard.
    pub yielding: f32,
}

impl Ground {
    /// Velocity that a point `gap` above the ground is brought to, and how softly.
    pub fn wants(&self, gap: f32, velocity: Vector3<f32>) -> (Vector3<f32>, f32) {
        if self.yielding <= 0.0 {
            return (Vector3::new(0.0, 0.0, wanted(gap / self.dt)), FORCE_MIXING);
        }
        // A critically damped spring whose time constant is `yielding` (MuJoCo, "Computation", "Reference"); of less than two
        // steps it would overshoot.
        let yielding = self.yielding.max(2.0 * self.dt);
        let [first, most] = IMPEDANCE;
        let depth = (-gap).max(0.0);
        let impedance = first + (most - first) * (depth / SURFACE).min(1.0);
        let kept = (1.0 - 2.0 * self.dt / (most * yielding)).max(0.0);
        let back = self.dt * impedance / (most * yielding).powi(2) * depth;
        let mut wanted = velocity * kept;
        wanted.z = if gap > 0.0 {
            wanted.z.min(-gap / self.dt)
        } else {
            wanted.z + back
        };
        (wanted, (1.0 - impedance) / impedance)
    }
}

/// Velocity that leaves no more than `room` metres a second to go, or recovers from a depth.
fn wanted(room: f32) -> f32 {
    if room > 0.0 {
        -room
    } else {
        (-room * ERROR_REDUCTION).min(FASTEST)
    }
}
