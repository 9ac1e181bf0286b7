//! Ctrl-C asks to stop; a second one insists.

use crate::failure::{Failure, Outcome};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// As shells report a program that was stopped by Ctrl-C.
const STOPPED: i32 = 130;

pub struct Stop(Arc<AtomicUsize>);

impl Stop {
    pub fn on_ctrl_c() -> Outcome<Self> {
        let presses = Arc::new(AtomicUsize::new(0));
        let counted = presses.clone();
        let handler = move || {
            if counted.fetch_add(1, Ordering::Relaxed) > 0 {
                std::process::exit(STOPPED);
            }
        };
        ctrlc::set_handler(handler)
            .map_err(|e| Failure::work(format!("cannot listen for Ctrl-C: {e}")))?;
        Ok(Self(presses))
    }

    pub fn is_wanted(&self) -> bool {
        self.0.load(Ordering::Relaxed) > 0
    }
}
