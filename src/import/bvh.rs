//! BVH (Biovision hierarchy): a text with a tree of joints, their offsets and channels, and a row of numbers per frame.
//!
//! There is no standard, so this reads what programs write: channels in any order and on any joint, several roots,
//! joints without an end site, any line ends and letter case, and rows that disagree with the header's count.

use super::UpAxis;
use super::measure::{Scale, rate_of_frame_time};
use super::scene::{Node, Scene, Take};
use crate::clip::{Problem, Severity, slerp};
use nalgebra::{Isometry3, Matrix3, Matrix4, Translation3, UnitQuaternion, Vector3};

/// Most joints that a file may have, and how deep they may be nested.
const MOST_JOINTS: usize = 1 << 16;
/// Coordinates beyond this are damage, in the file's units or degrees.
const MOST: f64 = 1e9;
/// Rate of a file whose frame time can't be used, Hz.
const USUAL_RATE: f64 = 30.0;

/// Why a BVH file couldn't be read.
#[derive(Debug, thiserror::Error)]
pub enum BvhError {
    #[error("line {line}: {what} is missing; write the file again")]
    Missing { line: usize, what: &'static str },
    #[error("line {line}: `{found}` where {expected} should be; repair that line")]
    Unexpected {
        line: usize,
        found: String,
        expected: &'static str,
    },
    #[error(
        "line {line}: `{found}` is no channel; there are Xposition to Zposition and Xrotation to Zrotation"
    )]
    Channel { line: usize, found: String },
    #[error("line {line}: more than {MOST_JOINTS} joints; split the file")]
    TooMany { line: usize },
    #[error("the hierarchy has no channels, so nothing can move; write the file again")]
    NoChannels,
    #[error("no frames follow the hierarchy; write the file again")]
    NoFrames,
}

/// One number of a frame: along or about an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Channel {
    Position(usize),
    Rotation(usize),
}

/// A joint or the end of a limb.
#[derive(Debug)]
struct Joint {
    name: String,
    parent: Option<usize>,
    /// Place in the parent, in the file's units.
    offset: Vector3<f64>,
    /// In the order of the numbers in a frame, which is the order in which rotations are composed.
    channels: Vec<Channel>,
    /// Where its numbers begin in a frame.
    first: usize,
}

/// A BVH file.
pub(crate) struct BvhScene {
    nodes: Vec<Node>,
    joints: Vec<Joint>,
    /// Numbers of all frames, one frame after the other.
    numbers: Vec<f64>,
    width: usize,
    rate: f64,
    takes: Vec<Take>,
    scale: Scale,
    problems: Vec<Problem>,
}

/// Reads a file. `name` becomes the take's name, since the format has none.
pub(crate) fn read(bytes: &[u8], name: &str) -> Result<BvhScene, BvhError> {
    let text = String::from_utf8_lossy(bytes);
    let mut words = Words::new(&text);
    let joints = hierarchy(&mut words)?;
    let width: usize = joints.iter().map(|joint| joint.channels.len()).sum();
    if width == 0 {
        return Err(BvhError::NoChannels);
    }
    let mut problems = Vec::new();
    let (count, rate) = header(&mut words, &mut problems)?;
    let numbers = numbers(&mut words, width, &mut problems)?;
    let frames = numbers.len() / width;
    problems.extend(other_count(count, frames));
    let nodes: Vec<Node> = joints.iter().map(node).collect();
    let scale = Scale::guess(&rest(&joints));
    problems.extend(scale.problem());
    let take = Take {
        name: name.to_owned(),
        start: 0.0,
        end: (frames - 1) as f64 / rate,
        fps: rate,
        animated: (0..joints.len())
            .filter(|&j| !joints[j].channels.is_empty())
            .collect(),
        wraps: None,
        channels: joints.len(),
        problems: Vec::new(),
        fault: None,
    };
    Ok(BvhScene {
        nodes,
        joints,
        numbers,
        width,
        rate,
        takes: vec![take],
        scale,
        problems,
    })
}

fn node(joint: &Joint) -> Node {
    Node {
        name: joint.name.clone(),
        parent: joint.parent,
        is_bone: true,
        is_plain: true,
    }
}

/// Words of a text with the lines that they stand on.
struct Words<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    line: usize,
    rest: &'a str,
}

