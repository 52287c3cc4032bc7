use std::sync::Arc;
use std::time::{Duration, Instant};

use lgvi_dynamics::{BodyState, Invariants};
use lgvi_middleware::Shutdown;
use lgvi_middleware::shm::{Delivery, StatePublisher};
use lgvi_msgs::shm::{BodySample, Name};
use lgvi_node::{Event, FlightReport, Miss, Node, NodeError, body_sample};
use lgvi_scene::Scene;
use tracing::{info, warn};

use crate::config::{Config, PATIENCE};
use crate::cuts::Cuts;
use crate::flight::Flight;
use crate::link::{self, LinkEnd};
use crate::messages::state_header;
use crate::pace::Pace;

/// How often waiting looks whether it is over.
const WAIT: Duration = Duration::from_millis(1);

/// How long a step may be waited for at a stretch.
const SLICE: Duration = Duration::from_millis(10);

/// How often a supervisor hears of progress.
const PROGRESS: Duration = Duration::from_millis(50);

/// The node's work, from parameters to shutdown.
pub(crate) fn run(node: &mut Node) -> Result<(), NodeError> {
    let config = Config::take(std::mem::take(&mut node.parameters))?;
    let scene = Arc::new(config.scene.clone());
    let names: Vec<Name> = scene
        .bodies
        .iter()
        .map(|body| Name::try_from(body.name.as_str()))
        .collect::<Result<_, _>>()
        .map_err(NodeError::input)?;
    let flight = Flight::new(&scene).map_err(NodeError::input)?;
    info!("flown by {}", flight.scheme());

    let shm = node.shm()?;
    let state_topic = node.args.resolve("~/state").map_err(NodeError::input)?;
    let delivery = if config.lossless() {
        Delivery::Lossless { patience: PATIENCE }
    } else {
        Delivery::DropNewest
    };
    let states = shm
        .state_publisher(&state_topic, names.len(), delivery)
        .map_err(NodeError::runtime)?;
    let (ros, _rosout) = node.ros()?;
    let link = link::start(
        ros,
        &shm,
        &config,
        Arc::clone(&scene),
        names.clone(),
        &node.shutdown,
    )?;
    node.report(&Event::Ready);

    let mut propagation = Propagation {
        flight,
        outgoing: Vec::with_capacity(names.len()),
        names,
        states,
        state_topic,
        samples: 0,
        cost: 0.0,
        arrival: None,
        cuts: Cuts::default(),
        link,
        shutdown: node.shutdown.clone(),
        config,
        scene,
    };
    let outcome = propagation
        .await_company()
        .and_then(|()| propagation.fly(node));
    if let Some(warning) = propagation.cuts.rest() {
        warn!("{warning}");
    }
    let mut messages = propagation.link.finish()?;
    // Of states, those that went over shared memory count: the ROS side sends fewer.
    messages.insert(propagation.state_topic.clone(), propagation.samples);
    node.report(&Event::Published { messages });
    let outcome = match propagation.link.fault() {
        Some(fault) => Err(NodeError::Runtime(fault.to_owned())),
        None => outcome,
    };
    let ended = outcome.map(|flown| {
        if let Some(report) = flown {
            info!("flown {} steps in {:.3} s", report.steps, report.seconds);
            node.report(&Event::Flown(report));
        }
    });
    if ended.is_err() {
        node.shutdown.request();
    }
    propagation.link.linger().and(ended)
}

struct Propagation {
    scene: Arc<Scene>,
    config: Config,
    flight: Flight,
    names: Vec<Name>,
    /// The state that is sent; kept so that sending allocates nothing.
    outgoing: Vec<BodySample>,
    states: StatePublisher,
    state_topic: String,
    /// Full-rate states sent.
    samples: u64,
    /// Cost of the manoeuvre's controls so far.
    cost: f64,
    /// The planned body's state where its last control sequence has ended, if that is before the end of the run.
    arrival: Option<BodyState>,
    /// Steps that could not be made as one.
    cuts: Cuts,
    link: LinkEnd,
    shutdown: Shutdown,
}

impl Propagation {
    /// Holds at step 0 until the subscribers and the control sequence that were asked for are there, or the shutdown.
    fn await_company(&mut self) -> Result<(), NodeError> {
        let wanted = self.config.await_subscribers;
        while !self.shutdown.requested() && !self.link.attended() {
            std::thread::sleep(WAIT);
        }
        while !self.shutdown.requested()
            && !self
                .states
                .wait_for_subscribers(wanted, WAIT)
                .map_err(NodeError::runtime)?
        {}
        let awaited = self
            .scene
            .maneuver
            .as_ref()
            .filter(|_| self.config.await_control);
        let Some(body) = awaited.map(|maneuver| maneuver.body) else {
            return Ok(());
        };
        while !self.shutdown.requested() && !self.flight.commanded(body) {
            self.take_controls()?;
            std::thread::sleep(WAIT);
        }
        Ok(())
    }

