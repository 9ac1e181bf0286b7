//! Why a file couldn't be written, and who can mend that.

use crate::explain::Explanation;
use std::io;
use std::path::Path;

/// Most bytes that a name can have on the file systems that are in use.
const LONGEST_NAME: usize = 255;

/// Explains why the file `path` couldn't be written. What lies in its way is for the caller to move; a full disk isn't.
pub fn unwritten(path: &Path, error: &io::Error) -> Explanation {
    let told = match obstacle(path) {
        Some((cause, remedy)) => Explanation::input(cause).remedy(remedy),
        None => Explanation::work(format!("cannot be written ({error})"))
            .remedy("check the path, its permissions and the free space on the disk"),
    };
    told.file(path)
}

/// What keeps any file from having this path, and what to do about it.
fn obstacle(path: &Path) -> Option<(&'static str, &'static str)> {
    if path.iter().any(|name| name.len() > LONGEST_NAME) {
        return Some(("no file can have so long a name", "choose a shorter name"));
    }
    let found = path.symlink_metadata().ok()?;
    let away = "move it away, or remove it";
    match path.metadata() {
        Ok(about) if about.is_dir() => Some(("this is a folder, and a file belongs here", away)),
        Ok(about) if !about.is_file() => {
            Some(("this is not a regular file, and one belongs here", away))
        }
        Err(_) if found.is_symlink() => Some(("this is a link that leads to no file", away)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::Fault;

    #[test]
    fn what_lies_in_the_way_is_for_the_caller_to_move() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("eval.json")).expect("made");
        std::fs::write(path("whole.json"), "{}").expect("written");
        let told = |path: &Path| unwritten(path, &io::ErrorKind::StorageFull.into());
        let long = path(&"x".repeat(5000));
        for wrong in [path("eval.json"), long] {
            let told = told(&wrong);
            assert_eq!(
                (told.fault, told.file.as_ref()),
                (Fault::Input, Some(&wrong))
            );
            assert!(told.remedy.is_some());
        }
        for fine in [path("whole.json"), path("new.json")] {
            assert_eq!(told(&fine).fault, Fault::Work);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_a_circle_is_no_file() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("policy");
        std::os::unix::fs::symlink(&path, &path).expect("linked");
        let told = unwritten(&path, &io::ErrorKind::Other.into());
        assert_eq!(told.fault, Fault::Input);
        assert!(told.cause.contains("a link"), "{told}");
    }
}
