//! `NAME.clip`: a safetensors file with the tensors of a [`Clip`] and its other fields as JSON metadata.
//!
//! Tensors, for J joints and F frames: `parent` i32 \[J\] (−1 for a root), `rest_translation` f32 \[J, 3\],
//! `rest_rotation` f32 \[J, 4\], `local_translation` f32 \[F, J, 3\], `local_rotation` f32 \[F, J, 4\]; and of a part of
//! a take `before_translation`, `before_rotation`, `after_translation`, `after_rotation`, alike. Metres, and
//! quaternions w, x, y, z. The metadata has the fields of [`Header`], of which `humanoid` is there
//! only where the source says which joint is which bone.

use super::sampling::{MOST_FPS, MOST_TRANSFORMS};
use super::{Clip, Error, Joint, LoopMode, Margin, Problem, Source};
use crate::file::{self, Flaw, Format, Reader, Writer};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

const FORMAT: Format = Format {
    name: "clip",
    version: 1,
    remedy: "import it again",
};
/// Names of the two tensors of the clip's own frames, and of those before and after them.
const LOCAL: [&str; 2] = ["local_translation", "local_rotation"];
const BEFORE: [&str; 2] = ["before_translation", "before_rotation"];
const AFTER: [&str; 2] = ["after_translation", "after_rotation"];

/// The metadata of a clip file.
#[derive(Serialize, Deserialize)]
struct Header {
    name: String,
    fps: f64,
    joints: Vec<String>,
    /// Joints by bone, as in [`Joint::bone`].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    humanoid: BTreeMap<String, usize>,
    #[serde(rename = "loop")]
    loop_mode: LoopMode,
    source: Source,
    problems: Vec<Problem>,
}

impl Clip {
    /// Writes the clip file `path`, or leaves what was there untouched. Transforms are rounded to `f32`.
    ///
    /// # Errors
    /// [`Error::File`] when the file can't be written, or the clip has frames of another number of joints.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        let writer = self.writer().map_err(|flaw| flaw.of(path, FORMAT))?;
        Ok(writer.save(path, FORMAT, &self.header())?)
    }

    /// Reads the clip file `path`.
    ///
    /// # Errors
    /// [`Error::File`] when the file can't be read, or is no whole clip of this version or an older one.
    pub fn load(path: impl AsRef<Path>) -> Result<Clip, Error> {
        Ok(file::load(path.as_ref(), FORMAT, Clip::from_bytes)?)
    }

    /// Rounds all transforms to what the clip's file can hold, so that a clip is the same whether it comes from a file
    /// of its own or straight from the importer.
    pub(crate) fn round_to_file(&mut self) {
        let rests = self.joints.iter_mut().map(|joint| &mut joint.rest);
        let frames = self.frames.iter_mut().flatten();
        for at in rests.chain(frames).chain(self.margin.transforms_mut()) {
            *at = rounded(at);
        }
    }

    fn header(&self) -> Header {
        Header {
            name: self.name.clone(),
            fps: self.fps,
            joints: self.joints.iter().map(|joint| joint.name.clone()).collect(),
            humanoid: bones(&self.joints),
            loop_mode: self.loop_mode,
            source: self.source.clone(),
            problems: self.problems.clone(),
        }
    }

    fn writer(&self) -> Result<Writer, Flaw> {
        let mut writer = Writer::default();
        let j = self.joints.len();
        writer.push("parent", &[j], parents(&self.joints)?);
        let rest = || self.joints.iter().map(|joint| &joint.rest);
        writer.push("rest_translation", &[j, 3], translations(rest()));
        writer.push("rest_rotation", &[j, 4], rotations(rest()));
        let Margin { before, after } = &self.margin;
        push_frames(&mut writer, LOCAL, j, &self.frames);
        for (names, frames) in [(BEFORE, before), (AFTER, after)] {
            if !frames.is_empty() {
                push_frames(&mut writer, names, j, frames);
            }
        }
        Ok(writer)
    }

    /// The clip that a file's bytes hold.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Clip, Flaw> {
        let reader = Reader::open(bytes, FORMAT)?;
        let header = header(&reader)?;
        let j = header.joints.len();
        let joints = joints(&reader, header.joints, header.humanoid)?;
        let frames = read_frames(&reader, LOCAL, j)?;
        if frames.is_empty() {
            return Err(Flaw::content(tensor(LOCAL[0]), "0 frames"));
        }
        let around = |names: [&str; 2]| match reader.has(names[0]) {
            true => read_frames(&reader, names, j),
            false => Ok(Vec::new()),
        };
        let margin = Margin {
            before: around(BEFORE)?,
            after: around(AFTER)?,
        };
        Ok(Clip {
            name: header.name,
            fps: header.fps,
            loop_mode: header.loop_mode,
            joints,
            frames,
            margin,
            source: header.source,
            problems: header.problems,
        })
    }
}

