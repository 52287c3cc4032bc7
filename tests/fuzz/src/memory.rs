//! An allocator that keeps account of what is in use, so that an input that takes too much ends the process there and
//! then. It knows nothing of what C libraries allocate themselves.

#![allow(unsafe_code, reason = "an allocator")]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    io::{Write, stderr},
    process,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering::Relaxed},
    },
};

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

static IN_USE: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);
static LIMIT: AtomicUsize = AtomicUsize::new(usize::MAX);

// SAFETY: everything is passed on to the system's allocator as it comes.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        IN_USE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        take(size);
        IN_USE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.realloc(pointer, layout, size) }
    }
}

fn take(size: usize) {
    let in_use = IN_USE.fetch_add(size, Relaxed).saturating_add(size);
    MOST.fetch_max(in_use, Relaxed);
    if in_use > LIMIT.load(Relaxed) {
        LIMIT.store(usize::MAX, Relaxed);
        let _ = writeln!(
            stderr(),
            "an input takes too much memory: {size} bytes more, {in_use} in all"
        );
        process::abort();
    }
}

/// Tests run on several threads.
static ALONE: Mutex<()> = Mutex::new(());

/// Calls `examine`, and aborts the process if that takes more than `limit` bytes at a time. Returns the most that was taken.
pub fn watch(limit: usize, examine: impl FnOnce()) -> usize {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let before = IN_USE.load(Relaxed);
    MOST.store(before, Relaxed);
    LIMIT.store(before.saturating_add(limit), Relaxed);
    examine();
    LIMIT.store(usize::MAX, Relaxed);
    MOST.load(Relaxed).saturating_sub(before)
}
