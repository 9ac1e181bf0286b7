//! Finding inputs: by path, by name in the library folder or in `runs/`, or the newest one.

use crate::failure::{Failure, Outcome};
use crate::shell;
use mimic::file::Lock;
use mimic::run::files;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Extensions of all files that a motion can be made of, in the order in which a name is looked for.
pub const ANIMATIONS: [&str; 11] = [
    "motion", "clip", "fbx", "glb", "gltf", "vrm", "vrma", "bvh", "amc", "txt", "json",
];
/// The same without motions.
pub const CLIPS: [&str; 10] = [
    "clip", "fbx", "glb", "gltf", "vrm", "vrma", "bvh", "amc", "txt", "json",
];
/// The same without our own formats: what other tools write.
pub const SOURCES: [&str; 9] = [
    "fbx", "glb", "gltf", "vrm", "vrma", "bvh", "amc", "txt", "json",
];

/// The folder of training runs.
pub const RUNS: &str = "runs";

/// How many names an error message lists.
const NAMES_SHOWN: usize = 8;

/// Most files of a folder that are compared with a name that was not found: a moment's work in the largest folders.
const MOST_COMPARED: usize = 10_000;

/// The file that `wanted` means: a path, or a name in the library with one of `extensions`, the first before the others.
pub fn file(wanted: &Path, library: &Path, extensions: &[&str]) -> Outcome<PathBuf> {
    let is_there = is_there(wanted)?;
    // A pipe or a device is refused by who reads it, with its kind.
    if is_there && !wanted.is_dir() {
        return Ok(wanted.to_path_buf());
    }
    if is_name(wanted) {
        let whole = Some(library.join(wanted)).filter(|path| path.is_file());
        if let Some(found) = whole.or_else(|| named(wanted, library, extensions)) {
            return Ok(found);
        }
    }
    Err(match is_there {
        true => folder(wanted),
        false => absent(wanted, library, extensions),
    })
}

/// Whether there is anything of this name. What we may not look at is there, but can't be read.
fn is_there(path: &Path) -> Outcome<bool> {
    is_there_by(path, fs::metadata(path).map(|_| ()))
}

/// The same, by what the system said when it was asked for something there.
fn is_there_by(path: &Path, asked: io::Result<()>) -> Outcome<bool> {
    match asked {
        Ok(()) => Ok(true),
        Err(e) if is_absence(&e) => Ok(false),
        Err(e) => Err(Failure::unreadable(path, &e)),
    }
}

/// Whether the system says that there is nothing: no such name, or a file where the path has a folder.
fn is_absence(error: &io::Error) -> bool {
    let kinds = [io::ErrorKind::NotFound, io::ErrorKind::NotADirectory];
    kinds.contains(&error.kind())
}

/// The failure of a command that was given a folder for a file.
fn folder(wanted: &Path) -> Failure {
    let name = shell::path(wanted);
    let (cause, remedy) = match is_run(wanted) {
        true => (
            "this is the folder of a run, and the command takes a clip or a motion",
            format!("use the run with `mimic replay {name}` or `mimic eval {name}`"),
        ),
        false => ("this is a folder", "name a file in it".to_owned()),
    };
    Failure::input(wanted, cause).with_remedy(remedy)
}

/// The same for commands that work on clips, and on what clips are made of.
pub fn clip(wanted: &Path, library: &Path, extensions: &[&str]) -> Outcome<PathBuf> {
    let found = file(wanted, library, extensions)?;
    if has_extension(&found, "motion") {
        return Err(
            Failure::input(&found, "this is a motion, not a clip").with_remedy(
                "give the clip that it was made from, or show the motion with `mimic tracks`",
            ),
        );
    }
    Ok(found)
}

/// The file of the library called `name` without its extension, which some systems write in capitals.
fn named(name: &Path, library: &Path, extensions: &[&str]) -> Option<PathBuf> {
    let called = |path: &PathBuf| path.is_file() && path.file_stem() == name.file_name();
    let mut files: Vec<_> = entries(library).filter(called).collect();
    files.sort();
    let mut wanted = extensions.iter();
    wanted.find_map(|e| files.iter().find(|path| has_extension(path, e)).cloned())
}

/// The file that `wanted` means. Left out, the newest file with the extension `newest` in this folder or in the library;
/// that is one of our own formats, so that no stray text file is taken for a clip.
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
        let cause = format!(
            "no file was given, and there is no `.{newest}` file in this folder or in the library `{library}`"
        );
        Failure::user(cause).with_remedy("name a file")
    })
}

