//! Signals that ask training to stop. While it learns, the first lets it save, and the second ends the program at once. Before
//! and after that there is nothing to save, and the first ends it.

use crate::failure::Outcome;
use crate::signals;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The exit code that shells report for a program ended by Ctrl-C: 128 and the number of SIGINT.
const STOPPED: i32 = 130;

/// What is done before the program ends at once.
type Farewell = Box<dyn FnOnce() + Send>;

/// Counts the signals.
#[derive(Clone)]
pub struct Stop(Arc<State>);

struct State {
    signals: AtomicUsize,
    /// The program ends at once.
    ends: AtomicBool,
    farewell: Mutex<Option<Farewell>>,
}

impl Stop {
    /// Begins to listen. The next signal ends the program.
    pub fn on_signals() -> Outcome<Self> {
        let state = Arc::new(State {
            signals: AtomicUsize::new(1),
            ends: AtomicBool::new(false),
            farewell: Mutex::new(None),
        });
        let stop = Self(state.clone());
        signals::on_stop(move || {
            if state.signals.fetch_add(1, Ordering::SeqCst) > 0 {
                state.ends.store(true, Ordering::SeqCst);
                let farewell = Self(state.clone()).set(None);
                farewell.into_iter().for_each(|farewell| farewell());
                std::process::exit(STOPPED);
            }
        })?;
        Ok(stop)
    }

    /// From now on `farewell` is done before the program ends at once.
    pub fn before_end(&self, farewell: impl FnOnce() + Send + 'static) {
        self.set(Some(Box::new(farewell)));
    }

    fn set(&self, farewell: Option<Farewell>) -> Option<Farewell> {
        let held = self.0.farewell.lock();
        std::mem::replace(&mut held.unwrap_or_else(PoisonError::into_inner), farewell)
    }

    /// Waits for the end of a program that ends at once: what it removes meanwhile looks like an error to who writes there.
    pub fn give_way(&self) {
        while self.0.ends.load(Ordering::SeqCst) {
            std::thread::park();
        }
    }

    /// From now on the first signal lets training save.
    pub fn save_first(&self) {
        self.0.signals.store(0, Ordering::SeqCst);
    }

    /// Whether training is asked to stop.
    pub fn is_wanted(&self) -> bool {
        self.0.signals.load(Ordering::SeqCst) > 0
    }

    /// Lets the next signal end the program. Returns whether there was one before.
    pub fn release(&self) -> bool {
        self.0.signals.swap(1, Ordering::SeqCst) > 0
    }
}
