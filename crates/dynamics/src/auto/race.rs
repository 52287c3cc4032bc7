use super::contender::Contender;
use super::cost::Cost;
use super::family::Family;
use super::flight::Flights;
use super::pilot::{Pilot, REFERENCE};
use super::{Candidate, Task};

/// Predicted costs, in multiples of the least, up to which a method is measured.
const CONTENDING: f64 = 1.5;

/// Error, in multiples of the target, that still reaches it.
const SLACK: f64 = 1.5;

/// Which method reaches the tolerance at the least cost: each is measured as long as it looks as if it could win.
pub(super) struct Race {
    contenders: Vec<Contender>,
    steps: f64,
    cost: Cost,
    /// Errors in multiples of what an earlier pilot let expect, once there was one: with steps of equal length, and others.
    correction: Option<[f64; 2]>,
}

impl Race {
    pub(super) fn new(task: &Task, cost: Cost) -> Self {
        let radians = task.rate * task.run.duration;
        let contender = |family: &Family| Contender::new(*family, radians);
        Self {
            contenders: task.families.iter().map(contender).collect(),
            steps: task.run.steps as f64,
            cost,
            correction: None,
        }
    }

    /// Races for the target of `pilot`.
    pub(super) fn run(&mut self, flights: &mut Flights<'_>, task: &Task, pilot: &Pilot) {
        while let Some(index) = self.next(task, pilot) {
            let correction = self.correction(&self.contenders[index]);
            let contender = &mut self.contenders[index];
            contender.fly(flights, task, pilot, correction);
            if let Some(correction) = &mut self.correction
                && contender.is_settled(pilot.target, pilot.extent(task), self.steps)
            {
                let ratio = contender.needed(pilot.target, 1.0) / contender.expected;
                correction[contender.class()] = libm::pow(ratio, contender.family.order.into());
            }
        }
    }

    /// Forgets the flights but for what they let expect of those of a longer pilot, for the target of the last one.
    pub(super) fn expect(&mut self, target: f64) {
        self.correction = Some([1.0; 2]);
        for contender in &mut self.contenders {
            contender.expect(target);
        }
    }

    /// Evaluations of gravity in the flight that looks cheapest.
    pub(super) fn evaluations(&self, pilot: &Pilot) -> Option<f64> {
        let known = self.contenders.iter().filter(|c| c.is_known());
        let predicted = known.map(|contender| {
            let needed = self.needed(contender, pilot);
            let (_, resolution) = contender.family.substeps(needed, self.steps);
            let evaluations = contender.steps(resolution) * f64::from(contender.family.stages);
            (self.predicted(contender, pilot), evaluations)
        });
        predicted
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, evaluations)| evaluations)
    }

    /// The method that references of the whole run take the fewest evaluations with, its resolution for them, and how many.
    pub(super) fn reference(&self, pilot: &Pilot) -> Option<(Family, f64, f64)> {
        let known = self
            .contenders
            .iter()
            .filter(|c| c.is_known() && c.family.is_reference());
        let references = known.map(|contender| {
            let resolution = contender.needed(REFERENCE * pilot.target, 1.0);
            let steps = contender.steps(resolution);
            (
                contender.family,
                resolution,
                steps * f64::from(contender.family.stages),
            )
        });
        references.min_by(|a, b| a.2.total_cmp(&b.2))
    }

    /// All that were measured, the cheapest first; after those that reach the target the ones that come nearest to it.
    pub(super) fn candidates(&self, pilot: &Pilot) -> Vec<Candidate> {
        let told = |c: &&Contender| c.is_known() || self.correction.is_some() && c.is_expected();
        let feasible =
            |(c, resolution): &(&Contender, f64)| c.family.is_feasible(*resolution, self.steps);
        let candidates = self.contenders.iter().filter(told);
        let candidates = candidates.map(|contender| (contender, self.needed(contender, pilot)));
        let mut candidates: Vec<_> = candidates
            .filter(feasible)
            .map(|(contender, needed)| {
                let (substeps, resolution) = contender.family.substeps(needed, self.steps);
                let order = f64::from(contender.family.order);
                let expected = || pilot.target * libm::pow(needed / resolution, order);
                Candidate {
                    method: contender.family.method(resolution),
                    substeps,
                    error: contender.error(resolution).unwrap_or_else(expected),
                    cost: self.predicted(contender, pilot),
                    measured: contender.is_known(),
                }
            })
            .collect();
        let lacks = |c: &Candidate| (c.error / pilot.target).max(SLACK);
        candidates.sort_by(|a, b| {
            let lack = lacks(a).total_cmp(&lacks(b));
            lack.then(a.cost.total_cmp(&b.cost))
        });
        candidates
    }

    fn needed(&self, contender: &Contender, pilot: &Pilot) -> f64 {
        contender.needed(pilot.target, self.correction(contender))
    }

    fn correction(&self, contender: &Contender) -> f64 {
        self.correction
            .map_or(1.0, |correction| correction[contender.class()])
    }

    fn predicted(&self, contender: &Contender, pilot: &Pilot) -> f64 {
        let needed = self.needed(contender, pilot);
        let (_, resolution) = contender.family.substeps(needed, self.steps);
        self.cost
            .flight(&contender.family, contender.steps(resolution), self.steps)
    }

    /// The cheapest of those that are to be measured yet.
    fn next(&self, task: &Task, pilot: &Pilot) -> Option<usize> {
        let extent = pilot.extent(task);
        let running = || {
            let all = self.contenders.iter().enumerate();
            all.filter(|(_, c)| c.is_known() || !c.closed)
        };
        let cost = |c: &Contender| self.predicted(c, pilot);
        let least = running()
            .map(|(_, c)| cost(c))
            .fold(f64::INFINITY, f64::min);
        running()
            .filter(|(_, c)| !c.closed && !c.is_settled(pilot.target, extent, self.steps))
            .map(|(index, c)| (index, cost(c)))
            .filter(|(_, cost)| *cost <= CONTENDING * least)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    }
}
