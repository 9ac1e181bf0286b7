//! What makes a result.

use mimic::run::files;
use sha2::{Digest, Sha256};
use std::fmt;
use std::fs::File;
use std::io;
use std::iter::repeat_n;
use std::path::{Component, Path, PathBuf};

/// A verb, its inputs, and those of its options that make it another result instead of a better one.
pub struct Maker {
    verb: &'static str,
    inputs: Vec<PathBuf>,
    detail: String,
    /// What the detail is, in words that go on from "made".
    by: &'static str,
}

impl Maker {
    /// With these inputs, files or runs.
    pub fn new<I: AsRef<Path>>(verb: &'static str, inputs: impl IntoIterator<Item = I>) -> Self {
        let inputs = inputs.into_iter();
        Self {
            verb,
            inputs: inputs.map(|input| input.as_ref().to_owned()).collect(),
            detail: String::new(),
            by: "",
        }
    }

    /// With what else tells two results apart, such as the take of a file.
    pub fn with(self, detail: impl Into<String>) -> Self {
        let detail = detail.into();
        Self { detail, ..self }
    }

    /// With what the detail is: `" with the same edits"`.
    pub fn by(self, by: &'static str) -> Self {
        Self { by, ..self }
    }

    /// What it makes, in words: "what `mimic edit` made from `kick.clip` with the same edits".
    pub fn what(&self) -> String {
        let inputs: Vec<String> = self
            .inputs()
            .map(|input| format!("`{}`", input.display()))
            .collect();
        let from = match inputs.as_slice() {
            [] => String::new(),
            [one] => format!(" from {one}"),
            [one, two] => format!(" from {one} and {two}"),
            [one, more @ ..] => format!(" from {one} and {} others", more.len()),
        };
        format!("what `mimic {}` made{from}{}", self.verb, self.by)
    }

    /// The inputs.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.inputs.iter().map(PathBuf::as_path)
    }

    /// What a result at `path` says about its maker. `None` where folder or inputs can't be found.
    pub fn mark(&self, path: &Path) -> Option<Mark> {
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
        let [mut maker, mut origin, mut content] = [(); 3].map(|()| Parts::default());
        maker.add(self.verb.as_bytes());
        maker.add(self.detail.as_bytes());
        for input in &self.inputs {
            let input = input.canonicalize().ok()?;
            maker.add(relative(&folder, &input).as_os_str().as_encoded_bytes());
            origin.add(input.as_os_str().as_encoded_bytes());
            content.add(&held(&input));
        }
        Some(Mark([maker, origin, content].map(Parts::text)))
    }
}

/// What a result says about its maker, in digests, because a file that is handed on shouldn't tell the paths of a disk: the verb
/// with where its inputs are relative to the result; where they are on the disk; and what is in them.
#[derive(Debug, PartialEq)]
pub struct Mark([String; 3]);

impl Mark {
    /// The digest that no two makers share.
    pub fn maker(&self) -> &str {
        &self.0[0]
    }

    /// Whether a result with the mark `found` is of the same maker: the inputs are at the same place and were exported again,
    /// perhaps, or they are elsewhere, as both were moved, and hold the same. Namesakes in another folder are neither.
    pub fn fits(&self, found: &str) -> bool {
        let Self([maker, origin, content]) = self;
        match found.split('-').collect::<Vec<_>>()[..] {
            [by, at, held] => by == maker && (at == origin || held == content),
            _ => false,
        }
    }
}

impl fmt::Display for Mark {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0.join("-"))
    }
}

/// The digest of several pieces.
#[derive(Default)]
struct Parts(Sha256);

impl Parts {
    fn add(&mut self, bytes: &[u8]) {
        self.0.update((bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    fn text(self) -> String {
        format!("{:x}", self.0.finalize()).split_off(32)
    }
}

/// Digest of what is in an input: a file, or the files of a run that make it what it is. What can't be read counts as empty.
fn held(input: &Path) -> Vec<u8> {
    let files = match input.is_dir() {
        true => vec![input.join(files::CONFIG), input.join(files::POLICY)],
        false => vec![input.to_owned()],
    };
    let mut digest = Sha256::new();
    for file in files.iter().filter(|file| file.is_file()) {
        File::open(file)
            .and_then(|mut file| io::copy(&mut file, &mut digest))
            .ok();
    }
    digest.finalize().to_vec()
}

/// The way from one place to another; the other's whole path where there is none, as between two drives.
fn relative(from: &Path, to: &Path) -> PathBuf {
    let shared = from.components().zip(to.components());
    let shared = shared.take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return to.to_owned();
    }
    let up = from.components().count() - shared;
    let down = to.components().skip(shared);
    repeat_n(Component::ParentDir, up).chain(down).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_lead_up_and_down() {
        let way = |from: &str, to: &str| relative(Path::new(from), Path::new(to));
        assert_eq!(way("/a/b", "/a/b/kick.fbx"), Path::new("kick.fbx"));
        assert_eq!(
            way("/a/b/c", "/a/d/kick.fbx"),
            Path::new("../../d/kick.fbx")
        );
    }

    #[test]
    fn a_maker_says_what_it_makes() {
        let what = |inputs: &[&str]| Maker::new("plot", inputs).what();
        assert_eq!(what(&[]), "what `mimic plot` made");
        assert_eq!(what(&["a"]), "what `mimic plot` made from `a`");
        assert_eq!(what(&["a", "b"]), "what `mimic plot` made from `a` and `b`");
        assert_eq!(
            what(&["a", "b", "c"]),
            "what `mimic plot` made from `a` and 2 others"
        );
        let edit = Maker::new("edit", ["a"])
            .with("x")
            .by(" with the same edits");
        assert_eq!(
            edit.what(),
            "what `mimic edit` made from `a` with the same edits"
        );
    }

    #[test]
    fn a_mark_tells_makers_apart_and_stays_when_all_moves() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = |name: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(&path, name).expect("written");
            path
        };
        let mark = |verb, input: &PathBuf, detail: &str, out: &str| {
            let maker = Maker::new(verb, [input]).with(detail);
            maker.mark(&folder.path().join(out))
        };
        let (first, second) = (file("a/walk.bvh"), file("b/walk.bvh"));
        let moved = file("elsewhere/a/walk.bvh");
        let own = mark("import", &first, "", "walk.clip").expect("it exists");
        let same = |other: Option<Mark>| other.is_some_and(|other| other.fits(&own.to_string()));
        // Moved, but another one: each file holds its own name.
        assert!(!same(mark("import", &moved, "", "elsewhere/walk.clip")));
        std::fs::copy(&first, &moved).expect("copied");
        assert!(same(mark("import", &moved, "", "elsewhere/walk.clip")));
        assert!(!same(mark("import", &second, "", "walk.clip")));
        assert!(!same(mark("edit", &first, "", "walk.clip")));
        assert!(!same(mark("import", &first, "run", "walk.clip")));
        assert_eq!(mark("import", &first, "", "no/walk.clip"), None);
        std::fs::write(&first, "exported again").expect("written");
        assert!(same(mark("import", &first, "", "walk.clip")));
        for other in ["", "a-b", &own.to_string().replace('-', "")] {
            assert!(!own.fits(other), "{other}");
        }
    }
}
