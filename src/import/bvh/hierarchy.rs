//! The tree of joints.

use super::error::BvhError;
use super::words::Words;
use nalgebra::Vector3;

/// Most joints that a file may have. Chosen, as a bound on memory: crowds have thousands.
const MOST_JOINTS: usize = 1 << 14;

/// One number of a frame: along or about an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Channel {
    Position(usize),
    Rotation(usize),
}

/// A joint or the end of a limb.
#[derive(Debug)]
pub(super) struct Joint {
    /// Its name; an end site without one is called after its joint.
    pub name: String,
    /// Index of the parent; `None` for a root.
    pub parent: Option<usize>,
    /// Position in the parent, in the file's units.
    pub offset: Vector3<f64>,
    /// In the order of the numbers in a frame, which is the order in which rotations are composed.
    pub channels: Vec<Channel>,
    /// Index of its first number in a frame.
    pub first: usize,
}

/// Joints up to the word MOTION, parents first.
pub(super) fn hierarchy(words: &mut Words) -> Result<Vec<Joint>, BvhError> {
    words.keyword("HIERARCHY")?;
    let mut joints: Vec<Joint> = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    let mut width = 0;
    loop {
        let word = words.expect("MOTION")?;
        match word.to_ascii_uppercase().as_str() {
            "ROOT" if !open.is_empty() => return Err(unclosed(words, &joints, &open)),
            "ROOT" | "JOINT" => {
                let name = words.name();
                begin(words, &mut joints, &mut open, name)?;
            }
            // "End Site", sometimes with a name.
            "END" => {
                let site = words.name();
                let name = end_name(&joints, &open, &site);
                begin(words, &mut joints, &mut open, name)?;
            }
            "OFFSET" => {
                let offset = [0, 1, 2].map(|_| words.number("an offset of three numbers"));
                let [x, y, z] = offset;
                let offset = Vector3::new(x?, y?, z?);
                last(words, &mut joints, &open, word)?.offset = offset;
            }
            "CHANNELS" => {
                let joint = last(words, &mut joints, &open, word)?;
                // A frame's numbers stand in the order of these lists, so a second one of a joint would be apart from it.
                if !joint.channels.is_empty() {
                    return Err(words.unexpected(word, "the rest of the joint"));
                }
                joint.first = width;
                joint.channels = channels(words)?;
                width += joint.channels.len();
            }
            "}" => {
                open.pop().ok_or_else(|| words.unexpected("}", "a joint"))?;
            }
            "MOTION" if !open.is_empty() => return Err(unclosed(words, &joints, &open)),
            "MOTION" if !joints.is_empty() => return Ok(joints),
            _ => return Err(words.unexpected(word, "ROOT, JOINT, OFFSET, CHANNELS, } or MOTION")),
        }
    }
}

/// The error of a block that should have ended before this.
fn unclosed(words: &Words, joints: &[Joint], open: &[usize]) -> BvhError {
    let joint = open.last().and_then(|&joint| joints.get(joint));
    BvhError::Unclosed {
        line: words.line,
        joint: joint.map_or_else(String::new, |joint| joint.name.clone()),
    }
}

/// Opens the block of a new joint.
fn begin(
    words: &mut Words,
    joints: &mut Vec<Joint>,
    open: &mut Vec<usize>,
    name: String,
) -> Result<(), BvhError> {
    words.keyword("{")?;
    if joints.len() >= MOST_JOINTS {
        return Err(BvhError::TooMany {
            line: words.line,
            most: MOST_JOINTS,
        });
    }
    joints.push(Joint {
        name,
        parent: open.last().copied(),
        offset: Vector3::zeros(),
        channels: Vec::new(),
        first: 0,
    });
    open.push(joints.len() - 1);
    Ok(())
}

/// The name of an end site, given what follows the word `End`.
fn end_name(joints: &[Joint], open: &[usize], site: &str) -> String {
    let named = site.strip_prefix("Site").unwrap_or(site).trim();
    match open.last() {
        Some(&joint) if named.is_empty() => format!("{}_end", joints[joint].name),
        _ => named.to_owned(),
    }
}

/// The joint whose block is open; `word` belongs to it.
fn last<'j>(
    words: &Words,
    joints: &'j mut [Joint],
    open: &[usize],
    word: &str,
) -> Result<&'j mut Joint, BvhError> {
    let joint = open.last().and_then(|&joint| joints.get_mut(joint));
    joint.ok_or_else(|| words.unexpected(word, "a joint"))
}

fn channels(words: &mut Words) -> Result<Vec<Channel>, BvhError> {
    let what = "a number of channels from 0 to 6";
    let count = words.number(what)?;
    if !(0.0..=6.0).contains(&count) || count.fract() != 0.0 {
        return Err(words.unexpected(&count.to_string(), what));
    }
    (0..count as usize).map(|_| channel(words)).collect()
}

fn channel(words: &mut Words) -> Result<Channel, BvhError> {
    let word = words.expect("a channel")?;
    let lower = word.to_ascii_lowercase();
    let axis = ["x", "y", "z"]
        .iter()
        .position(|axis| lower.starts_with(axis));
    match (axis, lower.get(1..)) {
        (Some(axis), Some("position")) => Ok(Channel::Position(axis)),
        (Some(axis), Some("rotation")) => Ok(Channel::Rotation(axis)),
        _ => Err(BvhError::Channel {
            line: words.line,
            found: word.chars().take(40).collect(),
        }),
    }
}
