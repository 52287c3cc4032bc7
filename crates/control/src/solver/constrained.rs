use lgvi_dynamics::BodyState;
use nalgebra::SVector;

use super::attempt::{DESCENTS, Solver, is_cheaper};
use super::class::Class;
use super::error::PlanError;
use super::progress::{Phase, Start, Warmth};
use crate::barrier::{Barrier, BarrierTolerances, Force, Given, Violation, forces};
use crate::newton::{Closeness, Ended, Ending, Iterate, Newton, Problem, Tolerances};
use crate::problem::{HalfSet, InequalitySet, StateInequality};
use crate::units::ROUNDING;
use crate::{Command, Dynamics, Plan};

/// Maximum number of Newton steps, in multiples of that without inequalities.
const PATIENCE: u32 = 3;

/// The gap of plans at minimum fuel, whose cost is flat near the minimum.
const FUEL_GAP: f64 = 1e-7;

/// States and commands, and the contributions of the inequalities to the gradient of the Lagrangian by interval.
type Known<const X: usize, const U: usize> = (Newton<X, U>, Vec<Force<X, U>>);

impl<C> Solver<'_, C> {
    /// The plan under the inequalities, at the ends of steps and between them.
    pub(super) fn constrained<const X: usize, const U: usize>(
        mut self,
        start: Start<'_>,
        warmth: Warmth,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        self.barrier = warmth.barrier;
        if let Start::Warm(plan) = start {
            match self.between_as(plan) {
                Ok(Some(plan)) => return Ok(plan),
                Ok(None) | Err(PlanError::Between { .. }) => (),
                Err(error) => return Err(error),
            }
        }
        let plan = self.at_ends(start, warmth)?;
        match (self.between(plan), start) {
            (Err(PlanError::Between { .. }), Start::Warm(_)) if warmth.again => {
                let plan = self.at_ends(Start::Cold, warmth)?;
                self.between(plan)
            }
            (done, _) => done,
        }
    }

    /// Imposes the inequalities on a plan that nearly satisfies them. Without such a plan, imposes them on the best
    /// plan without inequalities.
    fn at_ends<const X: usize, const U: usize>(
        &mut self,
        start: Start<'_>,
        warmth: Warmth,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        let transfer = self.transfer;
        let set = &transfer.inequalities;
        if let Start::Warm(plan) = start {
            match self.resumed(plan) {
                Err(error) if warmth.again && error.is_missing() => (),
                done => return done,
            }
        }
        if let Some(plan) = self.inertial_guess()? {
            let iterate = self.resampled(&plan)?;
            let newton = Newton::new(transfer.intervals, iterate);
            self.begin_anew();
            match self.impose(newton, None, set) {
                Err(error) if error.is_missing() => (),
                done => return done,
            }
        }
        let smoothness = std::mem::replace(&mut self.smoothness, 1.0);
        let free = self.cold()?;
        self.smoothness = smoothness;
        let free = match free {
            Ok(newton) => newton,
            Err((ended, newton)) => return Err(self.unsolved(ended, &newton.iterate)?),
        };
        let start = Newton::new(transfer.intervals, free.iterate.clone());
        self.begin_anew();
        match self.impose(free, None, set) {
            Err(error) if error.is_missing() => self.by_relaxation(start, error),
            done => done,
        }
    }

    /// Forgets what has failed: the next plan has another start.
    pub(super) fn begin_anew(&mut self) {
        (self.smooth, self.within) = (true, true);
    }

    /// Starts from a plan with its multipliers. If the plan has another number of intervals, only its path is used.
    fn resumed<const X: usize, const U: usize>(&mut self, plan: &Plan) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        let set = &self.transfer.inequalities;
        if let Some((newton, forces)) = self.known(plan)? {
            return self.impose(newton, Some(&forces), set);
        }
        let iterate = self.resampled(plan)?;
        let newton = Newton::new(self.transfer.intervals, iterate);
        self.impose(newton, None, set)
    }

    /// Takes a plan with as many intervals as the transfer as an iterate, with the multipliers of its terminal
    /// conditions and inequalities. Returns `None` if the number of intervals differs.
    pub(super) fn known<const X: usize, const U: usize>(
        &self,
        plan: &Plan,
    ) -> Result<Option<Known<X, U>>, PlanError>
    where
        C: Class<X, U>,
    {
        let transfer = self.transfer;
        let counts = [plan.commands.len(), plan.multipliers.len()];
        if counts != [transfer.intervals; 2] || plan.states.len() != transfer.intervals + 1 {
            return Ok(None);
        }
        let steps = self.class.steps(transfer)?;
        let problem = self.problem(transfer, &steps);
        let own = |lambda: &SVector<f64, 12>| lambda.fixed_rows::<X>(C::FIRST).into_owned();
        let costates: Vec<_> = plan.multipliers.iter().map(own).collect();
        let mut states = plan.states.clone();
        states[0] = transfer.initial;
        let jacobian = problem.ending.jacobian(&states[transfer.intervals]);
        // Least squares for `Cᵀ ν = λ_{N−1}`; rows without a condition keep ν = 0.
        let mut normal = jacobian * jacobian.transpose();
        for row in 0..X {
            if normal[(row, row)] == 0.0 {
                normal[(row, row)] = 1.0;
            }
        }
        let last = jacobian * costates[transfer.intervals - 1];
        let nu = normal
            .cholesky()
            .map_or(SVector::zeros(), |factor| factor.solve(&last));
        let iterate = Iterate {
            states,
            commands: plan
                .commands
                .iter()
                .map(|w| self.class.narrowed(w))
                .collect(),
            nu,
        };
        let Ok(forces) = forces(&problem, &iterate, &costates) else {
            return Ok(None);
        };
        Ok(Some((Newton::new(transfer.intervals, iterate), forces)))
    }

    /// For each interval of a plan, the contribution of prices and inequalities to the gradient of the Lagrangian by the commands.
    pub(super) fn command_forces<const X: usize, const U: usize>(
        &self,
        plan: &Plan,
    ) -> Result<Vec<Command>, PlanError>
    where
        C: Class<X, U>,
    {
        let known = self.known(plan)?;
        let forces = known.map(|(_, forces)| forces).unwrap_or_default();
        Ok(forces
            .iter()
            .map(|force| self.class.widened(&force.command))
            .collect())
    }

    /// Estimates the cost of leaving the region where the states of a plan violate the inequalities the most. The depth
    /// is at least that of rounding. The estimate serves as the size of the cost if the plan without inequalities costs
    /// nothing.
    fn detour<S, const X: usize, const U: usize>(
        &self,
        problem: &Problem<'_, S, C::Ending, X, U>,
        states: &[BodyState],
    ) -> f64
    where
        C: Class<X, U>,
    {
        let cost = |inequality: &StateInequality| {
            let [first, second] = inequality.coordinates().groups(C::OFFSETS);
            let offset = second.or(first)?;
            let cheapest = problem.stiffness.fixed_rows::<3>(offset).min();
            let moving = inequality.through(self.transfer.h, states.len());
            let at = |interval: usize| moving.get(interval).unwrap_or(inequality);
            let applies = inequality.applies(states.len());
            let states = states.iter().enumerate().filter(|(at, _)| applies[*at]);
            let depths = states.map(|(at_end, state)| inequality.size() * at(at_end).value(state));
            let depth = depths.fold(ROUNDING, f64::max);
            Some(cheapest * depth * depth)
        };
        self.transfer
            .inequalities
            .state
            .iter()
            .filter_map(cost)
            .sum()
    }

    /// The best plan that satisfies the inequalities of `set`, near a plan without inequalities.
    pub(super) fn impose<const X: usize, const U: usize>(
        &mut self,
        newton: Newton<X, U>,
        known: Option<&[Force<X, U>]>,
        set: &InequalitySet,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        let start = newton.iterate.clone();
        let anew = || Newton::new(self.transfer.intervals, start.clone());
        let is_missing =
            |found: &Result<_, PlanError>| found.as_ref().is_err_and(PlanError::is_missing);
        let mut found = self.imposed(newton, known, set);
        let fuel = self.transfer.actuation.minimizes_fuel();
        if self.smooth && fuel && known.is_none() && is_missing(&found) {
            self.smooth = false;
            found = self.imposed(anew(), known, set);
        }
        let limited = self.limited || matches!(found, Err(PlanError::NotConverged { .. }));
        if self.within && limited && is_missing(&found) {
            self.within = false;
            found = self.imposed(anew(), known, set);
        }
        let mut best = found?;
        for _ in 0..DESCENTS {
            if best.plan.certificate.sufficient {
                break;
            }
            let Some(newton) = self.below(&mut best)? else {
                break;
            };
            let Some((_, forces)) = self.known(&best.plan)? else {
                break;
            };
            match self.imposed(newton, Some(&forces), set) {
                Ok(found) if is_cheaper(&found.plan, &best.plan) => best = found,
                Err(PlanError::Stopped { .. }) => {
                    let best = Some(Box::new(best.plan));
                    return Err(PlanError::Stopped { best });
                }
                _ => break,
            }
        }
        Ok(best.plan)
    }

    /// A point of lower merit near a plan that is not a minimum.
    fn below<const X: usize, const U: usize>(
        &self,
        from: &mut Imposed<X, U>,
    ) -> Result<Option<Newton<X, U>>, PlanError>
    where
        C: Class<X, U>,
    {
        let steps = self.class.steps(self.transfer)?;
        let problem = self.problem(self.transfer, &steps);
        let mut newton = Newton::new(problem.intervals, from.iterate.clone());
        let lower = newton.downhill(&problem, &mut from.barrier);
        Ok(lower.map(|iterate| Newton::new(problem.intervals, iterate)))
    }

    /// The stationary point to which the interior point method converges.
    fn imposed<const X: usize, const U: usize>(
        &mut self,
        mut newton: Newton<X, U>,
        known: Option<&[Force<X, U>]>,
        set: &InequalitySet,
    ) -> Result<Imposed<X, U>, PlanError>
    where
        C: Class<X, U>,
    {
        let steps = self.class.steps(self.transfer)?;
        let problem = self.problem(self.transfer, &steps);
        newton.model.gains.clear();
        let mut barrier = self.barrier(&problem, &newton.iterate, set);
        barrier.keep_within(self.within);
        let Iterate {
            states, commands, ..
        } = &newton.iterate;
        let end = self.aimed(states[self.transfer.intervals]);
        if let Some(violation) = barrier.given_violation(&states[1..], &end) {
            let Violation {
                constraint,
                step,
                excess: violation,
                ..
            } = violation;
            return Err(PlanError::Infeasible {
                constraint,
                step,
                violation,
            });
        }
        match known {
            Some(forces) => barrier.resume(&states[1..], commands, forces, self.barrier),
            None => barrier.start(&states[1..], commands, self.smooth),
        }
        // Steps within the inequalities converge soon or not at all; it takes longer where the cost of fuel is flat.
        let patience = match (self.within, self.transfer.actuation.minimizes_fuel()) {
            (true, false) => 1,
            (true, true) => 2,
            (false, _) => PATIENCE,
        };
        let tolerances = Tolerances {
            iterations: patience * self.tolerances.iterations,
            near: 0.0,
            ..self.tolerances
        };
        let observe = &mut *self.observe;
        let ended = newton.run(
            &problem,
            &mut barrier,
            &tolerances,
            Closeness::Far,
            &mut self.standing,
            |now| observe(&now.progress(Phase::Constrained)),
        );
        self.limited = barrier.has_limited();
        match ended {
            Ended::Converged => {
                let mut iterate = newton.iterate.clone();
                let plan = self.finish(newton, &mut barrier)?;
                iterate.states.clone_from(&plan.states);
                Ok(Imposed {
                    plan,
                    iterate,
                    barrier,
                })
            }
            ended => match barrier.violated() {
                Some(violation) if ended != Ended::Stopped => Err(violation.into()),
                _ => Err(self.unsolved(ended, &newton.iterate)?),
            },
        }
    }

    /// The inequalities of `set`, with multipliers scaled to the cost of `iterate`.
    pub(super) fn barrier<S, const X: usize, const U: usize>(
        &self,
        problem: &Problem<'_, S, C::Ending, X, U>,
        iterate: &Iterate<X, U>,
        set: &InequalitySet,
    ) -> Barrier<X, U>
    where
        C: Class<X, U>,
    {
        let weight = problem.h * problem.weight;
        let commands = iterate.commands.iter();
        let cost: f64 = commands.map(|w| 0.5 * w.dot(&(weight * w))).sum();
        let cost = cost
            + self.fuel(iterate)
            + self.detour(problem, &iterate.states[1..])
            + charged(problem, set, C::OFFSETS[0]);
        self.barrier_of_cost(set, cost, self.barrier_tolerances())
    }

    /// The inequalities of `set`, with multipliers scaled to a cost of this size.
    pub(super) fn barrier_of_cost<const X: usize, const U: usize>(
        &self,
        set: &InequalitySet,
        cost: f64,
        tolerances: BarrierTolerances,
    ) -> Barrier<X, U>
    where
        C: Class<X, U>,
    {
        let selection = self.class.selection();
        Barrier::new(
            set,
            self.transfer,
            &selection,
            C::OFFSETS,
            self.given(),
            cost,
            tolerances,
        )
    }

    /// The last state, moved into the terminal set as far as it is planned.
    fn aimed<const X: usize, const U: usize>(&self, last: BodyState) -> BodyState
    where
        C: Class<X, U>,
    {
        let mut aimed = last;
        self.transfer.terminal.aim(&mut aimed);
        let [translates, rotates] = C::OFFSETS.map(|offset| offset.is_some());
        if !translates {
            (aimed.position, aimed.linear_momentum) = (last.position, last.linear_momentum);
        }
        if !rotates {
            (aimed.attitude, aimed.angular_momentum) = (last.attitude, last.angular_momentum);
        }
        aimed
    }

    /// The states that start and target fix.
    pub(super) fn given(&self) -> Given {
        let transfer = self.transfer;
        let halves = [&transfer.terminal.translation, &transfer.terminal.rotation];
        Given {
            first: transfer.dynamics == Dynamics::LieEuler,
            last_poses: halves.map(HalfSet::fixes_pose),
            last_momenta: halves.map(HalfSet::fixes_momentum),
        }
    }

    /// Barrier tolerances; the violation is at least the rounding error of the state inequalities.
    pub(super) fn barrier_tolerances(&self) -> BarrierTolerances {
        let default = BarrierTolerances::default();
        let states = self.transfer.inequalities.state.iter();
        let rounding = states.map(|inequality| ROUNDING / inequality.size());
        BarrierTolerances {
            violation: rounding.fold(default.violation, f64::max),
            gap: if self.transfer.actuation.minimizes_fuel() {
                FUEL_GAP
            } else {
                default.gap
            },
            ..default
        }
    }
}

/// Estimates what following the known costs of positions is worth: `F²/K` for the sum `F` of their prices.
fn charged<S, E, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    set: &InequalitySet,
    position: Option<usize>,
) -> f64 {
    let Some(offset) = position.filter(|_| !set.position_costs.is_empty()) else {
        return 0.0;
    };
    let stiffness = problem.stiffness.fixed_rows::<3>(offset).min();
    let prices = set.position_costs.iter().map(|cost| cost.price.norm());
    prices.sum::<f64>().powi(2) / stiffness
}

/// A stationary point under inequalities.
struct Imposed<const X: usize, const U: usize> {
    plan: Plan,
    /// The iterate of the plan.
    iterate: Iterate<X, U>,
    /// The inequalities, with their multipliers at the plan.
    barrier: Barrier<X, U>,
}

impl From<Violation> for PlanError {
    fn from(violation: Violation) -> Self {
        Self::NotFound {
            constraint: violation.constraint,
            step: violation.step,
            violation: violation.excess,
        }
    }
}
