//! The tokio runtime of the process: services, actions, timers and signals.

use std::{io, sync::Mutex};

use nix::sys::signal::{SigSet, Signal};
use tokio::runtime::{Builder, Handle, Runtime};

use crate::sync::lock;

/// One task may wait up to 20 ms for a client while another goes on.
const WORKERS: usize = 2;

/// The signals that end a process.
pub(crate) fn ending_signals() -> SigSet {
    SigSet::from_iter([Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP])
}

/// The runtime, which lives as long as the process. Its threads take the signals that end the process.
pub(crate) fn runtime() -> io::Result<Handle> {
    static RUNTIME: Mutex<Option<Runtime>> = Mutex::new(None);
    let mut runtime = lock(&RUNTIME);
    if let Some(runtime) = &*runtime {
        return Ok(runtime.handle().clone());
    }
    let started = Builder::new_multi_thread()
        .worker_threads(WORKERS)
        .thread_name("lgvi")
        .on_thread_start(|| {
            // The process may have been started with these signals blocked.
            let _ = ending_signals().thread_unblock();
        })
        .enable_all()
        .build()?;
    Ok(runtime.insert(started).handle().clone())
}
