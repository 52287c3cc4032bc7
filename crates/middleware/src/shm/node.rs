//! A process's part in shared memory.

use std::{
    fmt,
    path::PathBuf,
    sync::Arc,
    time::{Duration, Instant},
};

use iceoryx2::{
    node::{Node, NodeBuilder},
    prelude::{NodeName, SignalHandlingMode},
    service::{
        builder::publish_subscribe::{
            PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError as OpenOrCreateError,
        },
        port_factory::publish_subscribe::PortFactory,
    },
};

use super::{Service, ShmError, ShmOptions, channel::Channel, orphans, room, root};
use crate::Shutdown;

/// How long another process may take to create a service, on a host whose processors and disk are busy.
const CREATION: Duration = Duration::from_secs(60);

/// An open service.
pub(super) type Open<C> = PortFactory<Service, [<C as Channel>::Element], <C as Channel>::Header>;

/// Opens shared-memory ports. Clones are handles to the same node; it is removed when the last of them and of its
/// ports are dropped.
#[derive(Clone)]
pub struct ShmNode {
    node: Arc<Node<Service>>,
    root: PathBuf,
    domain_id: u16,
    shutdown: Shutdown,
}

impl ShmNode {
    /// Creates a node, and removes what dead processes have left.
    pub fn new(name: &str, options: &ShmOptions) -> Result<Self, ShmError> {
        let node_name = NodeName::new(name).map_err(|error| ShmError::Name {
            what: "node name",
            value: name.into(),
            reason: format!("{error:?}"),
        })?;
        root::prepare(options)?;
        let node = NodeBuilder::new()
            .name(&node_name)
            .config(&options.config()?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Service>()
            .map_err(|error| ShmError::Node {
                name: name.into(),
                owner: root::owner(&options.root_path()),
                root: options.root_path(),
                reason: error.to_string(),
            })?;
        let node = Self {
            node: Arc::new(node),
            root: options.root_path(),
            domain_id: options.domain_id,
            shutdown: Shutdown::new(),
        };
        node.clean();
        Ok(node)
    }

    /// Has no publisher that is made from here on wait for a subscriber once `shutdown` has been raised for 0.1 s.
    pub fn leave_on(mut self, shutdown: &Shutdown) -> Self {
        self.shutdown = shutdown.clone();
        self
    }

    pub(super) fn shutdown(&self) -> &Shutdown {
        &self.shutdown
    }

    /// Removes what processes that were killed have left, their ports included. Takes milliseconds.
    pub fn clean(&self) {
        self.node.try_cleanup_dead_nodes();
        orphans::remove(&self.root);
    }

    /// Opens the service of a topic, or creates it; returns its name too.
    pub(super) fn open<C: Channel>(&self, topic: &str) -> Result<(String, Open<C>), ShmError> {
        let name = format!("lgvi/{}{topic}", self.domain_id);
        let fail = |reason| ShmError::service(&name, "open shared memory", reason);
        room::check(&name, 0)?;
        let service_name = name
            .as_str()
            .try_into()
            .map_err(|error| fail(format!("{error:?}")))?;
        let begun = Instant::now();
        loop {
            let opened = self
                .node
                .service_builder(&service_name)
                .publish_subscribe::<[C::Element]>()
                .user_header::<C::Header>()
                .enable_safe_overflow(false)
                .max_publishers(C::PUBLISHERS)
                .max_subscribers(C::SUBSCRIBERS)
                .subscriber_max_buffer_size(C::BUFFER)
                .history_size(C::HISTORY)
                .open_or_create();
            match opened {
                Ok(service) => return Ok((name, service)),
                // Another process creates it, for which iceoryx2 waits 0.5 s. If it was killed while it did, what it has left is
                // in the way.
                Err(OpenOrCreateError::PublishSubscribeOpenError(
                    PublishSubscribeOpenError::HangsInCreation,
                )) if begun.elapsed() < CREATION && !self.shutdown.requested() => self.clean(),
                Err(error) => return Err(fail(format!("{error:?}"))),
            }
        }
    }
}

impl fmt::Debug for ShmNode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ShmNode")
            .field("name", &self.node.name().as_str())
            .field("domain_id", &self.domain_id)
            .finish()
    }
}
