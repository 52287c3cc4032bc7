use nalgebra::SVector;

use super::class::Class;
use super::error::PlanError;
use super::progress::{NewtonSettings, Phase, Progress, Start};
use super::resolution::resolved;
use super::scale::{metric, stiffness};
use crate::newton::{Ended, Iterate, Newton, Problem, Standing, Tolerances, Unconstrained, guess};
use crate::steps::Steps;
use crate::{Plan, Transfer};

/// One call's worth of attempts.
pub(super) struct Solver<'s, C> {
    pub(super) class: C,
    pub(super) transfer: &'s Transfer,
    pub(super) standing: Standing,
    pub(super) tolerances: Tolerances,
    pub(super) coarse: usize,
    pub(super) observe: &'s mut dyn FnMut(&Progress) -> bool,
}

/// Paths to start from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Guess {
    /// A smooth path between both ends, the attitude by the shorter way round or with further turns.
    Smooth { turns: f64 },
    /// The plans of ever less stout bodies.
    Stout,
    /// The plans to targets ever farther from where the free flight ends.
    Drifted,
    /// The plans with actuators that are missing, ever dearer.
    Assisted,
}

/// In the order of trial, in groups.
const GUESSES: [&[Guess]; 2] = [
    &[
        Guess::Assisted,
        Guess::Smooth { turns: 0.0 },
        Guess::Stout,
        Guess::Drifted,
    ],
    &[Guess::Smooth { turns: -1.0 }, Guess::Smooth { turns: 1.0 }],
];

/// Newton steps at most over a few intervals.
const COARSE_ITERATIONS: u32 = 40;
/// What suffices of a plan over a few intervals, to start from.
pub(super) const ROUGH: f64 = 3e-3;
/// How often a plan that is no minimum is gone on from.
pub(super) const DESCENTS: u32 = 5;
/// By what part a plan must be cheaper to be another.
const CHEAPER: f64 = 1e-9;
/// By how much stages may multiply at once.
const REFINEMENT: usize = 5;

/// An iteration that did not converge, and where it is.
pub(super) type Failure<const X: usize, const U: usize> = (Ended, Box<Newton<X, U>>);

impl<'s, C> Solver<'s, C> {
    pub(super) fn new(
        class: C,
        transfer: &'s Transfer,
        settings: &NewtonSettings,
        observe: &'s mut dyn FnMut(&Progress) -> bool,
    ) -> Self {
        Self {
            class,
            transfer,
            standing: Standing::default(),
            tolerances: Tolerances {
                violation: settings.violation.max(f64::EPSILON),
                stationarity: settings.stationarity,
                // A full step from there squares the error.
                near: settings.stationarity.sqrt(),
                iterations: settings.iterations,
            },
            coarse: settings.coarse.max(2),
            observe,
        }
    }

