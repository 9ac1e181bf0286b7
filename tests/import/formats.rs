//! The table of `docs/tried-files.md`: what becomes of every file of the collection that may lie beside the repository.
//!
//! `MIMIC_WRITE_DOCS=1` writes it. Without the feature `ufbx`, some of these files are refused and the table is another.

use mimic::explain::Explain;
use mimic::humanoid;
use mimic::import::{self, Inspection, Options};
use mimic_test_support::foreign;
use std::path::{Path, PathBuf};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/tried-files.md");
/// The table stands behind this line.
const MARK: &str = "<!-- Written by tests/import/formats.rs: MIMIC_WRITE_DOCS=1 -->\n";

/// All files below `folder`, in order. Buffers of glTF files go with these.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    let below = |path: PathBuf| match path.is_dir() {
        true => files(&path),
        false => vec![path],
    };
    let is_own = |path: &PathBuf| path.extension().is_none_or(|e| e != "bin" && e != "md");
    paths.into_iter().flat_map(below).filter(is_own).collect()
}

/// A message without its file, whose row it stands in.
fn reason(error: &impl Explain) -> String {
    let mut explanation = error.explain();
    explanation.file = None;
    explanation.to_string().replace('|', "\\|")
}

struct Row {
    text: String,
    /// Whether a clip could be read, and whether the joints are a humanoid's.
    is_read: bool,
    is_humanoid: bool,
}

fn row(path: &Path, folder: &Path) -> Row {
    let name = path.strip_prefix(folder).expect("it is inside").display();
    let look = match import::inspect(path) {
        Ok(look) => look,
        Err(error) => {
            let refused = reason(&error);
            return Row {
                text: format!("| `{name}` | | | | | refused: {refused} |\n"),
                is_read: false,
                is_humanoid: false,
            };
        }
    };
    let read = import::load(path, &Options::default());
    let became = match &read {
        Ok(clip) => format!("read, {} frames", clip.frames.len()),
        Err(error) => format!("refused: {}", reason(error)),
    };
    let (is_humanoid, humanoid) = humanoid_of(&look);
    let Inspection {
        format,
        takes,
        joints,
        ..
    } = look;
    Row {
        text: format!(
            "| `{name}` | {format} | {} | {} | {humanoid} | {became} |\n",
            takes.len(),
            joints.len()
        ),
        is_read: read.is_ok(),
        is_humanoid,
    }
}

fn humanoid_of(look: &Inspection) -> (bool, String) {
    match humanoid::map(&look.joints) {
        Ok(map) => (true, format!("yes, {} slots", map.matches.len())),
        Err(error) => (false, format!("no: {}", error.explain().cause)),
    }
}

fn table(folder: &Path) -> String {
    let rows: Vec<Row> = files(folder).iter().map(|path| row(path, folder)).collect();
    let count = |counts: fn(&Row) -> bool| rows.iter().filter(|row| counts(row)).count();
    let head = format!(
        "Of {} files, {} are read, {} of them as humanoids.\n\n\
        | file | format | takes | joints | humanoid | the default take |\n|---|---|---|---|---|---|\n",
        rows.len(),
        count(|row| row.is_read),
        count(|row| row.is_read && row.is_humanoid),
    );
    rows.iter().fold(head, |table, row| table + &row.text)
}

#[test]
fn the_page_says_what_becomes_of_every_file() {
    let Some(folder) = foreign("") else { return };
    let page = std::fs::read_to_string(PAGE).expect("the page");
    let (prose, written) = page.split_once(MARK).expect("the mark of the table");
    let table = table(&folder);
    if std::env::var_os("MIMIC_WRITE_DOCS").is_some_and(|set| set == "1") {
        std::fs::write(PAGE, format!("{prose}{MARK}{table}")).expect("it is written");
        return;
    }
    let differing = table.lines().zip(written.lines()).find(|(a, b)| a != b);
    assert_eq!(
        differing, None,
        "MIMIC_WRITE_DOCS=1 writes docs/tried-files.md anew"
    );
    assert_eq!(table, written);
}
