//! The sending end of a channel.

use std::{
    mem::MaybeUninit,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use iceoryx2::{
    port::{
        LoanError,
        publisher::{Publisher, PublisherCreateError},
        update_connections::UpdateConnections,
    },
    prelude::{AllocationStrategy, PortFactory as _},
    sample_mut_uninit::SampleMutUninit,
};

use super::{
    Service, ShmError, ShmNode,
    channel::{Channel, Control, State},
    delivery::{Backpressure, Delivered, Delivery},
    node::Open,
    room::{self, Reserved},
};

/// The most memory a publisher may take, unless that is for less than its channel's fewest samples (byte).
const MEMORY_LIMIT: usize = 256 << 20;

/// Stands for all subscribers.
const ALL: u128 = u128::MAX;

/// The cycle at which it is looked for memory.
const MEMORY_POLL: Duration = Duration::from_micros(100);

/// The cycle at which counts are polled.
const POLL: Duration = Duration::from_millis(1);

/// How long new subscribers have to connect; they do so when they receive.
const CONNECT: Duration = Duration::from_millis(20);

/// Memory for one sample.
type Loan<C> =
    SampleMutUninit<Service, [MaybeUninit<<C as Channel>::Element>], <C as Channel>::Header>;

/// Publishes samples of a channel.
#[derive(Debug)]
pub struct ShmPublisher<C: Channel> {
    port: Publisher<Service, [C::Element], C::Header>,
    backpressure: Arc<Backpressure>,
    reserved: Reserved,
    lost: u64,
    open: Open<C>,
    service: String,
}

impl ShmNode {
    /// Creates the publisher of states of up to `bodies` bodies; there may be one of a topic.
    pub fn state_publisher(
        &self,
        topic: &str,
        bodies: usize,
        delivery: Delivery,
    ) -> Result<ShmPublisher<State>, ShmError> {
        ShmPublisher::new(self, topic, bodies, delivery)
    }

    /// Creates a publisher of control sequences.
    pub fn control_publisher(&self, topic: &str) -> Result<ShmPublisher<Control>, ShmError> {
        ShmPublisher::new(self, topic, 1, Delivery::DropNewest)
    }
}

impl<C: Channel> ShmPublisher<C> {
    /// `elements` is the length of samples that memory is taken for.
    fn new(
        node: &ShmNode,
        topic: &str,
        elements: usize,
        delivery: Delivery,
    ) -> Result<Self, ShmError> {
        let (service, open) = node.open::<C>(topic)?;
        check::<C>(&service, elements)?;
        let backpressure = Arc::new(Backpressure::new(delivery, node.shutdown().clone()));
        let decider = Arc::clone(&backpressure);
        let size = (elements * size_of::<C::Element>()).max(1);
        let port = open
            .publisher_builder()
            .initial_max_slice_len(elements)
            .allocation_strategy(C::GROWTH)
            .override_sample_preallocation(move |worst_case| {
                worst_case.min((MEMORY_LIMIT / size).max(C::FEWEST))
            })
            .set_backpressure_handler(move |info| decider.decide(info))
            .create()
            .map_err(|error| match error {
                PublisherCreateError::ExceedsMaxSupportedPublishers => ShmError::AlreadyPublished {
                    service: service.clone(),
                    limit: C::PUBLISHERS,
                },
                error => ShmError::service(&service, "create a publisher", error),
            })?;
        let mut publisher = Self {
            port,
            backpressure,
            reserved: Reserved::default(),
            lost: 0,
            open,
            service,
        };
        if let Ok(sample) = publisher.port.loan_slice_uninit(elements) {
            publisher.reserve(&sample)?;
        }
        Ok(publisher)
    }

    /// Delivers otherwise from the next sample on.
    pub fn deliver(&self, delivery: Delivery) {
        self.backpressure.deliver(delivery);
    }

    /// Sends a sample with these elements.
    ///
    /// Allocates nothing but iceoryx2's note of the loan while samples are no longer than the publisher was made for; locks and
    /// waits only for a subscriber whose buffer is full.
    pub fn send(
        &mut self,
        header: C::Header,
        elements: &[C::Element],
    ) -> Result<Delivered, ShmError> {
        check::<C>(&self.service, elements.len())?;
        let subscribers = self.subscribers();
        if C::GROWTH != AllocationStrategy::Static {
            room::check(&self.service, size_of_val(elements))?;
        }
        self.backpressure.begin();
        let receivers = match self.loan(elements.len()) {
            Ok(mut sample) => {
                self.reserve(&sample)?;
                *sample.user_header_mut() = header;
                let sent = sample.write_from_slice(elements).send();
                sent.map_err(|error| self.send_error(error))?
            }
            // All memory waits with subscribers that do not keep up.
            Err(LoanError::OutOfMemory) => 0,
            Err(LoanError::ExceedsMaxLoanSize) => {
                let limit = self.port.initial_max_slice_len();
                return Err(too_long(&self.service, elements.len(), limit));
            }
            Err(error) => return Err(self.send_error(error)),
        };
        let refused = if self.subscribers() == subscribers {
            subscribers.saturating_sub(receivers)
        } else {
            self.backpressure.refused()
        };
        self.lost += refused as u64;
        Ok(Delivered { receivers, refused })
    }

    /// Has room in shared memory for a sample before it is written.
    fn reserve(&mut self, sample: &Loan<C>) -> Result<(), ShmError> {
        let begin = std::ptr::from_ref(sample.header()).addr();
        let end = sample.payload().as_ptr_range().end.addr();
        self.reserved.cover(&self.service, &(begin..end))
    }

    /// Memory for a sample. While there is none, subscribers that have taken it all are waited for as one is whose
    /// buffer is full.
    fn loan(&self, elements: usize) -> Result<Loan<C>, LoanError> {
        let mut since = None;
        loop {
            match self.port.loan_slice_uninit(elements) {
                Err(LoanError::OutOfMemory) => {
                    let since = since.get_or_insert_with(Instant::now);
                    if !self.backpressure.must_wait(ALL, since.elapsed()) {
                        return Err(LoanError::OutOfMemory);
                    }
                    thread::sleep(MEMORY_POLL);
                }
                loaned => return loaned,
            }
        }
    }

    /// How many samples subscribers had no room for, summed over subscribers.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// How many subscribers there are; one that was killed counts until it is cleaned up.
    pub fn subscribers(&self) -> usize {
        self.open.dynamic_config().number_of_subscribers()
    }

    /// Blocks until so many subscribers are connected or the time has passed; returns whether they are.
    pub fn wait_for_subscribers(
        &mut self,
        count: usize,
        timeout: Duration,
    ) -> Result<bool, ShmError> {
        let start = Instant::now();
        while self.subscribers() < count {
            if start.elapsed() >= timeout {
                return Ok(false);
            }
            thread::sleep(POLL);
        }
        self.connect()?;
        thread::sleep(CONNECT);
        Ok(true)
    }

    /// Connects to subscribers that have come, which get the latest samples that the publisher keeps for them.
    pub fn connect(&self) -> Result<(), ShmError> {
        let connected = self.port.update_connections();
        connected.map_err(|error| self.send_error(error))
    }

    fn send_error(&self, reason: impl ToString) -> ShmError {
        ShmError::service(&self.service, "send", reason)
    }
}

fn check<C: Channel>(service: &str, elements: usize) -> Result<(), ShmError> {
    if elements > C::MAX_ELEMENTS {
        return Err(too_long(service, elements, C::MAX_ELEMENTS));
    }
    Ok(())
}

fn too_long(service: &str, length: usize, limit: usize) -> ShmError {
    ShmError::TooLong {
        service: service.into(),
        length,
        limit,
    }
}
