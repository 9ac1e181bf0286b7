//! What could stand in an argument: names of runs, clips, takes, characters, presets, settings.

use crate::locate;
use crate::verbs::train;
use clap_complete::engine::{
    ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter,
};
use mimic::humanoid::Slot;
use mimic::import;
use mimic::run::PRESETS;
use mimic::skeleton::Skeleton;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Largest file that is read for the names of its takes, bytes: the answer has to come while somebody types.
const MOST_BYTES: u64 = 64 << 20;

/// Where names come from.
#[derive(Clone, Copy)]
pub enum Source {
    Runs,
    RunsAndAnimations,
    Animations,
    Clips,
    Takes,
    Skeletons,
    Presets,
    Settings,
    Slots,
    Maps,
}

impl Source {
    /// The same for clap.
    pub fn completer(self) -> ArgValueCompleter {
        ArgValueCompleter::new(move |typed: &OsStr| self.candidates(typed))
    }

    fn candidates(self, typed: &OsStr) -> Vec<CompletionCandidate> {
        let named = match self {
            Self::Runs => runs(),
            Self::RunsAndAnimations => runs()
                .into_iter()
                .chain(clips(&locate::ANIMATIONS))
                .collect(),
            Self::Animations => clips(&locate::ANIMATIONS),
            Self::Clips => clips(&locate::CLIPS),
            Self::Takes => takes(),
            Self::Skeletons => Skeleton::built_in().map(plain).collect(),
            Self::Presets => PRESETS.iter().map(preset).chain(runs()).collect(),
            Self::Settings => train::settings()
                .iter()
                .map(|path| plain(format!("{path}=")))
                .collect(),
            Self::Slots => Slot::ALL
                .map(|slot| plain(format!("{}=", slot.name())))
                .into(),
            Self::Maps => Vec::new(),
        };
        let start = typed.to_string_lossy();
        let fits = |c: &CompletionCandidate| c.get_value().to_string_lossy().starts_with(&*start);
        let mut found: Vec<_> = named.into_iter().filter(fits).collect();
        found.extend(
            self.files()
                .map(|files| files.complete(typed))
                .unwrap_or_default(),
        );
        found
    }

    /// The files that could stand there, and the folders that lead to them.
    fn files(self) -> Option<PathCompleter> {
        let extensions: &'static [&'static str] = match self {
            Self::RunsAndAnimations | Self::Animations => &locate::ANIMATIONS,
            Self::Clips => &locate::CLIPS,
            Self::Skeletons => &["xml"],
            Self::Presets | Self::Maps => &["json"],
            Self::Runs => &[],
            Self::Takes | Self::Settings | Self::Slots => return None,
        };
        let fits = move |path: &Path| {
            path.is_dir() || extensions.iter().any(|e| locate::has_extension(path, e))
        };
        Some(PathCompleter::any().filter(fits))
    }
}

fn plain(name: impl Into<String>) -> CompletionCandidate {
    CompletionCandidate::new(name.into())
}

fn preset(preset: &mimic::run::Preset) -> CompletionCandidate {
    plain(preset.name).help(Some(preset.about.into()))
}

/// Names of the runs in `runs/`.
fn runs() -> Vec<CompletionCandidate> {
    let runs = locate::runs(Path::new(locate::RUNS));
    let names = runs.iter().filter_map(|run| run.file_name()?.to_str());
    names.filter(|name| is_one_word(name)).map(plain).collect()
}

/// Names of the clips in the library.
fn clips(extensions: &[&str]) -> Vec<CompletionCandidate> {
    let names = locate::names(&library(), extensions);
    names
        .into_iter()
        .filter(|name| is_one_word(name))
        .map(plain)
        .collect()
}

/// The takes of the files on the line. One whose name the shell would take apart goes by its number.
fn takes() -> Vec<CompletionCandidate> {
    let library = library();
    let words = std::env::args_os().skip(1).map(PathBuf::from);
    let files = words.filter_map(|word| locate::file(&word, &library, &locate::SOURCES).ok());
    let small = |file: &PathBuf| std::fs::metadata(file).is_ok_and(|m| m.len() <= MOST_BYTES);
    let found = files
        .filter(small)
        .filter_map(|file| import::inspect(file).ok());
    let takes = found.flat_map(|found| found.takes.into_iter().enumerate());
    let take = |(at, take): (usize, import::TakeInfo)| match is_one_word(&take.name) {
        true => plain(take.name),
        false => {
            let shown = mimic::explain::plain(&take.name);
            plain((at + 1).to_string()).help(Some(shown.into()))
        }
    };
    takes.map(take).collect()
}

/// The library folder as in [`crate::cli::Cli`], from the words on the line.
fn library() -> PathBuf {
    let words: Vec<_> = std::env::args_os().collect();
    let given = words.windows(2).find(|pair| pair[0] == "--library");
    let given = given.map(|pair| pair[1].clone());
    let library = given.or_else(|| std::env::var_os("MIMIC_LIBRARY").filter(|v| !v.is_empty()));
    library.map_or_else(|| PathBuf::from(crate::cli::LIBRARY), PathBuf::from)
}

/// Whether shells take a name as it is, without quotes.
fn is_one_word(name: &str) -> bool {
    !name.is_empty()
        && name
            .chars()
            .all(|c| c.is_alphanumeric() || "-_.+".contains(c))
}