impl<'a> Words<'a> {
    fn new(text: &'a str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self {
            lines: text.lines().enumerate(),
            line: 1,
            rest: "",
        }
    }

    /// The next word; a brace is a word of its own.
    fn next(&mut self) -> Option<&'a str> {
        // A lone carriage return ends a line in files from old machines.
        let space = |c: char| c.is_whitespace() || c == '\0';
        loop {
            self.rest = self.rest.trim_start_matches(space);
            if !self.rest.is_empty() {
                break;
            }
            let (number, line) = self.lines.next()?;
            (self.line, self.rest) = (number + 1, line);
        }
        let brace = self.rest.starts_with(['{', '}']);
        let end = match brace {
            true => 1,
            false => self
                .rest
                .find(|c| space(c) || c == '{' || c == '}')
                .unwrap_or(self.rest.len()),
        };
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        Some(word)
    }

    /// The words up to the end of the line or a brace, as one name.
    fn name(&mut self) -> String {
        let end = self.rest.find(['{', '}', '\r']).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        self.rest = rest;
        name.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    fn expect(&mut self, expected: &'static str) -> Result<&'a str, BvhError> {
        let line = self.line;
        self.next().ok_or(BvhError::Missing {
            line,
            what: expected,
        })
    }

    fn keyword(&mut self, word: &'static str) -> Result<(), BvhError> {
        match self.expect(word)? {
            found if found.eq_ignore_ascii_case(word) => Ok(()),
            found => Err(self.unexpected(found, word)),
        }
    }

    fn number(&mut self, what: &'static str) -> Result<f64, BvhError> {
        let word = self.expect(what)?;
        self.parsed(word, what)
    }

    fn parsed(&self, word: &str, what: &'static str) -> Result<f64, BvhError> {
        // Some locales write a decimal comma.
        let number = word.parse().or_else(|_| word.replacen(',', ".", 1).parse());
        match number {
            Ok(number) if f64::abs(number) < MOST => Ok(number),
            _ => Err(self.unexpected(word, what)),
        }
    }

    fn unexpected(&self, found: &str, expected: &'static str) -> BvhError {
        BvhError::Unexpected {
            line: self.line,
            found: found.chars().take(40).collect(),
            expected,
        }
    }
}

/// Joints up to the word MOTION, parents first.
fn hierarchy(words: &mut Words) -> Result<Vec<Joint>, BvhError> {
    words.keyword("HIERARCHY")?;
    let mut joints: Vec<Joint> = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    let mut width = 0;
    loop {
        let word = words.expect("MOTION")?;
        match word.to_ascii_uppercase().as_str() {
            "ROOT" | "JOINT" => {
                let name = words.name();
                begin(words, &mut joints, &mut open, name, width)?;
            }
            // "End Site", sometimes with a name.
            "END" => {
                let site = words.name();
                let name = end_name(&joints, &open, &site);
                begin(words, &mut joints, &mut open, name, width)?;
            }
            "OFFSET" => {
                let offset = [0, 1, 2].map(|_| words.number("an offset of three numbers"));
                let [x, y, z] = offset;
                let offset = Vector3::new(x?, y?, z?);
                last(words, &mut joints, &open, word)?.offset = offset;
            }
            "CHANNELS" => {
                let channels = channels(words)?;
                width += channels.len();
                last(words, &mut joints, &open, word)?
                    .channels
                    .extend(channels);
            }
            "}" => {
                open.pop().ok_or_else(|| words.unexpected("}", "a joint"))?;
            }
            "MOTION" if !joints.is_empty() => return Ok(joints),
            _ => return Err(words.unexpected(word, "ROOT, JOINT, OFFSET, CHANNELS, } or MOTION")),
        }
    }
}

fn begin(
    words: &mut Words,
    joints: &mut Vec<Joint>,
    open: &mut Vec<usize>,
    name: String,
    first: usize,
) -> Result<(), BvhError> {
    words.keyword("{")?;
    if joints.len() >= MOST_JOINTS {
        return Err(BvhError::TooMany { line: words.line });
    }
    joints.push(Joint {
        name,
        parent: open.last().copied(),
        offset: Vector3::zeros(),
        channels: Vec::new(),
        first,
    });
    open.push(joints.len() - 1);
    Ok(())
}

fn end_name(joints: &[Joint], open: &[usize], site: &str) -> String {
    let named = site.strip_prefix("Site").unwrap_or(site).trim();
    match open.last() {
        Some(&joint) if named.is_empty() => format!("{}_end", joints[joint].name),
        _ => named.to_owned(),
    }
}

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

/// Count of frames and frames per second, as the header has them.
fn header(words: &mut Words, problems: &mut Vec<Problem>) -> Result<(f64, f64), BvhError> {
    words.keyword("Frames:")?;
    let count = words.number("a number of frames")?;
    words.keyword("Frame")?;
    words.keyword("Time:")?;
    let word = words.expect("a frame time")?;
    let seconds = words.parsed(word, "a frame time")?;
    let rate = rate_of_frame_time(word, seconds).unwrap_or_else(|| {
        problems.push(Problem {
            id: "frame-time".to_owned(),
            severity: Severity::Warning,
            message: format!(
                "a frame time of `{word}` can't be used; {USUAL_RATE} frames per second are assumed, write the right time into the file"
            ),
        });
        USUAL_RATE
    });
    Ok((count, rate))
}

/// Numbers of whole frames.
fn numbers(
    words: &mut Words,
    width: usize,
    problems: &mut Vec<Problem>,
) -> Result<Vec<f64>, BvhError> {
    let mut numbers = Vec::new();
    while let Some(word) = words.next() {
        numbers.push(words.parsed(word, "a number")?);
    }
    let over = numbers.len() % width;
    if over > 0 {
        problems.push(Problem {
            id: "frame-cut".to_owned(),
            severity: Severity::Warning,
            message: format!(
                "the last frame has {over} of {width} numbers and is left out; the file may be cut"
            ),
        });
    }
    numbers.truncate(numbers.len() - over);
    match numbers.is_empty() {
        true => Err(BvhError::NoFrames),
        false => Ok(numbers),
    }
}

fn other_count(stated: f64, found: usize) -> Option<Problem> {
    (stated != found as f64).then(|| Problem {
        id: "frame-count".to_owned(),
        severity: Severity::Note,
        message: format!("the header counts {stated} frames, and {found} follow: those are read"),
    })
}

/// World places of the joints without any rotation.
fn rest(joints: &[Joint]) -> Vec<Vector3<f64>> {
    let mut places: Vec<Vector3<f64>> = Vec::with_capacity(joints.len());
    for joint in joints {
        let parent = joint.parent.map_or_else(Vector3::zeros, |p| places[p]);
        places.push(parent + joint.offset);
    }
    places
}

impl BvhScene {
    /// Transform of a joint in its parent at a frame. A position channel replaces the offset along its axis, as the
    /// files with channels of both kinds on every joint mean it.
    fn local(&self, joint: &Joint, frame: usize) -> Isometry3<f64> {
        let numbers = &self.numbers[frame * self.width + joint.first..];
        let mut place = joint.offset;
        let mut turn = UnitQuaternion::identity();
        for (channel, number) in joint.channels.iter().zip(numbers) {
            match *channel {
                Channel::Position(axis) => place[axis] = *number,
                Channel::Rotation(axis) => {
                    let axis = Vector3::ith_axis(axis);
                    turn *= UnitQuaternion::from_axis_angle(&axis, number.to_radians());
                }
            }
        }
        Isometry3::from_parts(Translation3::from(place), turn)
    }

    /// The same between frames.
    fn local_at(&self, joint: &Joint, position: f64) -> Isometry3<f64> {
        let last = self.numbers.len() / self.width - 1;
        let frame = (position as usize).min(last);
        let a = self.local(joint, frame);
        let blend = position - frame as f64;
        if blend <= 1e-9 || frame == last {
            return a;
        }
        let b = self.local(joint, frame + 1);
        let place = a.translation.vector.lerp(&b.translation.vector, blend);
        Isometry3::from_parts(
            Translation3::from(place),
            slerp(&a.rotation, &b.rotation, blend),
        )
    }
}

impl Scene for BvhScene {
    fn format(&self) -> &'static str {
        "bvh"
    }

    fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    fn takes(&self) -> &[Take] {
        &self.takes
    }

    fn up_axis(&self) -> &str {
        "+Y"
    }

    fn unit_m(&self) -> f64 {
        self.scale.unit_m
    }

    fn canonical_from_file(&self) -> Matrix3<f64> {
        UpAxis::PlusY.canonical_from_file()
    }

    fn world(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>> {
        let mut world: Vec<Matrix4<f64>> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let local = match at {
                Some((_, time)) => self.local_at(joint, (time * self.rate).max(0.0)),
                None => Isometry3::from_parts(joint.offset.into(), UnitQuaternion::identity()),
            };
            let local = local.to_homogeneous();
            world.push(joint.parent.map_or(local, |parent| world[parent] * local));
        }
        world
    }

    fn problems(&self) -> &[Problem] {
        &self.problems
    }
}
