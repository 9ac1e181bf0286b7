//! `NAME.clip`: a safetensors file with the tensors of a [`Clip`] and its other fields as JSON metadata.
//!
//! Tensors, for J joints and F frames: `parent` i32 \[J\] (−1 for a root), `rest_translation` f32 \[J, 3\],
//! `rest_rotation` f32 \[J, 4\], `local_translation` f32 \[F, J, 3\], `local_rotation` f32 \[F, J, 4\]; and of a part of
//! a take `before_translation`, `before_rotation`, `after_translation`, `after_rotation`, alike. Metres, and
//! quaternions w, x, y, z. The metadata key `mimic` holds the JSON object [`Header`], in which `humanoid` is there only
//! where the source says which joint is which bone.

use super::sampling::{MOST_FPS, MOST_TRANSFORMS};
use super::{Clip, Error, Joint, LoopMode, Margin, Problem, Source};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

const FORMAT: &str = "clip";
const VERSION: u32 = 1;
const KEY: &str = "mimic";
const LOCAL: [&str; 2] = ["local_translation", "local_rotation"];
const BEFORE: [&str; 2] = ["before_translation", "before_rotation"];
const AFTER: [&str; 2] = ["after_translation", "after_rotation"];
/// Largest clip file that is read, in bytes.
const MOST_BYTES: u64 = 4 << 30;

#[derive(Serialize, Deserialize)]
struct Header {
    format: String,
    version: u32,
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

/// What every version of the header has, read first so that a later version is named and not called broken.
#[derive(Deserialize)]
struct Stamp {
    format: String,
    version: u32,
}

impl Clip {
    /// Writes the clip file `path`, or leaves what was there untouched.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        let io = |source| Error::Write {
            path: path.to_owned(),
            source,
        };
        let bytes = self.to_bytes().map_err(|e| Error::broken(path, e))?;
        crate::file::replace(path, &bytes).map_err(io)
    }

    /// Reads the clip file `path`.
    pub fn load(path: impl AsRef<Path>) -> Result<Clip, Error> {
        let path = path.as_ref();
        let io = |source| Error::Read {
            path: path.to_owned(),
            source,
        };
        let size = std::fs::metadata(path).map_err(io)?.len();
        if size > MOST_BYTES {
            return Err(Error::broken(
                path,
                format!("{size} bytes are more than {MOST_BYTES}"),
            ));
        }
        let bytes = std::fs::read(path).map_err(io)?;
        Clip::from_bytes(&bytes).map_err(|e| Error::broken(path, e))
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

    /// The bytes of the clip's file.
    fn to_bytes(&self) -> Result<Vec<u8>, String> {
        let header = Header {
            format: FORMAT.to_owned(),
            version: VERSION,
            name: self.name.clone(),
            fps: self.fps,
            joints: self.joints.iter().map(|joint| joint.name.clone()).collect(),
            humanoid: bones(&self.joints),
            loop_mode: self.loop_mode,
            source: self.source.clone(),
            problems: self.problems.clone(),
        };
        let header = serde_json::to_string(&header).map_err(|e| e.to_string())?;
        let j = self.joints.len();
        let rest = || self.joints.iter().map(|joint| &joint.rest);
        let mut tensors = vec![
            ("parent", Dtype::I32, vec![j], parents(&self.joints)?),
            (
                "rest_translation",
                Dtype::F32,
                vec![j, 3],
                translations(rest()),
            ),
            ("rest_rotation", Dtype::F32, vec![j, 4], rotations(rest())),
        ];
        let Margin { before, after } = &self.margin;
        tensors.extend(frames(LOCAL, j, &self.frames));
        if !before.is_empty() {
            tensors.extend(frames(BEFORE, j, before));
        }
        if !after.is_empty() {
            tensors.extend(frames(AFTER, j, after));
        }
        let mut views = Vec::new();
        for (name, dtype, shape, bytes) in &tensors {
            let view = TensorView::new(*dtype, shape.clone(), bytes).map_err(|e| e.to_string())?;
            views.push((*name, view));
        }
        let metadata = HashMap::from([(KEY.to_owned(), header)]);
        safetensors::serialize(views, Some(metadata)).map_err(|e| e.to_string())
    }

    /// The clip that a file's bytes hold, or what is wrong with them.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Clip, String> {
        let tensors =
            SafeTensors::deserialize(bytes).map_err(|e| format!("not safetensors ({e})"))?;
        let header = header(bytes)?;
        let j = header.joints.len();
        let parent = values::<4>(&tensors, "parent", Dtype::I32, &[Some(j)])?;
        let frames = read_frames(&tensors, LOCAL, j)?;
        if frames.is_empty() {
            return Err("0 frames".to_owned());
        }
        let around = |names: [&str; 2]| match tensors.tensor(names[0]) {
            Ok(_) => read_frames(&tensors, names, j),
            Err(_) => Ok(Vec::new()),
        };
        let margin = Margin {
            before: around(BEFORE)?,
            after: around(AFTER)?,
        };
        let rest_translation = floats(&tensors, "rest_translation", &[Some(j), Some(3)])?;
        let rest_rotation = floats(&tensors, "rest_rotation", &[Some(j), Some(4)])?;
        let rest = isometries("rest_rotation", &rest_translation, &rest_rotation)?;
        let parent: Vec<i32> = parent.into_iter().map(i32::from_le_bytes).collect();
        Ok(Clip {
            name: header.name,
            fps: header.fps,
            loop_mode: header.loop_mode,
            joints: joints(header.joints, header.humanoid, &parent, rest)?,
            frames,
            margin,
            source: header.source,
            problems: header.problems,
        })
    }
}

