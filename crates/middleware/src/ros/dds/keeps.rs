//! What a node knows of the endpoints and participants of others.

use std::{sync::Arc, time::Duration};

use rustdds::{DomainParticipantStatusEvent as Event, GUID};

use super::{
    faults::Faults, fence::Fence, first_samples::FirstSamples, laggards::Laggards,
    matches::Matches, names::Names,
};

/// What the background thread keeps up to date.
pub(super) struct Keeps {
    pub(super) matches: Arc<Matches>,
    pub(super) laggards: Arc<Laggards>,
    pub(super) names: Arc<Names>,
    pub(super) faults: Arc<Faults>,
    pub(super) fence: Arc<Fence>,
    pub(super) first_samples: Arc<FirstSamples>,
}

impl Keeps {
    pub(super) fn apply(&self, event: Event) {
        if self.fence.apply(&event) {
            return;
        }
        self.faults.apply(&event);
        if let Event::ParticipantLost { id, .. } = event {
            self.names.retain(|participant| participant.prefix != id);
        }
        let matched = match event {
            Event::RemoteWriterMatched {
                local_reader,
                remote_writer,
            } => Some((local_reader, remote_writer)),
            _ => None,
        };
        // Before the first samples, so that `Participant::serve` misses none.
        self.matches.apply(event);
        if let Some((reader, writer)) = matched {
            self.first_samples.expect(reader, writer);
        }
    }

    /// Forgets the remote endpoints and participants for which this is not so.
    pub(super) fn retain(
        &self,
        endpoint: impl Fn(GUID) -> bool,
        participant: impl Fn(GUID) -> bool,
    ) {
        self.matches.retain(&endpoint);
        self.faults.retain(&endpoint);
        self.names.retain(&participant);
        self.laggards.retain(&participant);
    }

    /// Does what is due; returns when there will be more to do.
    pub(super) fn tend(&self) -> Option<Duration> {
        self.names.refresh();
        let report = self.faults.report(&self.names);
        let reminder = self.laggards.remind(&self.matches);
        let asking = self.first_samples.ask(&self.laggards);
        report.into_iter().chain(reminder).chain(asking).min()
    }
}
