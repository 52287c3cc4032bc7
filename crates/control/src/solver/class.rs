//! Classes of motion: the iteration's view of a transfer that plans all coordinates or half of them.

use nalgebra::{SMatrix, SVector, Vector3};

use crate::discrete::{
    DecoupledCommands, DecouplingError, DiscreteDynamics, Full, Gyrostat, KickDriftKick,
    RotationOnly, TranslationOnly,
};
use crate::newton::{BodyFrame, Ending};
use crate::problem::{HalfSet, TerminalSet};
use crate::{Actuation, Command, MAX_COMMANDS, Transfer};

/// A class of motion of `X` coordinates under `U` commands.
pub(super) trait Class<const X: usize, const U: usize> {
    /// The steps of the class.
    type Steps<'t>: DiscreteDynamics<X, U>;
    /// The terminal conditions of the class.
    type Ending: Ending<X>;
    /// Index of the first of its coordinates among the twelve.
    const FIRST: usize;
    /// Indices of δx and ζ in z, if they are coordinates of the class.
    const OFFSETS: [Option<usize>; 2];

    /// The class under the commands of `actuation`.
    fn of(actuation: &Actuation) -> Result<Self, DecouplingError>
    where
        Self: Sized;

    fn steps<'t>(&self, transfer: &'t Transfer) -> Result<Self::Steps<'t>, DecouplingError>;

    fn ending<'t>(&self, transfer: &'t Transfer) -> &'t Self::Ending;

    /// `W` of the commands of the class.
    fn weight(&self, transfer: &Transfer) -> SMatrix<f64, U, U>;

    /// The actuation's commands for given commands of the class; all others are zero.
    fn widened(&self, command: &SVector<f64, U>) -> Command;

    /// The commands of the class, taken from the actuation's commands.
    fn narrowed(&self, command: &Command) -> SVector<f64, U>;

    /// Index of the moment among the commands, if commands are moments themselves.
    fn moments(&self, transfer: &Transfer) -> Option<usize>;

    /// Indices of the body-frame vectors that turn with the attitude.
    fn body_frame(&self, transfer: &Transfer) -> Option<BodyFrame> {
        let [_, attitude] = Self::OFFSETS;
        Some(BodyFrame {
            attitude: attitude?,
            moment: self.moments(transfer)?,
        })
    }

    /// The matrix `S` of `w = S w_U`.
    fn selection(&self) -> SMatrix<f64, MAX_COMMANDS, U> {
        let mut selection = SMatrix::<f64, MAX_COMMANDS, U>::zeros();
        for column in 0..U {
            let mut unit = SVector::<f64, U>::zeros();
            unit[column] = 1.0;
            selection.set_column(column, &self.widened(&unit));
        }
        selection
    }
}

/// Position and attitude, under the first `U` commands of the actuation.
pub(super) struct Both<const U: usize>;

impl<const U: usize> Class<12, U> for Both<U> {
    type Steps<'t> = KickDriftKick<'t, Full, 2, U>;
    type Ending = TerminalSet;
    const FIRST: usize = 0;
    const OFFSETS: [Option<usize>; 2] = [Some(0), Some(6)];

    fn of(_: &Actuation) -> Result<Self, DecouplingError> {
        Ok(Self)
    }

    fn steps<'t>(&self, transfer: &'t Transfer) -> Result<Self::Steps<'t>, DecouplingError> {
        Ok(KickDriftKick::full(transfer))
    }

    fn ending<'t>(&self, transfer: &'t Transfer) -> &'t TerminalSet {
        &transfer.terminal
    }

    fn weight(&self, transfer: &Transfer) -> SMatrix<f64, U, U> {
        let weight = transfer.actuation.weight();
        weight.fixed_view::<U, U>(0, 0).into_owned()
    }

    fn moments(&self, transfer: &Transfer) -> Option<usize> {
        transfer.actuation.gains().map(|_| 3)
    }

    fn widened(&self, command: &SVector<f64, U>) -> Command {
        command.fixed_resize(0.0)
    }

    fn narrowed(&self, command: &Command) -> SVector<f64, U> {
        command.fixed_rows::<U>(0).into_owned()
    }
}

