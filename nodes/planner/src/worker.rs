use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use lgvi_middleware::node::NodeError;
use lgvi_scene::Scene;

use crate::solver::{self, Iteration, Reason, Solved, Task, Unsolved};

/// What the worker says of a task, by its number.
pub(crate) enum Update {
    /// Where the solver is.
    Iteration(Iteration),
    /// The task is over.
    Ended(Box<Result<Solved, Unsolved>>),
}

/// The right to end a task before it has ended by itself.
#[derive(Debug)]
pub(crate) struct Stop {
    cancelled: AtomicBool,
    deadline: Option<Instant>,
}

impl Stop {
    pub(crate) fn new(deadline: Option<Instant>) -> Self {
        Self {
            cancelled: AtomicBool::new(false),
            deadline,
        }
    }

    pub(crate) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Release);
    }

    /// Why the task is to end now, if it is.
    pub(crate) fn reason(&self) -> Option<Reason> {
        if self.cancelled.load(Ordering::Acquire) {
            return Some(Reason::Cancelled);
        }
        let over = self
            .deadline
            .is_some_and(|deadline| Instant::now() >= deadline);
        over.then_some(Reason::Deadline)
    }
}

type Job = (u64, Task, Arc<Stop>);

/// A thread that solves one task after the other. It ends with the process.
pub(crate) struct Worker {
    jobs: Sender<Job>,
    updates: Receiver<(u64, Update)>,
    /// Number of the last task.
    last: u64,
}

impl Worker {
    pub(crate) fn start(scene: Arc<Scene>) -> Result<Self, NodeError> {
        let (jobs, accepted) = channel::<Job>();
        let (sender, updates) = channel();
        std::thread::Builder::new()
            .name("solver".into())
            .spawn(move || work(&scene, &accepted, &sender))
            .map_err(NodeError::runtime)?;
        Ok(Self {
            jobs,
            updates,
            last: 0,
        })
    }

    /// Hands over a task, which is begun when those before it are over; its number.
    pub(crate) fn give(&mut self, task: Task, stop: Arc<Stop>) -> Result<u64, NodeError> {
        self.last += 1;
        self.jobs
            .send((self.last, task, stop))
            .map_err(|_| NodeError::runtime("the solver's thread has ended"))?;
        Ok(self.last)
    }

    /// The next thing that the worker says, up to `timeout`.
    pub(crate) fn hear(&self, timeout: Duration) -> Result<Option<(u64, Update)>, NodeError> {
        match self.updates.recv_timeout(timeout) {
            Ok(update) => Ok(Some(update)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => {
                Err(NodeError::runtime("the solver's thread has ended"))
            }
        }
    }
}

fn work(scene: &Scene, jobs: &Receiver<Job>, updates: &Sender<(u64, Update)>) {
    while let Ok((number, task, stop)) = jobs.recv() {
        let mut observe = |now: &Iteration| {
            // Nobody hears it only when the process is about to end.
            let heard = updates.send((number, Update::Iteration(*now))).is_ok();
            heard && stop.reason().is_none()
        };
        let ended = solver::solve(scene, &task, &mut observe);
        let ended = ended.map_err(|unsolved| match (unsolved.reason, stop.reason()) {
            (Reason::Cancelled, Some(Reason::Deadline)) => Unsolved {
                reason: Reason::Deadline,
                message: "the time is used up".into(),
                ..unsolved
            },
            (Reason::Cancelled, Some(reason)) => Unsolved { reason, ..unsolved },
            // The solver stops by itself where not even its best iterate can be flown.
            (Reason::Cancelled, None) => Unsolved {
                reason: Reason::NotConverged,
                message: "not converged: no iterate can be flown".into(),
                ..unsolved
            },
            _ => unsolved,
        });
        if updates
            .send((number, Update::Ended(Box::new(ended))))
            .is_err()
        {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::{End, Initial};

    /// What would take minutes.
    fn long() -> (Arc<Scene>, Task) {
        let text = include_str!("../../../scenes/inclination_change.toml");
        let text = text.replace("steps = 1000", "steps = 300000");
        let scene = Scene::parse("test", &text).unwrap();
        let task = Task {
            first_step: 0,
            initial: Initial::State(scene.bodies[0].state),
            end: End::After(300_000),
            guess: None,
            switches: None,
        };
        (Arc::new(scene), task)
    }

    /// The reason for which a task ends.
    fn ending(worker: &Worker, task: u64) -> Reason {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(30) {
            if let Some((number, Update::Ended(ended))) =
                worker.hear(Duration::from_millis(10)).unwrap()
                && number == task
            {
                return ended.unwrap_err().reason;
            }
        }
        panic!("task {task} does not end")
    }

    #[test]
    fn tasks_end_when_they_are_cancelled_or_late_and_the_next_is_begun() {
        let (scene, task) = long();
        let mut worker = Worker::start(scene).unwrap();
        let cancelled = Arc::new(Stop::new(None));
        let first = worker.give(task.clone(), Arc::clone(&cancelled)).unwrap();
        let deadline = Instant::now() + Duration::from_millis(50);
        let late = worker
            .give(task.clone(), Arc::new(Stop::new(Some(deadline))))
            .unwrap();
        assert!(worker.hear(Duration::from_secs(30)).unwrap().is_some());
        cancelled.cancel();
        assert_eq!(ending(&worker, first), Reason::Cancelled);
        assert_eq!(ending(&worker, late), Reason::Deadline);
    }
}