/// The metadata, as far as it can be checked without the tensors.
fn header(reader: &Reader) -> Result<Header, Flaw> {
    let header: Header = reader.fields()?;
    if header.joints.is_empty() {
        return Err(Flaw::content("joints", "no joints"));
    }
    if !(header.fps > 0.0 && header.fps <= MOST_FPS) {
        let cause = format!("a rate of {} frames per second", header.fps);
        return Err(Flaw::content("fps", cause));
    }
    Ok(header)
}

/// Adds two tensors of frames of `j` joints.
fn push_frames(
    writer: &mut Writer,
    [places, turns]: [&str; 2],
    j: usize,
    frames: &[Vec<Isometry3<f64>>],
) {
    let (f, local) = (frames.len(), || frames.iter().flatten());
    writer.push(places, &[f, j, 3], translations(local()));
    writer.push(turns, &[f, j, 4], rotations(local()));
}

/// The frames of `j` joints that two tensors hold.
fn read_frames(
    reader: &Reader,
    [places, turns]: [&str; 2],
    j: usize,
) -> Result<Vec<Vec<Isometry3<f64>>>, Flaw> {
    let translation = floats(reader, places, &[None, Some(j), Some(3)])?;
    let f = translation.len() / (3 * j);
    if f.saturating_mul(j) > MOST_TRANSFORMS {
        let cause =
            format!("{f} frames of {j} joints, at most {MOST_TRANSFORMS} transforms are read");
        return Err(Flaw::content(tensor(places), cause));
    }
    let rotation = floats(reader, turns, &[Some(f), Some(j), Some(4)])?;
    let local = isometries(turns, &translation, &rotation)?;
    Ok(local.chunks_exact(j).map(<[_]>::to_vec).collect())
}

/// Joints by the bone that each is said to be.
fn bones(joints: &[Joint]) -> BTreeMap<String, usize> {
    let bones = joints.iter().enumerate();
    bones
        .filter_map(|(j, joint)| Some((joint.bone.clone()?, j)))
        .collect()
}

/// The joints' parents as the file holds them, −1 for a root.
fn parents(joints: &[Joint]) -> Result<Vec<i32>, Flaw> {
    let parent = |joint: &Joint| match joint.parent {
        Some(p) => i32::try_from(p)
            .map_err(|_| Flaw::content(format!("joint `{}`", joint.name), "too many joints")),
        None => Ok(-1),
    };
    joints.iter().map(parent).collect()
}

fn translations<'a>(
    transforms: impl Iterator<Item = &'a Isometry3<f64>>,
) -> impl Iterator<Item = f32> {
    transforms.flat_map(|t| [t.translation.x, t.translation.y, t.translation.z].map(|x| x as f32))
}

fn rotations<'a>(
    transforms: impl Iterator<Item = &'a Isometry3<f64>>,
) -> impl Iterator<Item = f32> {
    let numbers = |t: &Isometry3<f64>| [t.rotation.w, t.rotation.i, t.rotation.j, t.rotation.k];
    transforms.flat_map(move |t| numbers(t).map(|x| x as f32))
}

