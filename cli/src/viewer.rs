//! The rerun viewer, a program of its own.

use crate::failure::{Failure, Outcome};
use std::fmt::Display;
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Version of the recordings that we write. Viewers read those of their own version best.
pub const VERSION: &str = "0.36.3";

/// Where a viewer listens.
const PLACE: ([u8; 4], u16) = ([127, 0, 0, 1], rerun::DEFAULT_SERVER_PORT);

/// How long a viewer may take to answer.
const PATIENCE: Duration = Duration::from_secs(3);
/// How long it may take to start.
const START: Duration = Duration::from_secs(15);

pub struct Viewer {
    path: PathBuf,
    /// As it states it; `None` where it states none.
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

    /// The viewer, or a failure that says what to do without one.
    pub fn require() -> Outcome<Self> {
        Self::find().ok_or_else(|| {
            Failure::work(format!(
                "the rerun viewer is not installed: {}, or write the recording to a file with `--save out.rrd`",
                install()
            ))
        })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn fits(&self) -> bool {
        self.version.as_deref() == Some(VERSION)
    }

    /// Opens a window that stays when we are gone, or finds the one that is open; gives its address.
    pub fn open(&self) -> Outcome<String> {
        let place = SocketAddr::from(PLACE);
        if !answers(place) {
            let mut viewer = self.start(place.port())?;
            self.await_answer(place, &mut viewer)?;
        }
        Ok(address(&place.to_string()))
    }

    /// Its streams are closed: whoever reads ours would else wait for the viewer's end.
    fn start(&self, port: u16) -> Outcome<Child> {
        let mut command = Command::new(&self.path);
        command
            .arg(format!("--port={port}"))
            .args(["--expect-data-soon", "--hide-welcome-screen"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        // A Ctrl-C that is meant for us doesn't close the window.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        command.spawn().map_err(|e| self.broken(e))
    }

    /// The program that was started may only start the viewer and end well.
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
        Err(self.broken(format!(
            "it doesn't listen at `{place}` after {seconds} s; write the recording to a file with `--save`"
        )))
    }

    /// Serves a recording to browsers until it is stopped. What the viewer says is talk, so that standard output
    /// has nothing but our result.
    pub fn serve(&self, recording: &Path) -> Outcome {
        let stopped = Arc::new(AtomicBool::new(false));
        let flag = stopped.clone();
        // The viewer ends by the same Ctrl-C; we outlive it to clean up.
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
        Failure::work(format!(
            "the viewer `{path}` ended with {status}; start it by itself to see why, or write the recording to a file with `--save`"
        ))
    }

    fn broken(&self, cause: impl Display) -> Failure {
        Failure::work(format!("cannot start `{}`: {cause}", self.path.display()))
    }
}

fn answers(place: SocketAddr) -> bool {
    TcpStream::connect_timeout(&place, PATIENCE).is_ok()
}

/// Ended by Ctrl-C, of which our own handler may not have heard yet.
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

/// Address of a viewer that listens at `host:port`, unless it is a whole address already.
pub fn address(place: &str) -> String {
    if place.contains("://") {
        place.to_string()
    } else {
        format!("rerun+http://{place}/proxy")
    }
}

/// Whether somebody listens at `address`; a recording sent to nobody would wait for ever.
pub fn reach(address: &str) -> Outcome {
    let place = address.split("://").last().unwrap_or_default();
    let place = place.split('/').next().unwrap_or_default();
    let found = place.to_socket_addrs().map_err(|e| {
        Failure::user(format!(
            "`{address}` is no address of a viewer ({e}), give one as host:port"
        ))
    })?;
    if found.into_iter().any(answers) {
        return Ok(());
    }
    Err(Failure::work(format!(
        "no viewer listens at `{place}`, start one with `rerun`"
    )))
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
