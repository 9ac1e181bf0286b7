//! Weights of the residuals. A keypoint's distance counts 1 per metre (times its slot's weight); all others are relative to
//! that.
//!
//! Chosen by trial over the clips at hand, not by theory. `docs/results.md` has what was tried and measured.

/// Points that stand, per metre: a stance holds to a twelfth of what the source asks otherwise.
pub(super) const STANCE: f64 = 12.0;
/// Points below the ground, per metre of depth: in the first fit …
pub(super) const GROUND: f64 = 16.0;
/// … and in frames that are solved again because some point is left too deep.
pub(super) const STIFF_GROUND: [f64; 2] = [60.0, 200.0];
/// Limbs in each other or in the trunk, per metre of depth. Twice as much halves what overlap is left, but makes limbs jump
/// to the other side in more clips (by 23 cm in one).
pub(super) const OVERLAP: f64 = 3.0;
/// Coordinates outside of their limits, per radian or metre: in the first fit …
pub(super) const LIMIT: f64 = 3.0;
/// … and in frames that are solved again because some coordinate is left outside.
pub(super) const STIFF_LIMITS: [f64; 2] = [30.0, 300.0];
/// Every coordinate's distance from the guess, per radian or metre. Small: it decides only what nothing else does, such as
/// the twist of a straight arm, and makes the equations regular.
pub(super) const GUESS: f64 = 0.005;
/// Acceleration of translations, per m/s². Small against the goals at the frequencies of motion, so that it only takes out
/// noise.
pub(super) const LINEAR_ACCELERATION: f64 = 1e-4;
/// Acceleration of rotations, per rad/s². Weights of three to four times these gave a backflip nothing (docs/results.md).
pub(super) const ANGULAR_ACCELERATION: f64 = 3e-5;
/// Speed of a hinge beyond what [`crate::retarget::hinge_speed`] allows, per rad/s. With two fifths of it, the longest steps
/// summed up to 300 instead of 256 cm on `marathon`.
pub(super) const HINGE_SPEED: f64 = 0.01;
