//! The rerun viewer, a program of its own: finding, starting and reaching it.

mod place;

pub use place::Bind;

use crate::failure::{Failure, Outcome};
use crate::signals;
use place::answers;
use std::fmt::Display;
use std::io::Read;
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Version of the recordings that we write. A viewer reads recordings of its own version best.
pub const VERSION: &str = "0.36.3";

/// Where a viewer listens for recordings unless told otherwise: rerun's own default port.
const PORT: u16 = 9876;
/// The same for the page that web browsers open.
const PAGE: u16 = 9090;

/// Time between two looks at a viewer.
const PAUSE: Duration = Duration::from_millis(100);
/// How long a viewer may take to start. Chosen: a first start on a busy machine takes several seconds.
const START: Duration = Duration::from_secs(15);

/// How long a viewer that is asked to end may take. Chosen: whoever pressed Ctrl-C waits for it.
#[cfg(unix)]
const FAREWELL: Duration = Duration::from_secs(2);

/// An installed viewer.
pub struct Viewer {
    path: PathBuf,
    /// The version it states; `None` where it states none.
    pub version: Option<String>,
}

impl Viewer {
    /// The `rerun` program on the search path.
    pub fn find() -> Option<Self> {
        let path = installed()?;
        let version = stated_version(&path);
        Some(Self { path, version })
    }

    /// Whether there is such a program.
    pub fn is_installed() -> bool {
        installed().is_some()
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
    pub fn open(&self, bind: &Bind) -> Outcome<String> {
        let usual = bind.port.unwrap_or(PORT);
        let place = bind.place(usual);
        if !place::is_viewer(place::reachable(place)) {
            let port = bind.free_port(usual)?;
            let place = bind.place(port);
            let mut window = self.command(bind);
            window
                .arg(format!("--port={port}"))
                .args(["--expect-data-soon", "--hide-welcome-screen"]);
            let mut viewer = self.start(window)?;
            // The program that was started may be a launcher, which ends well before the window.
            let never = AtomicBool::new(false);
            self.await_answers(&[place], &mut viewer, |status| !status.success(), &never)?;
            return Ok(address(&place::reachable(place).to_string()));
        }
        Ok(address(&place::reachable(place).to_string()))
    }

    /// Serves a recording to web browsers until it is stopped. `ready` gets the address once it can be opened.
    pub fn serve(
        &self,
        recording: &Path,
        bind: &Bind,
        ready: impl FnOnce(&str) -> Outcome,
    ) -> Outcome {
        let stopped = Arc::new(AtomicBool::new(false));
        let flag = stopped.clone();
        // We stay to end the viewer and to remove the temporary file.
        signals::on_stop(move || flag.store(true, Ordering::Relaxed))?;
        let page = match bind.port {
            Some(port) => bind.free_port(port)?,
            None => bind.free_port(PAGE)?,
        };
        let data = Bind {
            port: None,
            ..*bind
        }
        .free_port_but(PORT, page)?;
        let mut command = self.command(bind);
        command
            .arg("--serve-web")
            .arg(format!("--port={data}"))
            .arg(format!("--web-viewer-port={page}"))
            .arg(recording);
        if let Some(origin) = bind.origin(page) {
            command.arg(format!("--cors-allow-origin={origin}"));
        }
        let mut viewer = self.start(command)?;
        let places = [bind.place(page), bind.place(data)];
        let served = self.await_answers(&places, &mut viewer, |_| true, &stopped);
        let served = served.and_then(|answers| match answers {
            true => ready(&bind.page_address(page, data))
                .and_then(|()| self.outlast(&mut viewer, &stopped).map_err(Failure::partly)),
            false => Ok(()),
        });
        end(&mut viewer);
        served
    }

    /// The viewer, listening where it is told to, with its streams closed: what it says isn't our result, and a program that
    /// reads ours would otherwise wait for the viewer's end.
    fn command(&self, bind: &Bind) -> Command {
        let mut command = Command::new(&self.path);
        command
            .arg(format!("--bind={}", bind.ip))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        // In a process group of its own: a Ctrl-C for this program leaves its window open, and what is served ends as a
        // whole, although the program that was started may be a launcher.
        on_its_own(&mut command);
        command
    }

    fn start(&self, mut command: Command) -> Outcome<Child> {
        command.spawn().map_err(|e| self.broken(e))
    }

    /// Waits until the viewer listens everywhere, or ends in a way that `fails`, or until this program is asked to end. Returns
    /// whether it listens.
    fn await_answers(
        &self,
        places: &[SocketAddr],
        viewer: &mut Child,
        fails: impl Fn(ExitStatus) -> bool,
        stopped: &AtomicBool,
    ) -> Outcome<bool> {
        let begun = Instant::now();
        while begun.elapsed() < START {
            if stopped.load(Ordering::Relaxed) {
                return Ok(false);
            }
            if places.iter().all(|place| answers(place::reachable(*place))) {
                return Ok(true);
            }
            let ended = viewer.try_wait().map_err(|e| self.broken(e))?;
            if let Some(status) = ended.filter(|status| fails(*status)) {
                return Err(self.ended(status));
            }
            std::thread::sleep(PAUSE);
        }
        let (seconds, place) = (START.as_secs(), places[0]);
        Err(self.broken(format!("it does not listen at `{place}` after {seconds} s")))
    }

    /// Waits until the viewer ends, or until this program is asked to.
    fn outlast(&self, viewer: &mut Child, stopped: &AtomicBool) -> Outcome {
        while !stopped.load(Ordering::Relaxed) {
            match viewer.try_wait().map_err(|e| self.broken(e))? {
                Some(status) if status.success() => return Ok(()),
                Some(status) => return Err(self.ended(status)),
                None => std::thread::sleep(PAUSE),
            }
        }
        Ok(())
    }

    fn ended(&self, status: ExitStatus) -> Failure {
        let path = self.path.display();
        Failure::work(format!("the viewer `{path}` ended with {status}")).with_remedy(
            "start it by itself to see why, or write the recording to a file with `--save FILE.rrd`",
        )
    }

    fn broken(&self, cause: impl Display) -> Failure {
        Failure::work(format!(
            "cannot start the viewer `{}`: {cause}",
            self.path.display()
        ))
        .with_remedy("write the recording to a file with `--save FILE.rrd`")
    }
}

/// Where the viewer is installed.
fn installed() -> Option<PathBuf> {
    let program = format!("rerun{}", std::env::consts::EXE_SUFFIX);
    std::env::split_paths(&std::env::var_os("PATH")?)
        .map(|folder| folder.join(&program))
        .find(|path| path.is_file())
}

/// Starts a program in a process group of its own.
fn on_its_own(command: &mut Command) {
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    #[cfg(not(unix))]
    let _ = command;
}

/// Ends a viewer and all that it started.
#[cfg(unix)]
fn end(viewer: &mut Child) {
    signal(viewer, libc::SIGTERM);
    if !has_ended_within(viewer, FAREWELL) {
        end_at_once(viewer);
    }
}

/// The same without asking.
#[cfg(unix)]
fn end_at_once(program: &mut Child) {
    signal(program, libc::SIGKILL);
    program.wait().ok();
}

/// Sends a signal to a program in a process group of its own, and to all that it started.
#[cfg(unix)]
#[allow(
    unsafe_code,
    reason = "no safe interface sends a signal to a process group"
)]
fn signal(program: &Child, signal: libc::c_int) {
    if let Ok(group) = i32::try_from(program.id()) {
        // SAFETY: sending a signal touches no memory of ours. The group has the number of its first process, which we
        // started and which has that number at least until it is waited for; later none of that number is left, or it is
        // the rest of the group.
        unsafe {
            libc::kill(-group, signal);
        }
    }
}

