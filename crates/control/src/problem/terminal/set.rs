use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{Row, Terminal, TerminalCondition};
use crate::newton::Ending;
use crate::units::Units;

/// The terminal set of both halves.
#[derive(Clone, Debug)]
pub(crate) struct TerminalSet {
    pub(crate) translation: HalfSet,
    pub(crate) rotation: HalfSet,
}

/// The conditions on one half of a transfer in its own units.
#[derive(Clone, Debug)]
pub(crate) struct HalfSet {
    condition: Option<Arc<dyn TerminalCondition>>,
    /// The units of the transfer's states, expressed in the units of the conditions.
    units: Units,
    /// The units of the variations of pose and momentum.
    variations: SVector<f64, 6>,
    /// The unit of each condition.
    rows: SVector<f64, 6>,
}

impl From<&Terminal> for TerminalSet {
    fn from(terminal: &Terminal) -> Self {
        Self::new(terminal, &Units::ones())
    }
}

impl TerminalSet {
    /// The conditions of `terminal` for a transfer in `units`.
    pub(crate) fn new(terminal: &Terminal, units: &Units) -> Self {
        let half = |half: usize| {
            let variations = units.variations().fixed_rows::<6>(6 * half).into_owned();
            let condition = terminal.conditions[half].clone();
            let rows = condition.as_ref().map_or([Row::None; 6], |c| c.rows());
            let unit = |row| match row {
                Row::None | Row::Number => 1.0,
                Row::Pose => variations[0],
                Row::Momentum => variations[3],
            };
            HalfSet {
                condition,
                units: *units,
                variations,
                rows: rows.map(unit).into(),
            }
        };
        Self {
            translation: half(0),
            rotation: half(1),
        }
    }

    /// The only state of the set, or `None` if the set has several.
    pub(crate) fn state(&self) -> Option<BodyState> {
        let mut state = BodyState {
            position: Vector3::zeros(),
            linear_momentum: Vector3::zeros(),
            attitude: Matrix3::identity(),
            angular_momentum: Vector3::zeros(),
        };
        let aimed = self.aim(&mut state);
        let single = [&self.translation, &self.rotation]
            .iter()
            .all(|half| half.fixes(Row::Pose) && half.fixes(Row::Momentum));
        (single && aimed == [[true; 2]; 2]).then_some(state)
    }

    /// The units of the transfer's states, expressed in the units of the conditions.
    pub(crate) fn units(&self) -> &Units {
        &self.translation.units
    }

    /// The unit of each condition.
    pub(crate) fn rows(&self) -> SVector<f64, 12> {
        let halves = [&self.translation, &self.rotation];
        SVector::from_fn(|row, _| halves[row / 6].rows[row % 6])
    }

    /// Moves `state` into the set as [`TerminalCondition::aim`] does, each half separately.
    pub(crate) fn aim(&self, state: &mut BodyState) -> [[bool; 2]; 2] {
        [self.translation.aim(state), self.rotation.aim(state)]
    }
}

impl HalfSet {
    /// Removes the conditions.
    pub(crate) fn release(&mut self) {
        self.condition = None;
    }

    /// True if there are no conditions.
    pub(crate) fn is_free(&self) -> bool {
        self.condition.is_none()
    }

    /// True if the final pose is a single point or a single rotation.
    pub(crate) fn fixes_pose(&self) -> bool {
        self.fixes(Row::Pose)
    }

    /// True if the final momentum is a single vector.
    pub(crate) fn fixes_momentum(&self) -> bool {
        self.fixes(Row::Momentum)
    }

    fn fixes(&self, quantity: Row) -> bool {
        let condition = self.condition.as_ref();
        let rows = condition.map_or([Row::None; 6], |condition| condition.rows());
        rows.iter().filter(|row| **row == quantity).count() == 3
    }

    fn aim(&self, state: &mut BodyState) -> [bool; 2] {
        let Some(condition) = &self.condition else {
            return [false; 2];
        };
        let mut aimed = self.units.state(state);
        let moved = condition.aim(&mut aimed);
        *state = self.units.inverse().state(&aimed);
        moved
    }
}

impl Ending<6> for HalfSet {
    fn residual(&self, state: &BodyState) -> SVector<f64, 6> {
        let Some(condition) = &self.condition else {
            return SVector::zeros();
        };
        let residual = condition.residual(&self.units.state(state));
        residual.component_div(&self.rows)
    }

    fn jacobian(&self, state: &BodyState) -> SMatrix<f64, 6, 6> {
        let Some(condition) = &self.condition else {
            return SMatrix::zeros();
        };
        let jacobian = condition.jacobian(&self.units.state(state));
        SMatrix::from_fn(|i, j| jacobian[(i, j)] * self.variations[j] / self.rows[i])
    }

    fn curvature(&self, state: &BodyState, nu: &SVector<f64, 6>) -> SMatrix<f64, 6, 6> {
        let Some(condition) = &self.condition else {
            return SMatrix::zeros();
        };
        let nu = nu.component_div(&self.rows);
        let curvature = condition.curvature(&self.units.state(state), &nu);
        curvature.component_mul(&(self.variations * self.variations.transpose()))
    }
}

impl Ending<12> for TerminalSet {
    fn residual(&self, state: &BodyState) -> SVector<f64, 12> {
        let mut c = SVector::<f64, 12>::zeros();
        c.fixed_rows_mut::<6>(0)
            .copy_from(&self.translation.residual(state));
        c.fixed_rows_mut::<6>(6)
            .copy_from(&self.rotation.residual(state));
        c
    }

    fn jacobian(&self, state: &BodyState) -> SMatrix<f64, 12, 12> {
        diagonal(
            &self.translation.jacobian(state),
            &self.rotation.jacobian(state),
        )
    }

    fn curvature(&self, state: &BodyState, nu: &SVector<f64, 12>) -> SMatrix<f64, 12, 12> {
        let [first, second] = [0, 6].map(|row| nu.fixed_rows::<6>(row).into_owned());
        diagonal(
            &self.translation.curvature(state, &first),
            &self.rotation.curvature(state, &second),
        )
    }
}

fn diagonal(first: &SMatrix<f64, 6, 6>, second: &SMatrix<f64, 6, 6>) -> SMatrix<f64, 12, 12> {
    let mut both = SMatrix::<f64, 12, 12>::zeros();
    both.fixed_view_mut::<6, 6>(0, 0).copy_from(first);
    both.fixed_view_mut::<6, 6>(6, 6).copy_from(second);
    both
}
