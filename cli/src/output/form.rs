//! The forms of results, and where each says what made it.

use super::maker::Mark;
use mimic::file::read_at_most;
use sha2::{Digest, Sha256};
use std::path::Path;

/// What a result is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A clip.
    Clip,
    /// A motion.
    Motion,
    /// A drawing of tracks or of curves.
    Drawing,
    /// An evaluation, as `--json` prints it. That of an agent that learned on is another, so it bears no mark.
    Evaluation,
    /// A recording for the viewer.
    Recording,
    /// A page of the manual.
    Page,
    /// Comma-separated values, which have no place for what made them.
    Table,
    /// A joint map. It is for people to edit, so nothing else stands in it.
    Map,
}

/// Where a text says what made it: a line of its own after the first, between these.
type Frame = (&'static str, &'static str);

/// Most bytes of a text that is looked at. Chosen: a drawing has a thousandth of that.
const MOST_TEXT: u64 = 64 << 20;
/// Bytes at the start of a recording that hold its id. Chosen: it stands in the first message, after some hundred bytes.
const HEAD: u64 = 4096;

impl Form {
    /// What its file's name ends in.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Clip => "clip",
            Self::Motion => "motion",
            Self::Drawing => "svg",
            Self::Evaluation | Self::Map => "json",
            Self::Recording => "rrd",
            Self::Page => "1",
            Self::Table => "csv",
        }
    }

    /// Its name, with an article.
    pub fn what(self) -> &'static str {
        match self {
            Self::Clip => "a clip",
            Self::Motion => "a motion",
            Self::Drawing => "a drawing",
            Self::Evaluation => "an evaluation",
            Self::Recording => "a recording",
            Self::Page => "a manual page",
            Self::Table => "a table",
            Self::Map => "a joint map",
        }
    }

    /// Whether the file at `path` may be replaced is clear before there is anything to write: by its mark alone.
    pub fn is_judged_by_mark(self) -> bool {
        matches!(self, Self::Drawing | Self::Recording | Self::Page)
    }

    /// Whether the file at `path` holds the same as these bytes, so that nothing is lost with it.
    pub fn holds(self, path: &Path, bytes: &[u8]) -> bool {
        match self {
            Self::Clip | Self::Motion => mimic::file::holds(path, bytes),
            _ => read_at_most(path, bytes.len() as u64).is_ok_and(|old| old == bytes),
        }
    }

    fn frame(self) -> Option<Frame> {
        match self {
            Self::Drawing => Some(("<!-- made: ", " -->")),
            Self::Page => Some((".\\\" made: ", "")),
            _ => None,
        }
    }

    /// The text with the mark of its maker, and a digest by which changes show.
    pub fn marked(self, text: &str, mark: &str) -> String {
        let (Some((open, close)), Some((first, rest))) = (self.frame(), text.split_once('\n'))
        else {
            return text.to_owned();
        };
        let digest = digest(first, rest);
        format!("{first}\n{open}{mark} {digest}{close}\n{rest}")
    }

    /// Whether the file at `path` bears this mark, and is as it was when it got it.
    pub fn is_marked_with(self, path: &Path, mark: &Mark) -> bool {
        let found = match self {
            Self::Clip | Self::Motion => mimic::file::made_by(path),
            Self::Recording => mark_of_recording(path, mark),
            _ => self.mark_of_text(path),
        };
        found.is_some_and(|found| mark.fits(&found))
    }

    /// The mark of a text that nobody changed since.
    fn mark_of_text(self, path: &Path) -> Option<String> {
        let text = start(path, MOST_TEXT).and_then(|bytes| String::from_utf8(bytes).ok());
        let parts = text.as_deref().and_then(|text| {
            let (first, rest) = text.split_once('\n')?;
            let (made, rest) = rest.split_once('\n')?;
            Some((first, made, rest))
        });
        let ((open, close), (first, made, rest)) = (self.frame()?, parts?);
        let made = made.strip_prefix(open)?.strip_suffix(close)?;
        let (mark, stated) = made.split_once(' ')?;
        (stated == digest(first, rest)).then(|| mark.to_owned())
    }
}

/// The mark in a recording, if it is of the same maker.
fn mark_of_recording(path: &Path, mark: &Mark) -> Option<String> {
    let bytes = start(path, HEAD)?;
    let id = format!("{ID}{}", mark.maker());
    let at = bytes
        .windows(id.len())
        .position(|some| some == id.as_bytes())?;
    let found = bytes.get(at + ID.len()..)?.get(..mark.to_string().len())?;
    String::from_utf8(found.to_vec()).ok()
}

/// What the id of a recording begins with, which is where it says what made it.
#[cfg(feature = "rerun")]
pub fn recording_id(mark: &str) -> String {
    format!("{ID}{mark}-")
}

const ID: &str = "mimic-";

/// Of a text without the line of its mark.
fn digest(first: &str, rest: &str) -> String {
    let mut digest = Sha256::new();
    for part in [first, "\n", rest] {
        digest.update(part.as_bytes());
    }
    format!("{:x}", digest.finalize())
}

/// The first bytes of a file.
fn start(path: &Path, most: u64) -> Option<Vec<u8>> {
    mimic::file::start_of(path, most).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_keeps_its_mark_until_somebody_changes_it() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("text");
        for (form, text) in [
            (Form::Drawing, "<svg>\n<rect/>\n</svg>\n"),
            (Form::Page, ".TH mimic 1\n.SH NAME\n"),
        ] {
            let marked = form.marked(text, "a-b-c");
            let holds = |text: &str, mark: &str| {
                std::fs::write(&path, text).expect("written");
                form.mark_of_text(&path).as_deref() == Some(mark)
            };
            assert!(holds(&marked, "a-b-c"), "{marked}");
            assert!(
                !holds(&marked, "a-b-d") && !holds(text, "a-b-c"),
                "{marked}"
            );
            for (old, new) in [("1", "2"), ("rect", "path"), ("made", "mads")] {
                let changed = marked.replacen(old, new, 1);
                assert!(changed == marked || !holds(&changed, "a-b-c"), "{changed}");
            }
        }
        // What other programs read has nothing in it but what they expect.
        for form in [Form::Table, Form::Map, Form::Evaluation] {
            assert_eq!(form.marked("a\nb\n", "a-b-c"), "a\nb\n");
        }
    }
}
