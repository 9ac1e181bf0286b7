//! Bytes of an animation file become a [`Clip`](crate::clip::Clip).
//!
//! A reader per format turns bytes into a [`scene::Scene`]; everything after that is common: the choice of take
//! and joints, canonical axes and metres, rigid transforms, sampling, loop detection.

mod acclaim;
mod axes;
mod bind;
mod bvh;
mod canonical;
mod deepmimic;
mod detect;
mod error;
mod facing;
mod fbx;
mod gltf;
mod inspect;
mod lead;
mod measure;
mod part;
mod rigid;
mod scene;
mod seam;
mod take;
mod tree;
mod upright;

pub use acclaim::AcclaimError;
pub use axes::{UnknownAxis, UpAxis};
pub use bvh::BvhError;
pub use deepmimic::DeepMimicError;
pub use error::Error;
pub use fbx::FbxError;
pub use gltf::GltfError;
pub use inspect::{Inspection, TakeInfo};

use crate::clip::edit::Plane;
use crate::clip::{Clip, LoopMode, Margin, Problem, Severity, Source};
use crate::humanoid;
use canonical::Rig;
use detect::Format;
use part::Part;
use rigid::Frame;
use scene::Scene;
use sha2::{Digest, Sha256};
use std::path::Path;

/// Largest animation file that is read, in bytes.
const MOST_BYTES: u64 = 2 << 30;

/// Frames × joints that any file may be sampled to, and how many more per byte of it: a few bytes can tell of hours,
/// but motion that fills them takes more.
const FREE_TRANSFORMS: usize = 1 << 18;
const TRANSFORMS_PER_BYTE: f64 = 0.5;

/// How a file is to be read, where it shouldn't decide itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Name of the take, or its number counted from 1; the take with most motion if left out.
    pub take: Option<String>,
    /// Frames per second to sample at; the take's own if left out.
    pub fps: Option<f64>,
    /// Part of the take to keep, in seconds from its start. If left out, all of it but a first frame from which the
    /// motion doesn't go on.
    pub trim: Option<(f64, f64)>,
    /// Whether it loops; found out if left out.
    pub loop_mode: Option<LoopMode>,
    /// Up axis of the file's data, where its header is wrong.
    pub up: Option<UpAxis>,
    /// Metres per unit of the file's data, where its header is wrong.
    pub unit_m: Option<f64>,
    /// Whether left and right change places.
    pub mirror: bool,
}

/// Looks at the file `path`.
pub fn inspect(path: impl AsRef<Path>) -> Result<Inspection, Error> {
    let path = path.as_ref();
    let file = file_name(path);
    let bytes = bytes_of(path, &file)?;
    let scene = open(&bytes, &file, path.parent())?;
    inspect::inspection(scene.as_ref(), &file)
}

/// Reads a take of the file `path`.
pub fn load(path: impl AsRef<Path>, options: &Options) -> Result<Clip, Error> {
    let path = path.as_ref();
    let file = file_name(path);
    read(&bytes_of(path, &file)?, &file, path.parent(), options)
}

/// Reads a take from a file's bytes. `file` names it; external buffers of a `.gltf` and the skeleton of an `.amc`
/// are taken from `folder` and nowhere else, and without a folder they are missing.
pub fn read(
    bytes: &[u8],
    file: &str,
    folder: Option<&Path>,
    options: &Options,
) -> Result<Clip, Error> {
    let scene = open(bytes, file, folder)?;
    let (take, note) = take::choose(scene.as_ref(), file, options.take.as_deref())?;
    let read = bytes.len().saturating_add(scene.contents().bytes_beside);
    let most = FREE_TRANSFORMS + (read as f64 * TRANSFORMS_PER_BYTE) as usize;
    let mut clip = clip(scene.as_ref(), file, take, options, most)?;
    if options.mirror {
        clip = mirrored(&clip, file)?;
    }
    clip.source.sha256 = Sha256::digest(bytes)
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect();
    clip.problems.extend(note);
    clip.round_to_file();
    Ok(clip)
}

/// The clip in the mirror of its figure's sagittal plane.
fn mirrored(clip: &Clip, file: &str) -> Result<Clip, Error> {
    let map = humanoid::map(&clip.joints).map_err(|source| Error::NoSides {
        file: file.to_owned(),
        source,
    })?;
    let pairs = humanoid::pairs(&clip.joints, &map);
    let plane = Plane::sagittal(&clip.joints, &pairs);
    let mirrored = clip.mirror(&pairs, &plane);
    mirrored.map_err(|source| Error::Mirror {
        file: file.to_owned(),
        source,
    })
}

/// Hands the bytes to the reader of their format.
fn open(bytes: &[u8], file: &str, folder: Option<&Path>) -> Result<Box<dyn Scene>, Error> {
    let owned = || file.to_owned();
    let format = detect::detect(bytes).map_err(|reason| Error::Unsupported {
        file: owned(),
        reason,
    })?;
    let gltf = |source| Error::Gltf {
        file: owned(),
        source,
    };
    let acclaim = |source| Error::Acclaim {
        file: owned(),
        source,
    };
    Ok(match format {
        Format::Glb => Box::new(gltf::read_glb(bytes, folder).map_err(gltf)?),
        Format::Gltf => Box::new(gltf::read_json(bytes, folder).map_err(gltf)?),
        Format::Bvh => {
            let read = bvh::read(bytes, stem(file));
            Box::new(read.map_err(|source| Error::Bvh {
                file: owned(),
                source,
            })?)
        }
        Format::Asf => Box::new(acclaim::read_asf(bytes).map_err(acclaim)?),
        Format::Amc => {
            Box::new(acclaim::read_amc(bytes, file, stem(file), folder).map_err(acclaim)?)
        }
        Format::DeepMimic => {
            let read = deepmimic::read(bytes, stem(file));
            Box::new(read.map_err(|source| Error::DeepMimic {
                file: owned(),
                source,
            })?)
        }
        Format::Fbx => fbx::open(bytes).map_err(|source| Error::Fbx {
            file: owned(),
            source,
        })?,
    })
}