type Tensor = (&'static str, Dtype, Vec<usize>, Vec<u8>);

/// Two tensors of frames of `j` joints.
fn frames(
    [places, turns]: [&'static str; 2],
    j: usize,
    frames: &[Vec<Isometry3<f64>>],
) -> [Tensor; 2] {
    let (f, local) = (frames.len(), || frames.iter().flatten());
    [
        (places, Dtype::F32, vec![f, j, 3], translations(local())),
        (turns, Dtype::F32, vec![f, j, 4], rotations(local())),
    ]
}

/// The frames of `j` joints that two tensors hold.
fn read_frames(
    tensors: &SafeTensors<'_>,
    [places, turns]: [&str; 2],
    j: usize,
) -> Result<Vec<Vec<Isometry3<f64>>>, String> {
    let translation = floats(tensors, places, &[None, Some(j), Some(3)])?;
    let f = translation.len() / (3 * j);
    if f.saturating_mul(j) > MOST_TRANSFORMS {
        return Err(format!("{f} frames of {j} joints"));
    }
    let rotation = floats(tensors, turns, &[Some(f), Some(j), Some(4)])?;
    let local = isometries(turns, &translation, &rotation)?;
    Ok(local.chunks_exact(j).map(<[_]>::to_vec).collect())
}

fn header(bytes: &[u8]) -> Result<Header, String> {
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(|e| e.to_string())?;
    let text = metadata.metadata().as_ref().and_then(|m| m.get(KEY));
    let text = text.ok_or_else(|| format!("no `{KEY}` in the metadata"))?;
    let broken = |e: serde_json::Error| format!("metadata: {e}");
    let stamp: Stamp = serde_json::from_str(text).map_err(broken)?;
    if stamp.format != FORMAT {
        return Err(format!("a `{}` file where a clip is wanted", stamp.format));
    }
    if stamp.version != VERSION {
        return Err(format!(
            "clip version {} where {VERSION} is the latest known",
            stamp.version
        ));
    }
    let header: Header = serde_json::from_str(text).map_err(broken)?;
    if header.joints.is_empty() {
        return Err("no joints".to_owned());
    }
    if !(header.fps > 0.0 && header.fps <= MOST_FPS) {
        return Err(format!("a rate of {} frames per second", header.fps));
    }
    Ok(header)
}

/// Joints by the bone that each is said to be.
fn bones(joints: &[Joint]) -> BTreeMap<String, usize> {
    let bones = joints.iter().enumerate();
    bones
        .filter_map(|(j, joint)| Some((joint.bone.clone()?, j)))
        .collect()
}

fn parents(joints: &[Joint]) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(4 * joints.len());
    for joint in joints {
        let parent = match joint.parent {
            Some(p) => {
                i32::try_from(p).map_err(|_| format!("too many joints for `{}`", joint.name))?
            }
            None => -1,
        };
        bytes.extend(parent.to_le_bytes());
    }
    Ok(bytes)
}

fn translations<'a>(transforms: impl Iterator<Item = &'a Isometry3<f64>>) -> Vec<u8> {
    let numbers = transforms.flat_map(|t| [t.translation.x, t.translation.y, t.translation.z]);
    numbers.flat_map(|x| (x as f32).to_le_bytes()).collect()
}

