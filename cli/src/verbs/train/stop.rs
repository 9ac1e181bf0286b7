//! Ctrl-C asks to stop; a second one insists, and so does the first once there is no more to save.

use crate::failure::{Failure, Outcome};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// As shells report a program that was stopped by Ctrl-C.
const STOPPED: i32 = 130;

pub struct Stop(Arc<AtomicUsize>);

impl Stop {
    /// `farewell` is said before the program ends by force.
    pub fn on_ctrl_c(farewell: impl Fn() + Send + 'static) -> Outcome<Self> {
        let presses = Arc::new(AtomicUsize::new(0));
        let counted = presses.clone();
        let handler = move || {
            if counted.fetch_add(1, Ordering::SeqCst) > 0 {
                farewell();
                std::process::exit(STOPPED);
            }
        };
        ctrlc::set_handler(handler)
            .map_err(|e| Failure::work(format!("cannot listen for Ctrl-C: {e}")))?;
        Ok(Self(presses))
    }

    pub fn is_wanted(&self) -> bool {
        self.0.load(Ordering::SeqCst) > 0
    }

    /// From now on the first Ctrl-C ends the program. Says whether there was one before.
    pub fn release(self) -> bool {
        self.0.swap(1, Ordering::SeqCst) > 0
    }
}
