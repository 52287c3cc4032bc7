use nalgebra::SVector;

use super::class::Class;
use super::error::PlanError;
use super::fuel::last_smoothness;
use super::neighboring::Inherited;
use super::progress::{NewtonSettings, Phase, Progress, Start, Warmth};
use super::resolution::resolved;
use super::scale::{self, stiffness};
use crate::discrete::DiscreteDynamics;
use crate::newton::{
    AUGMENTATIONS, Closeness, Ended, Iterate, Newton, Problem, Standing, Tolerances, Unconstrained,
    guess,
};
use crate::{Dynamics, Plan, Transfer};

/// The state of one call of the solver.
pub(super) struct Solver<'s, C> {
    pub(super) class: C,
    pub(super) transfer: &'s Transfer,
    pub(super) standing: Standing,
    pub(super) tolerances: Tolerances,
    pub(super) coarse: usize,
    pub(super) observe: &'s mut dyn FnMut(&Progress) -> bool,
    /// The part of their quadratic weight that commands with a price keep.
    pub(super) smoothness: f64,
    /// What the next plan takes over from the plan before.
    pub(super) inherited: Option<Inherited>,
    /// The plan for a force that does not turn with the body, once it is known.
    pub(super) inertial: Option<Plan>,
    /// True until a smooth start to minimum fuel has failed from the present start.
    pub(super) smooth: bool,
    /// True until steps within the inequalities have failed from the present start.
    pub(super) within: bool,
    /// True if inequalities have made a step of the last attempt shorter.
    pub(super) limited: bool,
    /// The barrier parameter to begin with at a plan, relative to the share of the cost per inequality.
    pub(super) barrier: f64,
}

/// Kinds of initial guesses.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Guess {
    /// A smooth path between both ends. The attitude turns the shorter way or with additional turns.
    Smooth { turns: f64 },
    /// The plans of a sequence of bodies that become more slender.
    InertiaHomotopy,
    /// The plans of a sequence of targets that start where the free flight ends.
    Drifted,
    /// The plans with the missing actuators added, at increasing weights.
    Assisted,
}

/// Guesses in the order of trial, in groups.
const GUESSES: [&[Guess]; 2] = [
    &[
        Guess::Assisted,
        Guess::Smooth { turns: 0.0 },
        Guess::InertiaHomotopy,
        Guess::Drifted,
    ],
    &[Guess::Smooth { turns: -1.0 }, Guess::Smooth { turns: 1.0 }],
];

/// Maximum number of Newton steps at a coarse resolution.
const COARSE_ITERATIONS: u32 = 40;
/// Tolerances of plans at a coarse resolution, which serve as initial guesses.
pub(super) const ROUGH: f64 = 3e-3;
/// Maximum number of descents from plans that are not minima.
pub(super) const DESCENTS: u32 = 5;
/// Relative decrease of the cost from which a plan counts as cheaper.
const CHEAPER: f64 = 1e-9;
/// Largest factor by which the number of intervals grows in one refinement.
const REFINEMENT: usize = 5;

