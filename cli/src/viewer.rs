//! The rerun viewer, a program of its own.

use crate::failure::{Failure, Outcome};
use rerun::SpawnOptions;
use std::fmt::Display;
use std::net::{TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Version of the recordings that we write. Viewers read those of their own version best.
pub const VERSION: &str = "0.36.3";

/// How long a viewer may take to answer.
const PATIENCE: Duration = Duration::from_secs(3);

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
        let options = SpawnOptions {
            executable_path: Some(self.path.display().to_string()),
            wait_for_bind: true,
            hide_welcome_screen: true,
            extra_env: vec![("RUST_LOG".into(), "error".into())],
            ..SpawnOptions::default()
        };
        let viewer = rerun::spawn(&options).map_err(|e| self.broken(e))?;
        Ok(address(&format!("127.0.0.1:{}", viewer.port)))
    }

    /// Serves a recording to browsers until it is stopped.
    pub fn serve(&self, recording: &Path) -> Outcome {
        let mut command = Command::new(&self.path);
        command
            .arg("--serve-web")
            .arg(recording)
            .stdin(Stdio::null());
        command.status().map_err(|e| self.broken(e))?;
        Ok(())
    }

    fn broken(&self, cause: impl Display) -> Failure {
        Failure::work(format!("cannot start `{}`: {cause}", self.path.display()))
    }
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
    let answers = |at| TcpStream::connect_timeout(&at, PATIENCE).is_ok();
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
