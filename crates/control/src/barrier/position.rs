use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::SVector;

use crate::problem::PositionCost;

/// The known costs of the positions at the ends of intervals.
pub(super) struct PositionCosts {
    /// The index of δx in z.
    offset: usize,
    by_end: Arc<[PositionCost]>,
    /// The costs at the iterate.
    paid: Vec<f64>,
}

impl PositionCosts {
    /// Returns `None` if there are none, or if the position is not planned.
    pub(super) fn new(by_end: &Arc<[PositionCost]>, offset: Option<usize>) -> Option<Self> {
        let offset = offset.filter(|_| !by_end.is_empty())?;
        Some(Self {
            offset,
            by_end: Arc::clone(by_end),
            paid: vec![0.0; by_end.len()],
        })
    }

    /// Adds the gradient at the end of an interval.
    pub(super) fn add<const X: usize>(
        &mut self,
        interval: usize,
        state: &BodyState,
        gradient: &mut SVector<f64, X>,
    ) {
        self.paid[interval] = self.value(interval, state);
        self.add_force(interval, gradient);
    }

    /// Adds the gradient to the force at the end of an interval.
    pub(super) fn add_force<const X: usize>(&self, interval: usize, force: &mut SVector<f64, X>) {
        let mut part = force.fixed_rows_mut::<3>(self.offset);
        part += self.by_end[interval].price;
    }

    /// The derivative along a direction.
    pub(super) fn slope<const X: usize>(&self, interval: usize, z: &SVector<f64, X>) -> f64 {
        let price = &self.by_end[interval].price;
        price.dot(&z.fixed_rows::<3>(self.offset))
    }

    pub(super) fn value(&self, interval: usize, state: &BodyState) -> f64 {
        let PositionCost { price, reference } = &self.by_end[interval];
        price.dot(&(state.position - reference))
    }

    /// The cost of all positions at the iterate.
    pub(super) fn paid(&self) -> f64 {
        self.paid.iter().sum()
    }
}
