//! Which settings of a method are worth flying, and their times in turns with those of all others.

use serde::Serialize;

use super::cases::{ErrorsAt, Judge, Setting};
use super::contestant::{Contestant, Flight};
use crate::error::BenchError;
use crate::peer::Tuning;

/// Longest flight (s) after which a method is not tuned finer.
const PATIENCE: f64 = 0.1;

/// The same of peers; those with a tolerance have few settings.
const PATIENCE_WITH_STEPS: f64 = 0.4;
const PATIENCE_WITH_TOLERANCE: f64 = 3.0;

/// Errors below this are rounding.
const FLOOR: f64 = 1e-13;

/// An error that rises below this has met rounding.
const RISES: f64 = 1e-6;

/// How often a finer step may be tried after one that could not be made.
const FAILURES: u32 = 16;

const TOLERANCES: [f64; 11] = [
    1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14,
];

/// Some peers are compiled for each tolerance, or take long to set up.
const PEER_TOLERANCES: [f64; 8] = [1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12, 1e-13];

/// One way to fly.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Point {
    /// Steps or tolerance.
    pub setting: f64,
    /// At the reference times at which a step ends.
    pub errors: Vec<ErrorsAt>,
    /// Time (s) of each repetition, on the processor.
    pub seconds: Vec<f64>,
}

/// A method with all ways to fly that were measured.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Measured {
    pub method: String,
    pub peer: bool,
    pub tuning: Option<Tuning>,
    pub points: Vec<Point>,
}

/// A method without a flight that was timed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct LeftOut {
    pub method: String,
    pub peer: bool,
    pub why: String,
    /// Of a peer that failed, not one whose flights are too long or too coarse.
    pub failed: bool,
}

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    pub repeats: u32,
    /// Only the coarsest flights.
    pub quick: bool,
}