/// How an error names a tensor.
fn tensor(name: &str) -> String {
    format!("tensor `{name}`")
}

/// The numbers of a tensor, all finite.
fn floats(reader: &Reader, name: &str, shape: &[Option<usize>]) -> Result<Vec<f64>, Flaw> {
    let numbers = reader.tensor::<f32>(name, shape)?;
    match numbers.iter().position(|x| !x.is_finite()) {
        Some(at) => {
            let cause = format!("element {at} is not a finite number");
            Err(Flaw::content(tensor(name), cause))
        }
        None => Ok(numbers.into_iter().map(f64::from).collect()),
    }
}

fn isometries(
    name: &str,
    translation: &[f64],
    rotation: &[f64],
) -> Result<Vec<Isometry3<f64>>, Flaw> {
    let places = translation.as_chunks::<3>().0;
    let turns = rotation.as_chunks::<4>().0;
    let isometry = |(i, (t, q)): (usize, (&[f64; 3], &[f64; 4]))| {
        let q = stored_rotation(Quaternion::new(q[0], q[1], q[2], q[3]));
        let q = q.ok_or_else(|| Flaw::content(tensor(name), format!("rotation {i} is zero")))?;
        Ok(Isometry3::from_parts(
            Translation3::new(t[0], t[1], t[2]),
            q,
        ))
    };
    places.iter().zip(turns).enumerate().map(isometry).collect()
}

/// A stored quaternion that is a rotation but for single precision is taken as it stands: what was saved and what is
/// loaded are the same, to the bit.
pub(crate) fn stored_rotation(q: Quaternion<f64>) -> Option<UnitQuaternion<f64>> {
    if (q.norm_squared() - 1.0).abs() < 1e-6 {
        return Some(UnitQuaternion::new_unchecked(q));
    }
    UnitQuaternion::try_new(q, 1e-3)
}

fn rounded(at: &Isometry3<f64>) -> Isometry3<f64> {
    let single = |x: f64| f64::from(x as f32);
    let q = at.rotation.coords.map(single);
    Isometry3::from_parts(
        Translation3::from(at.translation.vector.map(single)),
        UnitQuaternion::new_unchecked(Quaternion::from(q)),
    )
}

/// The joints of these names, which of them are which bone, and where each hangs.
fn joints(
    reader: &Reader,
    names: Vec<String>,
    bones: BTreeMap<String, usize>,
) -> Result<Vec<Joint>, Flaw> {
    let j = Some(names.len());
    let parents = reader.tensor::<i32>("parent", &[j])?;
    let translation = floats(reader, "rest_translation", &[j, Some(3)])?;
    let rotation = floats(reader, "rest_rotation", &[j, Some(4)])?;
    let rest = isometries("rest_rotation", &translation, &rotation)?;
    let joint = |(j, ((name, &parent), rest)): (usize, ((String, &i32), Isometry3<f64>))| {
        let parent = parent_of(j, &name, parent)?;
        Ok(Joint {
            name,
            parent,
            rest,
            bone: None,
        })
    };
    let joints = names.into_iter().zip(&parents).zip(rest).enumerate();
    let mut joints: Vec<Joint> = joints.map(joint).collect::<Result<_, _>>()?;
    for (bone, j) in bones {
        let Some(joint) = joints.get_mut(j) else {
            let cause = format!("bone `{bone}` is joint {j}, which isn't there");
            return Err(Flaw::content("humanoid", cause));
        };
        joint.bone = Some(bone);
    }
    Ok(joints)
}

/// The parent of joint `j` that the file gives, which has to stand before it.
fn parent_of(j: usize, name: &str, parent: i32) -> Result<Option<usize>, Flaw> {
    if parent == -1 {
        return Ok(None);
    }
    match usize::try_from(parent) {
        Ok(before) if before < j => Ok(Some(before)),
        _ => {
            let cause = format!("joint {j} `{name}` has parent {parent}, which isn't before it");
            Err(Flaw::content(tensor("parent"), cause))
        }
    }
}
