//! The node as a managed node: what it opens, the loop of the flight, and how it ends.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use lgvi_common::{Docked, Event, FlightReport, FramePrefix, Miss, body_sample};
use lgvi_dynamics::{BodyState, Invariants, Skip, StepError};
use lgvi_middleware::ParameterSpec;
use lgvi_middleware::node::{Managed, Node, NodeError, Stopped};
use lgvi_middleware::ros::Diagnosed;
use lgvi_middleware::shm::StatePublisher;
use lgvi_msgs::shm::{BodySample, Name};
use lgvi_scene::Scene;
use tracing::{info, warn};

use crate::choosing;
use crate::command::{Command, Target};
use crate::config::{self, Config, Rates};
use crate::cuts::Cuts;
use crate::cycle::Cycle;
use crate::flight::Flight;
use crate::link::{self, LinkEnd, Published, Wait};
use crate::lockstep::Lockstep;
use crate::messages::state_header;
use crate::monitor::Monitor;
use crate::orders::{Order, Orders};
use crate::pace::Pace;
use crate::resolution::Resolution;
use crate::sensors::Sensors;
use crate::wrench::Terms;
use crate::{ControlError, Controls};

/// How often waiting looks whether it is over.
const WAIT: Duration = Duration::from_millis(1);

/// The same for the answer of a controller.
const ANSWER: Duration = Duration::from_micros(20);

