//! The node as a managed node: what it opens, the loop of the flight, and how it ends.

mod commanding;
mod publishing;
mod summary;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use lgvi_common::{Docked, Event, FlightReport, FramePrefix};
use lgvi_dynamics::{BodyState, Invariants, Skip, StepError};
use lgvi_middleware::ParameterSpec;
use lgvi_middleware::node::{Managed, Node, NodeError, Stopped};
use lgvi_middleware::ros::Diagnosed;
use lgvi_middleware::shm::StatePublisher;
use lgvi_msgs::shm::{BodySample, Name};
use lgvi_scene::{Commands, Maneuver, Scene};
use tracing::{info, warn};

use self::commanding::Commanding;
use crate::flight::Flight;
use crate::node::choosing;
use crate::node::config::{self, Config, Rates};
use crate::node::cuts::Cuts;
use crate::node::link::{self, LinkEnd, Published, Wait};
use crate::node::lockstep::Lockstep;
use crate::node::monitor::Monitor;
use crate::node::orders::{Order, Orders};
use crate::node::pace::Pace;
use crate::node::resolution::Resolution;
use crate::node::sensors::Sensors;

/// How often waiting looks whether it is over.
const WAIT: Duration = Duration::from_millis(1);

/// How long a step may be waited for at a stretch.
const SLICE: Duration = Duration::from_millis(10);

/// How often a supervisor hears of progress.
const PROGRESS: Duration = Duration::from_millis(50);

/// How long those who listen have to take what was published last, when the node ends.
const FAREWELL: Duration = Duration::from_millis(200);

/// A flight, and all that it needs.
pub(crate) struct Propagator {
    pub(crate) scene: Arc<Scene>,
    config: Config,
    rates: Rates,
    /// The parameters' generation that `rates` are of.
    generation: u64,
    pub(crate) flight: Flight,
    pub(crate) sensors: Sensors,
    names: Vec<Name>,
    /// The state that is sent; kept so that sending allocates nothing.
    outgoing: Vec<BodySample>,
    states: StatePublisher,
    pub(crate) state_topic: String,
    /// Full-rate states sent.
    pub(crate) samples: u64,
    /// Cost of the controls of each planned body so far.
    costs: Vec<f64>,
    /// The planned body's state where its last control sequence has ended, if that is before the end of the run.
    arrival: Option<BodyState>,
    /// Steps that could not be made as one.
    cuts: Cuts,
    /// Bodies that have docked.
    pub(crate) docked: Vec<Docked>,
    pub(crate) link: LinkEnd,
    pub(crate) orders: Orders,
    /// Steps to be made of a paused flight, and who has asked for them.
    pub(crate) stepping: Option<(Order, u64)>,
    pace: Pace,
    /// Where it waits for plans made on the way.
    lockstep: Option<Lockstep>,
    /// Commands from outside.
    commanding: Commanding,
    pub(crate) phase: Phase,
    pub(crate) paused: bool,
    /// Sequences accepted.
    pub(crate) accepted: u64,
    /// Sequences refused because they came too late.
    late_controls: u64,
    /// The steps whose states were last sent over shared memory and handed to the ROS side.
    pub(crate) sampled: Option<u64>,
    pub(crate) handed: Option<u64>,
    start: Invariants,
    /// When the first step was made.
    began: Instant,
    told: Instant,
    pub(crate) monitor: Arc<Monitor>,
    pub(crate) resolution: Resolution,
    /// What was published has been accounted for, or is being so.
    pub(crate) accounted: bool,
    /// The flight is over, and what was published is waited for.
    pub(crate) ending: Option<Ending>,
    _diagnosed: Vec<Diagnosed>,
}

/// How far the flight is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Held until subscribers are there.
    Unattended,
    /// Held at step 0 until a control sequence is there.
    Uncommanded,
    /// On its way.
    Flying,
    /// All steps are made.
    Flown,
}

/// A flight that is over, of which nobody has been told yet.
pub(crate) struct Ending {
    pub(crate) report: FlightReport,
    pub(crate) published: Receiver<Published>,
}

impl Managed for Propagator {
    const NAME: &'static str = "lgvi_propagator";

    fn parameters() -> Vec<ParameterSpec> {
        config::specifications()
    }

