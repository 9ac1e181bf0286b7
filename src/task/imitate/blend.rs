//! What is left of the pose and speed of a motion while another takes over: every joint's offset from the new motion,
//! which fades (inertialisation: Bollo, "Inertialization", Game Developers Conference 2018; here along cubics).

use crate::sim::{Character, LinkState};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// Seconds in which the offsets fade.
const FADES: f64 = 0.4;

/// An offset and its rate: of the root's place, m, or of a rotation, rad, in the link's frame.
#[derive(Clone, Copy, Debug)]
struct Offset {
    at: Vector3<f32>,
    rate: Vector3<f32>,
}

impl Offset {
    /// The cubic that begins with offset and rate and ends at rest, without any: after the share `u` of [`FADES`].
    fn after(&self, u: f32) -> Offset {
        let s = FADES as f32;
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
    /// From where `present` has it, in a motion that begins with `begun`.
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

    /// Whether anything is left after so many seconds.
    pub fn lasts(&self, seconds: f64) -> bool {
        seconds < FADES
    }

    /// Adds to `links`, which are those of the new motion, what is left after so many seconds.
    pub fn apply(&self, character: &Character, seconds: f64, links: &mut [LinkState]) {
        let u = (seconds / FADES).clamp(0.0, 1.0) as f32;
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

/// The link that hangs on `parent` at its point `joined`, turned by `rotation`, at a `rate` of its joint in its own frame.
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

/// Body angular velocity of exp(v) while v changes at `rate`: the right Jacobian of the rotation group times `rate`.
fn right_jacobian(v: &Vector3<f32>, rate: &Vector3<f32>) -> Vector3<f32> {
    let angle = v.norm();
    if angle < 1e-3 {
        return rate - v.cross(rate) * 0.5;
    }
    let once = v.cross(rate);
    let square = angle * angle;
    rate - once * ((1.0 - angle.cos()) / square)
        + v.cross(&once) * ((angle - angle.sin()) / (square * angle))
}

/// The rate of v at which exp(v) turns with body angular velocity `rate`.
fn right_jacobian_inverse(v: &Vector3<f32>, rate: &Vector3<f32>) -> Vector3<f32> {
    let angle = v.norm();
    let once = v.cross(rate);
    if angle < 1e-3 {
        return rate + once * 0.5;
    }
    let half = angle / 2.0;
    let share = (1.0 - half * half.cos() / half.sin().max(1e-3)) / (angle * angle);
    rate + once * 0.5 + v.cross(&once) * share
}
