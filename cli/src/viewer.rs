//! The rerun viewer, a program of its own: finding, starting and reaching it.

use crate::failure::{Failure, Outcome};
use std::fmt::Display;
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Version of the recordings that we write. A viewer reads recordings of its own version best.
pub const VERSION: &str = "0.36.3";

/// Where a viewer listens unless told otherwise: this machine, and rerun's own default port.
const PLACE: ([u8; 4], u16) = ([127, 0, 0, 1], 9876);

/// How long a viewer may take to answer. Chosen: a network round trip takes well below a second.
const PATIENCE: Duration = Duration::from_secs(3);
/// How long a viewer may take to start. Chosen: a first start on a busy machine takes several seconds.
const START: Duration = Duration::from_secs(15);

/// An installed viewer.
pub struct Viewer {
    path: PathBuf,
    /// The version it states; `None` where it states none.
    pub version: Option<String>,
}

impl Viewer {
    /// The `rerun` program on the search path.
    pub fn find() -> Option<Self> {
        let program = format!("rerun{}", std::env::consts::EXE_SUFFIX);
        let path = std::env::split_paths(&std::env::var_os("PATH")?)
            .map(|folder| folder.join(&program))
            .find(|path| path.is_file())?;
        let version = stated_version(&path);
        Some(Self { path, version })
    }

    /// The viewer, or a failure that says how to get one.
    pub fn require() -> Outcome<Self> {
        Self::find().ok_or_else(|| {
            Failure::work("the rerun viewer is not installed").with_remedy(format!(
                "{}, or write the recording to a file with `--save out.rrd`",
                install()
            ))
        })
    }

    /// Where it is installed.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it has the version of our recordings.
    pub fn fits(&self) -> bool {
        self.version.as_deref() == Some(VERSION)
    }

    /// Opens a window that stays open after this program ends, or finds one that is open already. Returns its address.
    pub fn open(&self) -> Outcome<String> {
        let place = SocketAddr::from(PLACE);
        if !answers(place) {
            let mut viewer = self.start(place.port())?;
            self.await_answer(place, &mut viewer)?;
        }
        Ok(address(&place.to_string()))
    }

    /// Starts the viewer with its streams closed: a program that reads ours would otherwise wait for the viewer's end.
    fn start(&self, port: u16) -> Outcome<Child> {
        let mut command = Command::new(&self.path);
        command
            .arg(format!("--port={port}"))
            .args(["--expect-data-soon", "--hide-welcome-screen"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        // In a process group of its own, so that a Ctrl-C for this program leaves the window open.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        command.spawn().map_err(|e| self.broken(e))
    }

    /// Waits until the viewer listens. The program that was started may be a launcher, which ends well before that.
    fn await_answer(&self, place: SocketAddr, viewer: &mut Child) -> Outcome {
        let begun = Instant::now();
        while begun.elapsed() < START {
            if answers(place) {
                return Ok(());
            }
            let ended = viewer.try_wait().map_err(|e| self.broken(e))?;
            if let Some(status) = ended.filter(|status| !status.success()) {
                return Err(self.ended(status));
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        let seconds = START.as_secs();
        Err(self.broken(format!("it does not listen at `{place}` after {seconds} s")))
    }

    /// Serves a recording to web browsers until it is stopped. What the viewer prints goes to standard error, so that
    /// standard output holds nothing but our result.
    pub fn serve(&self, recording: &Path) -> Outcome {
        let stopped = Arc::new(AtomicBool::new(false));
        let flag = stopped.clone();
        // Ctrl-C reaches both programs. It ends the viewer; we stay to remove the temporary file.
        ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).ok();
        let mut command = Command::new(&self.path);
        command
            .arg("--serve-web")
            .arg(recording)
            .stdin(Stdio::null())
            .stdout(std::io::stderr());
        let status = command.status().map_err(|e| self.broken(e))?;
        if status.success() || interrupted(status) || stopped.load(Ordering::Relaxed) {
            return Ok(());
        }
        Err(self.ended(status))
    }

    fn ended(&self, status: ExitStatus) -> Failure {
        let path = self.path.display();
        Failure::work(format!("the viewer `{path}` ended with {status}")).with_remedy(
            "start it by itself to see why, or write the recording to a file with `--save`",
        )
    }

    fn broken(&self, cause: impl Display) -> Failure {
        Failure::work(format!(
            "cannot start the viewer `{}`: {cause}",
            self.path.display()
        ))
        .with_remedy("write the recording to a file with `--save`")
    }
}

fn answers(place: SocketAddr) -> bool {
    TcpStream::connect_timeout(&place, PATIENCE).is_ok()
}

/// Whether a program was ended by Ctrl-C. Our own handler may not have run yet.
#[cfg(unix)]
fn interrupted(status: ExitStatus) -> bool {
    const SIGINT: i32 = 2;
    let signal = std::os::unix::process::ExitStatusExt::signal(&status);
    signal == Some(SIGINT) || status.code() == Some(128 + SIGINT)
}

#[cfg(not(unix))]
fn interrupted(_: ExitStatus) -> bool {
    false
}

/// Address of a viewer that listens at `host:port`. A whole address stays as it is.
pub fn address(place: &str) -> String {
    if place.contains("://") {
        place.to_string()
    } else {
        format!("rerun+http://{place}/proxy")
    }
}

/// Fails where no viewer listens at `address`: sending would wait for one for ever.
pub fn reach(address: &str) -> Outcome {
    let place = address.split("://").last().unwrap_or_default();
    let place = place.split('/').next().unwrap_or_default();
    let found = place.to_socket_addrs().map_err(|e| {
        Failure::user(format!("`{address}` is not the address of a viewer ({e})"))
            .with_remedy("give one as host:port")
    })?;
    if found.into_iter().any(answers) {
        return Ok(());
    }
    Err(Failure::work(format!("no viewer listens at `{place}`"))
        .with_remedy("start one with `rerun`"))
}

/// How to get the viewer.
pub fn install() -> String {
    format!(
        "install it with `pip install rerun-sdk=={VERSION}` or `cargo install rerun-cli --version {VERSION}`"
    )
}

/// From the first line of `rerun --version`, e.g. `rerun-cli 0.36.3 (…)`.
fn stated_version(path: &Path) -> Option<String> {
    let output = Command::new(path).arg("--version").output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut words = text.split_whitespace();
    words
        .find(|word| word.starts_with(|c: char| c.is_ascii_digit()))
        .map(str::to_string)
}

#[cfg(all(test, feature = "rerun"))]
mod tests {
    use super::*;

    #[test]
    fn the_default_port_is_that_of_rerun() {
        assert_eq!(PLACE.1, rerun::DEFAULT_SERVER_PORT);
    }
}
