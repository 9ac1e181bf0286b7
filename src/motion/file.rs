//! `NAME.motion`: a safetensors file with the coordinates, body poses and tracks of a [`Motion`], and its other fields as
//! JSON metadata.
//!
//! Tensors are f64, for F frames, B bodies and C contact bodies: `qpos` \[F, nq\] and `qvel` \[F, nv\] in MuJoCo's order,
//! `body_position` \[F, B, 3\], `body_rotation` \[F, B, 4\] (w, x, y, z), `phase` \[F\], `com`, `com_velocity`,
//! `linear_momentum` and `angular_momentum` \[F, 3\], `contact` u8 \[F, C\], `root_wrench_residual` \[F, 6\]. A file that
//! another program wrote may have f32 in place of f64.
//!
//! A motion that was retargeted has its source too, of J joints, all f32 but the parents: the joint tree `source_parent`
//! i32 \[J\], `source_rest_translation` \[J, 3\], `source_rest_rotation` \[J, 4\]; the transforms in the first frame
//! `source_first_translation` and `source_first_rotation`; and tracks `source_rotation` \[F, R, 4\] and
//! `source_translation` \[F, S, 3\] of joints that the metadata lists.
//!
//! The metadata has the fields of [`Header`].

use super::source::RigHeader;
use super::{Cycle, Motion, MotionError, RetargetReport, SourceRig, Tracks};
use crate::clip::stored::stored_rotation;
use crate::clip::{LoopMode, length_flaw, rate_flaw};
use crate::file::{self, Flaw, Format, Reader, Writer};
use nalgebra::{Isometry3, Quaternion, Translation3, Vector3, Vector6};
use safetensors::tensor::{Dtype, TensorView};
use serde::{Deserialize, Serialize};
use std::path::Path;

const FORMAT: Format = Format {
    name: "motion",
    version: 1,
    remedy: "retarget its clip again",
};

/// Largest coordinate, in metres or radians, and largest velocity, in metres or radians a second. Chosen: in single precision, in
/// which a character is simulated, a point 100 km away is known to a centimetre, and no body moves at 100 km/s.
const MOST_COORDINATE: f64 = 1e5;
const MOST_SPEED: f64 = 1e5;

/// The metadata of a motion file.
#[derive(Serialize, Deserialize)]
struct Header {
    name: String,
    fps: f64,
    #[serde(rename = "loop")]
    loop_mode: LoopMode,
    cycle: CycleHeader,
    skeleton: SkeletonHeader,
    bodies: Vec<String>,
    /// Names of the contact bodies, in the order of the columns of `contact`.
    contact_bodies: Vec<String>,
    #[serde(default)]
    report: Option<RetargetReport>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    source: Option<RigHeader>,
}

#[derive(Serialize, Deserialize)]
struct CycleHeader {
    translation: [f64; 3],
    heading: f64,
}

#[derive(Serialize, Deserialize)]
struct SkeletonHeader {
    name: String,
    sha256: String,
}

