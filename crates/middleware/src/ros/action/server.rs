//! The server's side of an action.

use std::{sync::Arc, time::Duration};

use lgvi_msgs::Action;

use super::{
    GoalHandle,
    protocol::{CYCLE, Protocol},
    table::{Decision, Shared},
};
use crate::{
    ros::{Executor, RosError, RosNode, Running},
    sync::wait_while,
};

/// Offers an action: see [`RosNode::action_server`]. Dropped, it aborts the goals that are left.
pub struct ActionServer<A: Action> {
    shared: Arc<Shared<A>>,
    _running: Running,
}

impl<A: Action> ActionServer<A> {
    pub(in crate::ros) fn new<D>(node: &RosNode, action: &str, decide: D) -> Result<Self, RosError>
    where
        D: FnMut(&A::Goal, usize) -> Decision + Send + 'static,
    {
        let mut executor = Executor::new();
        let shared = Arc::new(Shared::new(executor.handle()));
        let mut protocol = Protocol::new(node, action, Arc::clone(&shared), decide)?;
        executor.cycle(CYCLE, move |context| protocol.turn(context));
        Ok(Self {
            shared,
            _running: executor.start()?,
        })
    }

    /// Waits for the next accepted goal, up to `timeout`; `None` if there is none. May be called from several threads.
    pub fn next_goal(&self, timeout: Duration) -> Option<GoalHandle<A>> {
        let Shared { table, arrival, .. } = &*self.shared;
        let mut table = wait_while(arrival, table, timeout, |table| table.queue.is_empty());
        let (id, goal, stop) = table.queue.pop_front()?;
        table.goals.execute(id);
        drop(table);
        self.shared.wakeup.wake();
        Some(GoalHandle {
            id,
            goal,
            stop,
            shared: Arc::clone(&self.shared),
        })
    }

    /// Has results that are too long to be sent replaced by what `shorten` leaves of them, if that is not too long too.
    #[must_use]
    pub fn shortened_by(self, shorten: fn(A::Result) -> A::Result) -> Self {
        self.shared.shorten.get_or_init(|| shorten);
        self
    }
}
