//! Axes, unit of length, frame rate and clock of the file.

use super::document::Document;
use super::properties::Properties;
use crate::clip::Problem;
use nalgebra::{Matrix3, Vector3};

/// Ticks per second of FBX 7 (`KTime`).
const TICKS: f64 = 46_186_158_000.0;
/// Ticks per second of the clock that newer files may choose.
const NEW_TICKS: f64 = 141_120_000.0;
/// The value of `TCDefinition` that keeps the old clock, and the first header version with that choice (both as in ufbx).
const OLD_CLOCK: i64 = 127;
const CLOCK_CHOICE: i64 = 1004;
/// Frame rates of `TimeMode` (`FbxTime::EMode` of the FBX SDK), Hz; 0 where the mode states none.
const FPS: [f64; 18] = [
    0.0,
    120.0,
    100.0,
    60.0,
    50.0,
    48.0,
    30.0,
    30.0,
    30000.0 / 1001.0,
    30000.0 / 1001.0,
    25.0,
    24.0,
    1000.0,
    24000.0 / 1001.0,
    0.0,
    96.0,
    72.0,
    60000.0 / 1001.0,
];
const CUSTOM_MODE: usize = 14;

#[derive(Clone, Debug)]
pub(super) struct Settings {
    /// E.g. `+Y`.
    pub up_axis: String,
    /// From the file's axes to Z up, X forward, Y left.
    pub canonical_from_file: Matrix3<f64>,
    /// Metres per unit: the file states centimetres.
    pub unit_m: f64,
    /// Frame rate that the file states, Hz.
    pub fps: Option<f64>,
    /// Ticks per second of its clock.
    pub ticks: f64,
    /// What is wrong with them.
    pub problems: Vec<Problem>,
}

impl Settings {
    /// The settings of a file.
    pub fn read(document: &Document) -> Self {
        let record = document.record("GlobalSettings");
        let properties = record.map(Properties::of);
        Self::of(
            |name| properties.and_then(|p| p.int(name)),
            |name| properties.and_then(|p| p.real(name)),
            ticks(document),
        )
    }

    /// The settings by properties, which are looked up by name.
    pub fn of(
        int: impl Fn(&str) -> Option<i64>,
        real: impl Fn(&str) -> Option<f64>,
        ticks: f64,
    ) -> Self {
        let mut problems = Vec::new();
        let axis = |name: &str| signed_axis(int(name)?, int(&format!("{name}Sign")));
        let axes = Axes::new(axis("UpAxis"), axis("FrontAxis"), axis("CoordAxis"));
        if axes.canonical_from_file().determinant() < 0.0 {
            problems.push(Problem::warning(
                "left-handed",
                "the file's axes are left-handed: the motion was mirrored to fit right-handed ones",
            ));
        }
        let unit = real("UnitScaleFactor").unwrap_or(1.0);
        // Centimetres per unit. Anything outside this range is damage (chosen).
        let unit = if (1e-9..=1e9).contains(&unit) {
            unit
        } else {
            problems.push(Problem::warning(
                "invalid-unit",
                "the file's unit of length is out of range: centimetres are assumed",
            ));
            1.0
        };
        Self {
            up_axis: axes.up.name(),
            canonical_from_file: axes.canonical_from_file(),
            unit_m: unit / 100.0,
            fps: fps(int("TimeMode"), real("CustomFrameRate")),
            ticks,
            problems,
        }
    }
}

/// The rate of a time mode, from 1 to 1000 Hz.
fn fps(mode: Option<i64>, custom: Option<f64>) -> Option<f64> {
    let mode = usize::try_from(mode?).ok()?;
    let fps = if mode == CUSTOM_MODE {
        custom?
    } else {
        *FPS.get(mode)?
    };
    (1.0..=1000.0).contains(&fps).then_some(fps)
}

/// Ticks per second of the file's clock.
fn ticks(document: &Document) -> f64 {
    let header = document.record("FBXHeaderExtension");
    let version = header
        .and_then(|header| header.child("FBXHeaderVersion")?.int(0))
        .unwrap_or(0);
    let clock = header.and_then(|header| header.child("OtherFlags")?.child("TCDefinition")?.int(0));
    match clock {
        Some(clock) if version >= CLOCK_CHOICE && clock != OLD_CLOCK => NEW_TICKS,
        _ => TICKS,
    }
}

/// A coordinate axis and its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    index: usize,
    sign: f64,
}

impl Axis {
    fn unit(self) -> Vector3<f64> {
        let mut unit = Vector3::zeros();
        unit[self.index] = self.sign;
        unit
    }

    fn name(self) -> String {
        let sign = if self.sign < 0.0 { '-' } else { '+' };
        format!("{sign}{}", ['X', 'Y', 'Z'][self.index])
    }
}

fn signed_axis(index: i64, sign: Option<i64>) -> Option<Axis> {
    let index = usize::try_from(index).ok().filter(|&index| index < 3)?;
    Some(Axis {
        index,
        sign: if sign.is_some_and(|sign| sign < 0) {
            -1.0
        } else {
            1.0
        },
    })
}