/// Waits until a program ends, or for so long.
#[cfg(unix)]
fn has_ended_within(program: &mut Child, patience: Duration) -> bool {
    let begun = Instant::now();
    while !matches!(program.try_wait(), Ok(Some(_))) {
        if begun.elapsed() > patience {
            return false;
        }
        std::thread::sleep(PAUSE / 4);
    }
    true
}

#[cfg(not(unix))]
fn end(viewer: &mut Child) {
    end_at_once(viewer);
}

#[cfg(not(unix))]
fn end_at_once(program: &mut Child) {
    program.kill().ok();
    program.wait().ok();
}

/// Address of a viewer that listens at `host:port`. A whole address stays as it is.
pub fn address(place: &str) -> String {
    if place.contains("://") {
        place.to_string()
    } else {
        format!("rerun+http://{place}/proxy")
    }
}

/// Fails where no viewer answers at `address`: sending would wait for one for ever.
pub fn reach(address: &str) -> Outcome {
    let place = address.split("://").last().unwrap_or_default();
    let place = place.split('/').next().unwrap_or_default();
    let found = place.to_socket_addrs().map_err(|e| {
        Failure::user(format!("`{address}` is not the address of a viewer ({e})"))
            .with_remedy("give one as host:port")
    })?;
    let found: Vec<SocketAddr> = found.collect();
    if found.iter().any(|place| place::is_viewer(*place)) {
        return Ok(());
    }
    let cause = match found.into_iter().any(answers) {
        true => format!("what listens at `{place}` does not answer as a viewer"),
        false => format!("no viewer listens at `{place}`"),
    };
    Err(Failure::work(cause).with_remedy("start a viewer with `rerun`, or name its address"))
}

/// How to get the viewer.
pub fn install() -> String {
    format!(
        "install it with `pip install rerun-sdk=={VERSION}` or `cargo install rerun-cli --version {VERSION}`"
    )
}

/// How long `rerun --version` may take, and most bytes of what it says. Its program answers at once, its Python package takes a
/// second. Who takes longer has a version that isn't known.
const PATIENCE: Duration = Duration::from_secs(2);
const MOST_SAID: u64 = 4096;

/// From the first line of `rerun --version`, e.g. `rerun-cli 0.36.3 (…)`.
fn stated_version(path: &Path) -> Option<String> {
    let mut program = Command::new(path);
    program.arg("--version").stdin(Stdio::null());
    program.stdout(Stdio::piped()).stderr(Stdio::null());
    on_its_own(&mut program);
    let mut child = program.spawn().ok()?;
    let said = child.stdout.take()?.take(MOST_SAID);
    // Whatever has this name may say nothing for ever, or talk without end.
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || sender.send(std::io::read_to_string(said).unwrap_or_default()));
    let text = receiver.recv_timeout(PATIENCE).ok();
    end_at_once(&mut child);
    let text = text?;
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
        assert_eq!(PORT, rerun::DEFAULT_SERVER_PORT);
    }
}
