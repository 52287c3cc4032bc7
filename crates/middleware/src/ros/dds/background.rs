//! The thread of a node that takes what DDS has for it.

use std::{
    io,
    pin::pin,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    task::{Context, Poll},
    thread::{self, JoinHandle, Thread},
};

use futures_core::Stream;
use rustdds::{DomainParticipant, DomainParticipantStatusListener, StatusEvented};
use tracing::warn;

use super::{census::Census, inbox::Inbox, keeps::Keeps};
use crate::{block::thread_waker, sync::lock};

/// Keeps [`Matches`](super::matches::Matches) up to date and fills the inboxes; ends when dropped.
///
/// Both must be done at once: RustDDS discards events that its queue has no room for, and [`Inbox`] says why samples
/// must not wait.
pub(super) struct Background {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    inboxes: Mutex<Vec<Arc<Inbox>>>,
}

impl Background {
    pub(super) fn start(participant: &DomainParticipant, keeps: Keeps) -> io::Result<Self> {
        let listener = participant.status_listener();
        let mut census = Census::new(participant.clone());
        let shared = Arc::new(Shared::default());
        let work = Arc::clone(&shared);
        let thread = thread::Builder::new()
            .name("dds-inbox".into())
            .spawn(move || work.run(&listener, &keeps, &mut census))?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Begins to fill an inbox.
    pub(super) fn add(&self, inbox: Arc<Inbox>) {
        lock(&self.shared.inboxes).push(inbox);
        self.unpark();
    }

    /// Ceases to fill an inbox.
    pub(super) fn remove(&self, inbox: &Arc<Inbox>) {
        lock(&self.shared.inboxes).retain(|other| !Arc::ptr_eq(other, inbox));
    }

    /// Has the thread look for something to do.
    pub(super) fn unpark(&self) {
        self.thread
            .as_ref()
            .map(JoinHandle::thread)
            .map(Thread::unpark);
    }
}

impl Shared {
    fn run(&self, listener: &DomainParticipantStatusListener, keeps: &Keeps, census: &mut Census) {
        let mut events = pin!(listener.as_async_status_stream());
        let waker = thread_waker();
        let mut context = Context::from_waker(&waker);
        while !self.stop.load(Ordering::Acquire) {
            for inbox in lock(&self.inboxes).iter() {
                inbox.fill(&waker);
            }
            let next = keeps.tend().into_iter();
            let next = next.chain([census.take(keeps, &lock(&self.inboxes))]).min();
            match events.as_mut().poll_next(&mut context) {
                Poll::Ready(Some(event)) => keeps.apply(event),
                Poll::Ready(None) => break,
                Poll::Pending => next.map_or_else(thread::park, thread::park_timeout),
            }
        }
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Release);
        self.unpark();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            warn!("the thread that takes samples from DDS has panicked");
        }
    }
}
