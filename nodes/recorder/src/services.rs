//! What is asked of a recording from outside, by the services of rosbag2's recorder.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lgvi_middleware::node::{Node, NodeError};
use lgvi_middleware::ros::{Executor, Running};
use lgvi_msgs::rosbag2_interfaces::srv::{
    IsPaused, IsPausedResponse, Pause, PauseResponse, Resume, ResumeResponse, SplitBagfile,
    SplitBagfileResponse,
};
use tracing::{info, warn};

use crate::queue::{Queue, Split};

/// The services, as long as the node is configured.
pub(crate) struct Services {
    /// Whether messages are dropped on purpose.
    pub(crate) paused: Arc<AtomicBool>,
    recording: Recording,
    _executor: Running,
}

/// The queue of the recording under way.
#[derive(Clone, Default)]
struct Recording(Arc<Mutex<Option<Arc<Queue>>>>);

impl Services {
    /// Offers `~/pause`, `~/resume`, `~/is_paused` and `~/split_bagfile`.
    pub(crate) fn serve(node: &Node) -> Result<Self, NodeError> {
        let paused = Arc::<AtomicBool>::default();
        let recording = Recording::default();
        let ros = &node.ros;
        let mut executor = Executor::new();
        let runtime = NodeError::runtime;

        let this = Arc::clone(&paused);
        let pause = ros.service_server("~/pause").map_err(runtime)?;
        executor.serve::<Pause>(pause, move |_, reply| {
            if !this.swap(true, Ordering::Relaxed) {
                info!("paused");
            }
            reply.send(&PauseResponse::default());
        });
        let this = Arc::clone(&paused);
        let resume = ros.service_server("~/resume").map_err(runtime)?;
        executor.serve::<Resume>(resume, move |_, reply| {
            if this.swap(false, Ordering::Relaxed) {
                info!("resumed");
            }
            reply.send(&ResumeResponse::default());
        });
        let this = Arc::clone(&paused);
        let is_paused = ros.service_server("~/is_paused").map_err(runtime)?;
        executor.serve::<IsPaused>(is_paused, move |_, reply| {
            let paused = this.load(Ordering::Relaxed);
            reply.send(&IsPausedResponse { paused });
        });
        let this = recording.clone();
        let split = ros.service_server("~/split_bagfile").map_err(runtime)?;
        executor.serve::<SplitBagfile>(split, move |_, reply| {
            let answer: Split = Box::new(move |split| {
                if let Err(why) = split {
                    warn!("not split: {why}");
                }
                reply.send(&SplitBagfileResponse::default());
            });
            match &*this.lock() {
                Some(queue) => queue.split(answer),
                None => answer(Err("nothing is recorded".to_owned())),
            }
        });
        Ok(Self {
            paused,
            recording,
            _executor: executor.start().map_err(NodeError::runtime)?,
        })
    }

    /// Has files split through this queue until the returned guard is dropped.
    #[must_use]
    pub(crate) fn attach(&self, queue: &Arc<Queue>) -> Attached {
        *self.recording.lock() = Some(Arc::clone(queue));
        Attached(self.recording.clone())
    }
}

/// A recording that can be split.
pub(crate) struct Attached(Recording);

impl Drop for Attached {
    fn drop(&mut self) {
        *self.0.lock() = None;
    }
}

impl Recording {
    fn lock(&self) -> MutexGuard<'_, Option<Arc<Queue>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