fn frame(scene: &dyn Scene, file: &str, options: &Options) -> Result<Frame, Error> {
    let unit_m = options.unit_m.unwrap_or_else(|| scene.contents().unit_m);
    if !(unit_m > 0.0 && unit_m.is_finite()) {
        return Err(Error::Unit {
            file: file.to_owned(),
            unit_m,
        });
    }
    let axes = match options.up {
        Some(up) if up.to_string() != scene.contents().up_axis => up.canonical_from_file(),
        _ => scene.contents().canonical_from_file,
    };
    let is_sure = options.up.is_some();
    Ok(Frame {
        axes,
        unit_m,
        is_sure,
    })
}

/// Samples a take, to `most` frames × joints at most.
fn clip(
    scene: &dyn Scene,
    file: &str,
    take: usize,
    options: &Options,
    most: usize,
) -> Result<Clip, Error> {
    let about = &scene.takes()[take];
    let span = part::span(about, file, options.trim)?;
    // The same for every part of a take.
    let first = Some((take, about.start));
    let rig = Rig::new(scene, file, frame(scene, file, options)?, first)?;
    let fps = options.fps.unwrap_or(about.fps);
    let most = part::most_frames(scene, about, rig.joints.len(), most);
    let mut part = Part::new(scene, file, about, span, fps, most)?;
    let mut world = rig.frames(take, &part.times)?;
    let has_first = part.times.first() == Some(&about.start);
    let is_asked_for = options.trim.is_some() && part.own.start == 0;
    let leads_nowhere = has_first && !is_asked_for && lead::is_apart(&world);
    if leads_nowhere {
        world.remove(0);
        part.leave_out_first();
    }
    let after = world.split_off(part.own.end);
    let before: Vec<_> = world.drain(..part.own.start).collect();
    let mut problems = scene.contents().problems.clone();
    problems.extend_from_slice(&about.problems);
    problems.extend((leads_nowhere && options.trim.is_none()).then(lead::problem));
    problems.extend(sampling_problems(part.fps, fps, &world));
    let wraps = match options.loop_mode {
        Some(mode) => mode == LoopMode::Wrap,
        None => about
            .wraps
            .filter(|_| options.trim.is_none())
            .unwrap_or_else(|| seam::wraps(&world)),
    };
    let locals = |world: Vec<Vec<_>>| world.iter().map(|frame| rig.locals(frame)).collect();
    let frames = locals(world);
    let margin = match wraps {
        true => Margin::default(),
        false => Margin {
            before: locals(before),
            after: locals(after),
        },
    };
    problems.extend(rig.problems);
    Ok(Clip {
        name: stem(file).to_owned(),
        fps: part.fps,
        loop_mode: if wraps {
            LoopMode::Wrap
        } else {
            LoopMode::Clamp
        },
        joints: rig.joints,
        frames,
        margin,
        source: Source {
            file: file.to_owned(),
            sha256: String::new(),
            format: scene.contents().format.to_owned(),
            take: about.name.clone(),
            fps: about.fps,
            up_axis: options
                .up
                .or(rig.other_up)
                .map_or_else(|| scene.contents().up_axis.clone(), |up| up.to_string()),
            unit_m: options.unit_m.unwrap_or_else(|| scene.contents().unit_m),
        },
        problems,
    })
}

fn sampling_problems(
    sampled: f64,
    fps: f64,
    world: &[Vec<nalgebra::Isometry3<f64>>],
) -> Vec<Problem> {
    let mut problems = Vec::new();
    if sampled != fps {
        problems.push(Problem {
            id: "rate-adjusted".to_owned(),
            severity: Severity::Note,
            message: format!(
                "sampled at {:.3} Hz, not {fps} Hz, so that a frame falls on the end",
                sampled
            ),
        });
    }
    if world.windows(2).all(|w| w[0] == w[1]) {
        problems.push(Problem {
            id: "still-take".to_owned(),
            severity: Severity::Warning,
            message: "nothing moves in this take; choose another with --take".to_owned(),
        });
    }
    problems
}

fn bytes_of(path: &Path, file: &str) -> Result<Vec<u8>, Error> {
    let io = |source| Error::Io {
        file: file.to_owned(),
        source,
    };
    let size = std::fs::metadata(path).map_err(io)?.len();
    if size > MOST_BYTES {
        return Err(Error::TooLarge {
            file: file.to_owned(),
            size,
            limit: MOST_BYTES,
        });
    }
    std::fs::read(path).map_err(io)
}

/// A list of at most eight items, and how many more there are.
fn few(items: impl ExactSizeIterator<Item = String>) -> String {
    const MOST: usize = 8;
    let more = items.len().saturating_sub(MOST);
    let list = items.take(MOST).collect::<Vec<_>>().join(", ");
    match more {
        0 => list,
        more => format!("{list}, … and {more} more"),
    }
}

fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

fn stem(file: &str) -> &str {
    file.rsplit_once('.')
        .map_or(file, |(stem, _)| if stem.is_empty() { file } else { stem })
}
