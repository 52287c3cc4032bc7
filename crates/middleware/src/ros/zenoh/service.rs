//! Services on Zenoh: a server is a queryable, a request a query.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{
        Arc, Mutex,
        atomic::{AtomicI64, Ordering},
        mpsc,
    },
    task::{Context, Poll, Waker},
    thread,
    time::Duration,
};

use ::zenoh::{
    Wait,
    query::{ConsolidationMode, Query, QueryTarget, Queryable},
};
use tracing::debug;

use super::{Announced, Connection, attachment::Attachment, keys::Endpoint, text};
use crate::{
    block::Deadline,
    ros::{
        CallError, PublishError, RequestId, TakeError,
        service::enqueue,
        wire::{Incoming, WireClient, WireEndpoint, WireServer},
    },
    sync::lock,
    wall,
};

/// Requests that wait for their reply.
const MAX_UNANSWERED: usize = 1024;

/// How long after a request that was dropped the next server is asked.
const PAUSE: Duration = Duration::from_millis(10);

/// The longest that Zenoh itself waits for a reply.
const LONGEST: Duration = Duration::from_secs(3600);

/// A queryable and the requests that it has heard.
pub(super) struct Server {
    requests: Arc<Mutex<Requests>>,
    key: String,
    _queryable: Queryable<()>,
    announced: Announced,
}

#[derive(Default)]
struct Requests {
    waiting: VecDeque<Incoming>,
    unanswered: BTreeMap<RequestId, Query>,
    /// In the order in which they have come.
    order: VecDeque<RequestId>,
    taker: Option<Waker>,
}

impl Server {
    pub(super) fn new(node: &Arc<Connection>, endpoint: Endpoint) -> Result<Self, String> {
        let key = endpoint.key(node.node.domain_id);
        let requests = Arc::new(Mutex::new(Requests::default()));
        let heard = Arc::clone(&requests);
        let queryable = node
            .session
            .declare_queryable(key.clone())
            .complete(true)
            .callback(move |query| lock(&heard).hear(query));
        Ok(Self {
            _queryable: queryable.wait().map_err(text)?,
            announced: Announced::new(node, endpoint)?,
            requests,
            key,
        })
    }
}

impl Requests {
    fn hear(&mut self, query: Query) {
        let Some((attachment, payload)) = Attachment::read(query.attachment()).zip(query.payload())
        else {
            debug!(key = %query.key_expr(), "a query that is no request of ROS 2");
            return;
        };
        let id = RequestId {
            writer: attachment.writer(),
            client: attachment.gid,
            sequence: attachment.sequence,
        };
        let info = attachment.info();
        let cdr = payload.to_bytes().into_owned();
        if let Some(oldest) = enqueue(&mut self.waiting, Incoming { id, cdr, info }, |other| {
            other.id
        }) {
            self.unanswered.remove(&oldest.id);
        }
        self.order.push_back(id);
        self.unanswered.insert(id, query);
        while self.order.len() > MAX_UNANSWERED
            && let Some(oldest) = self.order.pop_front()
        {
            self.unanswered.remove(&oldest);
        }
        if let Some(taker) = self.taker.take() {
            taker.wake();
        }
    }
}

impl WireServer for Server {
    fn poll_take(&self, context: &Context<'_>) -> Poll<Result<Incoming, TakeError>> {
        let mut requests = lock(&self.requests);
        match requests.waiting.pop_front() {
            Some(incoming) => Poll::Ready(Ok(incoming)),
            None => {
                requests.taker = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }

    fn reply(&self, id: RequestId, cdr: Vec<u8>) -> Result<(), PublishError> {
        // One that is gone has been given up, or was too long ago.
        let Some(query) = lock(&self.requests).unanswered.remove(&id) else {
            return Ok(());
        };
        let attachment = Attachment {
            sequence: id.sequence,
            time: wall::now(),
            gid: id.client,
        };
        let reply = query.reply(&self.key, cdr).attachment(attachment).wait();
        reply.map_err(|error| failed(self.service(), &error))
    }

    fn max_reply(&self) -> usize {
        usize::MAX
    }

    fn service(&self) -> &str {
        self.announced.topic()
    }
}

/// Sends queries.
pub(super) struct Client {
    key: String,
    sequence: AtomicI64,
    announced: Announced,
}

impl Client {
    pub(super) fn new(node: &Arc<Connection>, endpoint: Endpoint) -> Result<Self, String> {
        Ok(Self {
            key: endpoint.key(node.node.domain_id),
            announced: Announced::new(node, endpoint)?,
            sequence: AtomicI64::new(0),
        })
    }

    /// Sends a request; `None` if the servers have left without a reply, or the time has passed.
    fn ask(&self, cdr: Vec<u8>, deadline: Deadline) -> Result<Option<Vec<u8>>, PublishError> {
        let (answer, answers) = mpsc::channel();
        let attachment = Attachment {
            sequence: self.sequence.fetch_add(1, Ordering::Relaxed) + 1,
            time: wall::now(),
            gid: self.announced.gid,
        };
        let query = self
            .announced
            .node
            .session
            .get(&self.key)
            .payload(cdr)
            .attachment(attachment)
            .target(QueryTarget::AllComplete)
            .consolidation(ConsolidationMode::None)
            .timeout(deadline.left().min(LONGEST))
            .callback(move |reply| {
                if let Ok(sample) = reply.into_result() {
                    // The first one counts; nobody waits for others.
                    let _ = answer.send(sample.payload().to_bytes().into_owned());
                }
            })
            .wait();
        query.map_err(|error| failed(self.service(), &error))?;
        Ok(answers.recv_timeout(deadline.left()).ok())
    }
}

impl WireClient for Client {
    fn wait_for_server(&self, timeout: Duration) -> bool {
        self.announced.wait_for_matches(1, timeout)
    }

    fn call(&self, cdr: Vec<u8>, timeout: Duration) -> Result<Vec<u8>, CallError> {
        let deadline = Deadline::after(timeout);
        let mut asked = false;
        while self.wait_for_server(deadline.left()) {
            asked = true;
            if let Some(reply) = self.ask(cdr.clone(), deadline)? {
                return Ok(reply);
            }
            if deadline.left().is_zero() {
                break;
            }
            debug!(
                service = self.service(),
                "the server has left: asking the next one"
            );
            thread::sleep(PAUSE.min(deadline.left()));
        }
        let (service, waited) = (self.service().to_owned(), timeout);
        Err(if asked {
            CallError::NoReply { service, waited }
        } else {
            CallError::NoServer { service, waited }
        })
    }

    fn service(&self) -> &str {
        self.announced.topic()
    }
}

fn failed(service: &str, error: &::zenoh::Error) -> PublishError {
    PublishError::Wire {
        topic: service.to_owned(),
        reason: error.to_string(),
    }
}
