//! Where results are written, and what they never replace.

mod form;
mod maker;

pub use form::Form;
#[cfg(feature = "rerun")]
pub use form::recording_id;
pub use maker::Maker;

use crate::failure::{Failure, Outcome};
use crate::locate;
use maker::Mark;
use mimic::file::Unfinished;
use mimic::run::files;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file that a command writes as a whole or not at all.
///
/// It takes the place of a file that the same command made from the same inputs, even with other options: that is how
/// people work on a result. Of any other file it does with `--force` alone, and never of an input. A file that holds the
/// same already stays.
pub struct Output {
    path: PathBuf,
    form: Form,
    maker: Maker,
    /// The flag that names it.
    flag: &'static str,
    force: bool,
}

impl Output {
    /// With the path of `flag`, or one that follows from it.
    pub fn new(path: PathBuf, form: Form, maker: Maker, flag: &'static str, force: bool) -> Self {
        Self {
            path,
            form,
            maker,
            flag,
            force,
        }
    }

    /// Where it is written.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Refuses, before the work, what would be refused after it. Creates nothing.
    pub fn check(&self) -> Outcome {
        self.spare_inputs()?;
        self.check_name()?;
        let path = &self.path;
        if path.exists() && !path.is_file() {
            let cause = "this is not a file of the disk that could be replaced";
            return Err(Failure::input(path, cause).with_remedy(self.elsewhere()));
        }
        self.spare_run()?;
        let is_clear = self.force || !is_taken(path) || !self.form.is_judged_by_mark();
        match is_clear || self.is_ours(self.mark().as_ref()) {
            true => Ok(()),
            false => Err(self.refused()),
        }
    }

    /// Writes these bytes, which may hold what made them.
    pub fn write(&self, bytes: impl FnOnce(Option<&str>) -> Outcome<Vec<u8>>) -> Outcome {
        let made = self.make_folder()?;
        let written = self.write_here(bytes);
        if written.is_err() {
            unmake(&made);
        }
        written
    }

    fn write_here(&self, bytes: impl FnOnce(Option<&str>) -> Outcome<Vec<u8>>) -> Outcome {
        self.check()?;
        let mark = self.mark();
        let text = mark.as_ref().map(Mark::to_string);
        let bytes = bytes(text.as_deref())?;
        // Before anything else: this tidies the folder, too.
        let mut file = Unfinished::beside(&self.path).map_err(|e| self.unwritten(e))?;
        if is_taken(&self.path) && self.form.holds(&self.path, &bytes) {
            return Ok(());
        }
        let written = file.file().write_all(&bytes);
        written.map_err(|e| self.unwritten(e))?;
        self.settle(file, mark.as_ref())
    }

    /// Writes a text, with what made it where the form has a place for that.
    pub fn write_text(&self, text: &str) -> Outcome {
        self.write(|mark| {
            let text = match mark {
                Some(mark) => self.form.marked(text, mark),
                None => text.to_owned(),
            };
            Ok(text.into_bytes())
        })
    }

    /// Gives the file its name. A file that appeared there since the check is refused as it would have been then.
    fn settle(&self, file: Unfinished, mark: Option<&Mark>) -> Outcome {
        if self.force || self.is_ours(mark) {
            return file.replace().map_err(|e| self.unwritten(e));
        }
        file.create().map_err(|e| match e.kind() {
            io::ErrorKind::AlreadyExists => self.refused(),
            _ => self.unwritten(e),
        })
    }

    fn make_folder(&self) -> Outcome<Vec<PathBuf>> {
        let folder = self.path.parent().filter(|f| !f.as_os_str().is_empty());
        match folder {
            Some(folder) => make_folder(folder),
            None => Ok(Vec::new()),
        }
    }

    fn mark(&self) -> Option<Mark> {
        self.maker.mark(&self.path)
    }

    /// Whether what is there says that the same command made it.
    fn is_ours(&self, mark: Option<&Mark>) -> bool {
        mark.is_some_and(|mark| self.form.is_marked_with(&self.path, mark))
    }

    /// Refuses a name that says the file is something else.
    fn check_name(&self) -> Outcome {
        let (path, extension) = (&self.path, self.form.extension());
        if path.is_dir() {
            let flag = self.flag_in_ticks();
            let remedy = format!("name a file in it with {flag}, such as `NAME.{extension}`");
            return Err(Failure::input(path, "this is a folder").with_remedy(remedy));
        }
        if locate::has_extension(path, extension) {
            return Ok(());
        }
        let cause = match is_taken(path) {
            true => format!("this exists already and is not a `.{extension}` file"),
            false => format!("{} is written as a `.{extension}` file", self.form.what()),
        };
        let remedy = format!("end the name of {} in `.{extension}`", self.flag_in_ticks());
        Err(Failure::input(path, cause).with_remedy(remedy))
    }

