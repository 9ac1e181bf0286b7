//! The rig that a motion was retargeted from, and what of its clip the skeleton has no place for.

use crate::clip::{Joint, stored};
use crate::file::{Flaw, Reader, Writer};
use crate::humanoid::Slot;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What carrying a motion back onto the rig that it comes from needs beside the motion itself.
///
/// Joints that a body of the skeleton follows have no tracks, since the motion says where they are. The others (fingers,
/// the face, twist bones, a root above the hips) have tracks where they move in the clip. All numbers are exact in `f32`,
/// as clips' files hold them.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceRig {
    /// The source's joint tree: names, parents and rest transforms. Parents stand before their children.
    pub joints: Vec<Joint>,
    /// Index of the joint used for each slot.
    pub map: BTreeMap<Slot, usize>,
    /// Transform of every joint in its parent in the motion's first frame, metres. Joints without tracks that no body
    /// follows keep it.
    pub first: Vec<Isometry3<f64>>,
    /// Rotation in its parent by frame of the motion, of joints that turn and that no body follows.
    pub rotations: BTreeMap<usize, Vec<UnitQuaternion<f64>>>,
    /// Translation in its parent by frame of the motion, metres, of joints that shift and that no body follows.
    pub translations: BTreeMap<usize, Vec<Vector3<f64>>>,
}

/// What the metadata of a motion file says about the source; the numbers are in tensors.
#[derive(Serialize, Deserialize)]
pub(super) struct RigHeader {
    joints: Vec<String>,
    /// Joints by bone, as in [`Joint::bone`].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    humanoid: BTreeMap<String, usize>,
    map: BTreeMap<Slot, usize>,
    /// Joints of the columns of `source_rotation`.
    rotations: Vec<usize>,
    /// Joints of the columns of `source_translation`.
    translations: Vec<usize>,
}

/// What the names of the source's tensors begin with.
const PREFIX: &str = "source_";
const FIRST_TRANSLATION: &str = "source_first_translation";
const FIRST_ROTATION: &str = "source_first_rotation";
const TRANSLATION: &str = "source_translation";
const ROTATION: &str = "source_rotation";

impl SourceRig {
    /// Transform of `joint` in its parent in frame `frame` of the clip, metres; of a joint that a body follows, that of the
    /// first frame.
    ///
    /// # Panics
    /// If there is no such joint, or it has a track without such a frame.
    pub fn local(&self, joint: usize, frame: usize) -> Isometry3<f64> {
        let mut local = self.first[joint];
        if let Some(rotations) = self.rotations.get(&joint) {
            local.rotation = rotations[frame];
        }
        if let Some(translations) = self.translations.get(&joint) {
            local.translation = Translation3::from(translations[frame]);
        }
        local
    }

    pub(super) fn header(&self) -> RigHeader {
        RigHeader {
            joints: self.joints.iter().map(|joint| joint.name.clone()).collect(),
            humanoid: stored::bones(&self.joints),
            map: self.map.clone(),
            rotations: self.rotations.keys().copied().collect(),
            translations: self.translations.keys().copied().collect(),
        }
    }

    pub(super) fn push(&self, writer: &mut Writer, frames: usize) {
        let joints = self.joints.len();
        stored::push_tree(writer, PREFIX, &self.joints);
        let first = self.first.iter();
        let translations = stored::translations(first.clone());
        writer.push(FIRST_TRANSLATION, &[joints, 3], translations);
        writer.push(FIRST_ROTATION, &[joints, 4], stored::rotations(first));
        if !self.rotations.is_empty() {
            let at = |f: usize| {
                self.rotations
                    .values()
                    .filter_map(move |track| track.get(f))
            };
            let numbers = |q: &UnitQuaternion<f64>| [q.w, q.i, q.j, q.k].map(|x| x as f32);
            let values = (0..frames).flat_map(at).flat_map(numbers);
            writer.push(ROTATION, &[frames, self.rotations.len(), 4], values);
        }
        if !self.translations.is_empty() {
            let at = |f: usize| {
                self.translations
                    .values()
                    .filter_map(move |track| track.get(f))
            };
            let numbers = |v: &Vector3<f64>| [v.x, v.y, v.z].map(|x| x as f32);
            let values = (0..frames).flat_map(at).flat_map(numbers);
            writer.push(TRANSLATION, &[frames, self.translations.len(), 3], values);
        }
    }

    /// The source in the file of a motion with `frames` frames.
    pub(super) fn read(reader: &Reader, header: RigHeader, frames: usize) -> Result<Self, Flaw> {
        let count = header.joints.len();
        let of_map = header.map.values();
        let of_tracks = header.rotations.iter().chain(&header.translations);
        if let Some(joint) = of_map.chain(of_tracks).find(|joint| **joint >= count) {
            let cause = format!("joint {joint} of {count} joints");
            return Err(Flaw::content("source", cause));
        }
        for columns in [&header.rotations, &header.translations] {
            if !columns.is_sorted_by(|a, b| a < b) {
                return Err(Flaw::content("source", "its tracks are out of order"));
            }
        }
        let mut joints = stored::tree(reader, PREFIX, header.joints)?;
        stored::name_bones(&mut joints, header.humanoid)?;
        let shape = |size| [Some(count), Some(size)];
        let places = stored::floats(reader, FIRST_TRANSLATION, &shape(3))?;
        let turns = stored::floats(reader, FIRST_ROTATION, &shape(4))?;
        let first = stored::isometries(FIRST_ROTATION, &places, &turns)?;
        Ok(Self {
            joints,
            map: header.map,
            first,
            rotations: rotations(reader, &header.rotations, frames)?,
            translations: translations(reader, &header.translations, frames)?,
        })
    }
}

/// The tracks of rotations of these joints.
fn rotations(
    reader: &Reader,
    joints: &[usize],
    frames: usize,
) -> Result<BTreeMap<usize, Vec<UnitQuaternion<f64>>>, Flaw> {
    let numbers = numbers(reader, ROTATION, joints, frames, 4)?;
    let quaternions = numbers.as_chunks::<4>().0.iter().enumerate();
    let turns = quaternions.map(|(i, q)| stored::turn(ROTATION, i, q));
    let turns: Vec<_> = turns.collect::<Result<_, _>>()?;
    Ok(tracks(joints, &turns))
}

/// The tracks of translations of these joints.
fn translations(
    reader: &Reader,
    joints: &[usize],
    frames: usize,
) -> Result<BTreeMap<usize, Vec<Vector3<f64>>>, Flaw> {
    let numbers = numbers(reader, TRANSLATION, joints, frames, 3)?;
    let vectors = numbers.as_chunks::<3>().0.iter();
    let vectors: Vec<_> = vectors.map(|v| Vector3::from(*v)).collect();
    Ok(tracks(joints, &vectors))
}

/// The numbers of a tensor of tracks, which is left out where there are none.
fn numbers(
    reader: &Reader,
    name: &str,
    joints: &[usize],
    frames: usize,
    size: usize,
) -> Result<Vec<f64>, Flaw> {
    if joints.is_empty() {
        return Ok(Vec::new());
    }
    stored::floats(
        reader,
        name,
        &[Some(frames), Some(joints.len()), Some(size)],
    )
}

/// Tracks by joint, of values that stand frame by frame.
fn tracks<T: Copy>(joints: &[usize], values: &[T]) -> BTreeMap<usize, Vec<T>> {
    let track = |(column, joint): (usize, &usize)| {
        let values = values.iter().skip(column).step_by(joints.len());
        (*joint, values.copied().collect())
    };
    joints.iter().enumerate().map(track).collect()
}