    fn configure(node: &Node) -> Result<Self, NodeError> {
        let mut config = Config::read(&node.parameters)?;
        let prefix = FramePrefix::read(&node.parameters)?.of(node.args.namespace());
        config.scene = choosing::decide(node, config.scene)?.with_frame_prefix(&prefix);
        let generation = node.parameters.generation();
        let rates = Rates::read(&node.parameters, &config.scene)?;
        let scene = Arc::new(config.scene.clone());
        let names: Vec<Name> = scene
            .bodies
            .iter()
            .map(|body| Name::try_from(body.name.as_str()))
            .collect::<Result<_, _>>()
            .map_err(NodeError::input)?;
        let flight = Flight::new(&scene).map_err(NodeError::input)?;
        info!("flown by {}", flight.scheme());
        if let Skip::Within(allowance) = flight.scheme().skip {
            let tolerance = allowance.tolerance;
            info!(
                "left out of gravity: what changes the end of the run by {tolerance:.1e} at most"
            );
        }

        let shm = node.shm()?;
        let state_topic = node.args.resolve("~/state")?;
        let states = shm.state_publisher(&state_topic, names.len(), rates.delivery())?;
        let monitor = Arc::new(Monitor::new(&scene));
        let orders = Orders::serve(node, &scene)?;
        let commanding = Commanding::new(node, &shm, &scene, &config)?;
        // Last: after an error the process might end while the thread still lets go of shared memory, half of which would stay.
        let link = link::start(node, &shm, &config, &rates, &scene, &names, &monitor)?;
        let sensors = Sensors::new(&scene, link.listened());
        let planned = scene.maneuver.iter().flat_map(Maneuver::planned).count();
        let now = Instant::now();
        Ok(Self {
            outgoing: Vec::with_capacity(names.len()),
            start: flight.invariants(),
            resolution: Resolution::new(&scene, &flight),
            flight,
            sensors,
            names,
            states,
            state_topic,
            samples: 0,
            costs: vec![0.0; planned],
            arrival: None,
            cuts: Cuts::default(),
            docked: Vec::new(),
            orders,
            stepping: None,
            pace: Pace::free(),
            lockstep: config.lockstep.then(|| Lockstep::new(&scene)).flatten(),
            commanding,
            phase: Phase::Unattended,
            paused: false,
            accepted: 0,
            late_controls: 0,
            sampled: None,
            handed: None,
            began: now,
            told: now,
            _diagnosed: vec![
                Monitor::diagnose(&monitor, &node.diagnostics),
                link.diagnose(&node.diagnostics),
            ],
            monitor,
            accounted: false,
            ending: None,
            generation,
            rates,
            link,
            config,
            scene,
        })
    }

    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        // Those that came while nobody flew are of another time.
        self.link.forget_commands();
        self.commanding.forget()?;
        self.orders.open();
        let flown = self.fly(node);
        self.refuse();
        flown.map(|()| Stopped::Interrupted)
    }

    fn clean_up(mut self, node: &Node) -> Result<(), NodeError> {
        if let Some(warning) = self.cuts.rest() {
            warn!("{warning}");
        }
        let accounted = self.take_leave(node, FAREWELL);
        self.link.close().and(accounted)
    }
}

impl Propagator {
    /// Flies until the node is to stop.
    fn fly(&mut self, node: &Node) -> Result<(), NodeError> {
        self.set_pace(node);
        while !node.interrupted() {
            self.heed(node)?;
            let held = self.phase == Phase::Flying && self.waits_for_plan(node);
            let unanswered = self.phase == Phase::Flying && self.waits_for_command(node)?;
            match self.phase {
                Phase::Unattended => self.await_company()?,
                Phase::Uncommanded => self.await_command(node)?,
                Phase::Flying if held => std::thread::sleep(WAIT),
                Phase::Flying if unanswered => self.commanding.pause(),
                Phase::Flying if !self.paused || self.stepping.is_some() => self.step(node)?,
                Phase::Flying | Phase::Flown => std::thread::sleep(WAIT),
            }
        }
        Ok(())
    }

    /// Takes in what has come from outside: parameters, control sequences, orders.
    fn heed(&mut self, node: &Node) -> Result<(), NodeError> {
        let generation = node.parameters.generation();
        if generation != self.generation {
            self.generation = generation;
            self.rates = Rates::read(&node.parameters, &self.scene)?;
            self.states.deliver(self.rates.delivery());
            self.link.set_lossless(self.rates.lossless());
            self.set_pace(node);
        }
        self.link.check()?;
        self.take_controls();
        self.take_commands()?;
        self.take_answers()?;
        self.look_for_the_end(node)?;
        while self.stepping.is_none()
            && let Some(order) = self.orders.next()
        {
            self.obey(node, order)?;
        }
        Ok(())
    }

    /// From the present step on.
    pub(crate) fn set_pace(&mut self, node: &Node) {
        let now = self.scene.seconds(self.flight.step());
        self.pace.set(&node.clock, now, self.rates.real_time_factor);
    }

    /// Begins the flight when the subscribers that were asked for are there.
    fn await_company(&mut self) -> Result<(), NodeError> {
        let wanted = self.config.await_subscribers;
        let attended = self.link.attended() && self.states.wait_for_subscribers(wanted, WAIT)?;
        if attended {
            self.phase = Phase::Uncommanded;
        } else {
            std::thread::sleep(WAIT);
        }
        Ok(())
    }