    /// The problem of `view`, a resolution of the transfer.
    pub(super) fn problem<'p, S, const X: usize, const U: usize>(
        &self,
        view: &'p Transfer,
        steps: &'p S,
    ) -> Problem<'p, S, C::Ending, X, U>
    where
        C: Class<X, U>,
    {
        let own = |all: SVector<f64, 12>| all.fixed_rows::<X>(C::FIRST).into_owned();
        let weight = self.class.weight(view);
        Problem {
            steps,
            ending: self.class.ending(view),
            initial: view.initial,
            h: view.h,
            intervals: view.intervals,
            weight,
            command_units: weight.diagonal().map(|weight| weight.sqrt().recip()),
            turning: self.class.turning(view),
            stiffness: own(stiffness(view)),
            metric: own(metric(view)),
            rounding: own(view.rounding / self.tolerances.violation),
        }
    }

    /// The whole strategy; where a warm start fails, from nothing if `again`.
    pub(super) fn solve<const X: usize, const U: usize>(
        mut self,
        start: Start<'_>,
        again: bool,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        if !self.transfer.inequalities.is_empty() {
            return self.constrained(start, again);
        }
        let found = match start {
            Start::Warm(plan) => match self.warm(plan)? {
                Err((ended, _)) if again && ended != Ended::Stopped => self.cold()?,
                found => found,
            },
            Start::Cold => self.cold()?,
        };
        match found {
            Ok(newton) => self.certified(newton),
            Err((ended, newton)) => Err(self.unsolved(ended, &newton.iterate)?),
        }
    }

    /// Guess after guess, until one leads to a plan. What has not converged over a few intervals is refined only where no
    /// other guess of its group leads to one.
    pub(super) fn cold<const X: usize, const U: usize>(
        &mut self,
    ) -> Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>
    where
        C: Class<X, U>,
    {
        let mut first = None;
        let mut unsolvable = None;
        for group in GUESSES {
            let mut capped = Vec::new();
            for &guess in group {
                let Some(coarse) = self.coarse(guess) else {
                    continue;
                };
                let found = match coarse {
                    Ok(Ok(newton)) => self.refine(newton)?,
                    Ok(Err((ended, newton))) if self.goes_on(ended, &newton) => {
                        capped.push(*newton);
                        continue;
                    }
                    Ok(failure) => failure,
                    Err(error @ PlanError::Dynamics { .. }) => {
                        unsolvable = unsolvable.or(Some(error));
                        continue;
                    }
                    Err(error) => return Err(error),
                };
                match found {
                    Err(failure) if failure.0 != Ended::Stopped => first = first.or(Some(failure)),
                    done => return Ok(done),
                }
            }
            for newton in capped {
                match self.refine(newton)? {
                    Err(failure) if failure.0 != Ended::Stopped => first = first.or(Some(failure)),
                    done => return Ok(done),
                }
            }
        }
        match (first, unsolvable) {
            (Some(failure), _) => Ok(Err(failure)),
            (None, Some(error)) => Err(error),
            (None, None) => Err(PlanError::Stopped { best: None }),
        }
    }

    /// At the first resolution from a guess, where that can be made.
    fn coarse<const X: usize, const U: usize>(
        &mut self,
        guess: Guess,
    ) -> Option<Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>>
    where
        C: Class<X, U>,
    {
        match guess {
            Guess::Smooth { turns } => Some(self.smooth(turns)),
            Guess::Assisted => self.assisted(),
            Guess::Stout => self.stout(),
            Guess::Drifted => self.drifted(),
        }
    }

    /// From a plan over a few intervals to all.
    pub(super) fn refine<const X: usize, const U: usize>(
        &mut self,
        mut newton: Newton<X, U>,
    ) -> Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>
    where
        C: Class<X, U>,
    {
        loop {
            let (now, all) = (newton.iterate.commands.len(), self.transfer.intervals);
            if now == all {
                return Ok(Ok(newton));
            }
            let mut next = all;
            while next > REFINEMENT * now {
                next = next.div_ceil(REFINEMENT);
            }
            let view = resolved(self.transfer, next);
            let steps = self.class.steps(&view)?;
            let problem = self.problem(&view, &steps);
            let kept = guess::kept(&problem, &newton.iterate, &newton.model.policies);
            let iterate = match kept {
                Some(iterate) => iterate,
                None => {
                    let path = guess::refined(&newton.iterate.states, next);
                    let end = &newton.iterate.states[now];
                    let mut iterate = guess::along(&problem, &view.body, &path, end)
                        .map_err(|(step, source)| PlanError::Dynamics { step, source })?;
                    iterate.nu = newton.iterate.nu;
                    iterate
                }
            };
            let phase = if next < all {
                Phase::Coarse
            } else {
                Phase::Fine
            };
            match self.level(&problem, iterate, false, phase) {
                Ok(finer) => newton = finer,
                Err((ended, finer)) if self.goes_on(ended, &finer) => newton = *finer,
                failure => return Ok(failure),
            }
        }
    }

    /// Whether an iteration that did not converge is worth refining: at few intervals a slender body may turn so far in a
    /// step that there is no minimum, and yet be near that of more.
    fn goes_on<const X: usize, const U: usize>(&self, ended: Ended, newton: &Newton<X, U>) -> bool {
        ended == Ended::Capped && newton.iterate.commands.len() < self.transfer.intervals
    }

    /// At one resolution, without inequalities.
    pub(super) fn level<S, const X: usize, const U: usize>(
        &mut self,
        problem: &Problem<'_, S, C::Ending, X, U>,
        iterate: Iterate<X, U>,
        rough: bool,
        phase: Phase,
    ) -> Result<Newton<X, U>, Failure<X, U>>
    where
        S: Steps<X, U>,
        C: Class<X, U>,
    {
        let mut newton = Newton::new(problem.intervals, iterate);
        let observe = &mut *self.observe;
        let tolerances = if problem.intervals < self.transfer.intervals {
            Tolerances {
                violation: ROUGH,
                stationarity: ROUGH,
                iterations: self.tolerances.iterations.min(COARSE_ITERATIONS),
                ..self.tolerances
            }
        } else {
            newton.model.want_gains();
            self.tolerances
        };
        let ended = newton.run(
            problem,
            &mut Unconstrained,
            &tolerances,
            rough,
            &mut self.standing,
            |now| observe(&now.progress(phase)),
        );
        match ended {
            Ended::Converged => Ok(newton),
            ended => Err((ended, Box::new(newton))),
        }
    }

    /// The plan, iterated on where its certificate does not confirm that it has converged, and gone on from where it is no
    /// minimum.
    pub(super) fn certified<const X: usize, const U: usize>(
        mut self,
        newton: Newton<X, U>,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        let iterate = newton.iterate.clone();
        let plan = self.finish(newton, &mut Unconstrained)?;
        let found = &plan.certificate;
        if found.stationarity <= self.tolerances.stationarity
            && found.terminal <= self.tolerances.violation
        {
            return self.lowered(plan, iterate);
        }
        self.tolerances.near = 0.0;
        let steps = self.class.steps(self.transfer)?;
        let problem = self.problem(self.transfer, &steps);
        match self.level(&problem, iterate, false, Phase::Fine) {
            Ok(newton) => {
                let iterate = newton.iterate.clone();
                let plan = self.finish(newton, &mut Unconstrained)?;
                self.lowered(plan, iterate)
            }
            Err((ended, newton)) => Err(self.unsolved(ended, &newton.iterate)?),
        }
    }

    /// `plan`, which `iterate` is, or where it is not known to be a minimum a cheaper one that a direction of negative
    /// curvature leads to.
    pub(super) fn lowered<const X: usize, const U: usize>(
        &mut self,
        mut plan: Plan,
        mut iterate: Iterate<X, U>,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        let steps = self.class.steps(self.transfer)?;
        let problem = self.problem(self.transfer, &steps);
        for _ in 0..DESCENTS {
            if plan.certificate.sufficient {
                break;
            }
            iterate.states.clone_from(&plan.states);
            let mut newton = Newton::new(problem.intervals, iterate);
            let Some(lower) = newton.downhill(&problem, &mut Unconstrained) else {
                break;
            };
            match self.level(&problem, lower, false, Phase::Fine) {
                Ok(newton) => {
                    iterate = newton.iterate.clone();
                    let found = self.finish(newton, &mut Unconstrained)?;
                    if !is_cheaper(&found, &plan) {
                        break;
                    }
                    plan = found;
                }
                Err((Ended::Stopped, _)) => {
                    let best = Some(Box::new(plan));
                    return Err(PlanError::Stopped { best });
                }
                Err(_) => break,
            }
        }
        Ok(plan)
    }
}

/// Whether a plan that was gone on to is to be taken instead of the one before.
pub(super) fn is_cheaper(found: &Plan, before: &Plan) -> bool {
    found.cost < before.cost * (1.0 - CHEAPER)
}
