//! The numbers in attributes: all of them finite and of a size that physics can use, and directions that point somewhere.

use super::super::error::Defect;
use nalgebra::Vector3;

/// Largest number that is let through: MuJoCo's `mjMAXVAL`, beyond which it calls a coordinate or an acceleration bad.
const MOST: f64 = 1e10;
/// Shortest quaternion or axis that has a direction. Chosen, as for the axes of joints: a shorter one is a zero that went
/// through text and rounding.
const SHORTEST: f64 = 1e-9;

/// Attributes that hold names, paths or words, which may look like numbers.
const WORDS: [&str; 40] = [
    "actuator",
    "assetdir",
    "body",
    "body1",
    "body2",
    "childclass",
    "class",
    "content",
    "data",
    "file",
    "fileback",
    "filedown",
    "filefront",
    "fileleft",
    "fileright",
    "fileup",
    "geom",
    "geom1",
    "geom2",
    "hfield",
    "joint",
    "joint1",
    "joint2",
    "jointinparent",
    "material",
    "memory",
    "mesh",
    "meshdir",
    "model",
    "name",
    "objname",
    "prefix",
    "refname",
    "refsite",
    "site",
    "target",
    "tendon",
    "tendon1",
    "tendon2",
    "texture",
];

/// Checks the value of an attribute, if it holds numbers.
pub(super) fn check(name: &str, value: &str) -> Result<(), Defect> {
    if WORDS.binary_search(&name).is_ok() {
        return Ok(());
    }
    let numbers = || value.split_ascii_whitespace().flat_map(str::parse::<f64>);
    if let Some(wrong) = numbers().find(|x| x.is_nan() || x.abs() > MOST) {
        let cause = match wrong.is_finite() {
            true => format!("its `{name}` has the number {wrong:e}, which is too large to use"),
            false => format!("its `{name}` has the number {wrong}, which is not finite"),
        };
        let remedy = format!("write a finite number up to {MOST:e}");
        return Err(Defect::new(cause, remedy));
    }
    match points(name, numbers()) {
        true => Ok(()),
        false => Err(Defect::new(
            format!("its `{name}` has no direction"),
            "write numbers that are not all 0",
        )),
    }
}

/// Whether a rotation, which MJCF writes in five ways, is one. Others than rotations are.
fn points(name: &str, numbers: impl Iterator<Item = f64>) -> bool {
    let length = |numbers: &[f64]| numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
    let at_most = |count: usize| numbers.take(count).collect::<Vec<f64>>();
    match name {
        "quat" | "refquat" => length(&at_most(4)) > SHORTEST,
        "axisangle" | "zaxis" => length(&at_most(3)) > SHORTEST,
        "xyaxes" => match at_most(6).as_slice() {
            &[a, b, c, d, e, f] => {
                Vector3::new(a, b, c).cross(&Vector3::new(d, e, f)).norm() > SHORTEST
            }
            // Their count is for the parser to check.
            _ => true,
        },
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_in_order() {
        assert!(WORDS.is_sorted());
    }

    #[test]
    fn numbers_that_are_none_are_found() {
        for (name, value) in [
            ("kp", "nan"),
            ("kp", "-inf"),
            ("pos", "0 1e999 0"),
            ("mass", "1e308"),
            ("gravity", "0 0 -1e11"),
            ("quat", "0 0 0 0"),
            ("quat", "1e-300 0 0 0"),
            ("axisangle", "0 0 0 1"),
            ("zaxis", "0 0 0"),
            ("xyaxes", "1 0 0 2 0 0"),
        ] {
            let defect = check(name, value).expect_err(value);
            assert!(defect.cause.contains(&format!("`{name}`")), "{defect:?}");
        }
        for (name, value) in [
            ("name", "nan"),
            ("joint", "1e999"),
            ("quat", "0 0 0 1"),
            ("xyaxes", "1 0 0 0 1 0"),
            ("range", "-1e9 1e10"),
            ("euler", "0 0 0"),
            ("type", "infinite"),
        ] {
            assert_eq!(check(name, value), Ok(()), "{name} {value}");
        }
    }
}