/// The folder of the run that `wanted` means: a path, or a name in `runs/`. Left out, the newest run.
pub fn run(wanted: Option<&Path>) -> Outcome<PathBuf> {
    match wanted {
        Some(wanted) => match existing_run(wanted) {
            Some(run) => Ok(run),
            None => {
                for place in places(wanted) {
                    is_there(&place.join(files::CONFIG))?;
                }
                Err(absent_run(wanted))
            }
        },
        None => {
            // What can't be listed may well hold runs.
            if let Err(e) = fs::read_dir(RUNS) {
                is_there_by(Path::new(RUNS), Err(e))?;
            }
            newest_run().ok_or_else(no_run)
        }
    }
}

/// The failure of a command that takes the newest run, where none was saved.
fn no_run() -> Failure {
    let begun = runs(Path::new(RUNS)).into_iter().find(|path| is_run(path));
    match begun {
        Some(run) => Failure::input(&run, "nothing was saved of this run yet")
            .with_remedy("wait for the end of its first round, or resume its training"),
        None => Failure::user(format!("there is no run in `{RUNS}/`"))
            .with_remedy("make one with `mimic train CLIP`"),
    }
}

/// The run that `wanted` means, if there is one.
pub fn existing_run(wanted: &Path) -> Option<PathBuf> {
    places(wanted).find(|path| is_run(path))
}

/// Where the run may be that `wanted` means.
fn places(wanted: &Path) -> impl Iterator<Item = PathBuf> {
    let named = is_name(wanted).then(|| Path::new(RUNS).join(wanted));
    std::iter::once(wanted.to_path_buf()).chain(named)
}

/// Whether a folder holds a run.
pub fn is_run(path: &Path) -> bool {
    path.join(files::CONFIG).is_file()
}

/// The runs in a folder, by name, what is left of runs: folders with any of a run's own files in it, and what will be one.
pub fn runs(folder: &Path) -> Vec<PathBuf> {
    let own = [
        files::CONFIG,
        files::CHECKPOINT,
        files::POLICY,
        files::METRICS,
    ];
    let is_closed = |path: &Path| {
        let looked = fs::metadata(path.join(files::CONFIG));
        looked.is_err_and(|e| e.kind() == io::ErrorKind::PermissionDenied)
    };
    let holds = |path: &PathBuf| {
        let has_own = own.iter().any(|file| path.join(file).exists());
        has_own || is_closed(path) || Lock::holder(path).is_some()
    };
    let mut found: Vec<PathBuf> = entries(folder).filter(holds).collect();
    found.sort();
    found
}

/// The names that stand for files of the library, in order.
pub fn names(library: &Path, extensions: &[&str]) -> Vec<String> {
    let fits = |path: &PathBuf| extensions.iter().any(|e| has_extension(path, e));
    let files = entries(library).filter(fits);
    let names = files.filter_map(|path| Some(path.file_stem()?.to_string_lossy().into_owned()));
    let mut names: Vec<String> = names.collect();
    names.sort();
    names.dedup();
    names
}

/// When a run learned last; before its first checkpoint, when it was made.
pub fn run_time(run: &Path) -> Option<SystemTime> {
    let files = [files::CHECKPOINT, files::METRICS, files::CONFIG];
    files.iter().find_map(|file| modified(&run.join(file)))
}

