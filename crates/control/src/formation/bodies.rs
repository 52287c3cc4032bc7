use std::sync::Arc;

use nalgebra::Vector3;

use super::error::FormationError;
use super::near::Near;
use super::separation::{Distances, Path, Separation};
use super::{Agreement, Formation, sides};
use crate::anderson::{Anderson, minus, norm};
use crate::problem::PositionCost;
use crate::{Plan, PlanError, Start, Sweep, Transfer};

/// Change of the prices, relative to them, at which they have settled.
const SETTLED: f64 = 1e-6;
/// The same of prices that do not settle further: constraints of a body between the ends of steps are no smooth function of them.
const ROUGH: f64 = 1e-3;
/// The change of prices up to which plans are accepted after the last round.
const COARSE: f64 = 1e-2;
/// Maximum number of rounds with the same margins.
const ROUNDS: u32 = 300;
/// Number of rounds without a better agreement after which prices do not settle further.
const PATIENCE: u32 = 8;
/// The part of the residual that is added to the prices.
const DAMPING: f64 = 0.5;
/// Number of earlier prices that are taken into account.
const MEMORY: usize = 12;
/// Growth of the residual after which the iteration goes on from the best prices, and the factor of the damping there.
const STRAY: f64 = 4.0;
const SHORTER: f64 = 0.7;
/// Number of times that a step of the prices is halved because a body has no plan.
const HALVINGS: u32 = 4;
/// Maximum number of times that margins are adjusted, and of the first of them, in which they are secants as they are.
const MARGINS: u32 = 24;
const CALM: u32 = 4;
/// Factor by which margins are adjusted more after that, so that they end.
const HURRY: f64 = 2.0;

/// The solver of a transfer.
pub(super) type Solve<'s> = Box<dyn FnMut(&Transfer, Start<'_>) -> Result<Plan, PlanError> + 's>;

/// The bodies and their last plans. Prices are stacked by body and end of a step, three components each.
pub(super) struct Bodies<'s> {
    pub(super) transfers: &'s [Transfer],
    pub(super) separation: f64,
    /// From the least compliant body, which owns no inequality.
    pub(super) order: Vec<usize>,
    pub(super) solve: Solve<'s>,
    pub(super) plans: Vec<Plan>,
    pub(super) paths: Vec<Path>,
    /// Pairs that have an inequality.
    pub(super) near: Vec<Near>,
    /// Whether bodies pass each other on the sides of their first plans.
    pub(super) keeps_sides: bool,
}

/// What a round has led to.
pub(super) struct Round {
    pub(super) plans: Vec<Plan>,
    pub(super) paths: Vec<Path>,
    /// The prices that follow from its multipliers.
    pub(super) prices: Vec<f64>,
}

