//! A topic in the bag.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use lgvi_bag::{BagWriter, TopicId, WriteError};
use tracing::warn;

use crate::account::Track;
use crate::batch::Head;

/// A topic in the bag, or on its way there.
pub(crate) struct Recorded {
    track: Arc<Track>,
    /// Once it has been written to.
    id: Option<TopicId>,
}

impl Recorded {
    pub(crate) fn new(track: Arc<Track>) -> Self {
        Self { track, id: None }
    }

    /// Writes a message, unless the topic is not described yet.
    pub(crate) fn write(
        &mut self,
        writer: &mut BagWriter,
        head: Head,
        cdr: &[u8],
    ) -> Result<(), WriteError> {
        if self.id.is_none()
            && let Some(topic) = self.track.topic.get()
        {
            self.id = Some(writer.add_topic(topic)?);
        }
        let Some(id) = self.id else {
            return Ok(());
        };
        let [log_time, publish_time] =
            [head.log_time, head.publish_time].map(|time| time.max(0).cast_unsigned());
        // The bag's field is narrower; what counts is that neighbors differ.
        let sequence = head.sequence as u32;
        let Head { publisher, .. } = head;
        writer.write_of(publisher, id, log_time, publish_time, sequence, cdr)?;
        self.track.written.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    /// Counts a message that the bag cannot take.
    pub(crate) fn pass_over(&self, error: &WriteError) {
        let Track { name, unusable, .. } = &*self.track;
        if unusable.fetch_add(1, Ordering::Relaxed) == 0 {
            warn!("{name}: a message cannot be recorded: {error}");
        }
    }
}
