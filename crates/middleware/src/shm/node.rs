//! A process's part in shared memory.

use std::{
    fmt,
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use iceoryx2::{
    node::{Node, NodeBuilder},
    prelude::{NodeName, SignalHandlingMode},
    service::{
        builder::publish_subscribe::{
            PublishSubscribeCreateError as CreateError, PublishSubscribeOpenError as OpenError,
            PublishSubscribeOpenOrCreateError as Error,
        },
        port_factory::publish_subscribe::PortFactory,
    },
};

use tracing::warn;

use super::{Service, ShmError, ShmOptions, channel::Channel, orphans::Orphans, room, root};
use crate::{Shutdown, sync::lock};

/// How long another process may take to create a service, on a host whose processors and disk are busy.
const CREATION: Duration = Duration::from_secs(60);

/// After how long what dead nodes have left is looked for: one may have left a part of the service.
const CLEANING: Duration = Duration::from_secs(20);

/// From one try to the next, where iceoryx2 does not wait itself.
const PAUSE: Duration = Duration::from_millis(10);

/// An open service.
pub(super) type Open<C> = PortFactory<Service, [<C as Channel>::Element], <C as Channel>::Header>;

/// Opens shared-memory ports. Clones are handles to the same node; it is removed when the last of them and of its
/// ports are dropped.
#[derive(Clone)]
pub struct ShmNode {
    node: Arc<Node<Service>>,
    orphans: Arc<Mutex<Orphans>>,
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
            orphans: Arc::default(),
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
        self.remove_orphans();
    }

    fn remove_orphans(&self) {
        lock(&self.orphans).remove(self.node.config());
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
        let mut wait = Wait::new(self, &name);
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
                Err(error) if is_in_the_making(error) => wait.again(error)?,
                Err(error) => return Err(fail(format!("{error:?}"))),
            }
        }
    }
}

/// Whether another process creates or removes the service at the same time, for which iceoryx2 waits as long as its `creation_timeout`.
fn is_in_the_making(error: Error) -> bool {
    match error {
        Error::SystemInFlux => true,
        Error::PublishSubscribeOpenError(error) => matches!(
            error,
            OpenError::HangsInCreation
                | OpenError::DoesNotExist
                | OpenError::IsMarkedForDestruction
        ),
        Error::PublishSubscribeCreateError(error) => matches!(
            error,
            CreateError::HangsInCreation
                | CreateError::AlreadyExists
                | CreateError::IsBeingCreatedByAnotherInstance
        ),
    }
}

/// The wait for a service that another process creates.
struct Wait<'n> {
    node: &'n ShmNode,
    service: &'n str,
    begun: Instant,
    announced: bool,
    cleaned: bool,
}

impl<'n> Wait<'n> {
    fn new(node: &'n ShmNode, service: &'n str) -> Self {
        Self {
            node,
            service,
            begun: Instant::now(),
            announced: false,
            cleaned: false,
        }
    }

    /// Decides whether to try again. A process that was killed while it created the service has left something that is in the
    /// way, which is removed.
    fn again(&mut self, error: Error) -> Result<(), ShmError> {
        let waited = self.begun.elapsed();
        let service = self.service;
        if self.node.shutdown.requested() {
            let service = service.into();
            return Err(ShmError::Interrupted { service, waited });
        }
        if waited >= CREATION {
            return Err(ShmError::Unfinished {
                service: service.into(),
                waited,
                reason: format!("{error:?}"),
            });
        }
        if !self.announced {
            self.announced = true;
            warn!(service, reason = ?error, "waiting for another process that is creating a service of shared memory");
        }
        if waited >= CLEANING && !self.cleaned {
            self.cleaned = true;
            self.node.clean();
        } else {
            self.node.remove_orphans();
        }
        std::thread::sleep(PAUSE);
        Ok(())
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
