//! Which way is up in a file, and how its axes become Z up, X forward, Y left.

use crate::explain::{Explain, Explanation, Parameter, explained};
use nalgebra::{Matrix3, Vector3};
use std::fmt;
use std::str::FromStr;

/// The direction in a file's coordinates that points away from the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpAxis {
    /// +X points up.
    PlusX,
    /// −X points up.
    MinusX,
    /// +Y points up.
    PlusY,
    /// −Y points up.
    MinusY,
    /// +Z points up.
    PlusZ,
    /// −Z points up.
    MinusZ,
}

/// A text that isn't one of the six axes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownAxis(String);

explained!(UnknownAxis);

impl Explain for UnknownAxis {
    fn explain(&self) -> Explanation {
        Explanation::input(format!("unknown up axis `{}`", self.0)).remedy_by(
            Parameter::UpAxis,
            "give x, y or z, with - in front where it points down",
        )
    }
}

impl UpAxis {
    const NAMES: [(UpAxis, &'static str); 6] = [
        (UpAxis::PlusX, "+X"),
        (UpAxis::MinusX, "-X"),
        (UpAxis::PlusY, "+Y"),
        (UpAxis::MinusY, "-Y"),
        (UpAxis::PlusZ, "+Z"),
        (UpAxis::MinusZ, "-Z"),
    ];

    /// The axis nearest to `direction`, in the file's coordinates.
    pub(crate) fn nearest(direction: &Vector3<f64>) -> Self {
        let ends = [
            (Self::PlusX, Self::MinusX),
            (Self::PlusY, Self::MinusY),
            (Self::PlusZ, Self::MinusZ),
        ];
        let axis = direction.iamax();
        let (plus, minus) = ends[axis];
        if direction[axis] < 0.0 { minus } else { plus }
    }

    /// Rotation from the file's axes to Z up, X forward, Y left, for a file of which only the up axis is known.
    ///
    /// Characters in Y-up files face +Z and those in Z-up files −Y, by the conventions of Maya and 3ds Max. For the other axes
    /// any heading would do, because `facing` corrects it.
    pub(crate) fn canonical_from_file(self) -> Matrix3<f64> {
        match self {
            UpAxis::PlusX => Matrix3::new(0., 1., 0., 0., 0., 1., 1., 0., 0.),
            UpAxis::MinusX => Matrix3::new(0., -1., 0., 0., 0., 1., -1., 0., 0.),
            UpAxis::PlusY => Matrix3::new(0., 0., 1., 1., 0., 0., 0., 1., 0.),
            UpAxis::MinusY => Matrix3::new(0., 0., 1., -1., 0., 0., 0., -1., 0.),
            UpAxis::PlusZ => Matrix3::new(0., -1., 0., 1., 0., 0., 0., 0., 1.),
            UpAxis::MinusZ => Matrix3::new(0., -1., 0., -1., 0., 0., 0., 0., -1.),
        }
    }
}

impl fmt::Display for UpAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = Self::NAMES.iter().find(|(axis, _)| axis == self);
        f.write_str(named.map_or("", |(_, name)| name))
    }
}

impl FromStr for UpAxis {
    type Err = UnknownAxis;

    fn from_str(text: &str) -> Result<Self, UnknownAxis> {
        let wanted = text.trim().to_ascii_uppercase();
        Self::NAMES
            .iter()
            .find(|(_, name)| *name == wanted || name.strip_prefix('+') == Some(wanted.as_str()))
            .map(|(axis, _)| *axis)
            .ok_or_else(|| UnknownAxis(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_becomes_up_by_a_rotation() {
        let up = [
            Vector3::x(),
            -Vector3::x(),
            Vector3::y(),
            -Vector3::y(),
            Vector3::z(),
            -Vector3::z(),
        ];
        for ((axis, name), up) in UpAxis::NAMES.iter().zip(up) {
            let turn = axis.canonical_from_file();
            assert_eq!(turn * up, Vector3::z(), "{name}");
            assert_eq!(UpAxis::nearest(&(up * 3.0)), *axis);
            assert_eq!(turn.determinant(), 1.0, "{name}");
            assert_eq!(name.parse(), Ok(*axis));
        }
        assert_eq!("y".parse(), Ok(UpAxis::PlusY));
        assert_eq!("-z".parse(), Ok(UpAxis::MinusZ));
        assert!("w".parse::<UpAxis>().is_err());
    }
}
