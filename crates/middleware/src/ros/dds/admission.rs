//! How a sample finds room in a publisher's window.

use std::{
    sync::atomic::Ordering,
    time::{Duration, Instant},
};

use rustdds::{WriteOptions, bytes::Bytes, dds::result::WriteError, rpc::SampleIdentity};
use tracing::warn;

use super::{laggards::RemoteReader, publisher::Writer};
use crate::{block::block_on_for, ros::PublishError};

/// How long a subscription that did not keep up before is waited for when it holds up a publisher again, which is
/// once in half a window.
const GRACE: Duration = Duration::from_millis(20);

/// How long it may take until RustDDS has made room.
const TURNAROUND: Duration = Duration::from_millis(20);

impl Writer {
    /// Writes a sample as soon as there is room, waiting up to `limit`; then overwrites what the subscriptions that do
    /// not keep up have not received, but for the later half of the window.
    pub(super) fn admit(
        &self,
        payload: &Bytes,
        options: &WriteOptions,
        limit: Duration,
    ) -> Result<SampleIdentity, PublishError> {
        if let Some(identity) = self.attempt(payload, options, Duration::ZERO)? {
            return Ok(identity);
        }
        let start = Instant::now();
        if self.node().laggards.is_secured() {
            return self.admit_in_time(payload, options, limit);
        }
        let readers = self.node().reliable_readers(self.guid());
        let (suspects, others): (Vec<_>, Vec<_>) = readers
            .into_iter()
            .partition(|reader| self.node().laggards.suspects(reader.guid));
        if !suspects.is_empty() {
            if let Some(identity) = self.attempt(payload, options, GRACE.min(limit))? {
                for reader in &suspects {
                    self.node().laggards.pardon(reader.guid);
                }
                return Ok(identity);
            }
            for reader in &suspects {
                if let Some(identity) = self.overwrite_for(reader, payload, options)? {
                    return Ok(identity);
                }
            }
        }
        let left = limit.saturating_sub(start.elapsed());
        if let Some(identity) = self.attempt(payload, options, left)? {
            return Ok(identity);
        }
        for reader in &others {
            if let Some(identity) = self.overwrite_for(reader, payload, options)? {
                if self.node().laggards.suspect(reader.guid) {
                    let subscription = self.node().describe(reader.guid);
                    warn!(
                        topic = self.local.topic,
                        subscription, "does not keep up: loses messages from now on"
                    );
                }
                return Ok(identity);
            }
        }
        Err(self.no_room(start))
    }

    /// The same where nothing can be overwritten: room is waited for once, until there is some again.
    fn admit_in_time(
        &self,
        payload: &Bytes,
        options: &WriteOptions,
        limit: Duration,
    ) -> Result<SampleIdentity, PublishError> {
        let start = Instant::now();
        if !self.stalled.load(Ordering::Relaxed) {
            if let Some(identity) = self.attempt(payload, options, limit)? {
                return Ok(identity);
            }
            warn!(
                topic = self.local.topic,
                "a subscription does not keep up: messages are lost for all until it does"
            );
        }
        Err(self.no_room(start))
    }

    fn no_room(&self, start: Instant) -> PublishError {
        self.stalled.store(true, Ordering::Relaxed);
        PublishError::Full {
            topic: self.local.topic.clone(),
            waited: start.elapsed(),
            dropped: self.dropped.fetch_add(1, Ordering::Relaxed) + 1,
        }
    }

    fn overwrite_for(
        &self,
        reader: &RemoteReader,
        payload: &Bytes,
        options: &WriteOptions,
    ) -> Result<Option<SampleIdentity>, PublishError> {
        let next = self.sent.load(Ordering::Relaxed) + 1;
        let kept = (self.window / 2) as u64;
        let before = i64::try_from(next.saturating_sub(kept)).unwrap_or(i64::MAX);
        let writer = self.guid();
        self.node().laggards.overwrite(writer, reader, before);
        self.node().background.unpark();
        let limit = if self.stalled.load(Ordering::Relaxed) {
            Duration::ZERO
        } else {
            TURNAROUND
        };
        self.attempt(payload, options, limit)
    }

    fn attempt(
        &self,
        payload: &Bytes,
        options: &WriteOptions,
        limit: Duration,
    ) -> Result<Option<SampleIdentity>, PublishError> {
        let written = self.node().farewell.wait(limit, |slice| {
            let write = self
                .writer
                .async_write_with_options(payload.clone(), options.clone());
            match block_on_for(write, slice) {
                None | Some(Err(WriteError::WouldBlock { .. })) => None,
                written => written,
            }
        });
        match written {
            Some(Ok(identity)) => {
                self.stalled.store(false, Ordering::Relaxed);
                Ok(Some(identity))
            }
            None => Ok(None),
            Some(Err(error)) => Err(self.dds_error(&error)),
        }
    }
}
