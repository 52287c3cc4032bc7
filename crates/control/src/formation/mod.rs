//! Several bodies planned together, which keep apart.
//!
//! The bodies share the inequalities `g(x_i − x_j) ≤ 0` of each pair, and the sum of their costs is least. Each body is planned by
//! itself: of a pair, the more compliant body, its *owner*, has the inequality, with the last path of the other one as data. The
//! other one has its price instead: the known cost `Σ f_k · x_j(k)` with `f = y ∂g/∂x_j`, where `y` are the owner's multipliers. Where
//! the prices are those of the owner's own plan, the necessary conditions of all bodies are those of the joint problem, with the
//! same multipliers.
//!
//! A round plans each body once, the least compliant first, so that the last plans always keep apart. It maps prices to
//! prices `F(f)`. With compliances in the ratio `ρ ≤ 1` its slope is about `−ρ`, so that `f + ½ (F(f) − f)` contracts by
//! `½ (1 − ρ)`. Anderson's acceleration of this iteration copes with what the ratio does not tell.

mod error;
mod mixing;
mod separation;
mod sides;

use std::cell::Cell;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::problem::PositionCost;
use crate::{Motion, NewtonSettings, Plan, PlanError, Progress, Start, Transfer, solve};
pub use error::FormationError;
use mixing::{Mixing, minus, norm};
use separation::{Approach, Path, Separation};

/// Plans of several bodies that keep apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Formation {
    /// The plan of each body, in the order of the transfers.
    pub plans: Vec<Plan>,
    /// How well the plans fit each other.
    pub agreement: Agreement,
}

impl Formation {
    /// The sum of the plans' objectives.
    pub fn total_cost(&self) -> f64 {
        self.plans.iter().map(Plan::total_cost).sum()
    }
}

/// How well the plans of several bodies fit each other, beside the certificate of each plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Number of rounds in which each body was planned.
    pub rounds: u32,
    /// Norm of the difference between the prices that bodies paid for their paths and the multipliers of those that keep away
    /// from them, relative to the prices: the error of the joint necessary conditions.
    pub price: f64,
    /// The least distance between two bodies, along the motions that steps stand for.
    pub distance: f64,
    /// These bodies.
    pub nearest: [usize; 2],
}

/// Change of the prices, relative to them, at which they have settled.
const SETTLED: f64 = 1e-6;
/// The same of prices that do not settle further, because margins between the ends of steps change with the paths.
const ROUGH: f64 = 1e-3;
/// Maximum number of rounds.
const ROUNDS: u32 = 150;
/// Number of rounds without a better agreement after which prices do not settle further.
const PATIENCE: u32 = 12;
/// Distance, in parts of the separation, up to which two bodies count as near.
const NEAR: f64 = 2.0;
/// Growth of the residual after which earlier rounds are forgotten.
const STRAY: f64 = 4.0;
/// Number of times that a step of the prices is halved because a body has no plan.
const HALVINGS: u32 = 4;

