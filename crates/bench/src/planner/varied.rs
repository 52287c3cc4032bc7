//! The planner beside CasADi's solvers on random maneuvers of many kinds, with inequalities.
//!
//! Each is stated to lgvi in units of its own, to the peers in units of its size: they depend on them, lgvi does not.

use std::path::Path;
use std::time::Duration;

use lgvi_control::{NewtonSettings, Start, miss, solve};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Load, Method, Simulation, System};
use lgvi_truth::maneuvers::{Varied, varied};
use serde::Serialize;

use super::peer::{Casadi, Stated, VARIED};
use crate::clock::Moment;
use crate::error::{BenchError, write_json};
use crate::maneuvers::quantile;
use crate::peer::{CASADI, Python};
use crate::spread::short;
use crate::tables::Table;

/// Time after which a peer counts as not answering; only IPOPT can be told to end by itself.
const UNANSWERED: Duration = Duration::from_secs(30);

/// By how much a flight may miss the target, in units of the maneuver's size.
const MISS: f64 = 1e-3;

/// Costs that differ by less, relatively, are not told apart.
const SAME: f64 = 0.01;

/// What one solver made of one maneuver.
#[derive(Clone, Debug, Serialize)]
struct Attempt {
    /// Nothing where it is not solved.
    cost: Option<f64>,
    /// CPU time (s).
    seconds: f64,
    /// Why it is not solved.
    failure: Option<String>,
}

/// One maneuver.
#[derive(Debug, Serialize)]
struct Tried {
    index: u64,
    family: &'static str,
    ours: Attempt,
    /// In the order of [`VARIED`].
    peers: Vec<Attempt>,
}

/// A peer beside lgvi.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Beside {
    peer: &'static str,
    /// How many it solves, and how many of these lgvi solves.
    solved: usize,
    both: usize,
    /// Where lgvi's cost is more than a percent above the peer's, and below.
    dearer: usize,
    cheaper: usize,
    /// The peer's time in parts of lgvi's where both solve: median, 5 % and least.
    ratios: [f64; 3],
}

#[derive(Serialize)]
struct Report {
    seed: u64,
    intervals: usize,
    beside: Vec<Beside>,
    tried: Vec<Tried>,
}

/// Tries the first `count` maneuvers of `seed` in so many steps; keeps `varied_<steps>.json` and the table of that name.
pub(crate) fn run(
    count: u64,
    seed: u64,
    intervals: usize,
    python: Option<&Python>,
    directory: &Path,
) -> Result<(), BenchError> {
    let python = python.filter(|python| python.has(CASADI));
    let mut peers = python.map(Peers::start).transpose()?;
    let mut tried = Vec::new();
    for index in 0..count {
        let maneuver = varied(seed, index, intervals)?;
        let ours = plan(&maneuver)?;
        let peers = peers
            .as_mut()
            .map(|peers| peers.solve(&maneuver))
            .transpose()?;
        let one = Tried {
            index,
            family: maneuver.family.name(),
            ours,
            peers: peers.unwrap_or_default(),
        };
        one.print();
        tried.push(one);
    }
    let count = if peers.is_some() { VARIED.len() } else { 0 };
    let beside: Vec<_> = (0..count).map(|peer| Beside::of(peer, &tried)).collect();
    let name = format!("varied_{intervals}");
    table(intervals, &tried, &beside).keep(directory, &name)?;
    let report = Report {
        seed,
        intervals,
        beside,
        tried,
    };
    write_json(&directory.join(name).with_extension("json"), &report)
}

fn plan(maneuver: &Varied) -> Result<Attempt, BenchError> {
    let transfer = maneuver.stated()?;
    let begun = Moment::now();
    let plan = solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| true);
    Ok(Attempt {
        seconds: begun.elapsed(),
        failure: plan.as_ref().err().map(ToString::to_string),
        cost: plan.ok().map(|plan| plan.cost),
    })
}

/// CasADi's solvers, in a process that is started again where a solver does not answer.
struct Peers<'p> {
    python: &'p Python,
    casadi: Casadi,
}

impl<'p> Peers<'p> {
    fn start(python: &'p Python) -> Result<Self, BenchError> {
        let casadi = Casadi::start(python)?;
        Ok(Self { python, casadi })
    }

    /// An attempt of each of [`VARIED`].
    fn solve(&mut self, maneuver: &Varied) -> Result<Vec<Attempt>, BenchError> {
        let transfer = &maneuver.transfer;
        let Some(target) = transfer.target().state() else {
            return Err(BenchError::Body("a target that is no state".into()));
        };
        let stated = Stated {
            body: &maneuver.body,
            gm: maneuver.gm,
            h: transfer.h(),
            intervals: transfer.intervals(),
            weights: maneuver.weights,
            initial: transfer.initial(),
            target: &target,
            constraints: &maneuver.constraints,
        };
        self.casadi.build(&stated, &VARIED)?;
        let mut attempts = Vec::new();
        for solver in 0..VARIED.len() {
            let attempt = match self.casadi.solve_within(UNANSWERED, solver, true) {
                Ok(found) => {
                    let failure = match found.success {
                        true => unflown(maneuver, &found.controls()),
                        false => Some(found.status.clone()),
                    };
                    Attempt {
                        cost: failure.is_none().then_some(found.cost),
                        seconds: found.seconds,
                        failure,
                    }
                }
                Err(BenchError::Peer(failure)) => {
                    self.casadi = Casadi::start(self.python)?;
                    self.casadi.build(&stated, &VARIED)?;
                    Attempt {
                        cost: None,
                        seconds: UNANSWERED.as_secs_f64(),
                        failure: Some(failure),
                    }
                }
                Err(error) => return Err(error),
            };
            attempts.push(attempt);
        }
        Ok(attempts)
    }
}

