//! The offsets that carry a character from one motion into another: each joint begins where the old motion had it and fades
//! into the new one. Only the new motion has to be played meanwhile (inertialisation: Bollo, "Inertialization", Game Developers
//! Conference 2018; here along cubics).

use crate::sim::{Character, LinkState};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// Seconds in which the offsets fade. Chosen.
const FADE_S: f64 = 0.4;

/// An offset and its rate: of the root's place, m, or of a rotation, rad, in the link's frame.
#[derive(Clone, Copy, Debug)]
struct Offset {
    at: Vector3<f32>,
    rate: Vector3<f32>,
}

impl Offset {
    /// What is left after the share `u` of [`FADE_S`], on the cubic Hermite curve from this offset and rate to no offset at no
    /// rate: x (1 − u)² (1 + 2u) + v T u (1 − u)².
    fn after(&self, u: f32) -> Offset {
        let s = FADE_S as f32;
        let left = 1.0 - u;
        Offset {
            at: self.at * (left * left * (1.0 + 2.0 * u)) + self.rate * (s * u * left * left),
            rate: self.at * (-6.0 * u * left / s) + self.rate * (left * (1.0 - 3.0 * u)),
        }
    }
}

/// Offsets of a character from a motion that has begun.
#[derive(Clone, Debug)]
pub(super) struct Blend {
    shift: Offset,
    /// One per link.
    turns: Vec<Offset>,
}

impl Blend {
    /// The offsets between `present`, where the old motion has the character, and `begun`, where the new one begins.
    pub fn between(character: &Character, present: &[LinkState], begun: &[LinkState]) -> Blend {
        let turn = |i: usize| {
            let (old, old_rate) = joint(character, present, i);
            let (new, new_rate) = joint(character, begun, i);
            let by = new.inverse() * old;
            let at = by.scaled_axis();
            // old = new · by, so by turns at what is left of the old rate in the new one.
            let rate = old_rate - by.inverse() * new_rate;
            Offset {
                at,
                rate: right_jacobian_inverse(&at, &rate),
            }
        };
        let (old, new) = (&present[0], &begun[0]);
        Blend {
            shift: Offset {
                at: old.pose.translation.vector - new.pose.translation.vector,
                rate: old.linear - new.linear,
            },
            turns: (0..begun.len()).map(turn).collect(),
        }
    }

    /// Whether any offset is left after so many seconds.
    pub fn lasts(&self, seconds: f64) -> bool {
        seconds < FADE_S
    }

    /// Adds to `links`, which are those of the new motion, what is left after so many seconds.
    pub fn apply(&self, character: &Character, seconds: f64, links: &mut [LinkState]) {
        let u = (seconds / FADE_S).clamp(0.0, 1.0) as f32;
        // Joints are turned from the root outward: each link hangs on its parent as already moved, but the offset itself is
        // from the new motion alone.
        let alone = links.to_vec();
        for (i, turn) in self.turns.iter().enumerate() {
            let turn = turn.after(u);
            let by = UnitQuaternion::from_scaled_axis(turn.at);
            let (rotation, rate) = joint(character, &alone, i);
            let rate = by.inverse() * rate + right_jacobian(&turn.at, &turn.rate);
            let rotation = rotation * by;
            links[i] = match character.links[i].parent {
                None => {
                    let shift = self.shift.after(u);
                    let at = alone[i].pose.translation.vector + shift.at;
                    LinkState {
                        pose: Isometry3::from_parts(at.into(), rotation),
                        linear: alone[i].linear + shift.rate,
                        angular: rotation * rate,
                    }
                }
                Some(p) => {
                    let anchor = character.links[i].anchor.cast::<f32>();
                    let joined = alone[p].pose.inverse() * alone[i].pose * Point3::from(anchor);
                    hung(&links[p], &joined, rotation, (rate, anchor))
                }
            };
        }
    }
}

/// The link whose joint is at the point `joined` of its parent and at its own point `anchor` (both in link frames, metres),
/// turned by `rotation` against the parent, at the joint's `rate`, rad/s in the link's own frame.
fn hung(
    parent: &LinkState,
    joined: &Point3<f32>,
    rotation: UnitQuaternion<f32>,
    (rate, anchor): (Vector3<f32>, Vector3<f32>),
) -> LinkState {
    let rotation = parent.pose.rotation * rotation;
    let joint = (parent.pose * joined).coords;
    let angular = parent.angular + rotation * rate;
    let arm = rotation * anchor;
    let of_joint = parent
        .angular
        .cross(&(joint - parent.pose.translation.vector));
    LinkState {
        pose: Isometry3::from_parts((joint - arm).into(), rotation),
        linear: parent.linear + of_joint - angular.cross(&arm),
        angular,
    }
}

/// Rotation of link `i` in its parent, or in the world, and the rate at which it turns there, in its own frame, rad/s.
fn joint(
    character: &Character,
    links: &[LinkState],
    i: usize,
) -> (UnitQuaternion<f32>, Vector3<f32>) {
    let link = &links[i];
    let (turn, angular) = character.links[i].parent.map_or_else(
        || (UnitQuaternion::identity(), Vector3::zeros()),
        |p| (links[p].pose.rotation, links[p].angular),
    );
    (
        turn.inverse() * link.pose.rotation,
        link.pose.rotation.inverse() * (link.angular - angular),
    )
}

/// Body angular velocity of exp(v) while v changes at `rate`: the right Jacobian of the rotation group times `rate` (Solà et
/// al. 2018, "A micro Lie theory for state estimation in robotics", on SO(3)).
fn right_jacobian(v: &Vector3<f32>, rate: &Vector3<f32>) -> Vector3<f32> {
    let angle = v.norm();
    // Near 0 the closed form divides two tiny numbers; the next term of its series is below 1e-6 there.
    if angle < 1e-3 {
        return rate - v.cross(rate) * 0.5;
    }
    let once = v.cross(rate);
    let square = angle * angle;
    rate - once * ((1.0 - angle.cos()) / square)
        + v.cross(&once) * ((angle - angle.sin()) / (square * angle))
}

/// The rate of v at which exp(v) turns with body angular velocity `rate` (the inverse, there too).
fn right_jacobian_inverse(v: &Vector3<f32>, rate: &Vector3<f32>) -> Vector3<f32> {
    let angle = v.norm();
    let once = v.cross(rate);
    if angle < 1e-3 {
        return rate + once * 0.5;
    }
    // As 1/θ² − (1 + cos θ)/(2θ sin θ), rewritten with half the angle, whose sine is 0 only at 0 and at a full turn.
    let half = angle / 2.0;
    let share = (1.0 - half * half.cos() / half.sin().max(1e-3)) / (angle * angle);
    rate + once * 0.5 + v.cross(&once) * share
}
