//! An allocator that counts, for each thread, the bytes in use and their maximum.

#![allow(unsafe_code, reason = "an allocator is an unsafe trait")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static USED: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

/// The system's allocator with counts. Memory that another thread frees makes them wrong, so what is measured stays on its
/// thread.
struct Counting;

#[global_allocator]
static HEAP: Counting = Counting;

// SAFETY: every call is handed on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let used = USED.get() + layout.size().cast_signed();
        USED.set(used);
        PEAK.set(PEAK.get().max(used));
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        USED.set(USED.get() - layout.size().cast_signed());
        // SAFETY: `at` came from `System` with this layout.
        unsafe { System.dealloc(at, layout) }
    }
}

/// What `work` returns, and the most bytes it had in use at once.
pub fn peak_of<T>(work: impl FnOnce() -> T) -> (T, usize) {
    USED.set(0);
    PEAK.set(0);
    let result = work();
    (result, PEAK.get().cast_unsigned())
}
