//! The task in which a node answers requests, hears messages and does what is due at regular times.

use std::{
    convert::Infallible,
    future::poll_fn,
    pin::Pin,
    sync::{Arc, OnceLock},
    task::{Context, Poll, Waker},
    time::Duration,
};

use lgvi_msgs::{RosMessage, Service};
use tokio::{
    runtime::{Handle, RuntimeFlavor},
    task::{self, JoinHandle, unconstrained, yield_now},
    time::{Instant, MissedTickBehavior, interval, interval_at},
};
use tracing::warn;

use super::{PublishError, Request, RequestId, RosError, RosNode, ServiceServer, Subscription};
use crate::{block::block_on_for, runtime::runtime};

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

/// A started executor. Dropping it waits until nothing of it is left, but for a task that drops its own executor, which ends
/// after this turn.
#[derive(Debug)]
pub struct Running {
    task: JoinHandle<()>,
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
        let Self { mut tasks, wakeup } = self;
        let own = wakeup.clone();
        let task = runtime()?.spawn(poll_fn(move |context| {
            own.0.get_or_init(|| context.waker().clone());
            for task in &mut tasks {
                let _ = task.as_mut().poll(context);
            }
            Poll::<()>::Pending
        }));
        Ok(Running { task, wakeup })
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
        if task::try_id() == Some(self.task.id()) {
            return;
        }
        let mut ended = || block_on_for(unconstrained(&mut self.task), Duration::MAX);
        let single = RuntimeFlavor::CurrentThread;
        let _ = match Handle::try_current() {
            Ok(runtime) if runtime.runtime_flavor() == single => ended(),
            // The task may be next on this very thread, which others take over meanwhile.
            _ => task::block_in_place(ended),
        };
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
    use std::sync::{
        Mutex,
        mpsc::{self, Receiver},
    };

    use super::*;
    use crate::sync::lock;

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

    /// Has something done on another thread, which must come to its end.
    fn ends(act: impl FnOnce() + Send + 'static) -> bool {
        let (end, ended) = mpsc::channel();
        std::thread::spawn(move || {
            act();
            end.send(()).unwrap();
        });
        ended.recv_timeout(Duration::from_secs(10)).is_ok()
    }

    /// An executor that drops what it finds in a place, and tells of it.
    fn dropping(place: &Arc<Mutex<Option<Running>>>) -> (Running, Receiver<()>) {
        let (tell, told) = mpsc::channel();
        let place = Arc::clone(place);
        let mut executor = Executor::new();
        executor.every(Duration::from_millis(1), move || {
            if let Some(running) = lock(&place).take() {
                drop(running);
                tell.send(()).unwrap();
            }
        });
        (executor.start().unwrap(), told)
    }

    #[test]
    fn an_executor_may_be_dropped_by_its_own_task() {
        assert!(ends(|| {
            let place = Arc::default();
            let (running, dropped) = dropping(&place);
            *lock(&place) = Some(running);
            dropped.recv().unwrap();
        }));
    }

    #[test]
    fn an_executor_may_be_dropped_by_a_task_of_another() {
        assert!(ends(|| {
            let place = Arc::default();
            let (_other, dropped) = dropping(&place);
            let held = Arc::new(());
            let holding = Arc::clone(&held);
            let mut executor = Executor::new();
            executor.whenever(move || assert_eq!(Arc::strong_count(&holding), 2));
            *lock(&place) = Some(executor.start().unwrap());
            dropped.recv().unwrap();
            assert_eq!(Arc::strong_count(&held), 1);
        }));
    }
}
