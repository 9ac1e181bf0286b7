//! Which way a figure stands, where its file is wrong about it.
//!
//! Some files state that Y is up, or nothing at all, and hold data with Z up. A person stands on both feet in the rest pose
//! and, on the whole, in the motion. Where both agree on an axis other than the stated one, that axis is up.

use super::axes::UpAxis;
use super::figure;
use crate::clip::{Joint, Problem};
use crate::humanoid::{HumanoidMap, Slot};
use nalgebra::{Isometry3, Matrix3, Vector3};

/// A figure stands along an axis if its extent along it is this many times that across it. Chosen: 63° from the ground.
const CLEAR: f64 = 2.0;

/// Where a humanoid's head and feet are.
pub(crate) struct Stature(HumanoidMap);

impl Stature {
    /// That of a humanoid; `None` for other figures.
    pub fn of(joints: &[Joint]) -> Option<Self> {
        figure::humanoid(joints).map(Self)
    }

    /// From the middle of the feet to the head, or to the nearest joint to it that there is.
    fn rise(&self, world: &[Isometry3<f64>]) -> Option<Vector3<f64>> {
        let place = |slot| Some(world.get(self.0.joint(slot)?)?.translation.vector);
        let top = place(Slot::Head)
            .or_else(|| place(Slot::Neck))
            .or_else(|| place(Slot::Chest));
        let feet = (place(Slot::LeftFoot)? + place(Slot::RightFoot)?) / 2.0;
        Some(top? - feet)
    }

    /// The up axis of the file's data, where rest pose and motion agree on another one than stated. The poses are in canonical
    /// axes, which have the stated one as +Z; `axes` is canonical from file.
    pub fn other_up(
        &self,
        rest: &[Isometry3<f64>],
        motion: &[Vec<Isometry3<f64>>],
        axes: &Matrix3<f64>,
    ) -> Option<UpAxis> {
        let stands = along(&self.rise(rest)?)?;
        // Poses are summed, so that single ones upside down or lying count for little.
        let rises = motion.iter().filter_map(|pose| self.rise(pose));
        let moves = along(&rises.sum::<Vector3<f64>>())?;
        // Left-handed axes can't become right ones by a turn, so nothing is exchanged there.
        let plain = axes.determinant() > 0.0;
        (plain && stands == moves && stands != Vector3::z())
            .then(|| UpAxis::nearest(&(axes.transpose() * stands)))
    }
}

/// A note about the correction.
pub(crate) fn problem(stated: &str, up: UpAxis) -> Problem {
    Problem::note(
        "up-axis-corrected",
        format!(
            "the figure stands along {up}, not {stated}: {up} is used as up; give {stated} as the up axis to keep the file's"
        ),
    )
}

/// The axis, with its sign, that a vector clearly points along.
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
