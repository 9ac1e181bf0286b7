//! What makes a result.

use sha2::{Digest, Sha256};
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

    /// What a result at `path` says about its maker: a digest, because a file that is handed on shouldn't tell the paths of
    /// a disk. Inputs count by where they are relative to the result, so that both can move together, and not by what is in
    /// them: a clip that was exported again is the same source. `None` where folder or inputs can't be found.
    pub fn mark(&self, path: &Path) -> Option<String> {
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
        let mut digest = Sha256::new();
        let mut add = |bytes: &[u8]| {
            digest.update((bytes.len() as u64).to_le_bytes());
            digest.update(bytes);
        };
        add(self.verb.as_bytes());
        add(self.detail.as_bytes());
        for input in &self.inputs {
            let place = relative(&folder, &input.canonicalize().ok()?);
            add(place.as_os_str().as_encoded_bytes());
        }
        Some(format!("{:x}", digest.finalize()))
    }
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
        assert_eq!(own.len(), 64, "{own}");
        let same = |other: Option<String>| other.as_ref() == Some(&own);
        assert!(same(mark("import", &moved, "", "elsewhere/walk.clip")));
        assert!(!same(mark("import", &second, "", "walk.clip")));
        assert!(!same(mark("edit", &first, "", "walk.clip")));
        assert!(!same(mark("import", &first, "run", "walk.clip")));
        assert_eq!(mark("import", &first, "", "no/walk.clip"), None);
    }
}
