//! Checks MJCF text before the parser sees it: its size, nesting and counts are bounded, its numbers are numbers, and nothing
//! reads other files or generates bodies.

mod markup;
mod numbers;
mod unsimulated;

use super::error::{Defect, SkeletonError};
use markup::{Markup, Tag, markup};
pub(super) use unsimulated::limited_tendons;

/// Most bytes of a text. Chosen: the largest humanoids of MuJoCo Menagerie have fifty thousand, and the parser takes a
/// multiple of that in memory and time.
pub(crate) const MOST_BYTES: u64 = 1 << 20;
/// Deepest nesting of elements that is let through. Chosen: the parser recurses once per level, a thread's usual stack
/// holds 100 levels, and no character comes near that depth.
const MAX_DEPTH: usize = 100;
/// Deepest nesting of default classes: every element goes through those above its own. Chosen: models have up to five.
const MAX_CLASSES: usize = 16;
/// Most elements. Chosen: ten times as many as the largest humanoids have.
const MAX_ELEMENTS: usize = 20_000;
/// Most attributes of an element. The parser compares each with each. MuJoCo's elements have up to some fifty.
const MAX_ATTRIBUTES: usize = 64;
/// Longest name, in bytes, and longest value within `<default>`: the parser copies them to every element of their class.
/// Chosen.
const MAX_WORD: usize = 500;

/// What a character has at most of each kind, by the element that they stand in. Chosen: a human body with all fingers has
/// some 160 degrees of freedom, and the memory of retargeting grows with the square of their number.
const MAX_PARTS: [Parts; 6] = [
    Parts::new("default", "", 1000, "default classes"),
    Parts::new("body", "", 256, "bodies"),
    Parts::new("joint", "body", 256, "joints"),
    Parts::new("freejoint", "body", 256, "free joints"),
    Parts::new("geom", "", 2048, "geoms"),
    Parts::new("", "actuator", 1024, "actuators"),
];

/// A kind of parts.
struct Parts {
    /// Name of their elements, and of the element that they stand in; empty for any.
    element: &'static str,
    parent: &'static str,
    most: usize,
    /// The kind in words.
    words: &'static str,
}

impl Parts {
    const fn new(
        element: &'static str,
        parent: &'static str,
        most: usize,
        words: &'static str,
    ) -> Self {
        Self {
            element,
            parent,
            most,
            words,
        }
    }
}

/// Elements that read other files or generate bodies. A skeleton has to be complete in one text, because runs and policy
/// files carry that text along.
const REFUSED: [&str; 6] = [
    "include",
    "attach",
    "frame",
    "replicate",
    "composite",
    "flexcomp",
];

/// Checks the markup of `xml`, the MJCF of `skeleton`. Whether it is MJCF is for the parser to say.
pub(super) fn check(skeleton: &str, xml: &str) -> Result<(), SkeletonError> {
    let wrong = |place, defect| SkeletonError::mjcf(skeleton, place, defect);
    if xml.len() as u64 > MOST_BYTES {
        let cause = format!(
            "{} bytes of MJCF, where at most {MOST_BYTES} are read",
            xml.len()
        );
        return Err(wrong(
            None,
            Defect::new(cause, "remove what isn't the character"),
        ));
    }
    let mut guard = Guard::default();
    for piece in markup(xml) {
        match piece {
            Markup::Open(tag) => {
                let checked = guard.open(tag);
                checked.map_err(|defect| wrong(Some(guard.place(tag)), defect))?;
            }
            Markup::Close => drop(guard.open.pop()),
            Markup::Cdata => {
                let defect = Defect::new("MJCF has no CDATA sections", "remove them");
                return Err(wrong(None, defect));
            }
            Markup::Unclosed => {
                let defect = Defect::new("a tag or comment is not closed", "close it");
                return Err(wrong(None, defect));
            }
            Markup::Other => {}
        }
    }
    Ok(())
}

/// What has been seen of a text.
#[derive(Default)]
struct Guard<'a> {
    /// The elements that are open.
    open: Vec<Tag<'a>>,
    elements: usize,
    /// How many there are of each of [`MAX_PARTS`].
    parts: [usize; MAX_PARTS.len()],
}

