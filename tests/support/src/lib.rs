//! What the tests of the library and of the command line share: where clips by other people are, and how a test
//! says that it was skipped.
//!
//! Both lines below start with `skipped`; `.ci/run` counts them and fails on those of [`foreign`] where the folder of
//! clips is there. They are written to the standard error stream itself, because the test runner keeps what
//! `eprintln!` prints in a test that passes.

use std::io::Write;
use std::path::{Path, PathBuf};

/// Path of a file or folder of the collection of clips that may lie beside the repository, named relative to it. The
/// licences of these clips keep them out of the repository.
///
/// `None`, with a line that `.ci/run` counts, where it is missing: the test then passes without having tested it.
pub fn foreign(name: &str) -> Option<PathBuf> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let repository = here.ancestors().nth(2).unwrap_or(here);
    let path = repository.join("../shared/data").join(name);
    if path.exists() {
        return Some(path);
    }
    say(&format!("skipped for want of data, ../shared/data/{name}"));
    None
}

/// Says that the running test is skipped for want of something other than data, such as a program.
pub fn skip(reason: &str) {
    say(&format!("skipped, {reason}"));
}

/// Writes a line that names the running test: the runner names each test's thread after it.
fn say(what: &str) {
    let thread = std::thread::current();
    let line = format!("{what}: {}\n", thread.name().unwrap_or("a test"));
    // One write, so that lines of tests that run at the same time don't mix. Nobody is left to tell if it fails.
    let _ = std::io::stderr().write_all(line.as_bytes());
}
