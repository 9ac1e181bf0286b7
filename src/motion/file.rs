//! `NAME.motion`: a safetensors file whose metadata key `mimic` holds a JSON header.

use super::{Cycle, Motion, MotionError, Tracks};
use crate::clip::{LoopMode, MOST_FPS, stored_rotation};
use nalgebra::{Isometry3, Quaternion, Translation3, Vector3, Vector6};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::path::Path;

const FORMAT: &str = "motion";
const VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
struct Header {
    format: String,
    version: u32,
    name: String,
    fps: f64,
    #[serde(rename = "loop")]
    loop_mode: LoopMode,
    cycle: CycleHeader,
    skeleton: SkeletonHeader,
    bodies: Vec<String>,
    contact_bodies: Vec<String>,
    report: serde_json::Value,
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
    /// Writes the motion; the file appears whole or not at all.
    pub fn save(&self, path: &Path) -> Result<(), MotionError> {
        let error = |message: String| MotionError::Write {
            path: path.into(),
            message,
        };
        let bytes = self.to_bytes().map_err(error)?;
        crate::file::replace(path, &bytes).map_err(|e| error(e.to_string()))
    }

    /// Reads a motion and checks that all its parts fit together.
    pub fn load(path: &Path) -> Result<Self, MotionError> {
        let bytes = std::fs::read(path).map_err(|source| MotionError::Read {
            path: path.into(),
            source,
        })?;
        Self::from_bytes(&bytes).map_err(|message| MotionError::Format {
            path: path.into(),
            message,
        })
    }

    fn to_bytes(&self) -> Result<Vec<u8>, String> {
        let header = serde_json::to_string(&self.header()).map_err(|e| e.to_string())?;
        let columns = self.columns();
        let bytes: Vec<Vec<u8>> = columns.iter().map(Column::bytes).collect();
        let views = columns
            .iter()
            .zip(&bytes)
            .map(|(column, bytes)| Ok((column.name, column.view(bytes)?)))
            .collect::<Result<Vec<_>, String>>()?;
        let metadata = HashMap::from([("mimic".to_owned(), header)]);
        safetensors::serialize(views, Some(metadata)).map_err(|e| e.to_string())
    }

    fn header(&self) -> Header {
        let name = |&b: &usize| self.body_names.get(b).cloned().unwrap_or_default();
        Header {
            format: FORMAT.into(),
            version: VERSION,
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
        }
    }

    fn columns(&self) -> Vec<Column> {
        let t = &self.tracks;
        let vectors = |v: &[Vector3<f64>]| v.iter().map(|v| v.iter().copied().collect()).collect();
        let position = |p: &Isometry3<f64>| <[f64; 3]>::from(p.translation.vector);
        let rotation = |p: &Isometry3<f64>| {
            let r = &p.rotation;
            [r.w, r.i, r.j, r.k]
        };
        let poses = self.bodies.iter();
        let positions = poses.clone().map(|f| f.iter().flat_map(position).collect());
        let rotations = poses.map(|f| f.iter().flat_map(rotation).collect());
        let contact = |row: &Vec<bool>| row.iter().map(|&c| f64::from(u8::from(c))).collect();
        let wrench = |w: &Vector6<f64>| w.iter().copied().collect();
        let rows = |name, rows| Column::new(name, rows);
        vec![
            rows("qpos", self.qpos.clone()),
            rows("qvel", self.qvel.clone()),
            rows("body_position", positions.collect()).split(3),
            rows("body_rotation", rotations.collect()).split(4),
            rows("phase", t.phase.iter().map(|&p| vec![p]).collect()).flat(),
            rows("com", vectors(&t.com)),
            rows("com_velocity", vectors(&t.com_velocity)),
            rows("linear_momentum", vectors(&t.linear_momentum)),
            rows("angular_momentum", vectors(&t.angular_momentum)),
            rows("contact", t.contact.iter().map(contact).collect()).of_bytes(),
            rows(
                "root_wrench_residual",
                t.root_wrench_residual.iter().map(wrench).collect(),
            ),
        ]
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let header = read_header(bytes)?;
        let tensors = SafeTensors::deserialize(bytes).map_err(|e| e.to_string())?;
        let table = Table { tensors };
        let qpos = table.rows("qpos", None)?;
        let frames = qpos.len();
        let bodies = header.bodies.len();
        let contact_bodies = header
            .contact_bodies
            .iter()
            .map(|name| {
                let at = header.bodies.iter().position(|b| b == name);
                at.ok_or_else(|| format!("contact body `{name}` is not one of its bodies"))
            })
            .collect::<Result<Vec<_>, _>>()?;
        let rows = |name: &str, width: usize| table.rows_of(name, frames, Some(width));
        let poses = poses(
            &rows("body_position", 3 * bodies)?,
            &rows("body_rotation", 4 * bodies)?,
        )?;
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
            qvel: table.rows_of("qvel", frames, None)?,
            qpos,
            bodies: poses,
            report: header.report,
        })
    }
}