fn rotations<'a>(transforms: impl Iterator<Item = &'a Isometry3<f64>>) -> Vec<u8> {
    let numbers = transforms.flat_map(|t| [t.rotation.w, t.rotation.i, t.rotation.j, t.rotation.k]);
    numbers.flat_map(|x| (x as f32).to_le_bytes()).collect()
}

/// Elements of a tensor, after its type and shape are found to be those wanted (`None` is any length).
fn values<const N: usize>(
    tensors: &SafeTensors<'_>,
    name: &str,
    dtype: Dtype,
    shape: &[Option<usize>],
) -> Result<Vec<[u8; N]>, String> {
    let tensor = tensors
        .tensor(name)
        .map_err(|_| format!("no tensor `{name}`"))?;
    let found = tensor.shape();
    let fits = found.len() == shape.len()
        && found
            .iter()
            .zip(shape)
            .all(|(have, want)| want.is_none_or(|want| *have == want));
    if tensor.dtype() != dtype || !fits {
        let want: Vec<String> = shape
            .iter()
            .map(|s| s.map_or("F".to_owned(), |s| s.to_string()))
            .collect();
        let want = want.join(", ");
        return Err(format!(
            "tensor `{name}` is {:?} {found:?} where {dtype:?} [{want}] is wanted",
            tensor.dtype()
        ));
    }
    Ok(tensor.data().as_chunks::<N>().0.to_vec())
}

fn floats(
    tensors: &SafeTensors<'_>,
    name: &str,
    shape: &[Option<usize>],
) -> Result<Vec<f64>, String> {
    let bytes = values::<4>(tensors, name, Dtype::F32, shape)?;
    let numbers: Vec<f64> = bytes
        .into_iter()
        .map(|b| f64::from(f32::from_le_bytes(b)))
        .collect();
    match numbers.iter().position(|x| !x.is_finite()) {
        Some(at) => Err(format!(
            "tensor `{name}`: element {at} is not a finite number"
        )),
        None => Ok(numbers),
    }
}

fn isometries(
    name: &str,
    translation: &[f64],
    rotation: &[f64],
) -> Result<Vec<Isometry3<f64>>, String> {
    let places = translation.as_chunks::<3>().0;
    let turns = rotation.as_chunks::<4>().0;
    let isometry = |(i, (t, q)): (usize, (&[f64; 3], &[f64; 4]))| {
        let q = stored_rotation(Quaternion::new(q[0], q[1], q[2], q[3]));
        let q = q.ok_or_else(|| format!("tensor `{name}`: rotation {i} is zero"))?;
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

fn joints(
    names: Vec<String>,
    bones: BTreeMap<String, usize>,
    parents: &[i32],
    rest: Vec<Isometry3<f64>>,
) -> Result<Vec<Joint>, String> {
    let joint = |(j, ((name, &parent), rest)): (usize, ((String, &i32), Isometry3<f64>))| {
        let parent = match parent {
            -1 => None,
            p => match usize::try_from(p) {
                Ok(p) if p < j => Some(p),
                _ => {
                    return Err(format!(
                        "joint {j} `{name}` has parent {p}, which isn't before it"
                    ));
                }
            },
        };
        Ok(Joint {
            name,
            parent,
            rest,
            bone: None,
        })
    };
    let joints = names.into_iter().zip(parents).zip(rest).enumerate();
    let mut joints: Vec<Joint> = joints.map(joint).collect::<Result<_, _>>()?;
    for (bone, j) in bones {
        let joint = joints.get_mut(j);
        let joint =
            joint.ok_or_else(|| format!("bone `{bone}` is joint {j}, which isn't there"))?;
        joint.bone = Some(bone);
    }
    Ok(joints)
}
