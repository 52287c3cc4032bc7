//! The thread on which a node answers requests, hears messages and does what is due at regular times.

use std::{
    fmt, io,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    task::{Context, Poll},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use lgvi_msgs::{RosMessage, Service};
use tracing::warn;

use super::{PublishError, RequestId, ServiceServer, Subscription};
use crate::block::thread_waker;

/// Requests or messages of one endpoint that are taken before the others have their turn.
const TURN: usize = 16;

/// The longest pause.
const PAUSE: Duration = Duration::from_secs(1);

/// What an executor looks after. It begins with [`start`](Self::start).
#[derive(Default)]
pub struct Executor(Vec<Box<dyn Task>>);

/// A started executor. Dropping it ends its thread after what that is at.
#[derive(Debug)]
pub struct Running {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// The answer that a request waits for; it may be given later, on any thread. Dropping it leaves the client waiting in
/// vain.
pub struct Reply<S> {
    server: Arc<ServiceServer<S>>,
    id: RequestId,
}

impl Executor {
    /// Nothing to look after yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Has the requests of a service answered by `answer`, at once or later through the [`Reply`].
    pub fn serve<S: Service>(
        &mut self,
        server: ServiceServer<S>,
        answer: impl FnMut(S::Request, Reply<S>) + Send + 'static,
    ) {
        let server = Arc::new(server);
        self.0.push(Box::new(Serving { server, answer }));
    }

    /// Has the messages of a subscription heard by `hear`.
    pub fn listen<M: RosMessage + 'static>(
        &mut self,
        subscription: Subscription<M>,
        hear: impl FnMut(M) + Send + 'static,
    ) {
        self.0.push(Box::new(Listening { subscription, hear }));
    }

    /// Has `act` called once a period; what is missed is not made up for.
    pub fn every(&mut self, period: Duration, act: impl FnMut() + Send + 'static) {
        let due = Instant::now() + period;
        self.0.push(Box::new(Timed { period, due, act }));
    }

    /// Has `act` called whenever the executor is awake: after [`Running::wake`], and at least once a second.
    pub fn whenever(&mut self, act: impl FnMut() + Send + 'static) {
        self.0.push(Box::new(Whenever(act)));
    }

    /// Begins, on a thread of its own.
    pub fn start(mut self) -> io::Result<Running> {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = thread::Builder::new()
            .name("executor".into())
            .spawn(move || {
                let waker = thread_waker();
                let mut context = Context::from_waker(&waker);
                while !stopped.load(Ordering::Acquire) {
                    let pause = self.0.iter_mut().map(|task| task.turn(&mut context));
                    thread::park_timeout(pause.min().unwrap_or(PAUSE));
                }
            })?;
        Ok(Running {
            stop,
            thread: Some(thread),
        })
    }
}

impl Running {
    /// Has everything looked after now. Does not lock.
    pub fn wake(&self) {
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        self.wake();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            warn!("the thread that answers requests has panicked");
        }
    }
}

impl<S: Service> Reply<S> {
    /// Answers the request. Waits for no client; at most 20 ms for room.
    pub fn send(self, response: &S::Response) {
        if let Err(error) = self.server.reply(self.id, response) {
            warn!("no reply: {error}");
        }
    }

    /// Answers the request, by `instead` where the response is too long to be sent.
    pub fn send_or(self, response: &S::Response, instead: &S::Response) {
        match self.server.reply(self.id, response) {
            Err(error @ PublishError::TooLong { .. }) => {
                warn!("an empty reply instead: {error}");
                self.send(instead);
            }
            Err(error) => warn!("no reply: {error}"),
            Ok(()) => {}
        }
    }
}

/// Something that has its turn whenever the thread is awake.
trait Task: Send {
    /// Does what there is to do; how long to pause at most.
    fn turn(&mut self, context: &mut Context<'_>) -> Duration;
}

struct Serving<S, F> {
    server: Arc<ServiceServer<S>>,
    answer: F,
}

impl<S: Service, F: FnMut(S::Request, Reply<S>) + Send> Task for Serving<S, F> {
    fn turn(&mut self, context: &mut Context<'_>) -> Duration {
        for _ in 0..TURN {
            match self.server.poll_take(context) {
                Poll::Ready(Ok(request)) => {
                    let server = Arc::clone(&self.server);
                    let id = request.id;
                    (self.answer)(request.message, Reply { server, id });
                }
                Poll::Ready(Err(error)) => warn!("request ignored: {error}"),
                Poll::Pending => return self.server.next_look().unwrap_or(PAUSE),
            }
        }
        Duration::ZERO
    }
}

struct Listening<M, F> {
    subscription: Subscription<M>,
    hear: F,
}

impl<M: RosMessage, F: FnMut(M) + Send> Task for Listening<M, F> {
    fn turn(&mut self, context: &mut Context<'_>) -> Duration {
        for _ in 0..TURN {
            match self.subscription.poll_take(context) {
                Poll::Ready(Ok(sample)) => (self.hear)(sample.message),
                Poll::Ready(Err(error)) => warn!("message ignored: {error}"),
                Poll::Pending => return PAUSE,
            }
        }
        Duration::ZERO
    }
}

struct Timed<F> {
    period: Duration,
    due: Instant,
    act: F,
}

impl<F: FnMut() + Send> Task for Timed<F> {
    fn turn(&mut self, _: &mut Context<'_>) -> Duration {
        let now = Instant::now();
        if now >= self.due {
            (self.act)();
            self.due = (self.due + self.period).max(Instant::now());
        }
        self.due.saturating_duration_since(now)
    }
}

struct Whenever<F>(F);

impl<F: FnMut() + Send> Task for Whenever<F> {
    fn turn(&mut self, _: &mut Context<'_>) -> Duration {
        (self.0)();
        PAUSE
    }
}

impl fmt::Debug for Executor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Executor")
            .field("tasks", &self.0.len())
            .finish()
    }
}

impl<S: Service> fmt::Debug for Reply<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Reply").field(&self.server.name()).finish()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn what_is_to_be_done_is_done_when_the_executor_is_woken() {
        let (act, acted) = mpsc::channel();
        let mut executor = Executor::new();
        executor.whenever(move || act.send(()).unwrap());
        let running = executor.start().unwrap();
        acted.recv().unwrap();
        let began = Instant::now();
        running.wake();
        acted.recv().unwrap();
        assert!(began.elapsed() < PAUSE, "it has not been woken");
    }
}