/// Why a flight with these controls does not reach the target; nothing where it does. The equations of a step have more
/// solutions than the rotation: such as half a turn about a principal axis, which takes no moment.
fn unflown(maneuver: &Varied, controls: &[Load]) -> Option<String> {
    let transfer = &maneuver.transfer;
    let gravity = Central { gm: maneuver.gm };
    let system = System::new(vec![maneuver.body.clone()], vec![Box::new(gravity)]);
    let initial = vec![*transfer.initial()];
    let method = Method::LieEuler(Rotor::Discrete);
    let mut simulation = match Simulation::new(system, initial, method, transfer.h()) {
        Ok(simulation) => simulation,
        Err(error) => return Some(error.to_string()),
    };
    for control in controls {
        if let Err(error) = simulation.advance(&[*control]) {
            return Some(format!("cannot be flown: {error}"));
        }
    }
    let target = transfer.target().state()?;
    let missed = miss(&target, &simulation.states()[0]).norm();
    (missed > MISS).then(|| format!("misses the target by {missed:.1e} as flown"))
}

impl Beside {
    fn of(peer: usize, tried: &[Tried]) -> Self {
        let solved = tried.iter().filter(|one| one.peers[peer].cost.is_some());
        let costs: Vec<_> = tried
            .iter()
            .filter_map(|one| Some((one, one.ours.cost?, one.peers[peer].cost?)))
            .collect();
        let times = costs
            .iter()
            .map(|(one, ..)| one.peers[peer].seconds / one.ours.seconds);
        let mut times: Vec<_> = times.collect();
        times.sort_by(f64::total_cmp);
        let count = |holds: fn(f64, f64) -> bool| {
            let of = costs
                .iter()
                .filter(|(_, ours, theirs)| holds(*ours, *theirs));
            of.count()
        };
        Self {
            peer: VARIED[peer].label,
            solved: solved.count(),
            both: costs.len(),
            dearer: count(|ours, theirs| ours > theirs * (1.0 + SAME)),
            cheaper: count(|ours, theirs| theirs > ours * (1.0 + SAME)),
            ratios: [0.5, 0.05, 0.0].map(|part| quantile(&times, part)),
        }
    }
}

impl Tried {
    fn print(&self) {
        let told = |attempt: &Attempt| match (attempt.cost, &attempt.failure) {
            (Some(cost), _) => format!("{cost:.6e} in {:.1} ms", 1e3 * attempt.seconds),
            (None, failure) => format!(
                "{} in {:.1} ms",
                failure.as_deref().unwrap_or_default(),
                1e3 * attempt.seconds
            ),
        };
        let all = std::iter::once(&self.ours).chain(&self.peers).map(told);
        let all: Vec<_> = all.collect();
        println!("{}, {}: {}", self.index, self.family, all.join("; "));
    }
}

/// A row a peer.
fn table(intervals: usize, tried: &[Tried], beside: &[Beside]) -> Table {
    let count = tried.len();
    let ours = tried.iter().filter(|one| one.ours.cost.is_some()).count();
    let mut table = Table::new([
        format!("{count} maneuvers, N = {intervals}; lgvi solves {ours}"),
        "solved".into(),
        "of these by lgvi".into(),
        "lgvi > 1 % dearer, cheaper".into(),
        "CPU time in parts of lgvi's: median, 5 %, least".into(),
    ]);
    for row in beside {
        table.row([
            row.peer.into(),
            row.solved.to_string(),
            row.both.to_string(),
            format!("{}, {}", row.dearer, row.cheaper),
            row.ratios.map(short).join(", "),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::{Attempt, Beside, Tried};

    #[test]
    fn what_both_solve_is_compared() {
        let attempt = |cost: Option<f64>, seconds| Attempt {
            cost,
            seconds,
            failure: None,
        };
        let one = |ours, theirs| Tried {
            index: 0,
            family: "",
            ours,
            peers: vec![theirs],
        };
        let tried = [
            one(attempt(Some(1.0), 1.0), attempt(Some(1.005), 8.0)),
            one(attempt(Some(1.1), 1.0), attempt(Some(1.0), 4.0)),
            one(attempt(Some(1.0), 1.0), attempt(Some(2.0), 10.0)),
            one(attempt(None, 1.0), attempt(Some(2.0), 1.0)),
            one(attempt(Some(1.0), 1.0), attempt(None, 1.0)),
        ];
        let found = Beside::of(0, &tried);
        assert_eq!([found.solved, found.both], [4, 3]);
        assert_eq!([found.dearer, found.cheaper], [1, 1]);
        assert_eq!(found.ratios, [8.0, 4.0, 4.0]);
    }
}
