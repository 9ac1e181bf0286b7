//! Acclaim's pair of text files: ASF, a skeleton, and AMC, its motion.
//!
//! A bone begins where its parent ends. With C the rotation of its axes and M that of its degrees of freedom, its transform in
//! its parent is the translation by the parent's direction × length, then the rotation C · M · C⁻¹. So without motion all
//! bones are aligned with the world.

mod amc;
mod asf;
mod beside;
mod error;
mod lines;

use super::error::NoTakes;
use super::rigid::between;
use super::scene::{Contents, Node, Scene, Take, composed};
use super::{measure, names};
use crate::clip::Problem;
use amc::Motion;
use asf::{Bone, Freedom, Skeleton};
use error::AcclaimError;
use nalgebra::{Isometry3, Matrix4, Translation3, UnitQuaternion, Vector3};
use std::path::Path;

/// Rate of the CMU motion capture database, Hz: most AMC files don't state theirs.
const USUAL_RATE: f64 = 120.0;

/// A skeleton and, from an AMC file, its motion.
pub(crate) struct AcclaimScene {
    contents: Contents,
    skeleton: Skeleton,
    motion: Option<Motion>,
}

/// Reads a skeleton, which has no take.
pub(crate) fn read_asf(bytes: &[u8]) -> Result<AcclaimScene, AcclaimError> {
    let skeleton = asf::read(&String::from_utf8_lossy(bytes))?;
    Ok(AcclaimScene {
        contents: contents("asf", &skeleton, Vec::new()),
        skeleton,
        motion: None,
    })
}

/// Reads the motion in the file called `file`, whose skeleton is looked for in `folder`. The take gets the file's name, since
/// the format has none.
pub(crate) fn read_amc(
    bytes: &[u8],
    file: &str,
    folder: Option<&Path>,
) -> Result<AcclaimScene, AcclaimError> {
    let (found, skeleton) = beside::skeleton(file, folder)?;
    let bytes_beside = skeleton.len();
    let read = asf::read(&String::from_utf8_lossy(&skeleton));
    let skeleton = read.map_err(|source| AcclaimError::Skeleton {
        path: found,
        source: Box::new(source),
    })?;
    let motion = amc::read(&String::from_utf8_lossy(bytes), &skeleton)?;
    let takes = vec![take(names::stem(file), &motion)];
    let contents = Contents {
        bytes_beside,
        ..contents("amc", &skeleton, takes)
    };
    Ok(AcclaimScene {
        contents,
        skeleton,
        motion: Some(motion),
    })
}

fn contents(format: &'static str, skeleton: &Skeleton, takes: Vec<Take>) -> Contents {
    let bones = skeleton.bones.iter();
    let nodes = bones.map(|bone| Node::bone(bone.name.clone(), bone.parent));
    let bones = skeleton.bones.iter();
    let rest = measure::rest(bones.map(|bone| (bone.parent, bone.offset)));
    let (unit_m, problem) = measure::unit(skeleton.unit_m, &rest);
    Contents {
        unit_m,
        problems: Vec::from_iter(problem),
        no_takes: NoTakes {
            cause: "is a skeleton without motion",
            remedy: "give one of the .amc files that belong to it",
        },
        ..Contents::new(format, nodes.collect(), takes)
    }
}

fn take(name: &str, motion: &Motion) -> Take {
    let mut problems = motion.problems.clone();
    if motion.rate.is_none() {
        problems.push(Problem::note(
            "rate-assumed",
            format!(
                "the format has no frame rate: {USUAL_RATE} Hz is assumed, as in the CMU database; where that is wrong, add a line `:SAMPLES-PER-SECOND` with the right rate to the file's head"
            ),
        ));
    }
    let fps = motion.rate.unwrap_or(USUAL_RATE);
    Take {
        end: (motion.frames() - 1) as f64 / fps,
        fps,
        animated: motion.columns.iter().map(|column| column.bone).collect(),
        channels: motion.columns.len(),
        problems,
        ..Take::still(name.to_owned())
    }
}

/// Transform of a bone in its parent, given the numbers of its degrees of freedom in the file's units and radians.
fn local(bone: &Bone, numbers: &[f64]) -> Isometry3<f64> {
    let mut place = Vector3::zeros();
    let mut turn = UnitQuaternion::identity();
    for (freedom, &number) in bone.freedoms.iter().zip(numbers) {
        match *freedom {
            Freedom::Translation(axis) => place[axis] += number,
            // The first rotation is applied first, about fixed axes, so the next ones multiply from the left.
            Freedom::Rotation(axis) => {
                let axis = Vector3::ith_axis(axis);
                turn = UnitQuaternion::from_axis_angle(&axis, number) * turn;
            }
            Freedom::Length => {}
        }
    }
    let place = bone.offset + bone.axes * place;
    // Into the bone's axes, turn, and back: C · M · C⁻¹.
    let turn = bone.axes * turn * bone.axes.inverse();
    Isometry3::from_parts(Translation3::from(place), turn)
}

impl AcclaimScene {
    /// Transforms of all bones in their parents at a frame.
    fn locals(&self, motion: &Motion, frame: usize) -> Vec<Isometry3<f64>> {
        let still = |bone: &Bone| local(bone, &[]);
        let mut locals: Vec<_> = self.skeleton.bones.iter().map(still).collect();
        let row = motion.row(frame);
        for column in &motion.columns {
            let bone = &self.skeleton.bones[column.bone];
            locals[column.bone] = local(bone, &row[column.first..]);
        }
        locals
    }

    /// The same at a time in seconds: linear between frames, and rotations along the shortest arc. A billionth of a frame
    /// is rounding.
    fn locals_at(&self, motion: &Motion, time: f64) -> Vec<Isometry3<f64>> {
        let rate = motion.rate.unwrap_or(USUAL_RATE);
        // The frame before, and the fraction of the way to the next one.
        let (position, last) = ((time * rate).max(0.0), motion.frames() - 1);
        let frame = (position as usize).min(last);
        let blend = position - frame as f64;
        let mut locals = self.locals(motion, frame);
        if blend <= 1e-9 || frame == last {
            return locals;
        }
        for (a, b) in locals.iter_mut().zip(self.locals(motion, frame + 1)) {
            *a = between(a, &b, blend);
        }
        locals
    }
}

impl Scene for AcclaimScene {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn placed(&self, at: Option<(usize, f64)>) -> Vec<Matrix4<f64>> {
        let bones = &self.skeleton.bones;
        let locals = match (&self.motion, at) {
            (Some(motion), Some((_, time))) => self.locals_at(motion, time),
            _ => bones.iter().map(|bone| local(bone, &[])).collect(),
        };
        let locals = locals.iter().map(Isometry3::to_homogeneous);
        composed(&self.contents.nodes, locals)
    }
}