impl<'a> Guard<'a> {
    /// Where an element stands: by its own name, or by that of its joint or its body.
    fn place(&self, tag: Tag) -> String {
        let name = tag.name;
        if let Some(own) = tag.attribute("name") {
            return format!("{name} `{own}`");
        }
        if let Some(joint) = tag.attribute("joint") {
            return format!("{name} of joint `{joint}`");
        }
        let mut bodies = self.open.iter().rev().filter(|open| open.name == "body");
        match bodies.find_map(|body| body.attribute("name")) {
            Some(body) => format!("{name} of body `{body}`"),
            None => format!("<{name}>"),
        }
    }

    fn open(&mut self, tag: Tag<'a>) -> Result<(), Defect> {
        self.count(tag)?;
        let classes = self.open.iter().filter(|open| open.name == "default");
        let classes = classes.count();
        if classes > MAX_CLASSES {
            return Err(Defect::new(
                format!("default classes are nested more than {MAX_CLASSES} deep"),
                "remove levels of classes",
            ));
        }
        check_tag(tag, classes > 0)?;
        unsimulated::check(tag, self.open.last().map_or("", |open| open.name))?;
        if !tag.is_empty {
            self.open.push(tag);
        }
        match self.open.len() > MAX_DEPTH {
            true => Err(Defect::new(
                format!("elements are nested more than {MAX_DEPTH} deep"),
                "remove levels of nesting",
            )),
            false => Ok(()),
        }
    }

    fn count(&mut self, tag: Tag) -> Result<(), Defect> {
        self.elements += 1;
        let parent = self.open.last().map_or("", |open| open.name);
        let fits = |wanted: &str, found: &str| wanted.is_empty() || wanted == found;
        for (parts, count) in MAX_PARTS.iter().zip(&mut self.parts) {
            if fits(parts.element, tag.name) && fits(parts.parent, parent) {
                *count += 1;
            }
            if *count > parts.most {
                return Err(too_many(parts.most, parts.words));
            }
        }
        match self.elements > MAX_ELEMENTS {
            true => Err(too_many(MAX_ELEMENTS, "elements")),
            false => Ok(()),
        }
    }
}

fn too_many(most: usize, words: &str) -> Defect {
    Defect::new(
        format!("the file has more than {most} {words}"),
        "remove what isn't the character, or simplify it",
    )
}

fn check_tag(tag: Tag, is_default: bool) -> Result<(), Defect> {
    if REFUSED.contains(&tag.name) {
        return Err(Defect::new(
            format!("<{}> is not supported", tag.name),
            "save the model with MuJoCo's mj_saveLastXML, which writes all its content out",
        ));
    }
    for (number, (name, value)) in tag.attributes().enumerate() {
        if number == MAX_ATTRIBUTES {
            return Err(Defect::new(
                format!("it has more than {MAX_ATTRIBUTES} attributes"),
                "remove those that MJCF doesn't know",
            ));
        }
        if name.starts_with("xmlns") {
            return Err(Defect::new("MJCF has no namespaces", "remove `xmlns`"));
        }
        let is_copied = is_default || matches!(name, "name" | "class" | "childclass");
        if is_copied && value.len() > MAX_WORD {
            let cause = format!("its `{name}` is longer than {MAX_WORD} bytes");
            return Err(Defect::new(cause, "shorten it"));
        }
        numbers::check(name, value)?;
        // The parser panics on a longer sequence and skips letters that it doesn't know.
        if (tag.name, name) == ("compiler", "eulerseq") && !is_euler_sequence(value) {
            return Err(Defect::new(
                "the `eulerseq` of <compiler> is not three letters out of x, y, z, X, Y, Z",
                "correct it, for example to `xyz`",
            ));
        }
    }
    Ok(())
}

fn is_euler_sequence(value: &str) -> bool {
    value.len() == 3 && value.chars().all(|c| "xyzXYZ".contains(c))
}
