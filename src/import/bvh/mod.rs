//! BVH (Biovision hierarchy): a text with a tree of joints, their offsets and channels, and a row of numbers per frame.
//!
//! There is no standard, so this reads what programs write: channels in any order and on any joint, several roots,
//! joints without an end site, any line ends and letter case, and frames that disagree with the header's count.

mod error;
mod hierarchy;
mod rows;
mod words;

use super::measure::{Scale, rate_of_frame_time, rest};
use super::rigid::between;
use super::scene::{Contents, Node, Scene, Take, composed};
use crate::clip::Problem;
use error::BvhError;
use hierarchy::{Channel, Joint, hierarchy};
use nalgebra::{Isometry3, Matrix4, Translation3, UnitQuaternion, Vector3};
use rows::{Rows, rows};
use words::Words;

/// Rate of a file whose frame time can't be used, Hz. Chosen.
const USUAL_RATE: f64 = 30.0;

/// A BVH file.
pub(crate) struct BvhScene {
    contents: Contents,
    joints: Vec<Joint>,
    /// Numbers of all frames, one frame after the other.
    numbers: Vec<f64>,
    /// Numbers per frame.
    width: usize,
    /// Frames per second, Hz.
    rate: f64,
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
    let Rows {
        numbers,
        problems: of_rows,
    } = rows(&mut words, width, count)?;
    problems.extend(of_rows);
    let frames = numbers.len() / width;
    let scale = Scale::guess(&rest(
        joints.iter().map(|joint| (joint.parent, joint.offset)),
    ));
    problems.extend(scale.problem());
    let take = Take {
        end: (frames - 1) as f64 / rate,
        fps: rate,
        animated: (0..joints.len())
            .filter(|&j| !joints[j].channels.is_empty())
            .collect(),
        channels: joints.len(),
        ..Take::still(name.to_owned())
    };
    let nodes = joints
        .iter()
        .map(|joint| Node::bone(joint.name.clone(), joint.parent));
    Ok(BvhScene {
        contents: Contents {
            unit_m: scale.unit_m,
            problems,
            ..Contents::new("bvh", nodes.collect(), vec![take])
        },
        joints,
        numbers,
        width,
        rate,
    })
}

/// The number of frames that the header states, and the frame rate by its frame time, Hz.
fn header(words: &mut Words, problems: &mut Vec<Problem>) -> Result<(u64, f64), BvhError> {
    words.keyword("Frames:")?;
    let expected = "a whole number of frames";
    let word = words.expect(expected)?;
    let count = word.parse().map_err(|_| words.unexpected(word, expected))?;
    words.keyword("Frame")?;
    words.keyword("Time:")?;
    let word = words.expect("a frame time")?;
    let seconds = words.parsed(word, "a frame time")?;
    let rate = rate_of_frame_time(word, seconds).unwrap_or_else(|| {
        problems.push(Problem::warning(
            "frame-time",
            format!(
                "the frame time `{word}` can't be used, so {USUAL_RATE} Hz is assumed; write the right time into the file"
            ),
        ));
        USUAL_RATE
    });
    Ok((count, rate))
}

impl BvhScene {
    /// Transform of a joint in its parent at a frame. A position channel replaces the offset along its axis: files with both
    /// kinds of channel on every joint repeat the offset there. Rotations multiply in the order of their channels.
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

    /// The same at a position counted in frames: linear between frames, and rotations along the shortest arc. A billionth of
    /// a frame is rounding.
    fn local_at(&self, joint: &Joint, position: f64) -> Isometry3<f64> {
        let last = self.numbers.len() / self.width - 1;
        // The frame before, and the fraction of the way to the next one.
        let frame = (position as usize).min(last);
        let a = self.local(joint, frame);
        let blend = position - frame as f64;
        if blend <= 1e-9 || frame == last {
            return a;
        }
        let b = self.local(joint, frame + 1);
        between(&a, &b, blend)
    }
}

impl Scene for BvhScene {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn placed(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>> {
        let local = |joint: &Joint| match at {
            Some((_, time)) => self.local_at(joint, (time * self.rate).max(0.0)),
            None => Isometry3::from_parts(joint.offset.into(), UnitQuaternion::identity()),
        };
        let locals = self
            .joints
            .iter()
            .map(|joint| local(joint).to_homogeneous());
        composed(&self.contents.nodes, locals)
    }
}
