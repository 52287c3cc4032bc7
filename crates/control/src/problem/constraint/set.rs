use std::f64::consts::{FRAC_PI_2, PI};

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3x6, SVector, Vector3};

use super::error::Reader;
use super::state::Kind;
use super::{CommandInequality, Constraint, ConstraintError, StateInequality};
use crate::problem::{Actuation, Terminal, TranslationTarget};

/// All inequalities of a transfer.
#[derive(Clone, Debug, Default)]
pub(crate) struct InequalitySet {
    /// On each interval's commands.
    pub(crate) command: Vec<CommandInequality>,
    /// On the state at the end of each step.
    pub(crate) state: Vec<StateInequality>,
}

impl InequalitySet {
    /// Those that `constraints` state under an actuation, between a start and a target.
    pub(crate) fn new(
        constraints: &[Constraint],
        actuation: &Actuation,
        initial: &BodyState,
        target: &Terminal,
    ) -> Result<Self, ConstraintError> {
        let mut all = Self::default();
        for (index, constraint) in constraints.iter().enumerate() {
            let read = Reader(index);
            let force = || actuation.matrix().fixed_rows::<3>(0).into_owned();
            let moment = || actuation.matrix().fixed_rows::<3>(3).into_owned();
            match constraint {
                Constraint::Commands { limit } => {
                    for (command, &limit) in limit.iter().enumerate().take(actuation.commands()) {
                        let row = SVector::ith(command, 1.0);
                        all.component(read, row, limit)?;
                    }
                }
                Constraint::ForceComponents { limit } => all.components(read, &force(), limit)?,
                Constraint::MomentComponents { limit } => all.components(read, &moment(), limit)?,
                Constraint::ForceNorm { limit } => all.norm(read, &force(), *limit)?,
                Constraint::MomentNorm { limit } => all.norm(read, &moment(), *limit)?,
                Constraint::KeepOutCone {
                    axis,
                    direction,
                    half_angle,
                } => {
                    let angle = read.angle(*half_angle, PI)?;
                    all.keep(
                        read,
                        Kind::Cone {
                            axis: read.unit("axis", axis)?,
                            direction: read.unit("direction", direction)?,
                            cosine: libm::cos(angle),
                            sine: libm::sin(angle),
                        },
                    );
                }
                Constraint::KeepOutSphere { center, radius } => {
                    all.keep(
                        read,
                        Kind::Sphere {
                            center: read.point("center", center)?,
                            radius: read.length("radius", *radius)?,
                        },
                    );
                }
                Constraint::Corridor {
                    apex,
                    axis,
                    half_angle,
                } => {
                    let apex = read.point("apex", apex)?;
                    let angle = read.angle(*half_angle, FRAC_PI_2)?;
                    all.keep(
                        read,
                        Kind::Corridor {
                            apex,
                            axis: read.unit("axis", axis)?,
                            cosine: libm::cos(angle),
                            length: corridor_length(&apex, initial, target),
                        },
                    );
                }
            }
        }
        Ok(all)
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.command.is_empty() && self.state.is_empty()
    }

    fn keep(&mut self, read: Reader, kind: Kind) {
        self.state.push(StateInequality {
            constraint: read.0,
            kind,
            slack: 0.0,
        });
    }

    /// The same with `slack` of room each, `g ≤ slack`.
    pub(crate) fn relaxed(&self, slack: f64) -> Self {
        Self {
            command: self.command.iter().map(|row| row.relaxed(slack)).collect(),
            state: self.state.iter().map(|row| row.relaxed(slack)).collect(),
        }
    }

    /// `|row · w| ≤ limit`, where commands reach the row at all.
    fn component(
        &mut self,
        read: Reader,
        row: SVector<f64, 6>,
        limit: f64,
    ) -> Result<(), ConstraintError> {
        if let Some(limit) = read.limit("limit", limit)?
            && row != SVector::<f64, 6>::zeros()
        {
            let row = row / limit;
            self.command.push(CommandInequality::linear(read.0, row));
            self.command.push(CommandInequality::linear(read.0, -row));
        }
        Ok(())
    }

    fn components(
        &mut self,
        read: Reader,
        matrix: &Matrix3x6<f64>,
        limit: &Vector3<f64>,
    ) -> Result<(), ConstraintError> {
        for axis in 0..3 {
            self.component(read, matrix.row(axis).transpose(), limit[axis])?;
        }
        Ok(())
    }

    fn norm(
        &mut self,
        read: Reader,
        matrix: &Matrix3x6<f64>,
        limit: f64,
    ) -> Result<(), ConstraintError> {
        if let Some(limit) = read.limit("limit", limit)?
            && *matrix != Matrix3x6::zeros()
        {
            self.command
                .push(CommandInequality::norm(read.0, matrix, limit));
        }
        Ok(())
    }
}

/// The distance of start or target from the apex, whichever is farther; 1 where both are there.
fn corridor_length(apex: &Vector3<f64>, initial: &BodyState, target: &Terminal) -> f64 {
    let from_start = (initial.position - apex).norm();
    let length = match &target.translation {
        TranslationTarget::State { position, .. } | TranslationTarget::Position { position } => {
            from_start.max((position - apex).norm())
        }
        TranslationTarget::Orbit { .. } | TranslationTarget::Free => from_start,
    };
    if length > 0.0 { length } else { 1.0 }
}