/// How often a state is published until its first answer comes, and a warning comes at most.
const PROMPT: Duration = Duration::from_secs(1);

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
    /// Cost of the maneuver's controls so far.
    cost: f64,
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
    /// Where it waits for a controller from outside.
    cycle: Option<Cycle>,
    /// The commands taken for the present step, by the index of their target.
    commands: Vec<Option<Command>>,
    /// For what commands act, and the steps at which these are over.
    acting: Vec<(Target, u64)>,
    /// When it was last said that a command is over.
    silence_told: Option<Instant>,
    /// When the state that is waited at was last published.
    asked: Instant,
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
        let link = link::start(node, &shm, &config, &rates, &scene, &names, &monitor)?;
        let sensors = Sensors::new(&scene, link.listened());
        let cycle = Cycle::read(&node.parameters, &scene, &config.wrenches)?;
        if let (Some(cycle), Some(terms)) = (&cycle, &mut config.terms) {
            *terms = terms.for_steps(cycle.every());
        }
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
            cost: 0.0,
            arrival: None,
            cuts: Cuts::default(),
            docked: Vec::new(),
            orders,
            stepping: None,
            pace: Pace::free(),
            lockstep: config.lockstep.then(|| Lockstep::new(&scene)).flatten(),
            cycle,
            commands: vec![None; 2 * scene.bodies.len()],
            acting: Vec::new(),
            silence_told: None,
            asked: now,
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
            let answered = self.phase == Phase::Flying && self.waits_for_command(node)?;
            match self.phase {
                Phase::Unattended => self.await_company()?,
                Phase::Uncommanded => self.await_command(node)?,
                Phase::Flying if held => std::thread::sleep(WAIT),
                Phase::Flying if answered => {
                    let silent = self.cycle.as_ref().is_some_and(Cycle::is_silent);
                    std::thread::sleep(if silent { WAIT } else { ANSWER });
                }
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

    /// Begins the flight when the maneuver's body has a control sequence, where that was asked for.
    fn await_command(&mut self, node: &Node) -> Result<(), NodeError> {
        let maneuver = self.scene.maneuver.as_ref();
        let awaited = maneuver
            .filter(|_| self.config.await_control)
            .map(|maneuver| maneuver.body);
        if awaited.is_some_and(|body| !self.flight.commanded(body)) {
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

    /// Accepts or refuses the control sequences that have come in.
    fn take_controls(&mut self) {
        while let Some(controls) = self.link.next_controls() {
            let step = self.flight.step();
            let verdict = self.flight.admit(controls).map(|()| step);
            self.accepted += u64::from(verdict.is_ok());
            self.late_controls += u64::from(matches!(verdict, Err(ControlError::Late { .. })));
            self.link.answer(verdict);
        }
    }

    /// Flies the last command for each target that has come in.
    fn take_commands(&mut self) -> Result<(), NodeError> {
        let Some(terms) = self.config.terms else {
            return Ok(());
        };
        let step = self.flight.step();
        let mut taken = 0;
        while let Some(command) = self.link.next_command(taken) {
            let cycle = self.cycle.as_ref();
            if cycle.is_none_or(|cycle| cycle.admits(&self.scene, step, &command)) {
                let place = &mut self.commands[command.target().index(&self.scene)];
                taken += usize::from(place.is_none());
                *place = Some(command);
            }
        }
        for index in 0..self.commands.len() {
            if taken == 0 {
                break;
            }
            let Some(command) = self.commands[index].take() else {
                continue;
            };
            taken -= 1;
            if let Some(cycle) = &mut self.cycle {
                cycle.note(step, command.target());
            }
            let first_step = terms.first_step(step);
            if first_step < self.scene.steps {
                self.fly_command(&command, &terms, first_step)?;
            }
        }
        Ok(())
    }

    /// Flies a command from a step on, as the repetition reads it.
    fn fly_command(
        &mut self,
        command: &Command,
        terms: &Terms,
        first_step: u64,
    ) -> Result<(), NodeError> {
        let sequence = command
            .sequence(&self.scene, terms, first_step, self.flight.states())
            .map_err(NodeError::runtime)?;
        let controls = Controls::of_message(&self.scene, &sequence).map_err(NodeError::runtime)?;
        let end = controls.end();
        self.flight.accept(controls).map_err(NodeError::runtime)?;
        self.accepted += 1;
        let target = command.target();
        self.acting.retain(|(other, _)| *other != target);
        self.acting.push((target, end));
        self.link.flies(sequence);
        Ok(())
    }

    /// Says where the last command for a target is over, at most once a second.
    fn note_silence(&mut self) {
        let (step, before) = (self.flight.step(), self.acting.len());
        self.acting.retain(|(target, end)| {
            let quiet = |told: Instant| told.elapsed() < PROMPT;
            if step >= *end && !self.silence_told.is_some_and(quiet) {
                let what = target.describe(&self.scene);
                warn!("no new {what}: none acts from step {step} on");
            }
            step < *end
        });
        if self.acting.len() < before {
            self.silence_told = Some(Instant::now());
        }
    }

    /// Whether it holds until a controller has answered the present state.
    fn waits_for_command(&mut self, node: &Node) -> Result<bool, NodeError> {
        let step = self.flight.step();
        if step == self.scene.steps {
            return Ok(false);
        }
        let Some(cycle) = &mut self.cycle else {
            return Ok(false);
        };
        let waited = cycle.waits(&self.scene, step);
        if waited && cycle.is_silent() && self.asked.elapsed() >= PROMPT {
            // Who has come since has not seen it.
            self.asked = Instant::now();
            self.sense_again()?;
            self.link.repeat(&self.flight);
        }
        if waited {
            self.set_pace(node);
        }
        Ok(waited)
    }

    /// Whether a controller is to answer the state of a step.
    pub(crate) fn is_answered(&self, step: u64) -> bool {
        let cycle = self.cycle.as_ref();
        cycle.is_some_and(|cycle| cycle.begins_at(step))
    }

    /// The states have been replaced: what came in answers others.
    pub(crate) fn ask_again(&mut self) {
        self.link.forget_commands();
        self.sensors.begin(&self.flight);
        if let Some(cycle) = &mut self.cycle {
            cycle.ask_again();
        }
    }

    /// Whether it holds until a plan made on the way has come; what is missed meanwhile is not made up for.
    fn waits_for_plan(&mut self, node: &Node) -> bool {
        let Some(lockstep) = &mut self.lockstep else {
            return false;
        };
        let waited = lockstep.waits(&self.flight);
        if waited {
            self.set_pace(node);
        }
        waited
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
        self.note_silence();
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
            self.cost += maneuver.interval_cost(&self.flight.loads()[body], self.scene.h());
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

    /// Publishes the present state where its turn has come, or in any case.
    pub(crate) fn publish(&mut self, wait: Wait) -> Result<(), NodeError> {
        let step = self.flight.step();
        let answered = self.is_answered(step);
        let always = step == self.scene.steps || wait == Wait::Always || answered;
        if always || step.is_multiple_of(self.rates.state_every) {
            self.sample()?;
        }
        if always || step.is_multiple_of(self.rates.ros_every) {
            self.hand_over(if answered { Wait::Always } else { wait });
        }
        if answered {
            self.link.wake();
        }
        Ok(())
    }

    /// Sends the present state over shared memory.
    pub(crate) fn sample(&mut self) -> Result<(), NodeError> {
        let step = self.flight.step();
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
        self.states.send(header, &self.outgoing)?;
        self.samples += 1;
        self.sampled = Some(step);
        self.monitor
            .refused
            .store(self.states.lost(), Ordering::Relaxed);
        Ok(())
    }

    /// Hands the present state to the ROS side.
    pub(crate) fn hand_over(&mut self, wait: Wait) {
        let step = self.flight.step();
        if self.link.publish(&self.flight, wait) {
            self.handed = Some(step);
        } else {
            self.monitor.skipped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Begins anew at step 0 of the scene.
    pub(crate) fn restart(&mut self) -> Result<(), NodeError> {
        self.flight.reset(&self.scene).map_err(NodeError::runtime)?;
        self.sensors.begin(&self.flight);
        self.phase = Phase::Uncommanded;
        if let Some(lockstep) = &mut self.lockstep {
            lockstep.begin_anew();
        }
        if let Some(cycle) = &mut self.cycle {
            cycle.begin_anew();
        }
        self.link.forget_commands();
        self.acting.clear();
        self.cost = 0.0;
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

    pub(crate) fn report(&self) -> FlightReport {
        let (start, end) = (&self.start, self.flight.invariants());
        let units = &self.scene.units;
        FlightReport {
            steps: self.flight.step(),
            step_size: self.scene.h() * units.time,
            seconds: self.began.elapsed().as_secs_f64(),
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
            overruns: self.pace.overruns,
            late_controls: self.late_controls,
            cut_steps: self.cuts.total(),
            detail_changes: self.flight.switches(),
            docked: self.docked.clone(),
        }
    }

    /// How far the flight has arrived from the maneuver's target.
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

#[cfg(test)]
mod tests;
