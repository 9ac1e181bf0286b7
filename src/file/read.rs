//! Reading: regular files only, and never more bytes than the caller can bear.

use crate::explain::Explanation;
use std::fmt;
use std::fs::{File, FileType};
use std::io::{self, Read};
use std::path::Path;

/// What to do about a file that the system doesn't let us read.
const CHECK: &str = "check the path and its permissions";

/// Why we don't read a file that the system would let us read.
#[derive(Debug)]
struct Refusal {
    cause: String,
    remedy: &'static str,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.cause)
    }
}

impl std::error::Error for Refusal {}

/// The bytes of the regular file `path`, if they are at most `most`.
///
/// A pipe, a socket or a device is refused before it is opened: opening a pipe waits for a writer, and a device can give
/// bytes without end. [`unread`] explains the error.
///
/// # Errors
/// What the system says, something else than a regular file, or more bytes than `most`.
pub fn read_at_most(path: impl AsRef<Path>, most: u64) -> io::Result<Vec<u8>> {
    let path = path.as_ref();
    let about = std::fs::metadata(path)?;
    if !about.is_file() {
        return Err(irregular(about.file_type()));
    }
    if about.len() > most {
        return Err(too_large(most));
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(about.len()).unwrap_or(usize::MAX))?;
    // A file can grow meanwhile, and some of the system's own files say that they are empty.
    let mut some = File::open(path)?.take(most.saturating_add(1));
    some.read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        true => Err(too_large(most)),
        false => Ok(bytes),
    }
}

/// The text of the regular file `path`, if it has at most `most` bytes.
///
/// # Errors
/// As [`read_at_most`], and bytes that aren't UTF-8.
pub fn text_at_most(path: impl AsRef<Path>, most: u64) -> io::Result<String> {
    let text = String::from_utf8(read_at_most(path, most)?);
    text.map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        refusal(
            io::ErrorKind::InvalidData,
            format!("byte {at} is not UTF-8 text"),
            "check that it is the right file, and save it as UTF-8",
        )
    })
}

/// Explains why a file couldn't be read: an error of [`read_at_most`], or the system's own.
pub fn unread(error: &io::Error) -> Explanation {
    let inner = error.get_ref();
    match inner.and_then(|inner| inner.downcast_ref::<Refusal>()) {
        Some(Refusal { cause, remedy }) => Explanation::input(cause).remedy(remedy),
        None => Explanation::input(format!("cannot be read ({error})")).remedy(CHECK),
    }
}

fn refusal(kind: io::ErrorKind, cause: String, remedy: &'static str) -> io::Error {
    io::Error::new(kind, Refusal { cause, remedy })
}

fn irregular(found: FileType) -> io::Error {
    let (kind, found) = match found.is_dir() {
        true => (io::ErrorKind::IsADirectory, "a folder"),
        false => (io::ErrorKind::InvalidInput, special(found)),
    };
    let cause = format!("this is not a regular file, but {found}");
    refusal(kind, cause, "give the path of a file")
}

#[cfg(unix)]
fn special(found: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match found {
        found if found.is_fifo() => "a pipe",
        found if found.is_socket() => "a socket",
        _ => "a device",
    }
}

#[cfg(not(unix))]
fn special(_: FileType) -> &'static str {
    "a device"
}

fn too_large(most: u64) -> io::Error {
    let cause =
        format!("the file has more than {most} bytes, the most that are read of such a file");
    let remedy = "check that it is the right file";
    refusal(io::ErrorKind::FileTooLarge, cause, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(path: impl AsRef<Path>, most: u64) -> String {
        let error = read_at_most(path, most).expect_err("it has to be refused");
        unread(&error).to_string()
    }

    #[test]
    fn a_file_is_read_up_to_its_bound() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("text");
        std::fs::write(&path, "seven b").expect("written");
        assert_eq!(read_at_most(&path, 7).expect("it fits"), b"seven b");
        assert_eq!(text_at_most(&path, 8).expect("it fits"), "seven b");
        assert_eq!(
            refused(&path, 6),
            "the file has more than 6 bytes, the most that are read of such a file; check that it is the right file"
        );
        std::fs::write(&path, b"ab\xff").expect("written");
        let error = text_at_most(&path, 8).expect_err("not a text");
        assert!(
            unread(&error).cause.contains("byte 2 is not UTF-8"),
            "{error}"
        );
        let missing = refused(folder.path().join("none"), 1);
        assert!(missing.starts_with("cannot be read ("), "{missing}");
        assert!(missing.ends_with(CHECK), "{missing}");
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_regular_file_is_refused_before_it_is_opened() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.is_ok_and(|status| status.success()));
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).expect("a socket");
        for (path, what) in [
            (folder.path(), "a folder"),
            (pipe.as_path(), "a pipe"),
            (socket.as_path(), "a socket"),
            (Path::new("/dev/zero"), "a device"),
        ] {
            let expected =
                format!("this is not a regular file, but {what}; give the path of a file");
            assert_eq!(refused(path, 1 << 20), expected);
        }
    }

    /// The system's own files say that they have no bytes.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_that_hides_its_size_is_bounded_while_it_is_read() {
        assert!(refused("/proc/self/maps", 8).contains("more than 8 bytes"));
        assert!(read_at_most("/proc/self/maps", 1 << 24).is_ok_and(|maps| maps.len() > 8));
    }
}