impl Bodies<'_> {
    pub(super) fn intervals(&self) -> usize {
        self.transfers[0].intervals
    }

    /// Plans each body without the others.
    pub(super) fn free(&mut self) -> Result<(), FormationError> {
        for (body, transfer) in self.transfers.iter().enumerate() {
            let plan = (self.solve)(transfer, Start::Cold);
            let plan = plan.map_err(|error| self.failed(body, &[], error))?;
            self.paths.push(Path::of(transfer, &plan));
            self.plans.push(plan);
        }
        Ok(())
    }

    /// Begins with these plans.
    pub(super) fn begin(&mut self, plans: &[Plan]) {
        for (transfer, plan) in self.transfers.iter().zip(plans) {
            self.paths.push(Path::of(transfer, plan));
            // The multipliers are those of other inequalities.
            self.plans.push(Plan {
                sweep: Sweep::default(),
                ..plan.clone()
            });
        }
    }

    /// Plans that keep apart along whole steps, where the prices have settled.
    pub(super) fn settle(&mut self) -> Result<Formation, FormationError> {
        let count = 3 * self.intervals() * self.transfers.len();
        let mut prices = vec![0.0; count];
        let mut rounds = 0;
        for adjusted in 0..=MARGINS {
            let change = self.agree(&mut prices, &mut rounds)?;
            let hurry = if adjusted < CALM { 1.0 } else { HURRY };
            if !self.adjust(hurry)? {
                return Ok(self.formation(rounds, change));
            }
        }
        Err(self.too_near())
    }

    /// Rounds with the same margins until the prices have settled. Returns by how much they still change, relative to them.
    fn agree(&mut self, prices: &mut Vec<f64>, rounds: &mut u32) -> Result<f64, FormationError> {
        let mut damping = DAMPING;
        let mut iteration = Anderson::new(damping, MEMORY);
        // The best prices, their round, their residual, and their relative change.
        let mut best = None::<(Vec<f64>, Round, Vec<f64>, f64)>;
        let mut since = 0;
        for _ in 0..ROUNDS {
            if self.grow() {
                iteration.forget(damping);
                best = None;
            }
            *rounds += 1;
            let round = self.tried(prices, best.as_ref().map(|(prices, ..)| prices))?;
            let residual = minus(&round.prices, prices);
            let size = norm(&round.prices).max(norm(prices));
            let change = match size > 0.0 {
                true => norm(&residual) / size,
                false => 0.0,
            };
            self.plans.clone_from(&round.plans);
            self.paths.clone_from(&round.paths);
            let least = best.as_ref().map_or(f64::INFINITY, |(.., least)| *least);
            since += 1;
            if change < least {
                since = 0;
                best = Some((prices.clone(), round, residual.clone(), change));
            }
            let settled = change <= SETTLED || since >= PATIENCE && least <= ROUGH;
            if settled && !self.is_unseen() {
                break;
            }
            *prices = match &best {
                Some((from, round, residual, least)) if change > STRAY * least => {
                    // From there anew, but not the same way.
                    damping *= SHORTER;
                    iteration.forget(damping);
                    self.plans.clone_from(&round.plans);
                    self.paths.clone_from(&round.paths);
                    iteration.next(from, residual)
                }
                _ => iteration.next(prices, &residual),
            };
        }
        match best {
            Some((least, round, _, change)) if change <= COARSE => {
                *prices = least;
                (self.plans, self.paths) = (round.plans, round.paths);
                Ok(change)
            }
            best => Err(FormationError::Unsettled {
                rounds: *rounds,
                change: best.map_or(f64::INFINITY, |(.., change)| change),
                tolerance: COARSE,
            }),
        }
    }

    /// A round with these prices, or with ones nearer to those that are known to lead to plans.
    fn tried(
        &mut self,
        prices: &mut [f64],
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
    pub(super) fn round(&mut self, prices: &[f64]) -> Result<Round, FormationError> {
        let mut round = Round {
            plans: self.plans.clone(),
            paths: self.paths.clone(),
            prices: vec![0.0; prices.len()],
        };
        for place in 0..self.order.len() {
            let body = self.order[place];
            let near = self.near.iter().filter(|near| near.places[1] == place);
            let near: Vec<_> = near.cloned().collect();
            let other = |near: &Near| self.order[near.places[0]];
            let others: Vec<_> = near.iter().map(other).collect();
            let transfer = self.beside(body, &near, &round.paths, prices)?;
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
            self.charge(body, &near, &mut round);
        }
        Ok(round)
    }

    /// The transfer of a body beside the paths of others, where its own path has prices.
    fn beside(
        &self,
        body: usize,
        near: &[Near],
        paths: &[Path],
        prices: &[f64],
    ) -> Result<Transfer, FormationError> {
        let mut transfer = self.transfers[body].clone();
        let set = &mut transfer.inequalities;
        let index = set.next_index();
        for (number, near) in near.iter().enumerate() {
            let path = &paths[self.order[near.places[0]]];
            let apart = Separation::new(transfer.h, path, &near.radii(self.separation));
            let apart = apart.map_err(|_| FormationError::Separation(self.separation))?;
            set.add_at_ends(index + number, Arc::new(apart));
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
            (Distances([path, other]).nearest(), other)
        });
        let nearest = nearest.min_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
        let mut starts = vec![own.clone()];
        if let Some((approach, other)) = nearest
            && approach.distance < self.separation
            && !self.keeps_sides
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

    /// Adds the prices that the plan of an owner puts on the paths of others: `f = y ∂g/∂x_j = y (x_i − x_j)/R²`.
    pub(super) fn charge(&self, body: usize, near: &[Near], round: &mut Round) {
        let all = 3 * self.intervals();
        let multipliers = round.plans[body].sweep.multipliers();
        let own = multipliers.len() - near.len();
        for (near, row) in near.iter().zip(&multipliers[own..]) {
            let other = self.order[near.places[0]];
            let ends = round.paths[body].ends.iter().zip(&*round.paths[other].ends);
            let ends = ends.zip(near.radii(self.separation)).skip(1);
            let prices = round.prices[other * all..].chunks_exact_mut(3);
            for ((price, ((x, other), radius)), y) in prices.zip(ends).zip(row) {
                let force = (y / radius.powi(2)) * (x - other);
                for (price, force) in price.iter_mut().zip(&force) {
                    *price += force;
                }
            }
        }
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
                let distance = Distances(pair.map(|body| &self.paths[body]))
                    .nearest()
                    .distance;
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
