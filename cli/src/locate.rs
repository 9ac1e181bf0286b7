//! Finding inputs: by path, by name in the library folder or among the runs, or the most recent one.

use crate::failure::{Failure, Outcome};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Files that lead to a motion, the finished first.
pub const ANIMATIONS: [&str; 11] = [
    "motion", "clip", "fbx", "glb", "gltf", "vrm", "vrma", "bvh", "amc", "txt", "json",
];
/// The same without finished motions.
pub const CLIPS: [&str; 10] = [
    "clip", "fbx", "glb", "gltf", "vrm", "vrma", "bvh", "amc", "txt", "json",
];
/// What other tools write.
pub const SOURCES: [&str; 9] = [
    "fbx", "glb", "gltf", "vrm", "vrma", "bvh", "amc", "txt", "json",
];

/// Folder of training runs.
pub const RUNS: &str = "runs";
/// Every run has one, from its first moment.
pub const RUN_CONFIG: &str = "config.json";

/// How many names an error message lists.
const NAMES_SHOWN: usize = 8;

/// The file that `wanted` means: a path, or a name in the library with one of `extensions`, tried in order.
pub fn file(wanted: &Path, library: &Path, extensions: &[&str]) -> Outcome<PathBuf> {
    if wanted.is_file() {
        return Ok(wanted.to_path_buf());
    }
    if wanted.is_dir() && !is_name(wanted) {
        return Err(Failure::input(wanted, "a folder, give a file in it"));
    }
    if is_name(wanted) {
        let whole = Some(library.join(wanted)).filter(|path| path.is_file());
        if let Some(found) = whole.or_else(|| named(wanted, library, extensions)) {
            return Ok(found);
        }
    }
    Err(absent(wanted, library, extensions))
}

/// The file of the library that is called `name` but for its extension, which is in upper case on some systems.
fn named(name: &Path, library: &Path, extensions: &[&str]) -> Option<PathBuf> {
    let called = |path: &PathBuf| path.is_file() && path.file_stem() == name.file_name();
    let mut files: Vec<_> = entries(library).filter(called).collect();
    files.sort();
    let mut wanted = extensions.iter();
    wanted.find_map(|e| files.iter().find(|path| has_extension(path, e)).cloned())
}

/// The file that `wanted` means; left out, the newest `.newest` file here or in the library: one of our own
/// kinds, never just any text that lies about.
pub fn file_or_newest(
    wanted: Option<&Path>,
    library: &Path,
    extensions: &[&str],
    newest: &str,
) -> Outcome<PathBuf> {
    if let Some(wanted) = wanted {
        return file(wanted, library, extensions);
    }
    newest_file(&[Path::new("."), library], newest).ok_or_else(|| {
        let library = library.display();
        Failure::user(format!(
            "no file given, and no .{newest} here or in the library `{library}`"
        ))
    })
}

/// The folder of the run that `wanted` means: a path, or a name in `runs/`; left out, the newest one.
pub fn run(wanted: Option<&Path>) -> Outcome<PathBuf> {
    match wanted {
        Some(wanted) => existing_run(wanted).ok_or_else(|| absent_run(wanted)),
        None => newest_run().ok_or_else(|| {
            Failure::user(format!(
                "no run in `{RUNS}`, make one with `mimic train CLIP`"
            ))
        }),
    }
}

/// The run that `wanted` means, if there is one.
pub fn existing_run(wanted: &Path) -> Option<PathBuf> {
    let named = is_name(wanted).then(|| Path::new(RUNS).join(wanted));
    let places = std::iter::once(wanted.to_path_buf()).chain(named);
    places.into_iter().find(|path| is_run(path))
}

pub fn is_run(path: &Path) -> bool {
    path.join(RUN_CONFIG).is_file()
}

pub fn newest_run() -> Option<PathBuf> {
    let folders = entries(Path::new(RUNS)).filter(|path| is_run(path));
    folders.max_by_key(|path| (run_time(path), path.clone()))
}

/// When a run last learned something.
fn run_time(run: &Path) -> Option<SystemTime> {
    let files = ["checkpoint.safetensors", "metrics.jsonl", RUN_CONFIG];
    files.iter().find_map(|file| modified(&run.join(file)))
}

fn newest_file(folders: &[&Path], extension: &str) -> Option<PathBuf> {
    let files = folders.iter().flat_map(|folder| entries(folder));
    let files = files.filter(|path| path.is_file() && has_extension(path, extension));
    files
        .max_by_key(|path| (modified(path), path.clone()))
        .map(|path| {
            path.strip_prefix(".")
                .map(Path::to_path_buf)
                .unwrap_or(path)
        })
}

pub fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

fn modified(path: &Path) -> Option<SystemTime> {
    fs::metadata(path).and_then(|m| m.modified()).ok()
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    entries.filter_map(|entry| Some(entry.ok()?.path()))
}

/// A single word rather than a way through folders.
fn is_name(path: &Path) -> bool {
    path.components().count() == 1 && path.file_name().is_some()
}

fn absent(wanted: &Path, library: &Path, extensions: &[&str]) -> Failure {
    if !is_name(wanted) {
        return Failure::input(wanted, "no such file");
    }
    let fits = |path: &PathBuf| extensions.iter().any(|e| has_extension(path, e));
    let known = listing(entries(library).filter(fits));
    let library = library.display();
    let hint = match known {
        Some(known) => {
            format!("and none of that name in the library `{library}`, which has {known}")
        }
        None => format!(
            "and nothing in the library `{library}`; give a path, or a library with `--library DIR`"
        ),
    };
    Failure::input(wanted, format!("no such file, {hint}"))
}

fn absent_run(wanted: &Path) -> Failure {
    let known = listing(entries(Path::new(RUNS)).filter(|path| is_run(path)));
    let hint = match known {
        Some(known) => format!("there are {known}"),
        None => "make one with `mimic train CLIP`".into(),
    };
    let what = match wanted.is_file() {
        true => "is a file, and a run is a folder".to_owned(),
        false => format!("no run there or in `{RUNS}`"),
    };
    Failure::input(wanted, format!("{what}; {hint}"))
}

fn listing(paths: impl Iterator<Item = PathBuf>) -> Option<String> {
    let stem = |path: PathBuf| Some(path.file_stem()?.to_string_lossy().into_owned());
    let mut names: Vec<String> = paths.filter_map(stem).collect();
    names.sort();
    names.dedup();
    let more = names.len().saturating_sub(NAMES_SHOWN);
    names.truncate(NAMES_SHOWN);
    let mut text = names.join(", ");
    if more > 0 {
        text += &format!(" and {more} more");
    }
    (!names.is_empty()).then_some(text)
}
