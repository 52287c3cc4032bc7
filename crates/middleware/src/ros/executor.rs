//! The task in which a node answers requests, hears messages and does what is due at regular times.

use std::{
    convert::Infallible,
    future::{Future as _, poll_fn},
    sync::{
        Arc, Mutex, OnceLock, PoisonError,
        mpsc::{self, Receiver, Sender},
    },
    task::{Context, Poll, Waker},
    time::Duration,
};

use lgvi_msgs::{RosMessage, Service};
use tokio::{
    task::JoinHandle,
    time::{Instant, sleep},
};
use tracing::warn;

use super::{PublishError, RequestId, RosError, RosNode, ServiceServer, Subscription};
use crate::runtime::runtime;

/// Requests or messages of one endpoint that are taken before the others have their turn.
const TURN: usize = 16;

/// The longest pause.
const PAUSE: Duration = Duration::from_secs(1);

/// What an executor looks after. It begins with [`start`](Self::start).
#[derive(Default)]
pub struct Executor {
    tasks: Vec<Box<dyn Task>>,
    wakeup: Wakeup,
}

/// A started executor. Dropping it ends it after the turn that it is at.
#[derive(Debug)]
pub struct Running {
    task: JoinHandle<()>,
    end: Mutex<Receiver<Infallible>>,
    wakeup: Wakeup,
}

/// Wakes an executor that has had its first turn; the others will look by themselves.
#[derive(Clone, Debug, Default)]
pub(super) struct Wakeup(Arc<OnceLock<Waker>>);

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

    /// Offers a service, by a name that is expanded and remapped: its requests are answered by `answer`, at once or later
    /// through the [`Reply`].
    pub fn serve<S: Service>(
        &mut self,
        node: &RosNode,
        service: &str,
        answer: impl FnMut(S::Request, Reply<S>) + Send + 'static,
    ) -> Result<(), RosError> {
        let server = Arc::new(node.service_server(service)?);
        self.add(Serving { server, answer });
        Ok(())
    }

    /// The same for a service whose requests are answered at once; by the default response where the answer is too long to
    /// be sent.
    pub fn answer<S: Service>(
        &mut self,
        node: &RosNode,
        service: &str,
        mut answer: impl FnMut(S::Request) -> S::Response + Send + 'static,
    ) -> Result<(), RosError>
    where
        S::Response: Default,
    {
        self.serve::<S>(node, service, move |request, reply| {
            let response = answer(request);
            match reply.server.reply(reply.id, &response) {
                Err(error @ PublishError::TooLong { .. }) => {
                    warn!("an empty reply is sent instead: {error}");
                    reply.send(&S::Response::default());
                }
                sent => warn_of(sent),
            }
        })
    }

    /// Has the messages of a subscription heard by `hear`.
    pub fn listen<M: RosMessage + 'static>(
        &mut self,
        subscription: Subscription<M>,
        hear: impl FnMut(M) + Send + 'static,
    ) {
        self.add(Listening { subscription, hear });
    }

    /// Has `act` called once a period; what is missed is not made up for.
    pub fn every(&mut self, period: Duration, act: impl FnMut() + Send + 'static) {
        let due = Instant::now() + period;
        self.add(Timed { period, due, act });
    }

    /// Has `act` called whenever the executor is awake: after [`Running::wake`], and at least once a second.
    pub fn whenever(&mut self, act: impl FnMut() + Send + 'static) {
        self.add(Whenever(act));
    }

    /// Adds a task.
    pub(super) fn add(&mut self, task: impl Task + 'static) {
        self.tasks.push(Box::new(task));
    }

    /// Wakes the executor once it has started.
    pub(super) fn handle(&self) -> Wakeup {
        self.wakeup.clone()
    }

    /// Begins, on the runtime of the process. The tasks have their turns one after the other.
    pub fn start(self) -> Result<Running, RosError> {
        let Self { tasks, wakeup } = self;
        let (ended, end) = mpsc::channel();
        let mut turns = Turns {
            tasks,
            _ended: ended,
        };
        let own = wakeup.clone();
        let runtime = runtime()?;
        let _entered = runtime.enter();
        let mut pause = Box::pin(sleep(Duration::ZERO));
        let future = poll_fn(move |context| {
            own.0.get_or_init(|| context.waker().clone());
            let next = turns.next(context);
            pause.as_mut().reset(Instant::now() + next);
            if next.is_zero() || pause.as_mut().poll(context).is_ready() {
                context.waker().wake_by_ref();
            }
            Poll::<()>::Pending
        });
        let task = runtime.spawn(future);
        let end = Mutex::new(end);
        Ok(Running { task, end, wakeup })
    }
}

/// The tasks of a started executor.
struct Turns {
    tasks: Vec<Box<dyn Task>>,
    /// Dropped after the tasks, so that who waits for it finds nothing of them any more.
    _ended: Sender<Infallible>,
}

impl Turns {
    /// Each task has its turn; returns how long to pause at most.
    fn next(&mut self, context: &mut Context<'_>) -> Duration {
        let pauses = self.tasks.iter_mut().map(|task| task.turn(context));
        pauses.min().unwrap_or(PAUSE)
    }
}

impl Wakeup {
    /// Has everything looked after now. Does not lock.
    pub(super) fn wake(&self) {
        if let Some(waker) = self.0.get() {
            waker.wake_by_ref();
        }
    }
}

impl Running {
    /// Has everything looked after now. Does not lock.
    pub fn wake(&self) {
        self.wakeup.wake();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.task.abort();
        // The task drops its sender.
        let end = self.end.get_mut().unwrap_or_else(PoisonError::into_inner);
        let _ = end.recv();
    }
}

impl<S: Service> Reply<S> {
    /// Answers the request. Waits for no client; at most 20 ms for room.
    pub fn send(self, response: &S::Response) {
        warn_of(self.server.reply(self.id, response));
    }
}

fn warn_of(sent: Result<(), PublishError>) {
    if let Err(error) = sent {
        warn!("no reply: {error}");
    }
}

/// Something that has its turn whenever the executor is awake.
pub(super) trait Task: Send {
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
                Poll::Pending => return PAUSE,
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