impl Motion {
    /// Writes the motion file `path`; it appears whole or not at all.
    ///
    /// # Errors
    /// [`MotionError::File`] when the file can't be written, or [`load`](Motion::load) couldn't read it.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), MotionError> {
        Ok(file::save(path.as_ref(), FORMAT, self.bytes(None))?)
    }

    /// The bytes of a motion file. It keeps the text `made`, which [`made_by`](file::made_by) reads.
    ///
    /// # Errors
    /// [`MotionError::File`] when the motion's parts don't fit together.
    pub fn to_bytes(&self, made: Option<&str>) -> Result<Vec<u8>, MotionError> {
        Ok(self
            .bytes(made)
            .map_err(|flaw| flaw.of(self.name.as_ref(), FORMAT))?)
    }

    /// Reads the motion file `path` and checks that all its parts fit together.
    ///
    /// # Errors
    /// [`MotionError::File`] when the file can't be read, or is no whole motion of this version or an older one.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, MotionError> {
        Ok(file::load(path.as_ref(), FORMAT, Self::from_bytes)?)
    }

    fn bytes(&self, made: Option<&str>) -> Result<Vec<u8>, Flaw> {
        let writer = self.writer();
        writer.readable_bytes(FORMAT, &self.header(), made, Self::from_bytes)
    }

    fn header(&self) -> Header {
        let name = |&b: &usize| self.body_names.get(b).cloned().unwrap_or_default();
        Header {
            name: self.name.clone(),
            fps: self.fps,
            loop_mode: self.loop_mode,
            cycle: CycleHeader {
                translation: self.cycle.translation.into(),
                heading: self.cycle.heading,
            },
            skeleton: SkeletonHeader {
                name: self.skeleton_name.clone(),
                sha256: self.skeleton_sha256.clone(),
            },
            bodies: self.body_names.clone(),
            contact_bodies: self.contact_bodies.iter().map(name).collect(),
            report: self.report.clone(),
            source: self.source.as_ref().map(SourceRig::header),
        }
    }

    fn writer(&self) -> Writer {
        let mut writer = Writer::default();
        let frames = self.qpos.len();
        let width = |rows: &[Vec<f64>]| rows.first().map_or(0, Vec::len);
        for (name, rows) in [("qpos", &self.qpos), ("qvel", &self.qvel)] {
            let values = rows.iter().flatten().copied();
            writer.push(name, &[frames, width(rows)], values);
        }
        let bodies = self.bodies.first().map_or(0, Vec::len);
        let poses = || self.bodies.iter().flatten();
        let position = |p: &Isometry3<f64>| <[f64; 3]>::from(p.translation.vector);
        let rotation = |p: &Isometry3<f64>| {
            let r = &p.rotation;
            [r.w, r.i, r.j, r.k]
        };
        let positions = poses().flat_map(position);
        writer.push("body_position", &[frames, bodies, 3], positions);
        let rotations = poses().flat_map(rotation);
        writer.push("body_rotation", &[frames, bodies, 4], rotations);
        push_tracks(&mut writer, &self.tracks);
        if let Some(source) = &self.source {
            source.push(&mut writer, frames);
        }
        writer
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Flaw> {
        let reader = Reader::open(bytes, FORMAT)?;
        let header = header(&reader)?;
        let table = Table { reader };
        let qpos = within(MOST_COORDINATE, "qpos", table.rows("qpos", None)?)?;
        let frames = qpos.len();
        if let Some(cause) = length_flaw(frames.saturating_sub(1) as f64 / header.fps) {
            return Err(Flaw::content("fps", cause));
        }
        let bodies = header.bodies.len();
        let contact_bodies = contact_bodies(&header)?;
        let rows = |name: &str, width: usize| table.rows_of(name, frames, Some(width));
        let poses = poses(
            &rows("body_position", 3 * bodies)?,
            &rows("body_rotation", 4 * bodies)?,
        )?;
        let source = header.source;
        let source = source.map(|header| SourceRig::read(&table.reader, header, frames));
        Ok(Self {
            name: header.name,
            fps: header.fps,
            loop_mode: header.loop_mode,
            cycle: Cycle {
                translation: header.cycle.translation.into(),
                heading: header.cycle.heading,
            },
            skeleton_name: header.skeleton.name,
            skeleton_sha256: header.skeleton.sha256,
            body_names: header.bodies,
            tracks: table.tracks(frames, contact_bodies.len())?,
            contact_bodies,
            qvel: within(MOST_SPEED, "qvel", table.rows_of("qvel", frames, None)?)?,
            qpos,
            bodies: poses,
            report: header.report,
            source: source.transpose()?,
        })
    }
}

fn push_tracks(writer: &mut Writer, tracks: &Tracks) {
    let frames = tracks.phase.len();
    writer.push("phase", &[frames], tracks.phase.iter().copied());
    for (name, vectors) in [
        ("com", &tracks.com),
        ("com_velocity", &tracks.com_velocity),
        ("linear_momentum", &tracks.linear_momentum),
        ("angular_momentum", &tracks.angular_momentum),
    ] {
        let values = vectors.iter().flat_map(|v| <[f64; 3]>::from(*v));
        writer.push(name, &[frames, 3], values);
    }
    let columns = tracks.contact.first().map_or(0, Vec::len);
    let contact = tracks.contact.iter().flatten().map(|&c| u8::from(c));
    writer.push("contact", &[frames, columns], contact);
    let wrenches = tracks.root_wrench_residual.iter();
    let wrenches = wrenches.flat_map(|w| <[f64; 6]>::from(*w));
    writer.push("root_wrench_residual", &[frames, 6], wrenches);
}

/// The metadata, as far as it can be checked without the tensors.
fn header(reader: &Reader) -> Result<Header, Flaw> {
    let header: Header = reader.fields()?;
    if let Some(cause) = rate_flaw(header.fps) {
        return Err(Flaw::content("fps", cause));
    }
    let cycle = &header.cycle;
    let numbers = [&cycle.translation[..], &[cycle.heading]].concat();
    if numbers.iter().any(|x| !x.is_finite()) {
        return Err(Flaw::content("cycle", "a number is not finite"));
    }
    if numbers.iter().any(|x| x.abs() > MOST_COORDINATE) {
        return Err(Flaw::content("cycle", "a number is too large to use"));
    }
    Ok(header)
}