/// The three axes of `GlobalSettings`, as directions of a character in the scene.
///
/// FBX's front axis points out of the front view towards the viewer, so a character in its usual pose faces along it: +Z in a
/// Y-up file, −Y in a Z-up one. The coordinate axis points right in that view, which is the character's left. So front,
/// left and up are the canonical X, Y and Z, and are the rows of the matrix. It is a rotation if the three are right-handed
/// (left × up = front), and a reflection if the file says that they are left-handed.
struct Axes {
    up: Axis,
    front: Axis,
    left: Vector3<f64>,
}

impl Axes {
    fn new(up: Option<Axis>, front: Option<Axis>, coord: Option<Axis>) -> Self {
        let up = up.unwrap_or(Axis {
            index: 1,
            sign: 1.0,
        });
        let front = front.map_or_else(|| usual_front(up), |front| Self::settle(up, front));
        // A coordinate axis that is also up or front can't be right: then left follows from the two others.
        let coord = coord.filter(|coord| coord.index != up.index && coord.index != front.index);
        let left = coord.map_or_else(|| up.unit().cross(&front.unit()), Axis::unit);
        Self { up, front, left }
    }

    /// The front axis. The file has its index, but a few writers store FBX's parity instead: 1 for the first and 2 for the second
    /// of the two axes that aren't up. That shows where the number is the index of the up axis itself.
    fn settle(up: Axis, front: Axis) -> Axis {
        if front.index != up.index {
            return front;
        }
        let remaining = [[1, 2], [0, 2], [0, 1]][up.index];
        match front.index {
            0 => usual_front(up),
            parity => Axis {
                index: remaining[parity - 1],
                sign: front.sign,
            },
        }
    }

    fn canonical_from_file(&self) -> Matrix3<f64> {
        let rows = [self.front.unit(), self.left, self.up.unit()].map(|axis| axis.transpose());
        Matrix3::from_rows(&rows)
    }
}

/// Front of the usual axis systems: Maya's Y up and Max's Z up.
fn usual_front(up: Axis) -> Axis {
    if up.index == 2 {
        Axis {
            index: 1,
            sign: -1.0,
        }
    } else {
        Axis {
            index: 2,
            sign: 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(up: (i64, i64), front: (i64, i64), coord: (i64, i64)) -> Matrix3<f64> {
        let axis = |(index, sign)| signed_axis(index, Some(sign));
        Axes::new(axis(up), axis(front), axis(coord)).canonical_from_file()
    }

    #[test]
    fn y_up_characters_face_z() {
        let m = axes((1, 1), (2, 1), (0, 1));
        assert_eq!(m * Vector3::new(1.0, 2.0, 3.0), Vector3::new(3.0, 1.0, 2.0));
    }

    #[test]
    fn z_up_characters_face_minus_y() {
        let m = axes((2, 1), (1, -1), (0, 1));
        assert_eq!(
            m * Vector3::new(1.0, 2.0, 3.0),
            Vector3::new(-2.0, 1.0, 3.0)
        );
    }

    #[test]
    fn every_combination_is_orthogonal_and_as_handed_as_its_axes() {
        for up in 0..3 {
            for front in (0..3).filter(|&front| front != up) {
                for signs in 0..8 {
                    let sign = |bit: i64| 1 - 2 * (signs >> bit & 1);
                    let coord = 3 - up - front;
                    let m = axes((up, sign(0)), (front, sign(1)), (coord, sign(2)));
                    assert_eq!(m * m.transpose(), Matrix3::identity());
                    let unit = |index, sign| {
                        signed_axis(index, Some(sign))
                            .expect("an index below 3")
                            .unit()
                    };
                    let handed = unit(coord, sign(2))
                        .cross(&unit(up, sign(0)))
                        .dot(&unit(front, sign(1)));
                    assert_eq!(m.determinant(), handed);
                    assert_eq!(m * unit(up, sign(0)), Vector3::z());
                    assert_eq!(m * unit(front, sign(1)), Vector3::x());
                }
            }
        }
    }

    #[test]
    fn missing_or_clashing_axes_give_a_rotation() {
        let none: [Option<Axis>; 3] = [None; 3];
        let [up, front, coord] = none;
        assert_eq!(
            Axes::new(up, front, coord).canonical_from_file(),
            axes((1, 1), (2, 1), (0, 1))
        );
        for code in 0..27 {
            let m = axes((code % 3, 1), (code / 3 % 3, 1), (code % 3, 1));
            assert_eq!(m * m.transpose(), Matrix3::identity());
            assert_eq!(m.determinant(), 1.0);
        }
    }

    #[test]
    fn parity_names_the_front_of_a_z_up_file() {
        assert_eq!(axes((2, 1), (2, -1), (0, 1)), axes((2, 1), (1, -1), (0, 1)));
    }
}