    /// Accepts or refuses the control sequences that have come in.
    fn take_controls(&mut self) -> Result<(), NodeError> {
        if let Some(error) = self.link.bad_control() {
            return Err(NodeError::Input(format!("control sequence: {error}")));
        }
        if let Some(fault) = self.link.fault() {
            return Err(NodeError::Runtime(fault.to_owned()));
        }
        while let Some(controls) = self.link.next_controls() {
            let verdict = self.flight.accept(controls);
            self.link.answer(verdict);
        }
        Ok(())
    }

    /// Makes all steps; `None` when a shutdown comes between.
    fn fly(&mut self, node: &Node) -> Result<Option<FlightReport>, NodeError> {
        let start = self.flight.invariants();
        let mut pace = Pace::start(self.config.real_time_factor);
        let mut told = Instant::now();
        self.publish()?;
        while self.flight.step() < self.scene.steps {
            if self.shutdown.requested() {
                return Ok(None);
            }
            self.take_controls()?;
            self.advance()?;
            self.keep_pace(&mut pace)?;
            self.publish()?;
            if told.elapsed() >= PROGRESS {
                told = Instant::now();
                node.report(&Event::Flying {
                    step: self.flight.step(),
                });
            }
        }
        Ok(Some(self.report(&start, &pace)))
    }

    /// Waits until it is time for the present step; control sequences are taken meanwhile.
    fn keep_pace(&mut self, pace: &mut Pace) -> Result<(), NodeError> {
        let due = self.scene.seconds(self.flight.step());
        let mut left = pace.left(due);
        if left.is_zero() {
            pace.overrun();
        }
        while !left.is_zero() && !self.shutdown.requested() {
            self.shutdown.wait_timeout(left.min(SLICE));
            self.take_controls()?;
            left = pace.left(due);
        }
        Ok(())
    }

    fn advance(&mut self) -> Result<(), NodeError> {
        let step = self.flight.step();
        let report = self.flight.advance().map_err(|error| {
            let name = error.body().map(|body| &self.scene.bodies[body].name);
            let of = name.map(|name| format!(" of {name}")).unwrap_or_default();
            NodeError::Runtime(format!("step {step}{of}: {error}"))
        })?;
        if let Some(pieces) = self.flight.cut(report)
            && let Some(warning) = self.cuts.note(step, pieces, Instant::now())
        {
            warn!("{warning}");
        }
        if let Some(maneuver) = &self.scene.maneuver {
            let body = maneuver.body;
            self.cost += maneuver.interval_cost(&self.flight.loads()[body], self.scene.h());
            if maneuver.final_time.is_some() && self.flight.sequence_end(body) == Some(step + 1) {
                self.arrival = Some(self.flight.states()[body]);
            }
        }
        Ok(())
    }

    /// Publishes the present state where its turn has come.
    fn publish(&mut self) -> Result<(), NodeError> {
        let step = self.flight.step();
        let publishing = self.scene.publishing;
        let last = step == self.scene.steps;
        if last || step.is_multiple_of(publishing.state_every) {
            let header = state_header(&self.scene, step, self.samples);
            let (states, units) = (self.flight.states(), &self.scene.units);
            let bodies = self.names.iter().zip(states);
            self.outgoing.clear();
            self.outgoing
                .extend(bodies.map(|(&name, state)| body_sample(name, state, units)));
            if let Some(sample) = self.outgoing.iter().find(|sample| !sample.is_finite()) {
                let name = sample.name;
                let message = format!("step {step} of {name}: the state is not finite in SI");
                return Err(NodeError::Runtime(message));
            }
            self.states
                .send(header, &self.outgoing)
                .map_err(NodeError::runtime)?;
            self.samples += 1;
        }
        if last || step.is_multiple_of(publishing.ros_every) {
            self.link
                .publish(step, self.flight.states(), self.config.lossless());
        }
        Ok(())
    }

    fn report(&self, start: &Invariants, pace: &Pace) -> FlightReport {
        let end = self.flight.invariants();
        let units = &self.scene.units;
        FlightReport {
            steps: self.flight.step(),
            step_size: self.scene.h() * units.time,
            seconds: pace.elapsed(),
            miss: self.miss(),
            cost: self.scene.maneuver.as_ref().map(|_| self.cost),
            energy_start: start.energy * units.energy(),
            energy_end: end.energy * units.energy(),
            linear_momentum_change: (end.linear_momentum - start.linear_momentum).norm()
                * units.momentum(),
            angular_momentum_change: (end.angular_momentum - start.angular_momentum).norm()
                * units.angular_momentum(),
            orthogonality_error: end.orthogonality_error,
            refused: self.states.lost(),
            overruns: pace.overruns(),
            cut_steps: self.cuts.total(),
        }
    }

    /// How far the flight has arrived from the manoeuvre's target.
    fn miss(&self) -> Option<Miss> {
        let body = self.scene.maneuver.as_ref()?.body;
        let end = self.arrival.unwrap_or(self.flight.states()[body]);
        let miss = self.scene.miss(&end)?;
        let part = |which: usize| miss.fixed_rows::<3>(3 * which).norm();
        let units = &self.scene.units;
        Some(Miss {
            position: part(0) * units.length,
            linear_momentum: part(1) * units.momentum(),
            attitude: part(2),
            angular_momentum: part(3) * units.angular_momentum(),
            norm: miss.norm(),
        })
    }
}