/// The attitude of a body and the momentum of its wheels, under the first `U` commands of the actuation.
pub(super) struct Spinning<const U: usize>;

impl<const U: usize> Class<12, U> for Spinning<U> {
    type Steps<'t> = KickDriftKick<'t, Gyrostat, 2, U>;
    type Ending = TerminalSet;
    const FIRST: usize = 0;
    const OFFSETS: [Option<usize>; 2] = [None, Some(6)];

    fn of(_: &Actuation) -> Result<Self, DecouplingError> {
        Ok(Self)
    }

    fn steps<'t>(&self, transfer: &'t Transfer) -> Result<Self::Steps<'t>, DecouplingError> {
        KickDriftKick::gyrostat(transfer)
    }

    fn ending<'t>(&self, transfer: &'t Transfer) -> &'t TerminalSet {
        Both::<U>.ending(transfer)
    }

    fn weight(&self, transfer: &Transfer) -> SMatrix<f64, U, U> {
        Both::<U>.weight(transfer)
    }

    fn moments(&self, _: &Transfer) -> Option<usize> {
        None
    }

    fn widened(&self, command: &SVector<f64, U>) -> Command {
        Both::<U>.widened(command)
    }

    fn narrowed(&self, command: &Command) -> SVector<f64, U> {
        Both::<U>.narrowed(command)
    }
}

/// The center of mass alone.
#[derive(Clone)]
pub(super) struct Translation(pub(super) DecoupledCommands);

impl Class<6, 3> for Translation {
    type Steps<'t> = KickDriftKick<'t, TranslationOnly, 1, 3>;
    type Ending = HalfSet;
    const FIRST: usize = 0;
    const OFFSETS: [Option<usize>; 2] = [Some(0), None];

    fn of(actuation: &Actuation) -> Result<Self, DecouplingError> {
        Ok(Self(DecoupledCommands::forces(actuation)?))
    }

    fn steps<'t>(&self, transfer: &'t Transfer) -> Result<Self::Steps<'t>, DecouplingError> {
        KickDriftKick::translation(transfer, &self.0)
    }

    fn ending<'t>(&self, transfer: &'t Transfer) -> &'t HalfSet {
        &transfer.terminal.translation
    }

    fn weight(&self, _: &Transfer) -> SMatrix<f64, 3, 3> {
        *self.0.weight()
    }

    fn moments(&self, _: &Transfer) -> Option<usize> {
        None
    }

    fn widened(&self, command: &Vector3<f64>) -> Command {
        self.0.widened(command)
    }

    fn narrowed(&self, command: &Command) -> Vector3<f64> {
        self.0.narrowed(command)
    }
}

/// The attitude alone.
#[derive(Clone)]
pub(super) struct Rotation(pub(super) DecoupledCommands);

impl Class<6, 3> for Rotation {
    type Steps<'t> = KickDriftKick<'t, RotationOnly, 1, 3>;
    type Ending = HalfSet;
    const FIRST: usize = 6;
    const OFFSETS: [Option<usize>; 2] = [None, Some(0)];

    fn of(actuation: &Actuation) -> Result<Self, DecouplingError> {
        Ok(Self(DecoupledCommands::moments(actuation)?))
    }

    fn steps<'t>(&self, transfer: &'t Transfer) -> Result<Self::Steps<'t>, DecouplingError> {
        KickDriftKick::rotation(transfer, &self.0)
    }

    fn ending<'t>(&self, transfer: &'t Transfer) -> &'t HalfSet {
        &transfer.terminal.rotation
    }

    fn weight(&self, _: &Transfer) -> SMatrix<f64, 3, 3> {
        *self.0.weight()
    }

    fn moments(&self, transfer: &Transfer) -> Option<usize> {
        transfer.actuation.gains().map(|_| 0)
    }

    fn widened(&self, command: &Vector3<f64>) -> Command {
        self.0.widened(command)
    }

    fn narrowed(&self, command: &Command) -> Vector3<f64> {
        self.0.narrowed(command)
    }
}
