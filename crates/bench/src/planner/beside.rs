//! Attempts of lgvi and of its peers at the same random maneuvers, compared.

use std::path::Path;
use std::time::Duration;

use lgvi_control::{NewtonSettings, Start, Transfer, miss, solve};
use lgvi_dynamics::{MethodError, Simulation, StepError};
use lgvi_truth::maneuvers::ManeuverError;
use serde::Serialize;

use super::peer::{Casadi, Found, Solver, Stated};
use crate::clock::Moment;
use crate::error::{BenchError, write_json};
use crate::maneuvers::quantile;
use crate::peer::{CASADI, Python};
use crate::spread::short;
use crate::tables::Table;

/// Time after which a peer counts as not answering; only IPOPT can be told to end by itself.
const UNANSWERED: Duration = Duration::from_secs(30);

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
pub(super) struct Tried {
    index: u64,
    family: &'static str,
    ours: Attempt,
    /// In the order of the solvers.
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

/// A maneuver that lgvi and its peers are to plan.
pub(super) trait Drawn {
    fn family(&self) -> &'static str;

    /// As it is stated to lgvi.
    fn ours(&self) -> Result<Transfer, BenchError>;

    /// As it is stated to the peers, in units of its size.
    fn theirs(&self) -> Result<Stated<'_>, BenchError>;

    /// What lgvi's plan costs, from a cold start.
    fn planned(&self, transfer: &Transfer) -> Result<f64, String> {
        solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
            .map(|plan| plan.cost)
            .map_err(|error| error.to_string())
    }

    /// The transfer in units of its size, and its flight by a plan of this cost, which begins.
    fn begun(&self, cost: f64) -> (&Transfer, Result<Simulation, MethodError>);

    /// Makes a step of the flight with these commands.
    fn advance(&self, flight: &mut Simulation, commands: &[f64]) -> Result<(), StepError>;
}

/// By how much a flight may miss the target, in units of the maneuver's size.
const MISS: f64 = 1e-3;

/// Has lgvi and the solvers of its peer try the maneuvers of the first `count` indices.
pub(super) fn try_all<D: Drawn>(
    count: u64,
    python: Option<&Python>,
    solvers: &'static [Solver],
    draw: impl Fn(u64) -> Result<D, ManeuverError>,
) -> Result<Vec<Tried>, BenchError> {
    let python = python.filter(|python| python.has(CASADI));
    let mut peers = python
        .map(|python| Peers::start(python, solvers))
        .transpose()?;
    let mut tried = Vec::new();
    for index in 0..count {
        let maneuver = draw(index)?;
        let ours = Attempt::ours(&maneuver)?;
        let peers = peers.as_mut().map(|peers| peers.solve(&maneuver));
        let one = Tried {
            index,
            family: maneuver.family(),
            ours,
            peers: peers.transpose()?.unwrap_or_default(),
        };
        one.print();
        tried.push(one);
    }
    Ok(tried)
}

/// Why a flight with these commands does not reach the target; nothing where it does. The equations of a step have more
/// solutions than the rotation: such as half a turn about a principal axis, which takes no moment.
fn unflown(maneuver: &impl Drawn, found: &Found) -> Option<String> {
    let (transfer, flight) = maneuver.begun(found.cost);
    let mut flight = match flight {
        Ok(flight) => flight,
        Err(error) => return Some(error.to_string()),
    };
    for commands in &found.controls {
        if let Err(error) = maneuver.advance(&mut flight, commands) {
            return Some(format!("cannot be flown: {error}"));
        }
    }
    let target = transfer.target().state()?;
    let missed = miss(&target, &flight.states()[0]).norm();
    (missed > MISS).then(|| format!("misses the target by {missed:.1e} as flown"))
}

impl Attempt {
    /// lgvi's, from a cold start.
    fn ours(maneuver: &impl Drawn) -> Result<Self, BenchError> {
        let transfer = maneuver.ours()?;
        let begun = Moment::now();
        let cost = maneuver.planned(&transfer);
        Ok(Self {
            seconds: begun.elapsed(),
            failure: cost.as_ref().err().cloned(),
            cost: cost.ok(),
        })
    }
}

/// CasADi with some solvers, in a process that is started again where one does not answer.
struct Peers<'p> {
    python: &'p Python,
    solvers: &'static [Solver],
    casadi: Casadi,
}

impl<'p> Peers<'p> {
    fn start(python: &'p Python, solvers: &'static [Solver]) -> Result<Self, BenchError> {
        let casadi = Casadi::start(python)?;
        Ok(Self {
            python,
            solvers,
            casadi,
        })
    }

    /// An attempt of each solver.
    fn solve(&mut self, maneuver: &impl Drawn) -> Result<Vec<Attempt>, BenchError> {
        let stated = maneuver.theirs()?;
        self.casadi.build(&stated, self.solvers)?;
        let mut attempts = Vec::new();
        for solver in 0..self.solvers.len() {
            let attempt = match self.casadi.solve_within(UNANSWERED, solver, true) {
                Ok(found) => {
                    let failure = match found.success {
                        true => unflown(maneuver, &found),
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
                    self.casadi.build(&stated, self.solvers)?;
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

/// Keeps what has been tried as `<name>_<intervals>.json` and as the table of that name; the peers are those of `solvers`, if
/// any were there.
pub(super) fn keep(
    (name, seed, intervals): (&str, u64, usize),
    solvers: &[Solver],
    tried: Vec<Tried>,
    directory: &Path,
) -> Result<(), BenchError> {
    let compared = tried.iter().any(|one| !one.peers.is_empty());
    let solvers = if compared { solvers } else { &[] };
    let beside = solvers.iter().enumerate();
    let beside = beside.map(|(peer, solver)| Beside::of(solver.label, peer, &tried));
    let beside: Vec<_> = beside.collect();
    let name = format!("{name}_{intervals}");
    table(intervals, &tried, &beside).keep(directory, &name)?;
    let report = Report {
        seed,
        intervals,
        beside,
        tried,
    };
    write_json(&directory.join(name).with_extension("json"), &report)
}

impl Beside {
    fn of(label: &'static str, peer: usize, tried: &[Tried]) -> Self {
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
            peer: label,
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
        let found = Beside::of("peer", 0, &tried);
        assert_eq!([found.solved, found.both], [4, 3]);
        assert_eq!([found.dearer, found.cheaper], [1, 1]);
        assert_eq!(found.ratios, [8.0, 4.0, 4.0]);
    }
}
