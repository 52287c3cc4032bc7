//! The receiving end of a channel.

use iceoryx2::{port::subscriber::Subscriber, prelude::PortFactory as _, sample::Sample};

use super::{
    Service, ShmError, ShmNode,
    channel::{Channel, Control, State},
    node::Open,
};

/// Receives samples of a channel.
#[derive(Debug)]
pub struct ShmSubscriber<C: Channel> {
    port: Subscriber<Service, [C::Element], C::Header>,
    latest: Option<u64>,
    lost: u64,
    open: Open<C>,
    service: String,
}

/// A received sample, read where the publisher has written it. Up to two may be held at a time.
pub struct ShmSample<C: Channel>(Sample<Service, [C::Element], C::Header>);

impl<C: Channel> ShmSample<C> {
    /// What stands before the elements.
    pub fn header(&self) -> &C::Header {
        self.0.user_header()
    }

    /// The elements.
    pub fn elements(&self) -> &[C::Element] {
        self.0.payload()
    }
}

impl ShmNode {
    /// Creates a subscriber for states, of which up to `buffer` wait to be received: at least 1, at most 8192.
    pub fn state_subscriber(
        &self,
        topic: &str,
        buffer: usize,
    ) -> Result<ShmSubscriber<State>, ShmError> {
        ShmSubscriber::new(self, topic, buffer)
    }

    /// Creates a subscriber for control sequences; it gets the last one of each publisher too.
    pub fn control_subscriber(&self, topic: &str) -> Result<ShmSubscriber<Control>, ShmError> {
        ShmSubscriber::new(self, topic, Control::BUFFER)
    }
}

impl<C: Channel> ShmSubscriber<C> {
    fn new(node: &ShmNode, topic: &str, buffer: usize) -> Result<Self, ShmError> {
        let (service, open) = node.open::<C>(topic)?;
        let port = open
            .subscriber_builder()
            .buffer_size(buffer.clamp(1, C::BUFFER))
            .create()
            .map_err(|error| ShmError::service(&service, "create a subscriber", error))?;
        Ok(Self {
            port,
            latest: None,
            lost: 0,
            open,
            service,
        })
    }

    /// Takes the next sample; `None` if there is none. Also connects to new publishers: poll at least every 10 ms.
    pub fn receive(&mut self) -> Result<Option<ShmSample<C>>, ShmError> {
        let sample = self.port.receive();
        let sample = sample.map_err(|error| ShmError::service(&self.service, "receive", error))?;
        if let Some(sequence) = sample
            .as_ref()
            .and_then(|sample| C::sequence(sample.user_header()))
        {
            self.count_gap(sequence);
        }
        Ok(sample.map(ShmSample))
    }

    /// How many samples are missing between those received. A sequence that starts anew is a new run, not a loss.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// How many publishers there are; one that was killed counts until it is cleaned up.
    pub fn publishers(&self) -> usize {
        self.open.dynamic_config().number_of_publishers()
    }

    fn count_gap(&mut self, sequence: u64) {
        if let Some(latest) = self.latest.replace(sequence) {
            let gap = sequence.saturating_sub(latest).saturating_sub(1);
            self.lost = self.lost.saturating_add(gap);
        }
    }
}
