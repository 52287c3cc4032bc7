//! iceoryx2 with an event for each sample, which wakes the receiver: what this project's shared memory does without.

use std::time::{Duration, Instant};

use iceoryx2::node::Node;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::ipc_threadsafe;
use iceoryx2::service::port_factory::event::PortFactory;

use super::shm::{BareReceiver, BareSender, debug};
use super::way::{Receiver, Sender, Stamp};
use super::{Place, failed};
use crate::error::BenchError;

type Service = ipc_threadsafe::Service;

/// The end that sends, then notifies.
pub(super) struct EventSender {
    samples: BareSender,
    notifier: Notifier<Service>,
    _events: PortFactory<Service>,
}

/// The end that waits for events, then receives.
pub(super) struct EventReceiver {
    samples: BareReceiver,
    listener: Listener<Service>,
    _events: PortFactory<Service>,
}

fn events(node: &Node<Service>) -> Result<PortFactory<Service>, BenchError> {
    let name = "bare/state".try_into().map_err(debug)?;
    let builder = node.service_builder(&name).event();
    builder.open_or_create().map_err(debug)
}

impl EventSender {
    pub(super) fn new(place: &Place, bodies: usize) -> Result<Self, BenchError> {
        let samples = BareSender::new(place, bodies)?;
        let events = events(samples.node())?;
        let notifier = events.notifier_builder().create().map_err(failed)?;
        Ok(Self {
            samples,
            notifier,
            _events: events,
        })
    }
}

impl Sender for EventSender {
    fn send(&mut self, stamp: Stamp) -> Result<(), BenchError> {
        self.samples.send(stamp)?;
        self.notifier.notify().map(drop).map_err(failed)
    }
}

impl EventReceiver {
    pub(super) fn new(place: &Place) -> Result<Self, BenchError> {
        let samples = BareReceiver::new(place, true)?;
        let events = events(samples.node())?;
        let listener = events.listener_builder().create().map_err(failed)?;
        Ok(Self {
            samples,
            listener,
            _events: events,
        })
    }
}

impl Receiver for EventReceiver {
    fn receive(&mut self, patience: Duration) -> Result<Option<Stamp>, BenchError> {
        let begun = Instant::now();
        loop {
            if let Some(stamp) = self.samples.receive(Duration::ZERO)? {
                return Ok(Some(stamp));
            }
            let left = patience.saturating_sub(begun.elapsed());
            if left.is_zero() {
                return Ok(None);
            }
            self.listener.timed_wait(|_| {}, left).map_err(failed)?;
        }
    }
}
