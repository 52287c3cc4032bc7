use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector};

use super::{RotationSet, Terminal, TerminalError, TranslationSet};
use crate::newton::Ending;

/// The terminal set of both halves.
#[derive(Clone, Debug)]
pub(crate) struct TerminalSet {
    pub(crate) translation: TranslationSet,
    pub(crate) rotation: RotationSet,
}

impl TerminalSet {
    /// The conditions of a validated `terminal` on a body of `mass`.
    pub(crate) fn new(terminal: &Terminal, mass: f64) -> Result<Self, TerminalError> {
        Ok(Self {
            translation: TranslationSet::new(&terminal.translation, mass)?,
            rotation: RotationSet::new(&terminal.rotation)?,
        })
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
        diagonal(
            &self
                .translation
                .curvature(state, &nu.fixed_rows::<6>(0).into_owned()),
            &self
                .rotation
                .curvature(state, &nu.fixed_rows::<6>(6).into_owned()),
        )
    }
}

fn diagonal(first: &SMatrix<f64, 6, 6>, second: &SMatrix<f64, 6, 6>) -> SMatrix<f64, 12, 12> {
    let mut both = SMatrix::<f64, 12, 12>::zeros();
    both.fixed_view_mut::<6, 6>(0, 0).copy_from(first);
    both.fixed_view_mut::<6, 6>(6, 6).copy_from(second);
    both
}
