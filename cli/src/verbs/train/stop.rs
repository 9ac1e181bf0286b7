//! Ctrl-C: the first asks training to stop, the second ends the program at once. Once there is nothing left to save, the
//! first ends it too.

use crate::failure::{Failure, Outcome};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The exit code that shells report for a program ended by Ctrl-C: 128 and the number of SIGINT.
const STOPPED: i32 = 130;

/// Counts how often Ctrl-C was pressed.
pub struct Stop(Arc<AtomicUsize>);

impl Stop {
    /// Begins to count. `farewell` runs before the program ends at once.
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

    /// Whether training is asked to stop.
    pub fn is_wanted(&self) -> bool {
        self.0.load(Ordering::SeqCst) > 0
    }

    /// Lets the next Ctrl-C end the program. Returns whether there was one before.
    pub fn release(self) -> bool {
        self.0.swap(1, Ordering::SeqCst) > 0
    }
}
