//! `NAME.clip`: a safetensors file with the tensors of a [`Clip`] and its other fields as JSON metadata.
//!
//! Tensors, for J joints and F frames: `parent` i32 \[J\] (−1 for a root), `rest_translation` f32 \[J, 3\],
//! `rest_rotation` f32 \[J, 4\], `local_translation` f32 \[F, J, 3\], `local_rotation` f32 \[F, J, 4\]; and of a part of
//! a take `before_translation`, `before_rotation`, `after_translation`, `after_rotation`, alike. Metres, and
//! quaternions w, x, y, z. The metadata has the fields of [`Header`], of which `humanoid` is there
//! only where the source says which joint is which bone.

use super::sampling::{MOST_TRANSFORMS, length_flaw, rate_flaw};
use super::stored::{self, floats, isometries, rotations, rounded, translations};
use super::{Clip, Error, LoopMode, Margin, Problem, Source};
use crate::file::{self, Flaw, Format, Reader, Writer};
use nalgebra::Isometry3;
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
    /// Joints by bone, as in [`Joint::bone`](super::Joint::bone).
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
    /// [`Error::File`] when the file can't be written, or [`load`](Clip::load) couldn't read it: frames of another number of
    /// joints, or numbers that aren't finite.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        Ok(file::save(path.as_ref(), FORMAT, self.bytes(None))?)
    }

    /// The bytes of a clip file. It keeps the text `made`, which [`made_by`](crate::file::made_by) reads.
    ///
    /// # Errors
    /// [`Error::File`] when [`load`](Clip::load) couldn't read them: frames of another number of joints, or numbers that
    /// aren't finite.
    pub fn to_bytes(&self, made: Option<&str>) -> Result<Vec<u8>, Error> {
        Ok(self
            .bytes(made)
            .map_err(|flaw| flaw.of(self.name.as_ref(), FORMAT))?)
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

    fn bytes(&self, made: Option<&str>) -> Result<Vec<u8>, Flaw> {
        let writer = self.writer();
        writer.readable_bytes(FORMAT, &self.header(), made, Clip::from_bytes)
    }

    fn header(&self) -> Header {
        Header {
            name: self.name.clone(),
            fps: self.fps,
            joints: self.joints.iter().map(|joint| joint.name.clone()).collect(),
            humanoid: stored::bones(&self.joints),
            loop_mode: self.loop_mode,
            source: self.source.clone(),
            problems: self.problems.clone(),
        }
    }

    fn writer(&self) -> Writer {
        let mut writer = Writer::default();
        let j = self.joints.len();
        stored::push_tree(&mut writer, "", &self.joints);
        let Margin { before, after } = &self.margin;
        push_frames(&mut writer, LOCAL, j, &self.frames);
        for (names, frames) in [(BEFORE, before), (AFTER, after)] {
            if !frames.is_empty() {
                push_frames(&mut writer, names, j, frames);
            }
        }
        writer
    }

    /// The clip that a file's bytes hold.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Clip, Flaw> {
        let reader = Reader::open(bytes, FORMAT)?;
        let header = header(&reader)?;
        let j = header.joints.len();
        let mut joints = stored::tree(&reader, "", header.joints)?;
        stored::name_bones(&mut joints, header.humanoid)?;
        let frames = read_frames(&reader, LOCAL, j)?;
        if frames.is_empty() {
            return Err(Flaw::in_tensor(LOCAL[0], "0 frames"));
        }
        let duration = (frames.len() - 1) as f64 / header.fps;
        if let Some(cause) = length_flaw(duration) {
            return Err(Flaw::content("fps", cause));
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
    if let Some(cause) = rate_flaw(header.fps) {
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
        return Err(Flaw::in_tensor(places, cause));
    }
    let rotation = floats(reader, turns, &[Some(f), Some(j), Some(4)])?;
    let local = isometries(turns, &translation, &rotation)?;
    Ok(local.chunks_exact(j).map(<[_]>::to_vec).collect())
}
