use std::sync::Arc;

use nalgebra::Vector3;

use super::error::FormationError;
use super::mixing::{Mixing, minus, norm};
use super::separation::{Approach, Path, Separation};
use super::{Agreement, Formation, sides};
use crate::problem::PositionCost;
use crate::{Plan, PlanError, Start, Transfer};

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
    /// Pairs of places in the order that have an inequality.
    pub(super) near: Vec<[usize; 2]>,
}

/// What a round has led to.
pub(super) struct Round {
    pub(super) plans: Vec<Plan>,
    pub(super) paths: Vec<Path>,
    /// The prices that follow from its multipliers.
    pub(super) prices: Vec<f64>,
}

impl Bodies<'_> {
    fn intervals(&self) -> usize {
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

    pub(super) fn settle(&mut self) -> Result<Formation, FormationError> {
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
    pub(super) fn round(&mut self, prices: &[f64]) -> Result<Round, FormationError> {
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
    pub(super) fn charge(&self, body: usize, others: &[usize], round: &mut Round) {
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
