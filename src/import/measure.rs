//! Guesses for formats that state no unit of length, or round their frame rate.

use crate::clip::{Problem, extent};
use nalgebra::Vector3;

/// Frames per second of a frame time, `seconds`, that is written as `text`. `None` outside 1 to 10,000 Hz.
///
/// Writers round or cut frame times: 0.0333 and 0.033 mean 30 Hz. So a frame time stands for a whole rate if that rate's
/// exact frame time, rounded or cut to the digits written, gives the same text. The exact time may thus be half a last digit
/// below (rounded up) to one above (cut); the millionths make up for rounding in the division. The last digit must be
/// worth at most 4 % of the frame time (chosen): 0.03 could mean any of 29 to 40 Hz, and is used as it is.
pub(crate) fn rate_of_frame_time(text: &str, seconds: f64) -> Option<f64> {
    let rate = 1.0 / seconds;
    if !(1.0..=10_000.0).contains(&rate) {
        return None;
    }
    // How many digits are written after the point, and so how much the last one is worth.
    let digits = text.split(['e', 'E']).next()?;
    let digits = digits.split(['.', ',']).nth(1).map_or(0, str::len);
    let unit = 10f64.powi(-(digits.min(300) as i32));
    // How far the whole rate's exact frame time is above the written one, in units of the last digit.
    let beyond = (1.0 / rate.round() - seconds) / unit;
    let means_whole = unit <= 0.04 * seconds && (-0.500001..=1.000001).contains(&beyond);
    Some(if means_whole { rate.round() } else { rate })
}

/// The whole number within 0.1 % of a rate, if there is one, else the rate itself: writers round times to ticks, milliseconds or
/// six digits (1/30 s as 0.033332).
pub(crate) fn whole_rate(rate: f64) -> f64 {
    let whole = rate.round();
    if (rate - whole).abs() < 1e-3 * whole {
        whole
    } else {
        rate
    }
}

/// World positions at rest, in the file's units, of joints that don't turn there: parent and offset of each, parents first.
pub(crate) fn rest(
    joints: impl Iterator<Item = (Option<usize>, Vector3<f64>)>,
) -> Vec<Vector3<f64>> {
    let mut places: Vec<Vector3<f64>> = Vec::new();
    for (parent, offset) in joints {
        places.push(parent.map_or(offset, |p| places[p] + offset));
    }
    places
}

/// The unit of a file that doesn't state one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    /// Metres per unit.
    pub unit_m: f64,
    /// What the unit is called, in the plural.
    name: &'static str,
    /// Longest side of the box around the rest pose, in units.
    size: f64,
}

impl Scale {
    /// Units that files are written in, in metres. MakeHuman's is the decimetre. The last one is that of the CMU motion capture
    /// database, whose skeletons state a length of 0.45 units per inch.
    const UNITS: [(f64, &'static str); 6] = [
        (1.0, "metres"),
        (0.1, "decimetres"),
        (0.01, "centimetres"),
        (0.0254, "inches"),
        (0.001, "millimetres"),
        (0.0254 / 0.45, "CMU units of 5.64 cm"),
    ];
    /// Height of a person's rest pose from the toes to the top joint, metres. Chosen: the mean of adults is about 1.70 m, and
    /// the top joint is the head joint in some files and its end site in others.
    const PERSON_M: f64 = 1.65;

    /// The unit in which the longest side of the box around the joints at rest is nearest to a person's height, as a ratio.
    pub fn guess(rest: &[Vector3<f64>]) -> Self {
        let size = extent(rest.iter().copied());
        // Ratios are compared on a logarithmic scale: half as tall is as far off as twice as tall.
        let off = |unit: f64| (size * unit / Self::PERSON_M).ln().abs();
        let nearest = Self::UNITS
            .iter()
            .min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
        let (unit_m, name) = *nearest.filter(|_| size > 0.0).unwrap_or(&Self::UNITS[0]);
        Self { unit_m, name, size }
    }

    /// Whether `unit_m` makes the figure half to twice as tall as a person: a child or a giant. Chosen: most
    /// wrong units are off by more.
    fn allows(&self, unit_m: f64) -> bool {
        let tall = self.size * unit_m / Self::PERSON_M;
        self.size == 0.0 || (0.5..=2.0).contains(&tall)
    }

    /// A note about the guess.
    pub fn problem(&self) -> Option<Problem> {
        Some(Problem::note(
            "unit-guessed",
            format!(
                "the file states no unit: {} make the figure {:.2} m tall, the nearest to a person's size; give the unit where that is wrong",
                self.name,
                self.size * self.unit_m
            ),
        ))
    }
}

/// Metres per unit of a file that may state it, and a note if it had to be guessed: some files state a wrong unit.
pub(crate) fn unit(stated: Option<f64>, rest: &[Vector3<f64>]) -> (f64, Option<Problem>) {
    let scale = Scale::guess(rest);
    match stated {
        // A stated unit is believed as long as a person could have the size that it gives.
        Some(unit_m) if scale.allows(unit_m) => (unit_m, None),
        Some(unit_m) => {
            let tall = scale.size * unit_m;
            let message = format!(
                "the stated unit would make the figure {tall:.3} m tall: {} are used instead; give the unit where that is wrong",
                scale.name
            );
            let problem = Problem::warning("unit-guessed", message);
            (scale.unit_m, Some(problem))
        }
        None => (scale.unit_m, scale.problem()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_frame_times_mean_whole_rates() {
        let rate = |text: &str| rate_of_frame_time(text, text.parse().unwrap_or(0.0));
        for (text, expected) in [
            ("0.0333333", 30.0),
            (".03333", 30.0),
            ("0.033", 30.0),
            (".0083333", 120.0),
            ("0.008333", 120.0),
            ("0.041666", 24.0),
            ("0.016667", 60.0),
            ("0.01", 100.0),
            ("1.666667e-2", 60.0),
            ("0.03", 1.0 / 0.03),
            ("0.035", 1.0 / 0.035),
        ] {
            let found = rate(text).expect(text);
            assert!(
                (found - expected).abs() < 1e-9 * expected,
                "{text}: {found}"
            );
        }
        assert!((rate("0.0333667").expect("a rate") - 29.97).abs() < 1e-4);
        for none in ["0", "-0.01", "1e-9", "100"] {
            assert_eq!(rate(none), None, "{none}");
        }
    }

    #[test]
    fn figures_are_as_tall_as_people() {
        let of = |height: f64| Scale::guess(&[Vector3::zeros(), Vector3::new(0.1, height, 0.0)]);
        for (height, unit) in [
            (1.7, 1.0),
            (165.0, 0.01),
            (66.0, 0.0254),
            (1700.0, 0.001),
            (16.0, 0.1),
            (29.0, 0.0254 / 0.45),
        ] {
            assert_eq!(of(height).unit_m, unit, "{height}");
        }
        assert_eq!(Scale::guess(&[]).unit_m, 1.0);
        assert!(of(0.1).unit_m > 0.0);
    }

    #[test]
    fn a_stated_unit_is_believed_of_people() {
        let of = |stated, height| unit(stated, &[Vector3::zeros(), Vector3::new(0.1, height, 0.0)]);
        assert_eq!(of(Some(0.0254), 66.0), (0.0254, None));
        assert_eq!(of(Some(0.0254), 40.0), (0.0254, None));
        let (unit_m, problem) = of(Some(0.0254), 165.0);
        assert!(unit_m == 0.01 && problem.is_some_and(|problem| problem.message.contains("4.191")));
        assert_eq!(of(None, 1700.0).0, 0.001);
    }
}