/// An iteration that did not converge: how it ended, and its last state.
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
                // A full step from this error squares it.
                near: settings.stationarity.sqrt(),
                iterations: settings.iterations,
                beyond: false,
            },
            coarse: settings.coarse.max(2),
            observe,
            smoothness: last_smoothness(transfer),
            inherited: None,
            inertial: None,
            smooth: true,
            within: true,
            limited: false,
            barrier: Warmth::ANY.barrier,
        }
    }

    /// The problem of `view`, which is the transfer at some resolution.
    pub(super) fn problem<'p, S, const X: usize, const U: usize>(
        &self,
        view: &'p Transfer,
        steps: &'p S,
    ) -> Problem<'p, S, C::Ending, X, U>
    where
        C: Class<X, U>,
    {
        let own = |all: SVector<f64, 12>| all.fixed_rows::<X>(C::FIRST).into_owned();
        let metric = self.class.weight(view);
        Problem {
            steps,
            ending: self.class.ending(view),
            initial: view.initial,
            h: view.h,
            beside: None,
            intervals: view.intervals,
            weight: self.weight(view, metric),
            command_metric: metric,
            command_units: metric.diagonal().map(|weight| weight.sqrt().recip()),
            // A moment that turns would turn commands on that are off.
            body_frame: self.class.body_frame(view).filter(|_| view.off.is_none()),
            stiffness: own(stiffness(view)),
            metric: own(scale::metric(view)),
            rounding: own(view.rounding / self.tolerances.violation),
        }
    }

    /// Runs the whole strategy. A cold start follows a warm one that fails if that is asked for.
    pub(super) fn solve<const X: usize, const U: usize>(
        mut self,
        start: Start<'_>,
        warmth: Warmth,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        if !self.transfer.inequalities.is_empty() {
            return self.constrained(start, warmth);
        }
        let found = match start {
            Start::Warm(plan) => match self.warm(plan)? {
                Err((ended, _)) if warmth.again && ended != Ended::Stopped => self.cold()?,
                found => found,
            },
            Start::Cold => self.cold()?,
        };
        match found {
            Ok(newton) => self.certified(newton),
            Err((ended, newton)) => Err(self.unsolved(ended, &newton.iterate)?),
        }
    }

    /// Tries one guess after the other until one leads to a plan. A coarse iteration that has not converged is refined
    /// only if no other guess of its group leads to a plan.
    pub(super) fn cold<const X: usize, const U: usize>(
        &mut self,
    ) -> Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>
    where
        C: Class<X, U>,
    {
        let mut first = None;
        let mut unsolvable = None;
        if let Some(plan) = self.inertial_guess()? {
            match self.warm(&plan)? {
                Err(failure) if failure.0 != Ended::Stopped => first = Some(failure),
                done => return Ok(done),
            }
        }
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

    /// Solves at the first resolution from a guess. Returns `None` if the guess does not apply.
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
            Guess::InertiaHomotopy => self.inertia_homotopy(),
            Guess::Drifted => self.drifted(),
        }
    }

    /// Refines a coarse plan to all intervals.
    pub(super) fn refine<const X: usize, const U: usize>(
        &mut self,
        mut newton: Newton<X, U>,
    ) -> Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>
    where
        C: Class<X, U>,
    {
        let mut coarser = None;
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
            let iterate = self.extrapolated(&newton.iterate, coarser.as_ref())?;
            let kept = guess::kept(&problem, &iterate, &newton.model.policies);
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
            // The least augmentation often turns out to be too little only after most of the sweep.
            let closeness = match coarser {
                Some(_) => Closeness::Close {
                    augmentation: newton.augmentation.min(AUGMENTATIONS[1]),
                },
                None => Closeness::Far,
            };
            match self.level(&problem, iterate, closeness, phase) {
                Ok(finer) => coarser = Some(std::mem::replace(&mut newton, finer).iterate),
                Err((ended, finer)) if self.goes_on(ended, &finer) => {
                    newton = *finer;
                    coarser = None;
                }
                failure => return Ok(failure),
            }
        }
    }

    /// Returns true if there are several coarse resolutions, from which finer ones are extrapolated.
    fn extrapolates(&self) -> bool {
        self.transfer.intervals > REFINEMENT * self.first_intervals()
    }

    /// The solution `fine` of one resolution, extrapolated to all intervals by means of a `coarser` one.
    fn extrapolated<const X: usize, const U: usize>(
        &self,
        fine: &Iterate<X, U>,
        coarser: Option<&Iterate<X, U>>,
    ) -> Result<Iterate<X, U>, PlanError>
    where
        C: Class<X, U>,
    {
        let Some(coarser) = coarser else {
            return Ok(fine.clone());
        };
        let resolutions = [fine, coarser].map(|iterate| iterate.commands.len());
        let view = resolved(self.transfer, resolutions[0]);
        let steps = self.class.steps(&view)?;
        let order = match view.dynamics {
            Dynamics::LieEuler => 1,
            Dynamics::Lgvi => 2,
        };
        let error = |intervals: usize| (intervals as f64).recip().powi(order);
        let [own, other, rest] =
            [resolutions[0], resolutions[1], self.transfer.intervals].map(error);
        let share = (own - rest) / (other - own);
        Ok(guess::extrapolated(&steps, fine, coarser, share))
    }

    /// Returns true if an iteration that did not converge is worth refining. At a coarse resolution a slender body may
    /// turn so far in a step that no minimum exists, and yet the iterate may be near the minimum of a finer resolution.
    fn goes_on<const X: usize, const U: usize>(&self, ended: Ended, newton: &Newton<X, U>) -> bool {
        ended == Ended::Capped && newton.iterate.commands.len() < self.transfer.intervals
    }

    /// Solves at one resolution, without inequalities.
    pub(super) fn level<S, const X: usize, const U: usize>(
        &mut self,
        problem: &Problem<'_, S, C::Ending, X, U>,
        iterate: Iterate<X, U>,
        guess: Closeness,
        phase: Phase,
    ) -> Result<Newton<X, U>, Failure<X, U>>
    where
        S: DiscreteDynamics<X, U>,
        C: Class<X, U>,
    {
        let newton = Newton::new(problem.intervals, iterate);
        self.iterated(problem, newton, guess, phase)
    }

    /// [`Solver::level`] with the buffers of an iteration, from its iterate.
    pub(super) fn iterated<S, const X: usize, const U: usize>(
        &mut self,
        problem: &Problem<'_, S, C::Ending, X, U>,
        mut newton: Newton<X, U>,
        guess: Closeness,
        phase: Phase,
    ) -> Result<Newton<X, U>, Failure<X, U>>
    where
        S: DiscreteDynamics<X, U>,
        C: Class<X, U>,
    {
        let beyond = self.extrapolates();
        let observe = &mut *self.observe;
        let tolerances = if problem.intervals < self.transfer.intervals {
            Tolerances {
                violation: ROUGH,
                stationarity: ROUGH,
                iterations: self.tolerances.iterations.min(COARSE_ITERATIONS),
                beyond,
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
            guess,
            &mut self.standing,
            |now| observe(&now.progress(phase)),
        );
        match ended {
            Ended::Converged => Ok(newton),
            ended => Err((ended, Box::new(newton))),
        }
    }

    /// Completes the plan. If its certificate does not confirm convergence, the iteration continues; if it is not a
    /// minimum, a descent follows.
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
        match self.level(&problem, iterate, Closeness::Far, Phase::Fine) {
            Ok(newton) => {
                let iterate = newton.iterate.clone();
                let plan = self.finish(newton, &mut Unconstrained)?;
                self.lowered(plan, iterate)
            }
            Err((ended, newton)) => Err(self.unsolved(ended, &newton.iterate)?),
        }
    }

    /// Returns `plan`, which belongs to `iterate`. If it is not known to be a minimum, returns a cheaper plan that is
    /// found along a direction of negative curvature.
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
            match self.level(&problem, lower, Closeness::Far, Phase::Fine) {
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

/// Returns true if `found` is cheaper than `before` and replaces it.
pub(super) fn is_cheaper(found: &Plan, before: &Plan) -> bool {
    found.total_cost() < before.total_cost() * (1.0 - CHEAPER)
}
