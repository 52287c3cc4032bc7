//! The request to stop, from a signal or from within.

use std::{
    fs, io,
    sync::{Arc, Condvar, Mutex, OnceLock},
    time::{Duration, Instant},
};

use tokio::signal::unix::{SignalKind, signal};

use crate::{
    runtime::{ending_signals, runtime},
    sync::{lock, wait_while},
};

/// A flag that is raised once and stays raised; clones share it.
#[derive(Debug, Clone, Default)]
pub struct Shutdown(Arc<Flag>);

#[derive(Debug, Default)]
struct Flag {
    /// When `raised` was set, for who must not lock.
    since: OnceLock<Instant>,
    raised: Mutex<bool>,
    blocking: Condvar,
}

impl Shutdown {
    /// A flag that only [`request`](Self::request) raises.
    pub fn new() -> Self {
        Self::default()
    }

    /// A flag that SIGINT, SIGTERM and SIGHUP raise too; these signals have no other effect from here on. A SIGHUP that is
    /// ignored already, as under `nohup`, stays so. To be called before other threads are started.
    ///
    /// The signals are blocked on the calling thread and on those that it starts: in the midst of a wait for shared
    /// memory, a signal would make iceoryx2 0.10 fail.
    ///
    /// Fails if the handlers cannot be installed.
    pub fn on_signals() -> io::Result<Self> {
        let shutdown = Self::new();
        let runtime = runtime()?;
        let hangup = (!hangup_is_ignored()).then(SignalKind::hangup);
        let endings = [SignalKind::interrupt(), SignalKind::terminate()];
        for kind in endings.into_iter().chain(hangup) {
            let raised = shutdown.clone();
            let mut signals = {
                let _entered = runtime.enter();
                signal(kind)?
            };
            runtime.spawn(async move {
                while signals.recv().await.is_some() {
                    raised.request();
                }
            });
        }
        ending_signals().thread_block()?;
        Ok(shutdown)
    }

    /// Raises the flag.
    pub fn request(&self) {
        *lock(&self.0.raised) = true;
        let _ = self.0.since.set(Instant::now());
        self.0.blocking.notify_all();
    }

    /// Whether the flag is raised. Does not lock.
    pub fn requested(&self) -> bool {
        self.0.since.get().is_some()
    }

    /// How long the flag has been raised. Does not lock.
    pub fn elapsed(&self) -> Option<Duration> {
        self.0.since.get().map(Instant::elapsed)
    }

    /// Blocks until the flag is raised or the time has passed; returns whether it is raised.
    pub fn wait_timeout(&self, timeout: Duration) -> bool {
        let Flag {
            raised, blocking, ..
        } = &*self.0;
        *wait_while(blocking, raised, timeout, |raised| !*raised)
    }
}

/// Whether the process was started with SIGHUP ignored, by what the kernel says of it.
fn hangup_is_ignored() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    ignores(&status, SignalKind::hangup().as_raw_value())
}

/// Whether a signal is in the mask `SigIgn` of a process's status.
fn ignores(status: &str, signal: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use std::thread;

    use nix::sys::signal::Signal;

    use super::*;

    #[test]
    fn waiting_ends_with_the_request() {
        let shutdown = Shutdown::new();
        assert!(!shutdown.wait_timeout(Duration::from_millis(1)));
        assert_eq!(shutdown.elapsed(), None);
        let other = shutdown.clone();
        let requester = thread::spawn(move || {
            thread::sleep(Duration::from_millis(20));
            other.request();
        });
        let start = Instant::now();
        assert!(shutdown.wait_timeout(Duration::from_secs(10)));
        assert!(start.elapsed() < Duration::from_secs(5));
        assert!(shutdown.elapsed().unwrap() <= start.elapsed());
        requester.join().unwrap();
    }

    #[test]
    fn signals_raise_the_flag() {
        let hangup = (!hangup_is_ignored()).then_some(Signal::SIGHUP);
        for signal in [Signal::SIGTERM].into_iter().chain(hangup) {
            let shutdown = Shutdown::on_signals().unwrap();
            assert!(!shutdown.requested());
            nix::sys::signal::kill(nix::unistd::Pid::this(), signal).unwrap();
            assert!(shutdown.wait_timeout(Duration::from_secs(10)), "{signal}");
        }
    }

    #[test]
    fn ignored_signals_are_told_from_others() {
        let status = "SigBlk:\t0000000000000003\nSigIgn:\t0000000000001001\nSigCgt:\t0\n";
        assert!(ignores(status, Signal::SIGHUP as i32));
        assert!(
            !ignores(status, Signal::SIGINT as i32) && !ignores(status, Signal::SIGTERM as i32)
        );
        assert!(!ignores("", Signal::SIGHUP as i32));
    }
}