/// The run in `runs/` that learned last. One that was never saved has nothing to show.
pub fn newest_run() -> Option<PathBuf> {
    let learned = |path: &PathBuf| modified(&path.join(files::CHECKPOINT));
    let runs = entries(Path::new(RUNS)).filter(|path| is_run(path));
    let runs = runs.filter_map(|path| Some((learned(&path)?, path)));
    runs.max().map(|(_, path)| path)
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

/// Whether a file has this extension, in whatever case.
pub fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

fn modified(path: &Path) -> Option<SystemTime> {
    fs::metadata(path).and_then(|m| m.modified()).ok()
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    entries.filter_map(|entry| Some(entry.ok()?.path()))
}

/// Whether a path is a single name, which may stand for a file of the library or a run.
fn is_name(path: &Path) -> bool {
    path.components().count() == 1 && path.file_name().is_some()
}

fn absent(wanted: &Path, library: &Path, extensions: &[&str]) -> Failure {
    let fits = |path: &PathBuf| extensions.iter().any(|e| has_extension(path, e));
    let beside = beside(wanted).filter(fits);
    if !is_name(wanted) {
        let near = meant(wanted, beside);
        return Failure::input(wanted, "no such file")
            .with_remedy(near.unwrap_or_else(|| "check the path".to_owned()));
    }
    let known: Vec<PathBuf> = entries(library).filter(fits).collect();
    let names = known
        .iter()
        .filter_map(|path| Some(path.file_stem()?.into()));
    let near = meant(wanted, beside.chain(names));
    let cause = format!(
        "no such file here, nor one of that name in the library `{}`",
        library.display()
    );
    let remedy = match (near, listing(known.into_iter())) {
        (Some(near), _) => near,
        (None, Some(known)) => format!("give a path, or a name from the library: {known}"),
        (None, None) => "give a path, or the folder of your clips with `--library DIR`".into(),
    };
    Failure::input(wanted, cause).with_remedy(remedy)
}

/// The failure of a command whose run doesn't exist.
pub fn absent_run(wanted: &Path) -> Failure {
    let runs: Vec<PathBuf> = runs(Path::new(RUNS))
        .into_iter()
        .filter(|path| is_run(path))
        .collect();
    let names = runs
        .iter()
        .filter_map(|path| Some(path.file_name()?.into()));
    let near = match is_name(wanted) {
        true => meant(
            wanted,
            names.chain(beside(wanted).filter(|path| is_run(path))),
        ),
        false => meant(wanted, beside(wanted).filter(|path| is_run(path))),
    };
    let remedy = match (near, listing(runs.iter().cloned())) {
        (Some(near), _) => near,
        (None, Some(known)) => format!("choose one of the runs: {known}"),
        (None, None) => "make a run with `mimic train CLIP`".into(),
    };
    let cause = match wanted.is_file() {
        true => "this is a file, and a run is a folder".to_owned(),
        false if is_name(wanted) => {
            format!("there is no run of this name, neither here nor in `{RUNS}/`")
        }
        false if wanted.is_dir() => "there is no run in this folder".to_owned(),
        false => "there is no such folder".to_owned(),
    };
    Failure::input(wanted, cause).with_remedy(remedy)
}

/// The failure of a command that takes runs beside files, and whose input is neither: a run that was probably meant counts
/// more than a file.
pub fn or_run(wanted: Option<&Path>, failure: Failure) -> Failure {
    let absent = wanted.filter(|wanted| is_name(wanted) && !wanted.exists());
    let runs = runs(Path::new(RUNS)).into_iter();
    let names = runs.filter_map(|path| path.file_name().map(PathBuf::from));
    match absent.and_then(|wanted| meant(wanted, names)) {
        Some(meant) => failure.with_remedy(meant),
        None => failure,
    }
}

/// What was probably meant by a preset that doesn't exist: one of these names, a plan in a file, or a run.
pub fn meant_preset(
    wanted: &Path,
    names: impl IntoIterator<Item = &'static str>,
) -> Option<String> {
    let files = beside(wanted).filter(|path| has_extension(path, "json") || is_run(path));
    let runs = runs(Path::new(RUNS))
        .into_iter()
        .filter(|path| is_run(path));
    let runs = runs.filter_map(|path| path.file_name().map(PathBuf::from));
    let names = names.into_iter().map(PathBuf::from);
    meant(wanted, names.chain(runs).chain(files))
}

/// The question whether a file of this kind beside `wanted`, which doesn't exist, was meant.
pub fn meant_file(wanted: &Path, extension: &str) -> Option<String> {
    if wanted.exists() {
        return None;
    }
    meant(
        wanted,
        beside(wanted).filter(|path| has_extension(path, extension)),
    )
}

/// What lies where `wanted` was looked for, as paths that can be typed.
fn beside(wanted: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    let folder = wanted.parent().unwrap_or(Path::new("")).to_path_buf();
    let read = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => &folder,
    };
    let entries = entries(read).take(MOST_COMPARED);
    entries.filter_map(move |path| Some(folder.join(path.file_name()?)))
}

/// The question whether the most similar of these paths was meant; their folders are that of `wanted`, or are left out.
fn meant(wanted: &Path, known: impl Iterator<Item = PathBuf>) -> Option<String> {
    let name = wanted.file_name()?.to_string_lossy();
    let found = mimic::explain::meant_file(&name, known)?;
    Some(format!("did you mean `{}`?", found.display()))
}

/// The first few names of files or folders, without extensions, in a sentence.
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
