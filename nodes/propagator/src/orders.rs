//! What is asked of a flight from outside: by services, on a thread of their own, and done by the flight's loop between
//! two steps.

mod set_state;

use std::sync::{Arc, Mutex, PoisonError};

use lgvi_dynamics::BodyState;
use lgvi_middleware::ros::{Executor, Running};
use lgvi_msgs::srv::{SetState, SetStateResponse, Step, StepResponse};
use lgvi_msgs::std_srvs::srv::{SetBool, SetBoolResponse, Trigger, TriggerResponse};
use lgvi_node::{Node, NodeError};
use lgvi_scene::Scene;
use rtrb::{Consumer, Producer, RingBuffer};

/// Orders on their way to the loop.
const ORDERS: usize = 16;

/// What is to be done.
pub(crate) enum Command {
    /// Begin anew at step 0.
    Reset,
    /// Make no more steps, or go on.
    Pause(bool),
    /// Make so many steps of a paused flight.
    Step(u32),
    /// Set the states of these bodies at the present step.
    SetState(Vec<(usize, BodyState)>),
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
    executor: Running,
}

/// The services' end.
#[derive(Clone)]
struct Sender(Arc<Mutex<Producer<Order>>>);

impl Orders {
    /// Offers `~/reset`, `~/pause`, `~/step` and `~/set_state`.
    pub(crate) fn serve(node: &Node, scene: &Arc<Scene>) -> Result<Self, NodeError> {
        let (given, taken) = RingBuffer::new(ORDERS);
        let (done, mut answered) = RingBuffer::new(ORDERS);
        let sender = Sender(Arc::new(Mutex::new(given)));
        let ros = &node.ros;
        let mut executor = Executor::new();

        let give = sender.clone();
        let reset = ros.service_server("~/reset").map_err(NodeError::runtime)?;
        executor.serve::<Trigger>(reset, move |_, reply| {
            give.give(Command::Reset, move |outcome| {
                let (success, message) = said(outcome);
                reply.send(&TriggerResponse { success, message });
            });
        });
        let give = sender.clone();
        let pause = ros.service_server("~/pause").map_err(NodeError::runtime)?;
        executor.serve::<SetBool>(pause, move |request, reply| {
            give.give(Command::Pause(request.data), move |outcome| {
                let (success, message) = said(outcome);
                reply.send(&SetBoolResponse { success, message });
            });
        });
        let give = sender.clone();
        let step = ros.service_server("~/step").map_err(NodeError::runtime)?;
        executor.serve::<Step>(step, move |request, reply| {
            give.give(Command::Step(request.steps), move |outcome| {
                let step = outcome.as_ref().copied().unwrap_or_default();
                let (success, message) = said(outcome);
                reply.send(&StepResponse {
                    success,
                    message,
                    step,
                });
            });
        });
        let scene = Arc::clone(scene);
        let set_state = ros
            .service_server("~/set_state")
            .map_err(NodeError::runtime)?;
        executor.serve::<SetState>(set_state, move |request, reply| {
            let answer = move |outcome: Outcome| {
                let step = outcome.as_ref().copied().unwrap_or_default();
                let (success, message) = said(outcome);
                reply.send(&SetStateResponse {
                    success,
                    message,
                    step,
                });
            };
            match set_state::check(&scene, &request.bodies) {
                Ok(states) => sender.give(Command::SetState(states), answer),
                Err(error) => answer(Err(error.to_string())),
            }
        });

        executor.whenever(move || {
            while let Ok((order, outcome)) = answered.pop() {
                let order: Order = order;
                (order.answer)(outcome);
            }
        });
        Ok(Self {
            given: taken,
            done,
            executor: executor.start().map_err(NodeError::runtime)?,
        })
    }

    /// What is to be done next.
    pub(crate) fn next(&mut self) -> Option<Order> {
        self.given.pop().ok()
    }

    /// Says what has become of an order; the answer goes out from another thread.
    pub(crate) fn answer(&mut self, order: Order, outcome: Outcome) {
        // As many places as orders can be under way.
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
        let mut sender = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(rtrb::PushError::Full(refused)) = sender.push(order) {
            let why = format!("{ORDERS} others wait to be done");
            (refused.answer)(Err(why));
        }
    }
}

fn said(outcome: Outcome) -> (bool, String) {
    match outcome {
        Ok(step) => (true, format!("step {step}")),
        Err(why) => (false, why),
    }
}
