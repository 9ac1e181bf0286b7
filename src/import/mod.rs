//! Bytes of an animation file become a [`Clip`].
//!
//! A reader per format turns bytes into a scene: its nodes, its takes, and where every node is at any time. Everything after
//! that is common to all formats: the choice of the take and of the joints, canonical axes and metres, rigid transforms,
//! sampling, and the detection of loops.
//!
//! Positions are facts and everything else in a file is a claim: where rest pose, unit, up axis or heading disagree with
//! the motion, the motion counts and a [`Problem`](crate::clip::Problem) says so.

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
mod figure;
mod gltf;
mod inspect;
mod lead;
mod measure;
mod names;
mod options;
mod part;
mod rigid;
mod sample;
mod scene;
mod seam;
mod take;
mod tree;
mod upright;

pub use axes::{UnknownAxis, UpAxis};
pub use error::{Error, ErrorKind, NoTakes};
pub use inspect::{Inspection, TakeInfo};
pub use options::Options;

use crate::clip::Clip;
use crate::clip::edit::Plane;
use crate::file;
use crate::humanoid;
use detect::Format;
use error::malformed;
use scene::{Contents, Scene};
use sha2::{Digest, Sha256};
use std::path::Path;

/// Largest animation file that is read, in bytes. Chosen as a bound on memory: a parsed file takes a multiple of its bytes.
const MOST_BYTES: u64 = 2 << 30;

/// Frames × joints that any file may be sampled to, and how many more per byte of it. A few bytes can claim hours of motion,
/// but motion that fills hours takes many bytes. Chosen: a minute of 70 joints at 60 Hz from any file, and two bytes per
/// transform of a binary file beyond, where formats write 4 (a quaternion of bytes in glTF) to dozens before compression. A
/// text has at least twelve bytes per transform, as three short numbers take. A transform takes up to 130 bytes while a file
/// is read, so memory stays below 64 times a binary file and below 16 times a text.
const FREE_TRANSFORMS: usize = 1 << 18;
const TRANSFORMS_PER_BYTE: f64 = 0.5;
const TRANSFORMS_PER_LETTER: f64 = 0.08;
/// The same in texts that hold binary numbers, as glTF does, or keys in place of frames: these take memory of their own.
const TRANSFORMS_PER_DENSE_LETTER: f64 = 0.06;
/// How many bytes tell whether a file is a text: all binary formats have a zero near their beginning.
const TEXT_HEAD: usize = 64;

/// Tells what is in the file `path`: its takes, joints, axes and unit, without sampling any of its motion.
///
/// # Errors
/// An [`Error`] when the file can't be read, has no format that is known, or breaks its format.
pub fn inspect(path: impl AsRef<Path>) -> Result<Inspection, Error> {
    let path = path.as_ref();
    let inspect = || {
        let bytes = bytes_of(path)?;
        let scene = open(&bytes, &names::base_name(path), path.parent())?;
        inspect::inspection(scene.as_ref())
    };
    inspect().map_err(|kind| error(path, kind))
}

/// Reads a take of the file `path`.
///
/// # Errors
/// An [`Error`] when the file can't be read, breaks its format, or doesn't hold what `options` ask for.
pub fn load(path: impl AsRef<Path>, options: &Options) -> Result<Clip, Error> {
    let path = path.as_ref();
    let load = || {
        let bytes = bytes_of(path)?;
        clip(&bytes, &names::base_name(path), path.parent(), options)
    };
    load().map_err(|kind| error(path, kind))
}

/// Reads a take from a file's bytes. `file` is the file's name; it names the clip. External buffers of a `.gltf` and the
/// skeleton of an `.amc` are looked for in `folder` and nowhere else, and are missing where there is no folder.
///
/// # Errors
/// As for [`load`].
pub fn read(
    bytes: &[u8],
    file: &str,
    folder: Option<&Path>,
    options: &Options,
) -> Result<Clip, Error> {
    clip(bytes, file, folder, options).map_err(|kind| error(Path::new(file), kind))
}

fn error(file: &Path, kind: ErrorKind) -> Error {
    Error {
        file: file.to_owned(),
        kind,
    }
}

fn clip(
    bytes: &[u8],
    file: &str,
    folder: Option<&Path>,
    options: &Options,
) -> Result<Clip, ErrorKind> {
    let scene = open(bytes, file, folder)?;
    let (take, note) = take::choose(scene.as_ref(), options.take.as_deref())?;
    let most = most_transforms(bytes, scene.contents());
    let mut clip = sample::clip(scene.as_ref(), file, take, options, most)?;
    drop(scene);
    if options.mirror {
        clip = mirrored(&clip)?;
    }
    clip.source.sha256 = Sha256::digest(bytes)
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect();
    clip.problems.extend(note);
    // Last, so that a clip is the same straight from here and from its file.
    clip.round_to_file();
    Ok(clip)
}

/// Most frames × joints that a file of these bytes and contents may be sampled to.
fn most_transforms(bytes: &[u8], contents: &Contents) -> usize {
    let head = &bytes[..bytes.len().min(TEXT_HEAD)];
    let per_byte = match contents.format {
        _ if head.contains(&0) => TRANSFORMS_PER_BYTE,
        "bvh" | "amc" | "deepmimic" => TRANSFORMS_PER_LETTER,
        _ => TRANSFORMS_PER_DENSE_LETTER,
    };
    let beside = contents.bytes_beside as f64 * TRANSFORMS_PER_BYTE;
    let allowed = bytes.len() as f64 * per_byte + beside;
    FREE_TRANSFORMS + allowed as usize
}

/// The clip in the mirror of its figure's sagittal plane.
fn mirrored(clip: &Clip) -> Result<Clip, ErrorKind> {
    let map = humanoid::map(&clip.joints).map_err(|source| ErrorKind::NoSides { source })?;
    let pairs = humanoid::pairs(&clip.joints, &map);
    let plane = Plane::sagittal(&clip.joints, &pairs);
    let mirrored = clip.mirror(&pairs, &plane);
    mirrored.map_err(|source| ErrorKind::Mirror { source })
}

/// Hands the bytes to the reader of their format.
fn open(bytes: &[u8], file: &str, folder: Option<&Path>) -> Result<Box<dyn Scene>, ErrorKind> {
    // Formats without names for takes call theirs as the file.
    let name = names::stem(file);
    let format = detect::detect(bytes).map_err(|why| ErrorKind::Malformed(Box::new(why)))?;
    Ok(match format {
        Format::Glb => Box::new(gltf::read_glb(bytes, folder).map_err(malformed)?),
        Format::Gltf => Box::new(gltf::read_json(bytes, folder).map_err(malformed)?),
        Format::Bvh => Box::new(bvh::read(bytes, name).map_err(malformed)?),
        Format::Asf => Box::new(acclaim::read_asf(bytes).map_err(malformed)?),
        Format::Amc => Box::new(acclaim::read_amc(bytes, file, folder).map_err(malformed)?),
        Format::DeepMimic => Box::new(deepmimic::read(bytes, name).map_err(malformed)?),
        Format::Fbx => fbx::open(bytes).map_err(malformed)?,
    })
}

fn bytes_of(path: &Path) -> Result<Vec<u8>, ErrorKind> {
    file::read_at_most(path, MOST_BYTES).map_err(|source| ErrorKind::Read { source })
}