/// Plans transfers together at the least sum of their costs so that no two bodies come nearer to each other than `separation`, along
/// the whole of their steps. `observe` is called with the iterations of all plans, counted consecutively, and stops the
/// solver by returning `false`.
///
/// # Assumptions and limitations
/// The bodies do not act on each other. All transfers have the same steps; costs are in the same unit. The formation is a local
/// optimum: the sides on which bodies pass each other are chosen one body after the other, the cheapest of four. That it is a minimum
/// for joint changes of all plans is not certified; each plan is one beside the others.
///
/// # Errors
/// Returns an error if the transfers cannot be planned together, if one has no plan, or if prices do not settle.
pub fn solve_together(
    transfers: &[Transfer],
    separation: f64,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Formation, FormationError> {
    check_together(transfers, separation)?;
    let mut order: Vec<usize> = (0..transfers.len()).collect();
    let compliances: Vec<_> = transfers.iter().map(compliance).collect();
    order.sort_by(|a, b| compliances[*a].total_cmp(&compliances[*b]));
    let mut made = [0; 2];
    let mut bodies = Bodies {
        transfers,
        separation,
        order,
        solve: Box::new(|transfer, start| {
            let latest = Cell::new(made);
            let plan = solve(transfer, start, settings, |now| {
                latest.set([made[0] + now.iteration, made[1] + now.trials]);
                let [iteration, trials] = latest.get();
                observe(&Progress {
                    iteration,
                    trials,
                    ..*now
                })
            });
            made = latest.get();
            plan
        }),
        plans: Vec::new(),
        paths: Vec::new(),
        near: Vec::new(),
    };
    bodies.free()?;
    bodies.settle()
}

/// Checks that transfers can be planned together: that there are two or more with the same steps, that each moves its body at a
/// quadratic cost, and that all keep apart at their starts and, where the targets fix them, at their ends.
///
/// # Errors
/// Returns an error that says what does not fit.
pub fn check_together(transfers: &[Transfer], separation: f64) -> Result<(), FormationError> {
    if transfers.len() < 2 {
        return Err(FormationError::Few(transfers.len()));
    }
    if !(separation > 0.0 && separation.is_finite()) {
        return Err(FormationError::Separation(separation));
    }
    let unsupported = |body, what, expected| {
        Err(FormationError::Unsupported {
            body,
            what,
            expected,
        })
    };
    for (body, transfer) in transfers.iter().enumerate() {
        if transfer.h != transfers[0].h || transfer.intervals != transfers[0].intervals {
            return Err(FormationError::Steps {
                body,
                intervals: transfer.intervals,
                h: transfer.h,
            });
        }
        if transfer.motion == Motion::Rotation {
            return unsupported(body, "a plan of its attitude alone", "one of its position");
        }
        if transfer.chances.is_some() {
            let expected = "constraints on the nominal flight";
            return unsupported(body, "constraints that hold with a probability", expected);
        }
        if transfer.actuation.minimizes_fuel() {
            return unsupported(body, "a cost of fuel", "a quadratic cost");
        }
    }
    let ends = |transfer: &Transfer| {
        let mut end = transfer.initial;
        transfer.terminal.aim(&mut end);
        let fixed = transfer.terminal.translation.fixes_pose();
        fixed.then_some(end.position)
    };
    for body in 0..transfers.len() {
        for other in 0..body {
            let two = [&transfers[other], &transfers[body]];
            let start = two.map(|transfer| Some(transfer.initial.position));
            for (at, two) in [("start", start), ("end", two.map(ends))] {
                let [Some(one), Some(two)] = two else {
                    continue;
                };
                let distance = (one - two).norm();
                if distance < separation {
                    return Err(FormationError::Near {
                        bodies: [other, body],
                        at,
                        distance,
                        separation,
                    });
                }
            }
        }
    }
    Ok(())
}

/// How far a force of unit cost moves the body, up to a factor that is the same for all bodies.
fn compliance(transfer: &Transfer) -> f64 {
    let actuation = &transfer.actuation;
    let columns = (0..actuation.commands()).map(|command| {
        let force = actuation.matrix().fixed_view::<3, 1>(0, command);
        force.norm_squared() / actuation.weight()[(command, command)]
    });
    columns.sum::<f64>() / transfer.body.mass().powi(2)
}

/// The solver of a transfer.
type Solve<'s> = Box<dyn FnMut(&Transfer, Start<'_>) -> Result<Plan, PlanError> + 's>;

/// The bodies and their last plans. Prices are stacked by body and end of a step, three components each.
struct Bodies<'s> {
    transfers: &'s [Transfer],
    separation: f64,
    /// From the least compliant body, which owns no inequality.
    order: Vec<usize>,
    solve: Solve<'s>,
    plans: Vec<Plan>,
    paths: Vec<Path>,
    /// Pairs of places in the order that have an inequality.
    near: Vec<[usize; 2]>,
}

/// What a round has led to.
struct Round {
    plans: Vec<Plan>,
    paths: Vec<Path>,
    /// The prices that follow from its multipliers.
    prices: Vec<f64>,
}

