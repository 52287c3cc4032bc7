use super::flight::{End, Flights, Tuned};
use super::reference::Reference;
use super::{Candidate, ChoiceError};
use crate::Method;
use crate::integrator::{KeplerScheme, Rotor};

/// Candidate methods of equal steps. In the presence of drag, compositions take the place of Nyström splittings.
fn of_equal_steps(drag: bool) -> Vec<Method> {
    let lgvi = Method::Lgvi(Rotor::Discrete);
    let higher = [4, 6, 8].map(|order| match drag {
        true => Method::Composition {
            order,
            rotor: Rotor::Exact,
        },
        false => Method::Nystrom { order },
    });
    let kepler = KeplerScheme::ALL.map(|scheme| Method::WisdomHolman { scheme });
    let kepler = kepler.into_iter().filter(|_| !drag);
    kepler.chain([lgvi]).chain(higher).collect()
}

/// Tolerances of methods with error control: two per decade, starting from the loosest.
const LOOSEST: f64 = 1e-2;
const A_DECADE: f64 = 2.0;

/// Cost (in approximate nanoseconds) up to which a method of equal steps may be rehearsed, even if it exceeds the cost
/// of the reference.
const CHEAP: f64 = 1e8;

/// Integrates the candidates, each method from coarse to fine until it meets the tolerance or costs more than a
/// candidate that does. Returns the candidates that meet the tolerance, and the best of each other method.
pub(super) fn search(
    flights: &mut Flights<'_>,
    reference: &Reference,
    tolerance: f64,
) -> Result<Vec<Candidate>, ChoiceError> {
    let mut all = Vec::new();
    let cheapest = |all: &[Candidate]| {
        let met = all.iter().filter(|candidate| candidate.error <= tolerance);
        met.map(|met| met.cost).fold(f64::INFINITY, f64::min)
    };
    for tuned in [Tuned::DormandPrince, Tuned::Taylor] {
        let expands = || flights.cost.expands() && !flights.has_drag();
        if tuned == Tuned::DormandPrince || expands() {
            let most = cheapest(&all);
            all.extend(adaptive(flights, reference, tolerance, tuned, most)?);
        }
    }
    for method in of_equal_steps(flights.has_drag()) {
        let most = cheapest(&all);
        all.extend(equal(flights, reference, tolerance, method, most)?);
    }
    Ok(all)
}

/// The interpolated solution of Dormand and Prince, which is cheaper than the closed form where a run asks for many
/// states, if it meets the tolerance and costs less than `most`.
pub(super) fn interpolated(
    flights: &mut Flights<'_>,
    reference: &Reference,
    tolerance: f64,
    most: f64,
) -> Result<Option<Candidate>, ChoiceError> {
    let found = adaptive(flights, reference, tolerance, Tuned::DormandPrince, most)?;
    Ok(found.filter(|found| found.error <= tolerance && found.cost < most))
}

/// The loosest setting of a method with error control that meets the tolerance, or the most accurate one if none does.
/// Settings that cost more than `most` are abandoned.
fn adaptive(
    flights: &mut Flights<'_>,
    reference: &Reference,
    tolerance: f64,
    tuned: Tuned,
    most: f64,
) -> Result<Option<Candidate>, ChoiceError> {
    let mut best: Option<Candidate> = None;
    let allowed = (2.0 * reference.cost()).min(most * reference.part());
    for rung in 0.. {
        let local = LOOSEST * libm::pow(10.0, -f64::from(rung) / A_DECADE);
        if local < 2.0 * reference.tolerance {
            break;
        }
        let mut comparison = reference.comparison(flights, tolerance);
        let course = flights.adaptive(tuned, local, allowed, |instant, states| {
            comparison.compare(instant, states)
        })?;
        let (method, error) = (tuned.to(local), comparison.error);
        if best.is_none_or(|best| error < best.error) {
            best = Some(Candidate {
                method,
                substeps: 1,
                error,
                cost: if error.is_finite() {
                    flights.price(method, 1, course.steps / reference.part())
                } else {
                    f64::INFINITY
                },
            });
        }
        if error <= tolerance || course.end == End::Costly {
            break;
        }
    }
    Ok(best)
}

/// The coarsest setting of a method of equal steps that meets the tolerance, or the most accurate one if none does.
/// Only settings that cost less than `most` are tried.
fn equal(
    flights: &mut Flights<'_>,
    reference: &Reference,
    tolerance: f64,
    method: Method,
    most: f64,
) -> Result<Option<Candidate>, ChoiceError> {
    let mut best: Option<Candidate> = None;
    let allowed = reference.cost().max(CHEAP) / reference.part();
    for substeps in rungs() {
        let cost = flights.price(method, substeps, 0.0);
        if cost >= most.min(allowed) {
            break;
        }
        if flights.steps_to(reference.last(), substeps).is_none() {
            continue;
        }
        let mut comparison = reference.comparison(flights, tolerance);
        flights.equal(method, substeps, |instant, states| {
            comparison.compare(instant, states)
        })?;
        let error = comparison.error;
        if best.is_none_or(|best| error < best.error) {
            best = Some(Candidate {
                method,
                substeps,
                error,
                cost,
            });
        }
        if error <= tolerance {
            break;
        }
    }
    Ok(best)
}

/// Numbers of substeps: 1, 2, 3, 4, 6, 8, 11 and so on, two per octave.
fn rungs() -> impl Iterator<Item = u32> {
    let further = (2..62).map(|half: i32| libm::round(libm::exp2(0.5 * f64::from(half))) as u32);
    std::iter::once(1).chain(further)
}
