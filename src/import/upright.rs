//! Which way a figure stands, where a file is wrong about it.
//!
//! Some files say that Y is up, or say nothing, and hold data whose up is Z. A person stands on both feet in the rest
//! pose and, on the whole, in the motion: where both agree on an axis that isn't the stated one, it is up.

use super::axes::UpAxis;
use crate::clip::{Joint, Problem};
use crate::humanoid::{self, HumanoidMap, Slot};
use nalgebra::{Isometry3, Matrix3, Vector3};

/// An axis counts as the one that a figure stands along if it is this many times longer than the others.
const CLEAR: f64 = 2.0;
/// Figures with more joints than this are no humanoids, and looking for one among them takes long.
const MOST_JOINTS: usize = 4096;

/// Where a humanoid's head and feet are.
pub(crate) struct Stature(HumanoidMap);

impl Stature {
    pub fn of(joints: &[Joint]) -> Option<Self> {
        (joints.len() <= MOST_JOINTS)
            .then(|| humanoid::map(joints).ok())?
            .map(Self)
    }

    /// From the middle of the feet to the head.
    fn rise(&self, world: &[Isometry3<f64>]) -> Option<Vector3<f64>> {
        let place = |slot| Some(world.get(self.0.joint(slot)?)?.translation.vector);
        let top = place(Slot::Head)
            .or_else(|| place(Slot::Neck))
            .or_else(|| place(Slot::Chest));
        let feet = (place(Slot::LeftFoot)? + place(Slot::RightFoot)?) / 2.0;
        Some(top? - feet)
    }

    /// The file's up axis in place of the stated one, +Z of the canonical axes, where rest pose and motion agree on
    /// another. All poses are in canonical axes, in which `axes` put the file's.
    pub fn other_up(
        &self,
        rest: &[Isometry3<f64>],
        motion: &[Vec<Isometry3<f64>>],
        axes: &Matrix3<f64>,
    ) -> Option<UpAxis> {
        let stands = along(&self.rise(rest)?)?;
        let rises = motion.iter().filter_map(|pose| self.rise(pose));
        let moves = along(&rises.sum::<Vector3<f64>>())?;
        // A reflection has no axes that could be exchanged by a turn.
        let plain = axes.determinant() > 0.0;
        (plain && stands == moves && stands != Vector3::z())
            .then(|| UpAxis::nearest(&(axes.transpose() * stands)))
    }
}

pub(crate) fn problem(stated: &str, up: UpAxis) -> Problem {
    Problem::note(
        "up-axis-corrected",
        format!(
            "the figure stands along {up}, not {stated}: {up} is used as up; give {stated} as the up axis to keep the file's"
        ),
    )
}

/// The axis, with its sign, that a vector clearly runs along.
fn along(v: &Vector3<f64>) -> Option<Vector3<f64>> {
    let longest = v.iamax();
    let mut others = *v;
    others[longest] = 0.0;
    let clear = v[longest].abs() > CLEAR * others.norm();
    let mut axis = Vector3::zeros();
    axis[longest] = v[longest].signum();
    (clear && v[longest] != 0.0).then_some(axis)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_run_along_an_axis_or_none() {
        assert_eq!(along(&Vector3::new(0.1, -1.7, 0.2)), Some(-Vector3::y()));
        assert_eq!(along(&Vector3::new(0.0, 0.0, 1.0)), Some(Vector3::z()));
        assert_eq!(along(&Vector3::new(1.0, 0.0, 0.8)), None);
        assert_eq!(along(&Vector3::zeros()), None);
    }
}
