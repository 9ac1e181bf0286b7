//! Reading: regular files only, and never more bytes than the caller can bear.

use crate::explain::Explanation;
use std::fmt;
use std::fs::{File, FileType, Metadata};
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// A folder in words.
const FOLDER: &str = "a folder";
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
    let (file, length) = open(path.as_ref(), most)?;
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX))?;
    // A file can grow meanwhile.
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        true => Err(too_large(most)),
        false => Ok(bytes),
    }
}

/// Opens the regular file `path`, if it has at most `most` bytes. Also returns how many it has.
fn open(path: &Path, most: u64) -> io::Result<(File, u64)> {
    let about = std::fs::metadata(path)?;
    if !about.is_file() {
        return Err(irregular(special(about.file_type())));
    }
    if about.len() > most {
        return Err(too_large(most));
    }
    if about.len() == 0 && is_of_the_system(&about) {
        return Err(irregular("a file of the system's own"));
    }
    Ok((File::open(path)?, about.len()))
}

/// The lines of the regular file `path`, if it has at most `most` bytes, one after the other: a file of many lines needn't be in
/// memory as a whole. `each` gets the number of a line, from 1, and its text without the end. A last line that has no end is left
/// out, for somebody may be writing it.
///
/// # Errors
/// As [`text_at_most`], a line of more than `longest` bytes, and those of `each`.
pub fn lines_at_most<E: From<io::Error>>(
    path: impl AsRef<Path>,
    most: u64,
    longest: u64,
    mut each: impl FnMut(usize, &str) -> Result<(), E>,
) -> Result<(), E> {
    let (file, _) = open(path.as_ref(), most)?;
    let mut reader = BufReader::new(file.take(most));
    let mut line = Vec::new();
    for number in 1.. {
        line.clear();
        reader.by_ref().take(longest).read_until(b'\n', &mut line)?;
        if line.pop_if(|byte| *byte == b'\n').is_none() {
            let is_long = line.len() as u64 == longest;
            return match is_long {
                true => Err(long_line(number, longest).into()),
                false => Ok(()),
            };
        }
        let text = std::str::from_utf8(&line).map_err(|_| {
            let cause = format!("line {number} is not UTF-8 text");
            refusal(io::ErrorKind::InvalidData, cause, "remove the line")
        })?;
        each(number, text)?;
    }
    Ok(())
}

fn long_line(number: usize, longest: u64) -> io::Error {
    let cause = format!("line {number} has more than {longest} bytes");
    refusal(io::ErrorKind::InvalidData, cause, "remove the line")
}

/// The first bytes of the regular file `path`, at most `most`.
///
/// # Errors
/// As [`read_at_most`], but for a file of many bytes.
pub fn start_of(path: impl AsRef<Path>, most: u64) -> io::Result<Vec<u8>> {
    let (file, _) = open(path.as_ref(), u64::MAX)?;
    let mut bytes = Vec::new();
    file.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
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

fn irregular(found: &str) -> io::Error {
    let kind = match found {
        FOLDER => io::ErrorKind::IsADirectory,
        _ => io::ErrorKind::InvalidInput,
    };
    let cause = format!("this is not a regular file, but {found}");
    refusal(kind, cause, "give the path of a file")
}

#[cfg(unix)]
fn special(found: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match found {
        found if found.is_dir() => FOLDER,
        found if found.is_fifo() => "a pipe",
        found if found.is_socket() => "a socket",
        _ => "a device",
    }
}

#[cfg(not(unix))]
fn special(found: FileType) -> &'static str {
    if found.is_dir() { FOLDER } else { "a device" }
}

/// Whether a file that says it is empty is made up by the system as it is read, as those of `/proc` are: reading some of them waits
/// for what may never come.
#[cfg(target_os = "linux")]
fn is_of_the_system(about: &Metadata) -> bool {
    use std::os::linux::fs::MetadataExt;
    let devices = ["/proc", "/sys", "/sys/kernel/debug", "/sys/kernel/tracing"];
    let device = |path: &str| std::fs::metadata(path).ok().map(|folder| folder.st_dev());
    let mut devices = devices.into_iter().filter_map(device);
    devices.any(|device| device == about.st_dev())
}

#[cfg(not(target_os = "linux"))]
fn is_of_the_system(_: &Metadata) -> bool {
    false
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

    /// The system's own files say that they have no bytes, and some have one when something happens.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_that_the_system_makes_up_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let link = folder.path().join("link.bvh");
        for path in ["/proc/self/maps", "/proc/kmsg", "/proc/version"] {
            std::os::unix::fs::symlink(path, &link).expect("a link");
            for path in [Path::new(path), &link] {
                let said = refused(path, 1 << 24);
                assert!(said.contains("a file of the system's own"), "{said}");
            }
            std::fs::remove_file(&link).expect("removed");
        }
        let empty = folder.path().join("empty");
        std::fs::write(&empty, "").expect("written");
        assert_eq!(read_at_most(&empty, 1).expect("it is empty"), b"");
    }

    #[test]
    fn lines_are_read_one_by_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("lines");
        let read = |text: &[u8], longest| {
            std::fs::write(&path, text).expect("written");
            let mut lines = Vec::new();
            let each = |number, line: &str| {
                lines.push(format!("{number}{line}"));
                Ok::<(), io::Error>(())
            };
            let read = lines_at_most(&path, 100, longest, each);
            read.map(|()| lines).map_err(|e| unread(&e).to_string())
        };
        let lines = |lines: &[&str]| Ok(lines.iter().map(|line| (*line).to_owned()).collect());
        assert_eq!(read(b"", 9), lines(&[]));
        assert_eq!(read(b"a\n\nbc\nhalf", 9), lines(&["1a", "2", "3bc"]));
        assert_eq!(read(b"abcd\n", 5), lines(&["1abcd"]));
        let long = "line 2 has more than 5 bytes; remove the line".to_owned();
        assert_eq!(read(b"a\nabcde\n", 5), Err(long));
        assert!(read(b"\xff\n", 5).is_err_and(|said| said.contains("not UTF-8")));
        assert!(read(&[b'\n'; 101], 5).is_err_and(|said| said.contains("100 bytes")));
    }
}
