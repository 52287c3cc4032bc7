//! Whether the automatic choice keeps its promise: random flights, each against a truth of its own.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use lgvi_dynamics::auto::{ChoiceError, choose};
use lgvi_truth::flights::{Class, Flight};

use crate::clock::Moment;
use crate::error::BenchError;
use crate::tables::Table;

/// How much tighter the second tolerance of each flight is, and the tightest that there is.
const TIGHTER: f64 = 1e-2;
const TIGHTEST: f64 = 1e-14;

/// The flights of a class.
#[derive(Default)]
struct Tally {
    flights: usize,
    /// Errors in tolerances, of flights without a warning whose truth is known.
    errors: Vec<f64>,
    warned: usize,
    refused: usize,
    /// Truths that are not known to the tolerance.
    doubtful: usize,
    /// A tighter tolerance that ends with a larger error.
    worse: usize,
    /// Any other refusal.
    failed: Vec<String>,
    seconds: Vec<f64>,
}

/// How a flight ended.
enum End {
    Error(f64),
    Warned,
    Refused,
    Doubtful,
    Failed(String),
}

/// Prints a row a class; keeps the table `promises`.
pub(crate) fn run(scenes: u64, seed: u64, directory: &Path) -> Result<(), BenchError> {
    let mut tallies: BTreeMap<usize, Tally> = BTreeMap::new();
    for index in 0..scenes {
        let flight = Flight::random(seed, index);
        let class = Class::ALL.iter().position(|class| *class == flight.class);
        tallies
            .entry(class.unwrap_or_default())
            .or_default()
            .add(index, &flight);
    }
    let head = [
        "flights",
        "scenes",
        "error ≤ tolerance",
        "≤ 2 tolerances",
        "greatest error (tolerances)",
        "refused with the floor",
        "warned",
        "truth unknown",
        "tighter but worse",
        "choosing (s, median, most)",
    ];
    let mut table = Table::new(head.map(str::to_owned));
    let mut all = Tally::default();
    for (class, mut tally) in tallies {
        table.row(tally.row(&format!("{:?}", Class::ALL[class])));
        all.join(tally);
    }
    table.row(all.row("all"));
    table.keep(directory, "promises")?;
    for failure in &all.failed {
        println!("{failure}");
    }
    Ok(())
}

impl Tally {
    fn add(&mut self, index: u64, flight: &Flight) {
        let (end, seconds) = end(flight, flight.tolerance);
        self.seconds.push(seconds);
        self.flights += 1;
        match end {
            End::Error(error) => {
                self.errors.push(error / flight.tolerance);
                let tighter = (TIGHTER * flight.tolerance).max(TIGHTEST);
                let (End::Error(then), _) = self::end(flight, tighter) else {
                    return;
                };
                self.worse += usize::from(then > error.max(tighter));
            }
            End::Warned => self.warned += 1,
            End::Refused => self.refused += 1,
            End::Doubtful => self.doubtful += 1,
            End::Failed(error) => self
                .failed
                .push(format!("{index}, {:?}: {error}", flight.class)),
        }
    }

    fn join(&mut self, other: Self) {
        self.flights += other.flights;
        self.errors.extend(other.errors);
        self.warned += other.warned;
        self.refused += other.refused;
        self.doubtful += other.doubtful;
        self.worse += other.worse;
        self.failed.extend(other.failed);
        self.seconds.extend(other.seconds);
    }

    fn row(&mut self, name: &str) -> Vec<String> {
        let within = |most: f64| {
            let kept = self.errors.iter().filter(|error| **error <= most).count();
            format!("{:.1} %", 100.0 * kept as f64 / self.errors.len() as f64)
        };
        let greatest = self.errors.iter().copied().fold(0.0, f64::max);
        let (met, twice) = (within(1.0), within(2.0));
        self.seconds.sort_by(f64::total_cmp);
        let seconds = |at: usize| self.seconds.get(at).copied().unwrap_or(f64::NAN);
        let median = seconds(self.seconds.len() / 2);
        let most = seconds(self.seconds.len().saturating_sub(1));
        vec![
            name.into(),
            self.flights.to_string(),
            met,
            twice,
            format!("{greatest:.2}"),
            self.refused.to_string(),
            self.warned.to_string(),
            self.doubtful.to_string(),
            self.worse.to_string(),
            format!("{median:.2}, {most:.1}"),
        ]
    }
}

/// How a flight with the chosen method ends, and how long choosing took (s).
fn end(flight: &Flight, tolerance: f64) -> (End, f64) {
    let begun = Moment::now();
    let go_on = &mut |_| ControlFlow::Continue(());
    let (run, states) = (flight.run, &flight.states);
    let choice = choose(&mut flight.system(), states, run, tolerance, go_on);
    let seconds = begun.elapsed();
    let choice = match choice {
        Ok(choice) => choice,
        Err(ChoiceError::Floor { .. }) => return (End::Refused, seconds),
        Err(error) => return (End::Failed(error.to_string()), seconds),
    };
    if choice.warning().is_some() {
        return (End::Warned, seconds);
    }
    let flown = flight.fly(choice.method, run.steps, choice.substeps);
    let end = match (flight.truth(), flown) {
        (Some(truth), _) if truth.doubt > tolerance => End::Doubtful,
        (Some(truth), Some(states)) => End::Error(truth.error(&states)),
        (None, _) => End::Doubtful,
        (_, None) => End::Failed(format!("a step of {choice} cannot be made")),
    };
    (end, seconds)
}
