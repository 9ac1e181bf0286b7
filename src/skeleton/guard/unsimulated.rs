//! What MuJoCo knows and our simulation doesn't. A character that has it would learn under other physics than its file states, so it
//! is named and refused. What only takes a little freedom away is told.

use super::super::error::Defect;
use super::markup::{Markup, Tag, markup};

/// Numbers of an attribute: its name, the fewest and the most. MuJoCo reads the first ones and ignores or refuses the rest.
const COUNTS: [(&str, usize, usize); 16] = [
    ("axis", 3, 3),
    ("axisangle", 4, 4),
    ("ctrlrange", 2, 2),
    ("diaginertia", 3, 3),
    ("euler", 3, 3),
    ("forcerange", 2, 2),
    ("friction", 1, 3),
    ("fromto", 6, 6),
    ("fullinertia", 6, 6),
    ("gear", 1, 6),
    ("pos", 3, 3),
    ("quat", 4, 4),
    ("range", 2, 2),
    ("size", 1, 3),
    ("xyaxes", 6, 6),
    ("zaxis", 3, 3),
];
/// The elements whose numbers are used.
const COUNTED: [&str; 4] = ["body", "geom", "inertial", "joint"];
/// The ways to state a rotation, of which an element has one.
const ROTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];
/// Dimensions of contact that there are.
const CONDIM: [&str; 4] = ["1", "3", "4", "6"];
/// What a tendon does beside being measured and limited.
const PULLS: [&str; 4] = ["stiffness", "damping", "frictionloss", "armature"];
/// What an actuator can drive beside a joint.
const DRIVEN: [&str; 5] = ["tendon", "site", "body", "cranksite", "jointinparent"];

/// Checks an element, given the one that it stands in.
pub(super) fn check(tag: Tag, parent: &str) -> Result<(), Defect> {
    let not_simulated =
        |what: String, remedy: &str| Err(Defect::new(format!("{what} is not simulated"), remedy));
    match (tag.name, parent) {
        (name, "equality") => {
            return not_simulated(
                format!("<{name}> of <equality>"),
                "remove it; bodies are joined by standing in one another",
            );
        }
        (_, "tendon") | ("tendon", "default") => {
            if let Some(pull) = PULLS.into_iter().find(|name| is_on(tag, name)) {
                return not_simulated(
                    format!("the `{pull}` of a tendon"),
                    "remove it, or give the joints that the tendon spans a `stiffness` and a `damping`",
                );
            }
        }
        (_, "actuator") => {
            if let Some(driven) = DRIVEN
                .into_iter()
                .find(|name| tag.attribute(name).is_some())
            {
                return not_simulated(
                    format!("an actuator of a `{driven}`"),
                    "drive single joints with `joint`",
                );
            }
        }
        ("body", _) if tag.attribute("mocap") == Some("true") => {
            return not_simulated("a `mocap` body".to_owned(), "remove the body, or `mocap`");
        }
        ("body", _) if is_on(tag, "gravcomp") => {
            return not_simulated("`gravcomp`".to_owned(), "remove it, or set it to 0");
        }
        ("geom", _) => check_condim(tag)?,
        _ => {}
    }
    if COUNTED.contains(&tag.name) || parent == "actuator" {
        check_rotations(tag)?;
        check_counts(tag)?;
    }
    Ok(())
}

/// Whether an attribute is a number other than 0, or is none.
fn is_on(tag: Tag, name: &str) -> bool {
    let value = tag.attribute(name);
    value.is_some_and(|value| {
        let mut numbers = value.split_ascii_whitespace().map(str::parse::<f64>);
        numbers.any(|number| number != Ok(0.0))
    })
}

fn check_condim(tag: Tag) -> Result<(), Defect> {
    match tag.attribute("condim").map(str::trim) {
        Some(other) if !CONDIM.contains(&other) => Err(Defect::new(
            format!("its `condim` of {other} is none that contacts have"),
            format!("write one of {}", CONDIM.join(", ")),
        )),
        _ => Ok(()),
    }
}

fn check_rotations(tag: Tag) -> Result<(), Defect> {
    let mut stated = ROTATIONS
        .into_iter()
        .filter(|name| tag.attribute(name).is_some());
    match (stated.next(), stated.next()) {
        (Some(one), Some(other)) => Err(Defect::new(
            format!("it states its rotation twice, by `{one}` and `{other}`"),
            "keep one of the two",
        )),
        _ => Ok(()),
    }
}

fn check_counts(tag: Tag) -> Result<(), Defect> {
    for (name, least, most) in COUNTS {
        let Some(value) = tag.attribute(name) else {
            continue;
        };
        let found = value.split_ascii_whitespace().count();
        if !(least..=most).contains(&found) {
            let wanted = match least == most {
                true => format!("{most}"),
                false => format!("{least} to {most}"),
            };
            let cause = format!("its `{name}` has {found} numbers instead of {wanted}");
            return Err(Defect::new(cause, format!("write {wanted} numbers")));
        }
    }
    Ok(())
}

/// The tendons that are limited, by name: their limits aren't simulated.
pub(crate) fn limited_tendons(xml: &str) -> Vec<String> {
    let (mut inside, mut found) = (false, Vec::new());
    for piece in markup(xml) {
        let Markup::Open(tag) = piece else {
            continue;
        };
        match tag.name {
            "tendon" => inside = true,
            "fixed" | "spatial" if inside => {
                let is_limited = match tag.attribute("limited") {
                    Some(stated) => stated == "true",
                    None => tag.attribute("range").is_some(),
                };
                let name = tag.attribute("name").unwrap_or("without a name");
                found.extend(is_limited.then(|| name.to_owned()));
            }
            "joint" | "site" | "geom" | "pulley" if inside => {}
            _ => inside = false,
        }
    }
    found
}
