//! How far long work is: a bar on a terminal, and where nobody watches one, a line now and then.

use crate::amount;
use crate::printer::Printer;
use indicatif::ProgressBar;
use mimic::explain::plain;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

/// Work that is done sooner needs no bar.
const SOON: Duration = Duration::from_secs(1);
/// How often a bar is drawn again.
const TICK: Duration = Duration::from_millis(200);
/// When the first line is due, and how much later each of the others.
const FIRST: Duration = Duration::from_secs(10);
const LATER: Duration = Duration::from_secs(60);

/// When the next line of progress is due: soon for whoever waits, then seldom, for logs are read later.
pub struct Pace {
    begun: Instant,
    due: Duration,
}

impl Pace {
    /// Begins now.
    pub fn new() -> Self {
        Self {
            begun: Instant::now(),
            due: FIRST,
        }
    }

    /// Whether a line is due; it is due once.
    pub fn is_due(&mut self) -> bool {
        let elapsed = self.begun.elapsed();
        let due = elapsed >= self.due;
        if due {
            let whole = elapsed.as_secs() / LATER.as_secs() + 1;
            self.due = LATER * u32::try_from(whole).unwrap_or(u32::MAX);
        }
        due
    }
}

/// How much of some work is done, told by the work itself.
#[derive(Default)]
pub struct Share(AtomicU32);

impl Share {
    /// Most steps that are told apart.
    const STEPS: f64 = 1000.0;

    /// Tells it, from 0 to 1.
    pub fn set(&self, share: f64) {
        self.0
            .store((share * Self::STEPS) as u32, Ordering::Relaxed);
    }

    /// In per cent, once something was told.
    fn percent(&self) -> Option<f64> {
        let steps = self.0.load(Ordering::Relaxed);
        (steps > 0).then(|| 100.0 * f64::from(steps) / Self::STEPS)
    }
}

/// Does work that may take long. `what` says what it is, such as "retargeting `kick.fbx`".
pub fn during<T>(printer: &Printer, what: &str, work: impl FnOnce(&Share) -> T) -> T {
    let share = &Share::default();
    thread::scope(|scope| {
        let (working, ended) = channel::<()>();
        let watch = move || watch(printer, what, share, &ended);
        // Without a thread to spare, the work is done unwatched.
        let builder = thread::Builder::new();
        let watcher = builder.spawn_scoped(scope, watch);
        let result = work(share);
        drop((working, watcher));
        result
    })
}

/// Shows how far work is until it ends.
fn watch(printer: &Printer, what: &str, share: &Share, ended: &Receiver<()>) {
    let begun = Instant::now();
    let mut pace = Pace::new();
    let mut bar: Option<ProgressBar> = None;
    while ended.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
        let text = line(what, share.percent(), begun.elapsed());
        if begun.elapsed() >= SOON {
            let bar = bar.get_or_insert_with(|| printer.progress(0, "{spinner} {wide_msg}"));
            bar.set_message(text.clone());
            bar.tick();
        }
        if bar.as_ref().is_some_and(ProgressBar::is_hidden) && pace.is_due() {
            printer.say(text);
        }
    }
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
}

fn line(what: &str, percent: Option<f64>, elapsed: Duration) -> String {
    let what = plain(what);
    let since = amount::duration(elapsed.as_secs_f64());
    match percent {
        Some(percent) => format!("{what}: {percent:.0} % after {since}"),
        None => format!("{what}: {since}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_due_after_ten_seconds_and_then_every_minute() {
        let ago = |seconds| {
            let begun = Instant::now().checked_sub(Duration::from_secs(seconds));
            begun.expect("the system runs for longer")
        };
        let mut pace = Pace::new();
        assert!(!pace.is_due());
        let mut due = Vec::new();
        for second in (0..200).step_by(5) {
            pace.begun = ago(second);
            if pace.is_due() {
                due.push(second);
            }
        }
        assert_eq!(due, [10, 60, 120, 180]);
    }

    #[test]
    fn work_gives_its_result_at_once() {
        let printer = Printer::new(&crate::args::Talk {
            json: false,
            quiet: true,
            verbose: false,
        });
        let begun = Instant::now();
        let result = during(&printer, "counting", |share| {
            share.set(0.5);
            share.percent()
        });
        assert_eq!(result, Some(50.0));
        assert!(begun.elapsed() < SOON, "nobody waits for the watcher");
    }

    #[test]
    fn a_line_says_what_is_done_and_since_when() {
        let after = Duration::from_secs(12);
        assert_eq!(
            line("reading `a.bvh`", None, after),
            "reading `a.bvh`: 12 s"
        );
        let part = line("retargeting `a.bvh`", Some(41.0), after);
        assert_eq!(part, "retargeting `a.bvh`: 41 % after 12 s");
    }
}