    /// Begins the flight when all planned bodies have a control sequence, where that was asked for.
    fn await_command(&mut self, node: &Node) -> Result<(), NodeError> {
        let maneuver = self.scene.maneuver.as_ref();
        let awaited = maneuver.filter(|_| self.config.await_control);
        let is_missing = |planned: &Maneuver| !self.flight.commanded(planned.body);
        if awaited.is_some_and(|maneuver| maneuver.planned().any(is_missing)) {
            std::thread::sleep(WAIT);
            return Ok(());
        }
        self.phase = Phase::Flying;
        self.began = Instant::now();
        self.set_pace(node);
        if self.sampled.is_some() {
            return Ok(());
        }
        self.sense_again()?;
        self.publish(Wait::Always)
    }

    /// Makes the next step when its time has come, and publishes where it leads.
    fn step(&mut self, node: &Node) -> Result<(), NodeError> {
        let next = self.flight.step() + 1;
        if next > self.scene.steps {
            return self.conclude(node);
        }
        if self.stepping.is_none() {
            let (due, stamp) = (self.scene.seconds(next), self.scene.stamp(next));
            if !self.pace.wait(due, stamp, SLICE) {
                return Ok(());
            }
        }
        self.advance()?;
        if let Some(lockstep) = &mut self.lockstep
            && lockstep.reach(&self.flight)
            && !next.is_multiple_of(self.rates.state_every)
            && !self.is_answered(next)
        {
            self.sample()?;
        }
        // Steps that were asked for have the time that it takes.
        self.publish(match self.stepping {
            None => Wait::AsConfigured,
            Some(_) => Wait::ForRoom,
        })?;
        if self.told.elapsed() >= PROGRESS {
            self.told = Instant::now();
            node.report_progress(Event::Flying { step: next });
        }
        self.count_down();
        if next == self.scene.steps {
            self.conclude(node)?;
        }
        Ok(())
    }

    fn advance(&mut self) -> Result<(), NodeError> {
        self.note_timeouts();
        let step = self.flight.step();
        let timed = self.monitor.times(step, !self.pace.is_free());
        let report = if self.sensors.is_empty() {
            let made = self.flight.advance();
            made.map_err(|error| self.step_failed(&error))?
        } else {
            self.advance_sensing()?
        };
        if let Some(began) = timed {
            self.monitor.timed(began.elapsed());
        }
        self.monitor.step.store(step + 1, Ordering::Relaxed);
        self.note_docked();
        self.resolution.note(&self.scene, &self.flight);
        let overruns = self.pace.overruns;
        self.monitor.overruns.store(overruns, Ordering::Relaxed);
        if let Some(pieces) = self.flight.cut(report)
            && let Some(warning) = self.cuts.note(step, pieces, Instant::now())
        {
            warn!("{warning}");
        }
        if let Some(maneuver) = &self.scene.maneuver {
            let body = maneuver.body;
            for (cost, planned) in self.costs.iter_mut().zip(maneuver.planned()) {
                *cost += cost_of_step(&self.scene, &self.flight, planned);
            }
            if maneuver.final_time.is_some() && self.flight.sequence_end(body) == Some(step + 1) {
                self.arrival = Some(self.flight.states()[body]);
            }
        }
        Ok(())
    }

    /// The present step cannot be made.
    pub(crate) fn step_failed(&self, error: &StepError) -> NodeError {
        let (step, error) = (self.flight.step(), self.scene.step_error(error));
        NodeError::Runtime(format!("step {step}: {error}"))
    }

    /// Begins anew at step 0 of the scene.
    pub(crate) fn restart(&mut self) -> Result<(), NodeError> {
        self.flight.reset(&self.scene).map_err(NodeError::runtime)?;
        self.sensors.begin(&self.flight);
        self.phase = Phase::Uncommanded;
        if let Some(lockstep) = &mut self.lockstep {
            lockstep.begin_anew();
        }
        self.link.forget_commands();
        self.commanding.forget()?;
        self.commanding.begin_anew();
        self.costs.fill(0.0);
        self.late_controls = 0;
        self.docked.clear();
        self.arrival = None;
        self.start = self.flight.invariants();
        self.resolution.begin(&self.flight);
        self.monitor.begin(&self.flight, &self.start);
        Ok(())
    }

    /// Takes the present state for the one that the invariants are measured from.
    pub(crate) fn measure_from_here(&mut self) {
        self.start = self.flight.invariants();
        self.resolution.begin(&self.flight);
        self.monitor.begin(&self.flight, &self.start);
    }
}

/// The cost of what acted on a planned body in the last step.
fn cost_of_step(scene: &Scene, flight: &Flight, planned: &Maneuver) -> f64 {
    let h = scene.h();
    let rigid = &flight.system().bodies()[planned.body];
    match (planned.commands(), rigid.thrusters(), rigid.wheels()) {
        (Commands::Thrusters, Some(thrusters), _) => {
            planned.effort_cost(thrusters.states().iter().map(|one| one.thrust), h)
        }
        (Commands::Wheels, _, Some(wheels)) => {
            planned.effort_cost(wheels.states().iter().map(|one| one.torque), h)
        }
        _ => planned.interval_cost(&flight.loads()[planned.body], h),
    }
}

#[cfg(test)]
mod tests;
