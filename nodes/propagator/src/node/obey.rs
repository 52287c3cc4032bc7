//! How the flight's loop carries out orders.

use lgvi_middleware::node::{Node, NodeError};
use lgvi_msgs::msg::{BodyState, Intervention};

use crate::node::link::Wait;
use crate::node::messages;
use crate::node::orders::{Command, INACTIVE, Order};
use crate::node::run::{Phase, Propagator};

impl Propagator {
    /// Carries out an order, or begins to.
    pub(crate) fn obey(&mut self, node: &Node, order: Order) -> Result<(), NodeError> {
        let here = Ok(self.flight.step());
        let outcome = match &order.command {
            Command::Reset | Command::SetState(..) if self.phase == Phase::Unattended => {
                Err(self.phase.why().to_owned())
            }
            Command::Pause(pause) => {
                self.paused = *pause;
                // What was missed meanwhile is not made up for.
                self.set_pace(node);
                here
            }
            Command::Step(steps) => {
                let steps = u64::from(*steps);
                return self.begin_steps(order, steps);
            }
            Command::Reset => {
                self.publish_first()?;
                self.restart()?;
                self.intervene(node, Intervention::RESET, Vec::new())?;
                Ok(0)
            }
            Command::SetState(states, given) => {
                self.publish_first()?;
                let set = match self.flight.try_states(&self.scene, states) {
                    Ok(()) => self.flight.set_states(states),
                    refused => refused,
                };
                match set {
                    Ok(()) => {
                        self.measure_from_here();
                        self.ask_again()?;
                        self.intervene(node, Intervention::SET_STATE, given.clone())?;
                        here
                    }
                    Err(error) => Err(error.to_string()),
                }
            }
        };
        self.orders.answer(order, outcome);
        Ok(())
    }

    /// Publishes where the flight is before its course is changed, where that has not been done: with every intervention, the
    /// state at its step is there as it was and as it is.
    fn publish_first(&mut self) -> Result<(), NodeError> {
        let step = Some(self.flight.step());
        if self.sampled != step {
            self.sample()?;
        }
        if self.handed != step {
            self.hand_over(Wait::Always);
        }
        Ok(())
    }

    /// Announces that the course has been changed, and publishes where the flight is now.
    fn intervene(
        &mut self,
        node: &Node,
        kind: u8,
        bodies: Vec<BodyState>,
    ) -> Result<(), NodeError> {
        let (scene, flight) = (&self.scene, &self.flight);
        let message = messages::intervention(scene, flight, kind, self.accepted, bodies)
            .map_err(NodeError::runtime)?;
        self.accounted = false;
        self.link.intervene(message, node)?;
        self.set_pace(node);
        self.sense_again()?;
        self.publish(Wait::Always)
    }

    /// Begins to make steps of a paused flight.
    fn begin_steps(&mut self, order: Order, steps: u64) -> Result<(), NodeError> {
        let step = self.flight.step();
        let refusal = if !self.paused {
            Some("the flight is not paused".to_owned())
        } else if self.phase != Phase::Flying {
            Some(format!(
                "the flight is not on its way: {}",
                self.phase.why()
            ))
        } else if steps == 0 {
            Some("`steps` is 0, expected at least 1".to_owned())
        } else {
            None
        };
        match refusal {
            Some(why) => self.orders.answer(order, Err(why)),
            None => self.stepping = Some((order, step.saturating_add(steps))),
        }
        Ok(())
    }

    /// Takes no orders until the node is active again, and refuses those that are not done.
    pub(crate) fn refuse(&mut self) {
        if let Some((order, _)) = self.stepping.take() {
            let step = self.flight.step();
            let why = format!("{INACTIVE} any more: the flight is at step {step}");
            self.orders.answer(order, Err(why));
        }
        self.orders.close();
    }

    /// Ends the making of steps when they are made, or when there are no more.
    pub(crate) fn count_down(&mut self) {
        let (step, last) = (self.flight.step(), self.scene.steps);
        let over = |(_, until): &mut (Order, u64)| step >= *until || step == last;
        if let Some((order, until)) = self.stepping.take_if(over) {
            let made = if step >= until {
                Ok(step)
            } else {
                Err(format!("step {last} is the scene's last"))
            };
            self.orders.answer(order, made);
        }
    }
}

impl Phase {
    fn why(self) -> &'static str {
        match self {
            Self::Unattended => "subscribers are awaited",
            Self::Uncommanded => "a control sequence is awaited",
            Self::Flying => "it is",
            Self::Flown => "all steps are made",
        }
    }
}
