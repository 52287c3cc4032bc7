//! What is asked of a flight from outside: by services, on a thread of their own, and done by the flight's loop between
//! two steps.

use std::sync::{Arc, Mutex};

use lgvi_middleware::node::Node;
use lgvi_middleware::ros::{Executor, RosError, Running};
use lgvi_middleware::sync::lock;
use lgvi_msgs::msg;
use lgvi_msgs::srv::{SetState, SetStateResponse, Step, StepResponse};
use lgvi_msgs::std_srvs::srv::{SetBool, SetBoolResponse, Trigger, TriggerResponse};
use lgvi_scene::Scene;
use rtrb::{Consumer, Producer, RingBuffer};

use crate::SetStates;

/// Orders on their way to the loop.
const ORDERS: usize = 16;

/// Why an order is refused while the loop does not run.
pub(crate) const INACTIVE: &str = "the node is not active";

/// What is to be done.
pub(crate) enum Command {
    /// Begin anew at step 0.
    Reset,
    /// Make no more steps, or go on.
    Pause(bool),
    /// Make so many steps of a paused flight.
    Step(u32),
    /// Set the states of some bodies at the present step, which were given as these.
    SetState(SetStates, Vec<msg::BodyState>),
}

/// The step at which the flight is when it has been done, or why it has not.
pub(crate) type Outcome = Result<u64, String>;

/// A command, and who waits for its outcome.
pub(crate) struct Order {
    pub(crate) command: Command,
    answer: Box<dyn FnOnce(Outcome) + Send>,
}

/// The loop's end.
pub(crate) struct Orders {
    given: Consumer<Order>,
    done: Producer<(Order, Outcome)>,
    sender: Sender,
    executor: Running,
}

/// The services' end.
#[derive(Clone)]
struct Sender(Arc<Mutex<Gate>>);

/// Lets orders through while the loop runs.
struct Gate {
    open: bool,
    orders: Producer<Order>,
}

impl Orders {
    /// Offers `~/reset`, `~/pause`, `~/step` and `~/set_state`.
    pub(crate) fn serve(node: &Node, scene: &Arc<Scene>) -> Result<Self, RosError> {
        let (given, taken) = RingBuffer::new(ORDERS);
        let (done, mut answered) = RingBuffer::new(2 * ORDERS);
        let sender = Sender(Arc::new(Mutex::new(Gate {
            open: false,
            orders: given,
        })));
        let ros = &node.ros;
        let mut executor = Executor::new();

        let give = sender.clone();
        executor.serve::<Trigger>(ros, "~/reset", move |_, reply| {
            give.give(Command::Reset, move |outcome| {
                let (success, message) = said(outcome);
                reply.send(&TriggerResponse { success, message });
            });
        })?;
        let give = sender.clone();
        executor.serve::<SetBool>(ros, "~/pause", move |request, reply| {
            give.give(Command::Pause(request.data), move |outcome| {
                let (success, message) = said(outcome);
                reply.send(&SetBoolResponse { success, message });
            });
        })?;
        let give = sender.clone();
        executor.serve::<Step>(ros, "~/step", move |request, reply| {
            give.give(Command::Step(request.steps), move |outcome| {
                let step = outcome.as_ref().copied().unwrap_or_default();
                let (success, message) = said(outcome);
                reply.send(&StepResponse {
                    success,
                    message,
                    step,
                });
            });
        })?;
        let give = sender.clone();
        let scene = Arc::clone(scene);
        executor.serve::<SetState>(ros, "~/set_state", move |request, reply| {
            let answer = move |outcome: Outcome| {
                let step = outcome.as_ref().copied().unwrap_or_default();
                let (success, message) = said(outcome);
                reply.send(&SetStateResponse {
                    success,
                    message,
                    step,
                });
            };
            match SetStates::of_message(&scene, &request.bodies) {
                Ok(states) => give.give(Command::SetState(states, request.bodies), answer),
                Err(error) => answer(Err(error.to_string())),
            }
        })?;

        executor.whenever(move || {
            while let Ok((order, outcome)) = answered.pop() {
                let order: Order = order;
                (order.answer)(outcome);
            }
        });
        Ok(Self {
            given: taken,
            done,
            sender,
            executor: executor.start()?,
        })
    }

    /// Takes orders from now on.
    pub(crate) fn open(&self) {
        lock(&self.sender.0).open = true;
    }

    /// Refuses those that come from now on, and those that wait.
    pub(crate) fn close(&mut self) {
        lock(&self.sender.0).open = false;
        while let Some(order) = self.next() {
            self.answer(order, Err(INACTIVE.to_owned()));
        }
    }

    /// What is to be done next.
    pub(crate) fn next(&mut self) -> Option<Order> {
        // One place more is for the order that is being carried out.
        (self.done.slots() > 1).then(|| self.given.pop().ok())?
    }

    /// Says what has become of an order; the answer goes out from another thread.
    pub(crate) fn answer(&mut self, order: Order, outcome: Outcome) {
        // There is room: see `next`.
        let _ = self.done.push((order, outcome));
        self.executor.wake();
    }
}

impl Sender {
    fn give(&self, command: Command, answer: impl FnOnce(Outcome) + Send + 'static) {
        let order = Order {
            command,
            answer: Box::new(answer),
        };
        let mut gate = lock(&self.0);
        let refused = if gate.open {
            gate.orders.push(order).err().map(|error| {
                let rtrb::PushError::Full(order) = error;
                (order, format!("{ORDERS} others wait to be done"))
            })
        } else {
            Some((order, INACTIVE.to_owned()))
        };
        drop(gate);
        if let Some((order, why)) = refused {
            (order.answer)(Err(why));
        }
    }
}

fn said(outcome: Outcome) -> (bool, String) {
    match outcome {
        Ok(step) => (true, format!("step {step}")),
        Err(why) => (false, why),
    }
}