    fn spare_inputs(&self) -> Outcome {
        let own = self.path.canonicalize();
        let is_own =
            |input: &Path| matches!((&own, input.canonicalize()), (Ok(a), Ok(b)) if *a == b);
        match self.maker.inputs().any(is_own) {
            true => Err(Failure::input(&self.path, "this is the input itself")
                .with_remedy(self.elsewhere())),
            false => Ok(()),
        }
    }

    /// Refuses to write one of the files that a run is made of. No force helps: the run would be lost.
    fn spare_run(&self) -> Outcome {
        let folder = self.path.parent().filter(|f| !f.as_os_str().is_empty());
        let is_run = locate::is_run(folder.unwrap_or(Path::new(".")));
        match self
            .path
            .file_name()
            .filter(|name| is_run && files::is_own(name))
        {
            Some(_) => {
                Err(Failure::input(&self.path, "this is a file of a run")
                    .with_remedy(self.elsewhere()))
            }
            None => Ok(()),
        }
    }

    fn refused(&self) -> Failure {
        let cause = format!("this exists already, and it is not {}", self.maker.what());
        let remedy = format!("{}, or replace this one with `--force`", self.elsewhere());
        Failure::input(&self.path, cause).with_remedy(remedy)
    }

    fn unwritten(&self, cause: io::Error) -> Failure {
        Failure::write(&self.path, cause)
    }

    fn elsewhere(&self) -> String {
        let extension = self.form.extension();
        format!(
            "write to another file with `{} FILE.{extension}`",
            self.flag
        )
    }

    fn flag_in_ticks(&self) -> String {
        format!("`{}`", self.flag)
    }
}

/// Whether anything has this name, be it a link that leads nowhere.
fn is_taken(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// Makes a folder for results, and those that it is in. Returns those that weren't there, the innermost first.
pub fn make_folder(folder: &Path) -> Outcome<Vec<PathBuf>> {
    let is_named = |path: &&Path| !path.as_os_str().is_empty();
    let missing = folder.ancestors().filter(is_named);
    let missing: Vec<PathBuf> = missing
        .take_while(|path| !path.is_dir())
        .map(Path::to_owned)
        .collect();
    // A file in the way, a pipe, or a link that leads nowhere.
    if let Some(taken) = missing.iter().find(|path| is_taken(path)) {
        let cause = match taken.is_file() {
            true => "this is a file, and the result needs a folder",
            false => "this is not a folder, and the result needs one",
        };
        return Err(
            Failure::input(taken, cause).with_remedy("name another folder with `--out FOLDER/`")
        );
    }
    std::fs::create_dir_all(folder).map_err(|e| {
        unmake(&missing);
        Failure::write(folder, e)
    })?;
    Ok(missing)
}

/// Removes folders that were made for what couldn't be written. Those with something in them stay.
pub fn unmake(made: &[PathBuf]) {
    for folder in made {
        std::fs::remove_dir(folder).ok();
    }
}

/// Path of a result: the file that `--out` names, or `NAME.EXTENSION` in the folder that it names, or in this folder.
pub fn result_path(out: Option<&Path>, name: &str, form: Form) -> PathBuf {
    let file = format!("{}.{}", safe_name(name), form.extension());
    match out {
        Some(out) if names_folder(out) => out.join(file),
        Some(out) => out.to_path_buf(),
        None => PathBuf::from(file),
    }
}

/// Whether `--out` means a folder: one that exists, or a path that ends in a slash.
pub fn names_folder(out: &Path) -> bool {
    out.is_dir() || out.as_os_str().to_string_lossy().ends_with('/')
}

/// A name from a file, such as that of a take, as a file name that every system takes.
pub fn safe_name(name: &str) -> String {
    let clean = |c: char| {
        if c.is_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '-'
        }
    };
    let name: String = name.chars().map(clean).collect();
    let name = name.trim_matches(['-', '.']);
    if name.is_empty() {
        "clip".into()
    } else {
        name.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_file_names() {
        assert_eq!(safe_name("mixamo.com|Take 001"), "mixamo.com-Take-001");
        assert_eq!(safe_name("../../x"), "x");
        assert_eq!(safe_name("…/"), "clip");
    }

    #[test]
    fn out_is_a_file_or_a_folder() {
        let path = |out: &str| result_path(Some(Path::new(out)), "kick", Form::Clip);
        assert_eq!(path("a/b.clip"), Path::new("a/b.clip"));
        assert_eq!(path("a/"), Path::new("a/kick.clip"));
        let here = result_path(None, "kick", Form::Clip);
        assert_eq!(here, Path::new("kick.clip"));
    }
}
