//! What flies a case: an integrator of this project or of a peer.

use std::cell::RefCell;
use std::rc::Rc;

use lgvi_dynamics::{BodyState, Load, Method, Simulation, System};
use lgvi_truth::Case;

use crate::clock::Moment;
use crate::error::BenchError;
use crate::methods::Family;
use crate::peer::{Flyer, Tuning};

/// The states at the reference times, nothing at those where no step ends.
pub(crate) type States = Vec<Option<Vec<BodyState>>>;

/// Time (s) and states of a flight.
pub(crate) struct Flight {
    pub seconds: f64,
    pub states: States,
}

/// Something that flies a case.
pub(crate) trait Contestant {
    fn label(&self) -> &str;

    /// Whether it is a peer's.
    fn is_peer(&self) -> bool;

    /// By what it is tuned; nothing where there is but one way to fly.
    fn tuning(&self) -> Option<Tuning>;

    /// A flight, or why it cannot be made.
    fn fly(&mut self, setting: f64) -> Result<Result<Flight, String>, BenchError>;

    /// The time (s) of a flight that could be made.
    fn time(&mut self, setting: f64) -> Result<f64, BenchError>;
}

/// Least time (s) for which a flight is repeated to be timed once; a shorter first one warms up. As peers do it.
const TIMED: f64 = 5e-3;

/// An integrator of this project.
pub(crate) struct Own<'a> {
    pub label: String,
    pub family: Family,
    pub case: &'a Case,
    pub times: &'a [f64],
}

impl Own<'_> {
    fn method(&self, setting: f64) -> (Method, u64) {
        match self.family {
            Family::Stepped(method) => (method, setting as u64),
            Family::Adaptive(method) => (method(setting), 1),
            Family::Exact(method) => (method, 1),
        }
    }

    fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or_default()
    }

    /// At step 0 of `steps` to the time `t`.
    fn simulation(&self, method: Method, t: f64, steps: u64) -> Result<Simulation, BenchError> {
        let (system, states) = self.case.system()?;
        Ok(Simulation::new(system, states, method, t / steps as f64)?)
    }

    /// Seconds of some steps; an error where one cannot be made.
    fn advance(simulation: &mut Simulation, steps: u64) -> Result<f64, BenchError> {
        let controls = vec![Load::default(); simulation.states().len()];
        let begun = Moment::now();
        for _ in 0..steps {
            simulation.advance(&controls)?;
        }
        Ok(begun.elapsed())
    }

    /// Each time in a flight of its own.
    fn leap(&self, method: Method) -> Result<States, BenchError> {
        let leap = |&t: &f64| {
            let mut simulation = self.simulation(method, t, 1)?;
            Self::advance(&mut simulation, 1)?;
            Ok(Some(simulation.states().to_vec()))
        };
        self.times.iter().map(leap).collect()
    }

    /// All times in one flight.
    fn visit(&self, method: Method, steps: u64) -> Result<(f64, States), BenchError> {
        let mut simulation = self.simulation(method, self.end(), steps)?;
        let mut seconds = 0.0;
        let mut states = Vec::new();
        for time in self.times {
            let count = time / self.end() * steps as f64;
            if (count - count.round()).abs() > 1e-9 * steps as f64 {
                states.push(None);
                continue;
            }
            let more = (count.round() as u64).saturating_sub(simulation.step());
            seconds += Self::advance(&mut simulation, more)?;
            states.push(Some(simulation.states().to_vec()));
        }
        Ok((seconds, states))
    }
}

impl Contestant for Own<'_> {
    fn label(&self) -> &str {
        &self.label
    }

    fn is_peer(&self) -> bool {
        false
    }

    fn tuning(&self) -> Option<Tuning> {
        match self.family {
            Family::Stepped(_) => Some(Tuning::Steps),
            Family::Adaptive(_) => Some(Tuning::Tolerance),
            Family::Exact(_) => None,
        }
    }

    fn fly(&mut self, setting: f64) -> Result<Result<Flight, String>, BenchError> {
        let (method, steps) = self.method(setting);
        let made = match self.family {
            Family::Stepped(_) => self.visit(method, steps),
            // of the first time all others are multiples; the work does not depend on how often states are shown
            Family::Adaptive(_) => self.visit(method, (self.end() / self.times[0]).round() as u64),
            Family::Exact(_) => self.leap(method).map(|states| (0.0, states)),
        };
        match made {
            Ok((seconds, states)) => Ok(Ok(Flight { seconds, states })),
            Err(error @ (BenchError::Step(_) | BenchError::Method(_))) => {
                Ok(Err(error.to_string()))
            }
            Err(error) => Err(error),
        }
    }

    fn time(&mut self, setting: f64) -> Result<f64, BenchError> {
        let (method, steps) = self.method(setting);
        let once = || {
            let mut simulation = self.simulation(method, self.end(), steps)?;
            Self::advance(&mut simulation, steps)
        };
        let first = once()?;
        if first >= TIMED {
            return Ok(first);
        }
        let (mut seconds, mut flights) = (0.0, 0);
        while seconds < TIMED {
            seconds += once()?;
            flights += 1;
        }
        Ok(seconds / f64::from(flights))
    }
}

/// A peer's integrator.
pub(crate) struct Peers<'a> {
    pub label: String,
    pub name: String,
    pub tuning: Tuning,
    pub flyer: Rc<RefCell<Flyer>>,
    pub system: &'a System,
}

impl Contestant for Peers<'_> {
    fn label(&self) -> &str {
        &self.label
    }

    fn is_peer(&self) -> bool {
        true
    }

    fn tuning(&self) -> Option<Tuning> {
        Some(self.tuning)
    }

    fn fly(&mut self, setting: f64) -> Result<Result<Flight, String>, BenchError> {
        let flown = self.flyer.borrow_mut().fly(&self.name, setting)?;
        Ok(flown.map(|flown| Flight {
            seconds: flown.seconds,
            states: flown.states(self.system),
        }))
    }

    fn time(&mut self, setting: f64) -> Result<f64, BenchError> {
        let timed = self.flyer.borrow_mut().time(&self.name, setting)?;
        timed.map_err(BenchError::Peer)
    }
}
