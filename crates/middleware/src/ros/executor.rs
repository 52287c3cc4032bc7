//! The task in which a node answers requests, hears messages and does what is due at regular times.

use std::{
    convert::Infallible,
    future::poll_fn,
    pin::Pin,
    sync::{
        Arc, Mutex, OnceLock, PoisonError,
        mpsc::{self, Receiver, Sender},
    },
    task::{Context, Poll, Waker},
    time::Duration,
};

use lgvi_msgs::{RosMessage, Service};
use tokio::{
    task::{JoinHandle, yield_now},
    time::{Instant, MissedTickBehavior, interval, interval_at},
};
use tracing::warn;

use super::{PublishError, Request, RequestId, RosError, RosNode, ServiceServer, Subscription};
use crate::runtime::runtime;

/// The longest pause.
const PAUSE: Duration = Duration::from_secs(1);

/// Something that goes on as long as the executor does.
type Task = Pin<Box<dyn Future<Output = Infallible> + Send>>;

/// What an executor looks after. It begins with [`start`](Self::start).
#[derive(Default)]
pub struct Executor {
    tasks: Vec<Task>,
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
        mut answer: impl FnMut(S::Request, Reply<S>) + Send + 'static,
    ) -> Result<(), RosError> {
        let server = Arc::new(node.service_server(service)?);
        self.add(async move {
            loop {
                match server.recv().await {
                    Ok(Request { id, message }) => {
                        let server = Arc::clone(&server);
                        answer(message, Reply { server, id });
                    }
                    Err(error) => warn!("request ignored: {error}"),
                }
                yield_now().await;
            }
        });
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
        mut hear: impl FnMut(M) + Send + 'static,
    ) {
        self.add(async move {
            loop {
                match subscription.recv().await {
                    Ok(sample) => hear(sample.message),
                    Err(error) => warn!("message ignored: {error}"),
                }
                yield_now().await;
            }
        });
    }

    /// Has `act` called once a period; what is missed is not made up for.
    pub fn every(&mut self, period: Duration, mut act: impl FnMut() + Send + 'static) {
        self.add(async move {
            let mut ticks = interval_at(Instant::now() + period, period);
            ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
            loop {
                ticks.tick().await;
                act();
            }
        });
    }

    /// Has `act` called whenever the executor is awake: after [`Running::wake`], and at least once a second.
    pub fn whenever(&mut self, mut act: impl FnMut() + Send + 'static) {
        self.cycle(PAUSE, move |_| act());
    }

    /// Has `turn` called whenever the executor is awake, and at least once a period.
    pub(super) fn cycle(
        &mut self,
        period: Duration,
        mut turn: impl FnMut(&Context<'_>) + Send + 'static,
    ) {
        self.add(async move {
            let mut ticks = interval(period);
            poll_fn(move |context| {
                while ticks.poll_tick(context).is_ready() {}
                turn(context);
                Poll::Pending
            })
            .await
        });
    }

    fn add(&mut self, task: impl Future<Output = Infallible> + Send + 'static) {
        self.tasks.push(Box::pin(task));
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
        let task = runtime()?.spawn(poll_fn(move |context| {
            own.0.get_or_init(|| context.waker().clone());
            // All of it is moved into this task.
            let turns = &mut turns;
            for task in &mut turns.tasks {
                let _ = task.as_mut().poll(context);
            }
            Poll::<()>::Pending
        }));
        let end = Mutex::new(end);
        Ok(Running { task, end, wakeup })
    }
}

/// The tasks of a started executor.
struct Turns {
    tasks: Vec<Task>,
    /// Dropped after the tasks, so that who waits for it finds nothing of them any more.
    _ended: Sender<Infallible>,
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

    #[test]
    fn nothing_of_an_executor_is_left_once_it_is_dropped() {
        let (act, acted) = mpsc::channel();
        let held = Arc::new(());
        let holding = Arc::clone(&held);
        let mut executor = Executor::new();
        executor.whenever(move || {
            act.send(()).unwrap();
            std::thread::sleep(Duration::from_millis(100));
            assert_eq!(Arc::strong_count(&holding), 2);
        });
        let running = executor.start().unwrap();
        acted.recv().unwrap();
        drop(running);
        assert_eq!(Arc::strong_count(&held), 1);
    }
}