fn read_header(bytes: &[u8]) -> Result<Header, String> {
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(|e| e.to_string())?;
    let text = metadata.metadata().as_ref().and_then(|m| m.get("mimic"));
    let text = text.ok_or("it has no `mimic` metadata")?;
    let header: Header =
        serde_json::from_str(text).map_err(|e| format!("its `mimic` metadata: {e}"))?;
    if header.format != FORMAT {
        return Err(format!("it holds a {}", header.format));
    }
    if header.version > VERSION {
        return Err(format!(
            "it has version {}, and this program reads up to {VERSION}; update it",
            header.version
        ));
    }
    if !(header.fps > 0.0 && header.fps <= MOST_FPS) {
        return Err(format!(
            "its frame rate {} is no positive number up to {MOST_FPS}",
            header.fps
        ));
    }
    let cycle = &header.cycle;
    if !cycle
        .translation
        .iter()
        .chain([&cycle.heading])
        .all(|x| x.is_finite())
    {
        return Err("its cycle is not finite".into());
    }
    Ok(header)
}

fn poses(
    positions: &[Vec<f64>],
    rotations: &[Vec<f64>],
) -> Result<Vec<Vec<Isometry3<f64>>>, String> {
    let pose = |(p, r): (&[f64], &[f64])| {
        let shift = Translation3::from(Vector3::from_column_slice(p));
        let turn = stored_rotation(Quaternion::new(r[0], r[1], r[2], r[3]));
        let turn = turn.ok_or("the rotation of a body is zero: `body_rotation` is damaged")?;
        Ok(Isometry3::from_parts(shift, turn))
    };
    positions
        .iter()
        .zip(rotations)
        .map(|(p, r)| p.chunks_exact(3).zip(r.chunks_exact(4)).map(pose).collect())
        .collect()
}

/// One tensor to be written: a row per frame.
struct Column {
    name: &'static str,
    rows: Vec<Vec<f64>>,
    /// Size of the innermost axis, if rows have two.
    inner: Option<usize>,
    one_axis: bool,
    bytes: bool,
}

impl Column {
    fn new(name: &'static str, rows: Vec<Vec<f64>>) -> Self {
        Self {
            name,
            rows,
            inner: None,
            one_axis: false,
            bytes: false,
        }
    }

    fn split(mut self, inner: usize) -> Self {
        self.inner = Some(inner);
        self
    }

    fn flat(mut self) -> Self {
        self.one_axis = true;
        self
    }

    fn of_bytes(mut self) -> Self {
        self.bytes = true;
        self
    }

    fn bytes(&self) -> Vec<u8> {
        let values = self.rows.iter().flatten();
        if self.bytes {
            values.map(|&x| u8::from(x != 0.0)).collect()
        } else {
            values.flat_map(|x| x.to_le_bytes()).collect()
        }
    }

    fn view<'a>(&self, bytes: &'a [u8]) -> Result<TensorView<'a>, String> {
        let width = self.rows.first().map_or(0, Vec::len);
        let mut shape = vec![self.rows.len()];
        match self.inner {
            Some(inner) => shape.extend([width / inner, inner]),
            None if !self.one_axis => shape.push(width),
            None => {}
        }
        let dtype = if self.bytes { Dtype::U8 } else { Dtype::F64 };
        TensorView::new(dtype, shape, bytes).map_err(|e| format!("{}: {e}", self.name))
    }
}

/// Tensors of a file, read as rows of numbers.
struct Table<'a> {
    tensors: SafeTensors<'a>,
}

impl Table<'_> {
    /// `name` with exactly `frames` rows.
    fn rows_of(
        &self,
        name: &str,
        frames: usize,
        width: Option<usize>,
    ) -> Result<Vec<Vec<f64>>, String> {
        if width == Some(0) {
            return Ok(vec![Vec::new(); frames]);
        }
        let rows = self.rows(name, width)?;
        if rows.len() != frames {
            return Err(format!(
                "tensor `{name}` has {} frames where `qpos` has {frames}",
                rows.len()
            ));
        }
        Ok(rows)
    }

    fn tracks(&self, frames: usize, contact_bodies: usize) -> Result<Tracks, String> {
        let rows = |name: &str, width: usize| self.rows_of(name, frames, Some(width));
        let vectors = |name: &str| -> Result<Vec<Vector3<f64>>, String> {
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

    /// `name` with all axes but the first as one, of size `width` if given.
    fn rows(&self, name: &str, width: Option<usize>) -> Result<Vec<Vec<f64>>, String> {
        let view = self
            .tensors
            .tensor(name)
            .map_err(|_| format!("it has no tensor `{name}`"))?;
        let values = numbers(&view).ok_or_else(|| {
            format!("tensor `{name}` has to hold finite numbers of type F64, F32 or U8")
        })?;
        let frames = view.shape().first().copied().unwrap_or(0);
        let found = values.len().checked_div(frames).unwrap_or(0);
        if width.is_some_and(|w| frames > 0 && w != found) {
            return Err(format!(
                "tensor `{name}` has {found} numbers per frame instead of {}",
                width.unwrap_or(0)
            ));
        }
        if found == 0 {
            return Err(format!("tensor `{name}` is empty"));
        }
        Ok(values.chunks_exact(found).map(<[f64]>::to_vec).collect())
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