impl Bodies<'_> {
    fn intervals(&self) -> usize {
        self.transfers[0].intervals
    }

    /// Plans each body without the others.
    fn free(&mut self) -> Result<(), FormationError> {
        for (body, transfer) in self.transfers.iter().enumerate() {
            let plan = (self.solve)(transfer, Start::Cold);
            let plan = plan.map_err(|error| self.failed(body, &[], error))?;
            self.paths.push(Path::of(transfer, &plan));
            self.plans.push(plan);
        }
        Ok(())
    }

    fn settle(&mut self) -> Result<Formation, FormationError> {
        let count = 3 * self.intervals() * self.transfers.len();
        let mut prices = vec![0.0; count];
        let mut mixing = Mixing::default();
        // The prices of the best round and their relative change.
        let mut best = None::<(Vec<f64>, f64)>;
        let mut held = None::<Formation>;
        let mut since = 0;
        for rounds in 1..=ROUNDS {
            if self.grow() {
                mixing.forget();
                (best, held) = (None, None);
            }
            let round = self.tried(&mut prices, best.as_ref().map(|(prices, _)| prices))?;
            let residual = minus(&round.prices, &prices);
            let size = norm(&round.prices).max(norm(&prices));
            let change = match size > 0.0 {
                true => norm(&residual) / size,
                false => 0.0,
            };
            (self.plans, self.paths) = (round.plans, round.paths);
            let missed = self.unseen();
            let least = best.as_ref().map_or(f64::INFINITY, |(_, least)| *least);
            since += 1;
            if change < least && !missed {
                since = 0;
                held = Some(self.formation(rounds, change));
                best = Some((prices.clone(), change));
            }
            let rough = since >= PATIENCE && least <= ROUGH;
            if let Some(formation) = held.take_if(|_| !missed && (change <= SETTLED || rough)) {
                return Ok(formation);
            }
            if change > STRAY * least {
                mixing.forget();
            }
            prices = mixing.next(&prices, &residual);
        }
        match (held, best) {
            (Some(formation), Some((_, least))) if least <= ROUGH => Ok(formation),
            (_, best) => Err(FormationError::Unsettled {
                rounds: ROUNDS,
                change: best.map_or(f64::INFINITY, |(_, least)| least),
                tolerance: ROUGH,
            }),
        }
    }

    /// A round with these prices, or with ones nearer to those that are known to lead to plans.
    fn tried(
        &mut self,
        prices: &mut Vec<f64>,
        known: Option<&Vec<f64>>,
    ) -> Result<Round, FormationError> {
        let mut halvings = 0;
        loop {
            match (self.round(prices), known) {
                (Err(FormationError::Body { .. } | FormationError::Apart { .. }), Some(known))
                    if halvings < HALVINGS =>
                {
                    halvings += 1;
                    for (price, known) in prices.iter_mut().zip(known) {
                        *price = 0.5 * (*price + known);
                    }
                }
                (done, _) => return done,
            }
        }
    }

    /// Plans each body once, with these prices.
    fn round(&mut self, prices: &[f64]) -> Result<Round, FormationError> {
        let mut round = Round {
            plans: self.plans.clone(),
            paths: self.paths.clone(),
            prices: vec![0.0; prices.len()],
        };
        for place in 0..self.order.len() {
            let body = self.order[place];
            let pairs = self.near.iter().filter(|pair| pair[1] == place);
            let others: Vec<_> = pairs.map(|pair| self.order[pair[0]]).collect();
            let transfer = self.beside(body, &others, &round.paths, prices)?;
            let first = !others.is_empty()
                && self.plans[body].sweep.multipliers().len() < transfer.inequalities.state.len();
            let plan = match first {
                true => self.aside(body, &others, &transfer, &round.paths),
                false => (self.solve)(&transfer, Start::Warm(&self.plans[body])),
            };
            let mut plan = plan.map_err(|error| self.failed(body, &others, error))?;
            let ends = plan.states.iter().skip(1);
            let charged = transfer.inequalities.position_costs.iter().zip(ends);
            plan.paid -= charged
                .map(|(cost, state)| cost.price.dot(&(state.position - cost.reference)))
                .sum::<f64>();
            round.paths[body] = Path::of(&self.transfers[body], &plan);
            round.plans[body] = plan;
            self.charge(body, &others, &mut round);
        }
        Ok(round)
    }

    /// The transfer of a body beside the paths of others, where its own path has prices.
    fn beside(
        &self,
        body: usize,
        others: &[usize],
        paths: &[Path],
        prices: &[f64],
    ) -> Result<Transfer, FormationError> {
        let mut transfer = self.transfers[body].clone();
        let set = &mut transfer.inequalities;
        let index = set.next_index();
        for (number, other) in others.iter().enumerate() {
            let apart = Separation::new(&paths[*other], self.separation);
            let apart = apart.map_err(|_| FormationError::Separation(self.separation))?;
            set.add(index + number, Arc::new(apart));
        }
        let all = 3 * self.intervals();
        let own = &prices[body * all..(body + 1) * all];
        if own.iter().any(|price| *price != 0.0) {
            let ends = self.paths[body].ends.iter().skip(1);
            let costs = own.chunks_exact(3).zip(ends);
            let costs = costs.map(|(price, reference)| PositionCost {
                price: Vector3::from_column_slice(price),
                reference: *reference,
            });
            set.position_costs = costs.collect();
        }
        Ok(transfer)
    }

    /// The cheapest plan of a body that keeps away from others for the first time.
    fn aside(
        &mut self,
        body: usize,
        others: &[usize],
        transfer: &Transfer,
        paths: &[Path],
    ) -> Result<Plan, PlanError> {
        let own = &self.plans[body];
        let path = &self.paths[body];
        let nearest = others.iter().map(|other| {
            let other = &paths[*other];
            (Approach::of([path, other]), other)
        });
        let nearest = nearest.min_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
        let mut starts = vec![own.clone()];
        if let Some((approach, other)) = nearest
            && approach.distance < self.separation
        {
            starts.extend(sides::guesses(
                transfer,
                own,
                other,
                approach,
                self.separation,
            ));
        }
        let mut best = None::<Result<Plan, PlanError>>;
        for start in &starts {
            let found = (self.solve)(transfer, Start::Warm(start));
            if let Err(PlanError::Stopped { .. }) = found {
                return found;
            }
            let better = match (&found, &best) {
                (_, None) | (Ok(_), Some(Err(_))) => true,
                (Ok(found), Some(Ok(best))) => found.total_cost() < best.total_cost(),
                (Err(_), Some(_)) => false,
            };
            if better {
                best = Some(found);
            }
        }
        best.unwrap_or(Err(PlanError::Stopped { best: None }))
    }

    /// Adds the prices that the plan of an owner puts on the paths of others: `f = y ∂g/∂x_j = y (x_i − x_j)/d²`.
    fn charge(&self, body: usize, others: &[usize], round: &mut Round) {
        let all = 3 * self.intervals();
        let multipliers = round.plans[body].sweep.multipliers();
        let own = multipliers.len() - others.len();
        for (other, row) in others.iter().zip(&multipliers[own..]) {
            let ends = round.paths[body]
                .ends
                .iter()
                .zip(&*round.paths[*other].ends);
            let prices = round.prices[other * all..].chunks_exact_mut(3);
            for ((price, (x, other)), y) in prices.zip(ends.skip(1)).zip(row) {
                let force = (y / self.separation.powi(2)) * (x - other);
                for (price, force) in price.iter_mut().zip(&force) {
                    *price += force;
                }
            }
        }
    }

    /// Gives the pairs that come near to each other an inequality; whether there are any new ones.
    fn grow(&mut self) -> bool {
        let before = self.near.len();
        for place in 0..self.order.len() {
            for other in 0..place {
                let pair = [other, place];
                if !self.near.contains(&pair) && self.distance(pair) < NEAR * self.separation {
                    self.near.push(pair);
                }
            }
        }
        self.near.sort_unstable();
        self.near.len() > before
    }

    /// Whether a pair without an inequality is too near.
    fn unseen(&self) -> bool {
        let places = 0..self.order.len();
        let mut pairs = places.flat_map(|place| (0..place).map(move |other| [other, place]));
        pairs.any(|pair| !self.near.contains(&pair) && self.distance(pair) < self.separation)
    }

    fn distance(&self, places: [usize; 2]) -> f64 {
        Approach::of(places.map(|place| &self.paths[self.order[place]])).distance
    }

    fn formation(&self, rounds: u32, price: f64) -> Formation {
        let mut agreement = Agreement {
            rounds,
            price,
            distance: f64::INFINITY,
            nearest: [0, 1],
        };
        for body in 0..self.plans.len() {
            for other in 0..body {
                let pair = [other, body];
                let distance = Approach::of(pair.map(|body| &self.paths[body])).distance;
                if distance < agreement.distance {
                    (agreement.distance, agreement.nearest) = (distance, pair);
                }
            }
        }
        Formation {
            plans: self.plans.clone(),
            agreement,
        }
    }

    /// The error of a body's plan beside others.
    fn failed(&self, body: usize, others: &[usize], error: PlanError) -> FormationError {
        let constraint = match error {
            PlanError::Stopped { .. } => return FormationError::Stopped,
            PlanError::Infeasible { constraint, .. }
            | PlanError::NotFound { constraint, .. }
            | PlanError::Between { constraint, .. } => Some(constraint),
            _ => None,
        };
        let own = self.transfers[body].inequalities.next_index();
        let other = constraint.and_then(|index| others.get(index.checked_sub(own)?));
        let source = Box::new(error);
        match other {
            Some(other) => FormationError::Apart {
                bodies: [*other, body],
                source,
            },
            None => FormationError::Body { body, source },
        }
    }
}
