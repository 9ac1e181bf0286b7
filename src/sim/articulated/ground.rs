//! The contact model: which velocity the ground demands of a point near it, and how firmly.

use nalgebra::Vector3;

/// A point enters the contact problem if it is, or would be at the end of the step, nearer to the ground than this, metres.
/// Chosen: the contact impulses themselves change velocities within the step, so points that would stay clear without them
/// need a margin.
pub(super) const MARGIN: f32 = 0.005;
/// Share of a penetration that is taken back in one step: the error reduction parameter (ERP) of ODE and Bullet. Chosen: 0.2,
/// ODE's default too.
const ERROR_REDUCTION: f32 = 0.2;
/// Fastest that a penetration is taken back, m/s. Chosen: a reference motion may start a little inside the ground, and the
/// character has to be lifted out, not thrown out.
const MAX_RECOVERY: f32 = 0.5;
/// Softness of a hard contact, as a share of its own response: constraint force mixing (CFM). Chosen: enough that several
/// points of one sole share its load evenly instead of by their order, too little to see.
const SOFTNESS: f32 = 1e-3;
/// Impedance of a soft contact at the surface and from [`IMPEDANCE_WIDTH`] on: `dmin` and `dmax` of MuJoCo's default `solimp`.
const IMPEDANCE: [f32; 2] = [0.9, 0.95];
/// Depth at which the impedance reaches its highest value, metres: `width` of MuJoCo's default `solimp`.
const IMPEDANCE_WIDTH: f32 = 0.001;

/// The ground as one step sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ground {
    /// Duration of the step, seconds.
    pub dt: f32,
    /// Time constant with which it gives way, seconds; 0 if it is hard.
    pub time_constant: f32,
}

impl Ground {
    /// Velocity (m/s) to which a point is to be brought that is `gap` metres above the ground and moves at `velocity`, and the
    /// softness of that demand: the regularisation added to its response, as a share of it.
    pub fn target(&self, gap: f32, velocity: Vector3<f32>) -> (Vector3<f32>, f32) {
        if self.time_constant <= 0.0 {
            return (Vector3::new(0.0, 0.0, hard_target(gap / self.dt)), SOFTNESS);
        }
        // A critically damped spring (MuJoCo, "Computation", "Reference"): a point of depth r below the surface is accelerated by
        // −b v − k r, with b = 2 / (dmax τ) and k = d(r) / (dmax² τ²), τ the time constant and d(r) the impedance. A τ of less
        // than two steps would make it overshoot, so MuJoCo bounds it too (`refsafe`).
        let time_constant = self.time_constant.max(2.0 * self.dt);
        let [first, most] = IMPEDANCE;
        // The impedance rises linearly with depth here, where MuJoCo's default is a smooth curve between the same ends.
        let depth = (-gap).max(0.0);
        let impedance = first + (most - first) * (depth / IMPEDANCE_WIDTH).min(1.0);
        let kept = (1.0 - 2.0 * self.dt / (most * time_constant)).max(0.0);
        let back = self.dt * impedance / (most * time_constant).powi(2) * depth;
        // One step of that acceleration. Above the surface there is no spring yet: the point may come down to it.
        let mut target = velocity * kept;
        target.z = if gap > 0.0 {
            target.z.min(-gap / self.dt)
        } else {
            target.z + back
        };
        // MuJoCo's regulariser R = (1 − d) / d · A, with A the point's own response.
        (target, (1.0 - impedance) / impedance)
    }
}

/// Vertical velocity of a point on hard ground: it may reach the ground within the step but not go farther, and one that is
/// inside is brought back. `speed` is gap / dt, m/s.
fn hard_target(speed: f32) -> f32 {
    if speed > 0.0 {
        -speed
    } else {
        (-speed * ERROR_REDUCTION).min(MAX_RECOVERY)
    }
}
