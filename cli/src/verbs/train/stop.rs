//! Signals that ask training to stop: Ctrl-C (SIGINT), a system that shuts down (SIGTERM), a terminal that closes (SIGHUP).
//! The first lets training save, the second ends the program at once. Once there is nothing left to save, the first ends it
//! too.

use crate::failure::{Failure, Outcome};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The exit code that shells report for a program ended by Ctrl-C: 128 and the number of SIGINT.
const STOPPED: i32 = 130;

/// Counts the signals.
pub struct Stop(Arc<AtomicUsize>);

impl Stop {
    /// Begins to count. `farewell` runs before the program ends at once.
    pub fn on_signals(farewell: impl Fn() + Send + 'static) -> Outcome<Self> {
        let signals = Arc::new(AtomicUsize::new(0));
        let counted = signals.clone();
        let handler = move || {
            if counted.fetch_add(1, Ordering::SeqCst) > 0 {
                farewell();
                std::process::exit(STOPPED);
            }
        };
        let outlives_terminal = hangup::is_ignored();
        ctrlc::set_handler(handler)
            .map_err(|e| Failure::work(format!("cannot listen for Ctrl-C: {e}")))?;
        if outlives_terminal {
            hangup::ignore();
        }
        Ok(Self(signals))
    }

    /// Whether training is asked to stop.
    pub fn is_wanted(&self) -> bool {
        self.0.load(Ordering::SeqCst) > 0
    }

    /// Lets the next signal end the program. Returns whether there was one before.
    pub fn release(self) -> bool {
        self.0.swap(1, Ordering::SeqCst) > 0
    }
}

/// `nohup` starts a program with SIGHUP ignored, so that it outlives its terminal. That is to stay so.
#[cfg(unix)]
#[allow(
    unsafe_code,
    reason = "no safe interface tells or keeps what happens at a signal"
)]
mod hangup {
    pub fn is_ignored() -> bool {
        let mut action = std::mem::MaybeUninit::<libc::sigaction>::uninit();
        // SAFETY: with a null second argument `sigaction` changes nothing, and writes the third when it returns 0.
        unsafe {
            libc::sigaction(libc::SIGHUP, std::ptr::null(), action.as_mut_ptr()) == 0
                && action.assume_init().sa_sigaction == libc::SIG_IGN
        }
    }

    pub fn ignore() {
        // SAFETY: ignoring a signal runs no code of ours.
        unsafe {
            libc::signal(libc::SIGHUP, libc::SIG_IGN);
        }
    }
}

#[cfg(not(unix))]
mod hangup {
    pub fn is_ignored() -> bool {
        false
    }

    pub fn ignore() {}
}