/// Errors of all methods, then their times, in turns; and what is left out.
pub(crate) fn measure(
    contestants: &mut [Box<dyn Contestant + '_>],
    setting: &Setting,
    judge: &Judge<'_>,
    effort: Effort,
) -> Result<(Vec<Measured>, Vec<LeftOut>), BenchError> {
    let (mut all, mut left_out) = (Vec::new(), Vec::new());
    for contestant in contestants.iter_mut() {
        let points = sweep(contestant.as_mut(), setting, judge, effort);
        let points = forgiven(contestant.as_ref(), points, &mut left_out)?;
        let points = match points {
            Some(Swept::Points(points)) => points,
            Some(Swept::Nothing { why, failed }) => {
                left_out.push(LeftOut {
                    method: contestant.label().into(),
                    peer: contestant.is_peer(),
                    why,
                    failed: failed && contestant.is_peer(),
                });
                Vec::new()
            }
            None => Vec::new(),
        };
        all.push(Measured {
            method: contestant.label().into(),
            peer: contestant.is_peer(),
            tuning: contestant.tuning(),
            points,
        });
    }
    for _ in 0..effort.repeats {
        for (contestant, measured) in contestants.iter_mut().zip(&mut all) {
            let times = measured.points.iter();
            let times = times.map(|point| contestant.time(point.setting));
            let times = times.collect::<Result<Vec<_>, _>>();
            let Some(times) = forgiven(contestant.as_ref(), times, &mut left_out)? else {
                measured.points.clear();
                continue;
            };
            for (point, time) in measured.points.iter_mut().zip(times) {
                point.seconds.push(time);
            }
        }
    }
    all.retain(|measured| !measured.points.is_empty());
    Ok((all, left_out))
}

/// A peer that fails is left out.
fn forgiven<T>(
    contestant: &dyn Contestant,
    result: Result<T, BenchError>,
    left_out: &mut Vec<LeftOut>,
) -> Result<Option<T>, BenchError> {
    match result {
        Err(error) if contestant.is_peer() => {
            left_out.push(LeftOut {
                method: contestant.label().into(),
                peer: true,
                why: error.to_string(),
                failed: true,
            });
            Ok(None)
        }
        result => result.map(Some),
    }
}

/// What a sweep has found.
enum Swept {
    Points(Vec<Point>),
    /// Whether it failed: no flight could be made.
    Nothing {
        why: String,
        failed: bool,
    },
}

/// Finer and finer flights until rounding or patience ends it.
fn sweep(
    contestant: &mut dyn Contestant,
    setting: &Setting,
    judge: &Judge<'_>,
    effort: Effort,
) -> Result<Swept, BenchError> {
    let tolerances: &[f64] = match contestant.is_peer() {
        true => &PEER_TOLERANCES,
        false => &TOLERANCES,
    };
    let settings: Box<dyn Iterator<Item = f64>> = match contestant.tuning() {
        None => Box::new(std::iter::once(1.0)),
        Some(Tuning::Tolerance) => Box::new(tolerances.iter().copied()),
        Some(Tuning::Steps) if contestant.is_peer() => Box::new(steps(setting.steps).step_by(2)),
        Some(Tuning::Steps) => Box::new(steps(setting.steps)),
    };
    let by_steps = contestant.tuning() == Some(Tuning::Steps);
    let patience = match (effort.quick, contestant.is_peer(), by_steps) {
        (true, ..) => 0.0,
        (_, false, _) => PATIENCE,
        (_, true, true) => PATIENCE_WITH_STEPS,
        (_, true, false) => PATIENCE_WITH_TOLERANCE,
    };
    let (mut points, mut failures, mut least) = (Vec::new(), 0, f64::INFINITY);
    let mut failure = None;
    for tuned in settings {
        let flight = match contestant.fly(tuned)? {
            Ok(flight) => flight,
            Err(why) => {
                failure = Some(why);
                failures += 1;
                if failures > FAILURES {
                    break;
                }
                continue;
            }
        };
        let seconds = flight.seconds;
        let errors = errors(flight, setting, judge)?;
        let Some(last) = errors.last() else { continue };
        let error = setting.error(last);
        if !error.is_finite() || (by_steps && error > least && least < RISES) {
            break;
        }
        least = least.min(error);
        if effort.quick || error <= setting.coarse {
            points.push(Point {
                setting: tuned,
                errors,
                seconds: Vec::new(),
            });
        }
        if seconds > patience || (by_steps && error < FLOOR) {
            break;
        }
    }
    Ok(match (points.is_empty(), failure) {
        (false, _) => Swept::Points(points),
        (true, Some(why)) if least.is_infinite() => Swept::Nothing { why, failed: true },
        (true, _) => Swept::Nothing {
            why: format!(
                "flights up to {patience} s have errors above {:.0e}",
                setting.coarse
            ),
            failed: false,
        },
    })
}

/// Growing numbers of steps, two in an octave, so that the reference times are ends of steps.
fn steps(fewest: u64) -> impl Iterator<Item = f64> {
    let octaves = (0..24).map(move |octave| (fewest << octave) as f64);
    octaves.flat_map(|steps| [steps, 1.5 * steps])
}

fn errors(
    flight: Flight,
    setting: &Setting,
    judge: &Judge<'_>,
) -> Result<Vec<ErrorsAt>, BenchError> {
    let times = setting.times(judge.case());
    let reached = times.into_iter().zip(flight.states);
    let reached = reached.filter_map(|(t, states)| Some((t, states?)));
    reached
        .map(|(t, states)| judge.errors(t, &states))
        .collect()
}

#[cfg(test)]
mod tests {
    use lgvi_dynamics::Method;
    use lgvi_dynamics::integrator::Rotor;
    use lgvi_truth::Case;

    use super::super::cases::{Judge, Setting};
    use super::super::contestant::{Contestant, Flight, Own};
    use super::{Effort, measure};
    use crate::error::BenchError;
    use crate::methods::Family;
    use crate::peer::Tuning;

    #[derive(Clone, Copy, PartialEq)]
    enum Fault {
        None,
        DiesInFlight,
        DiesBeingTimed,
        NeverFlies,
        TooCoarse,
    }

    /// An own method as a peer with a fault.
    struct Faulty<'a>(Own<'a>, Fault);

    impl Contestant for Faulty<'_> {
        fn label(&self) -> &str {
            self.0.label()
        }

        fn is_peer(&self) -> bool {
            self.1 != Fault::None
        }

        fn tuning(&self) -> Option<Tuning> {
            self.0.tuning()
        }

        fn fly(&mut self, setting: f64) -> Result<Result<Flight, String>, BenchError> {
            match self.1 {
                Fault::DiesInFlight => Err(BenchError::Peer("it has ended".into())),
                Fault::NeverFlies => Ok(Err("not finite".into())),
                Fault::TooCoarse => {
                    let (_, states) = self.0.case.system()?;
                    let states = vec![Some(states); self.0.times.len()];
                    Ok(Ok(Flight {
                        seconds: 10.0,
                        states,
                    }))
                }
                Fault::None | Fault::DiesBeingTimed => self.0.fly(setting),
            }
        }

        fn time(&mut self, setting: f64) -> Result<f64, BenchError> {
            match self.1 {
                Fault::DiesBeingTimed => Err(BenchError::Peer("it has ended".into())),
                _ => self.0.time(setting),
            }
        }
    }

    #[test]
    fn a_peer_that_fails_is_left_out_and_the_others_are_measured() {
        let setting = Setting::named("a2_two_dumbbells_coupled").unwrap();
        let case = Case::load(setting.name).unwrap();
        let judge = Judge::new(&case, setting).unwrap();
        let times = setting.times(&case);
        let faults = [
            ("in flight", Fault::DiesInFlight),
            ("timed", Fault::DiesBeingTimed),
            ("never", Fault::NeverFlies),
            ("coarse", Fault::TooCoarse),
            ("own", Fault::None),
        ];
        let contestant = |(label, fault): (&str, Fault)| {
            let own = Own {
                label: label.into(),
                family: Family::Stepped(Method::Lgvi(Rotor::default())),
                case: &case,
                times: &times,
            };
            Box::new(Faulty(own, fault)) as Box<dyn Contestant>
        };
        let mut contestants: Vec<_> = faults.into_iter().map(contestant).collect();
        let effort = Effort {
            repeats: 1,
            quick: false,
        };
        let (measured, left_out) = measure(&mut contestants, setting, &judge, effort).unwrap();
        let names: Vec<_> = measured.iter().map(|one| one.method.as_str()).collect();
        assert_eq!(names, ["own"]);
        let told = left_out.iter();
        let told: Vec<_> = told
            .map(|one| (one.method.as_str(), one.why.as_str(), one.failed))
            .collect();
        let coarse = "flights up to 0.4 s have errors above 1e-1";
        let expected = [
            ("in flight", "it has ended", true),
            ("never", "not finite", true),
            ("coarse", coarse, false),
            ("timed", "it has ended", true),
        ];
        assert_eq!(told, expected);
    }
}
