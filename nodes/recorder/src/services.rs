//! What is asked of a recording from outside, by the services of rosbag2's recorder.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use lgvi_middleware::ros::{Executor, RosError, RosNode, Running};
use lgvi_middleware::sync::lock;
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
    pub(crate) fn serve(ros: &RosNode) -> Result<Self, RosError> {
        let paused = Arc::<AtomicBool>::default();
        let recording = Recording::default();
        let mut executor = Executor::new();

        let this = Arc::clone(&paused);
        executor.answer::<Pause>(ros, "~/pause", move |_| {
            if !this.swap(true, Ordering::Relaxed) {
                info!("paused");
            }
            PauseResponse::default()
        })?;
        let this = Arc::clone(&paused);
        executor.answer::<Resume>(ros, "~/resume", move |_| {
            if this.swap(false, Ordering::Relaxed) {
                info!("resumed");
            }
            ResumeResponse::default()
        })?;
        let this = Arc::clone(&paused);
        executor.answer::<IsPaused>(ros, "~/is_paused", move |_| IsPausedResponse {
            paused: this.load(Ordering::Relaxed),
        })?;
        let this = recording.clone();
        executor.serve::<SplitBagfile>(ros, "~/split_bagfile", move |_, reply| {
            let answer: Split = Box::new(move |split| {
                if let Err(why) = split {
                    warn!("not split: {why}");
                }
                reply.send(&SplitBagfileResponse::default());
            });
            let queue = lock(&this.0).clone();
            match queue {
                Some(queue) => queue.split(answer),
                None => answer(Err("nothing is recorded".to_owned())),
            }
        })?;
        Ok(Self {
            paused,
            recording,
            _executor: executor.start()?,
        })
    }

    /// Has files split through this queue until the returned guard is dropped.
    #[must_use]
    pub(crate) fn attach(&self, queue: &Arc<Queue>) -> Attached {
        *lock(&self.recording.0) = Some(Arc::clone(queue));
        Attached(self.recording.clone())
    }
}

/// A recording that can be split.
pub(crate) struct Attached(Recording);

impl Drop for Attached {
    fn drop(&mut self) {
        *lock(&self.0.0) = None;
    }
}