/// The rows of the tensor `name`, if all their numbers are of a size that can be simulated.
fn within(most: f64, name: &str, rows: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, Flaw> {
    let large = |row: &Vec<f64>| row.iter().any(|x| x.abs() > most);
    match rows.iter().position(large) {
        Some(frame) => {
            let cause = format!("a number in frame {frame} is beyond {most:e}, too large to use");
            Err(Flaw::in_tensor(name, cause))
        }
        None => Ok(rows),
    }
}

fn contact_bodies(header: &Header) -> Result<Vec<usize>, Flaw> {
    let index = |name: &String| {
        let at = header.bodies.iter().position(|body| body == name);
        let unknown = || format!("`{name}` is not one of the bodies");
        at.ok_or_else(|| Flaw::content("contact_bodies", unknown()))
    };
    header.contact_bodies.iter().map(index).collect()
}

/// Poses of all bodies from the rows of two tensors.
fn poses(positions: &[Vec<f64>], rotations: &[Vec<f64>]) -> Result<Vec<Vec<Isometry3<f64>>>, Flaw> {
    let pose = |(p, r): (&[f64], &[f64])| {
        let shift = Translation3::from(Vector3::from_column_slice(p));
        let turn = stored_rotation(Quaternion::new(r[0], r[1], r[2], r[3]));
        let zero = || Flaw::in_tensor("body_rotation", "a rotation is zero");
        Ok(Isometry3::from_parts(shift, turn.ok_or_else(zero)?))
    };
    positions
        .iter()
        .zip(rotations)
        .map(|(p, r)| p.chunks_exact(3).zip(r.chunks_exact(4)).map(pose).collect())
        .collect()
}

/// Tensors of a file, read as rows of numbers, one row per frame.
struct Table<'a> {
    reader: Reader<'a>,
}

impl Table<'_> {
    /// `name` with exactly `frames` rows.
    fn rows_of(
        &self,
        name: &str,
        frames: usize,
        width: Option<usize>,
    ) -> Result<Vec<Vec<f64>>, Flaw> {
        if width == Some(0) {
            return Ok(vec![Vec::new(); frames]);
        }
        let rows = self.rows(name, width)?;
        if rows.len() != frames {
            let cause = format!("{} frames where `qpos` has {frames}", rows.len());
            return Err(Flaw::in_tensor(name, cause));
        }
        Ok(rows)
    }

    fn tracks(&self, frames: usize, contact_bodies: usize) -> Result<Tracks, Flaw> {
        let rows = |name: &str, width: usize| self.rows_of(name, frames, Some(width));
        let vectors = |name: &str| -> Result<Vec<Vector3<f64>>, Flaw> {
            let rows = rows(name, 3)?;
            Ok(rows.iter().map(|r| Vector3::from_column_slice(r)).collect())
        };
        let wrenches = rows("root_wrench_residual", 6)?;
        let contact = rows("contact", contact_bodies)?;
        let stands = |row: &Vec<f64>| row.iter().map(|&c| c != 0.0).collect();
        Ok(Tracks {
            phase: rows("phase", 1)?.concat(),
            com: vectors("com")?,
            com_velocity: vectors("com_velocity")?,
            linear_momentum: vectors("linear_momentum")?,
            angular_momentum: vectors("angular_momentum")?,
            contact: contact.iter().map(stands).collect(),
            root_wrench_residual: wrenches
                .iter()
                .map(|r| Vector6::from_column_slice(r))
                .collect(),
        })
    }

    /// `name` with all axes but the first taken as one, of size `width` if given.
    fn rows(&self, name: &str, width: Option<usize>) -> Result<Vec<Vec<f64>>, Flaw> {
        let wrong = |cause: String| Err(Flaw::in_tensor(name, cause));
        let view = self.reader.view(name)?;
        let Some(values) = numbers(&view) else {
            return wrong("not finite numbers of type F64, F32 or U8".to_owned());
        };
        let frames = view.shape().first().copied().unwrap_or(0);
        let found = values.len().checked_div(frames).unwrap_or(0);
        match width {
            _ if found == 0 => wrong("empty".to_owned()),
            Some(width) if width != found => {
                wrong(format!("{found} numbers per frame instead of {width}"))
            }
            _ => Ok(values.chunks_exact(found).map(<[f64]>::to_vec).collect()),
        }
    }
}

/// All numbers of a tensor; `None` for other types or numbers that are not finite.
fn numbers(view: &TensorView) -> Option<Vec<f64>> {
    let data = view.data();
    let values: Vec<f64> = match view.dtype() {
        Dtype::F64 => data
            .chunks_exact(8)
            .map(|b| b.try_into().map_or(f64::NAN, f64::from_le_bytes))
            .collect(),
        Dtype::F32 => data
            .chunks_exact(4)
            .map(|b| f64::from(b.try_into().map_or(f32::NAN, f32::from_le_bytes)))
            .collect(),
        Dtype::U8 => data.iter().map(|&b| f64::from(b)).collect(),
        _ => return None,
    };
    values.iter().all(|x| x.is_finite()).then_some(values)
}
