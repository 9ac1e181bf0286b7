//! What happens at signals of the system.

use crate::failure::{Failure, Outcome};

/// Calls `handler` at every Ctrl-C (SIGINT), when the system shuts down (SIGTERM) and when the terminal closes (SIGHUP).
/// `nohup` starts a program with SIGHUP ignored, so that it outlives its terminal. That stays so.
pub fn on_stop(handler: impl FnMut() + Send + 'static) -> Outcome {
    let outlives_terminal = system::ignores_hangup();
    ctrlc::set_handler(handler)
        .map_err(|e| Failure::work(format!("cannot listen for Ctrl-C: {e}")))?;
    if outlives_terminal {
        system::ignore_hangup();
    }
    Ok(())
}

/// Lets a write beyond the largest file that the system allows (`ulimit -f`) fail, so that it can be reported. By default the
/// system ends the program without a word.
pub fn report_large_files() {
    system::ignore_large_file();
}

#[cfg(unix)]
#[allow(
    unsafe_code,
    reason = "no safe interface tells or keeps what happens at a signal"
)]
mod system {
    pub fn ignores_hangup() -> bool {
        let mut action = std::mem::MaybeUninit::<libc::sigaction>::uninit();
        // SAFETY: with a null second argument `sigaction` changes nothing, and writes the third when it returns 0.
        unsafe {
            libc::sigaction(libc::SIGHUP, std::ptr::null(), action.as_mut_ptr()) == 0
                && action.assume_init().sa_sigaction == libc::SIG_IGN
        }
    }

    pub fn ignore_hangup() {
        ignore(libc::SIGHUP);
    }

    pub fn ignore_large_file() {
        ignore(libc::SIGXFSZ);
    }

    fn ignore(signal: libc::c_int) {
        // SAFETY: ignoring a signal runs no code of ours.
        unsafe {
            libc::signal(signal, libc::SIG_IGN);
        }
    }
}

#[cfg(not(unix))]
mod system {
    pub fn ignores_hangup() -> bool {
        false
    }

    pub fn ignore_hangup() {}

    pub fn ignore_large_file() {}
}
