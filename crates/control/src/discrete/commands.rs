use nalgebra::{Matrix3, SVector, Vector3};
use thiserror::Error;

use crate::{Actuation, Command};

/// The error that an actuation's commands cannot plan one half of a motion.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error(
    "{found} of the commands have a {what} and nothing else, expected 1 to 3 where the rest of the motion is that of \
     the free flight"
)]
pub struct CommandsError {
    /// "force" or "moment".
    what: &'static str,
    /// Number of commands.
    found: usize,
}

/// The commands of an actuation that move one half of the motion and leave the other alone.
///
/// A command with both force and moment would disturb the free flight of the other half. It stays at zero, like the
/// commands of the other half.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DecoupledCommands {
    /// Indices of their columns in the actuation.
    columns: [Option<usize>; 3],
    /// Force or moment of unit commands; zero beyond the last command.
    matrix: Matrix3<f64>,
    /// The weight of the commands; the identity beyond the last command.
    weight: Matrix3<f64>,
}

impl DecoupledCommands {
    /// The commands with a force only.
    pub(crate) fn forces(actuation: &Actuation) -> Result<Self, CommandsError> {
        Self::of(actuation, "force", [0, 3])
    }

    /// The commands with a moment only.
    pub(crate) fn moments(actuation: &Actuation) -> Result<Self, CommandsError> {
        Self::of(actuation, "moment", [3, 0])
    }

    /// The commands whose load is in the three rows starting at `own`, with none in the rows starting at `other`.
    fn of(
        actuation: &Actuation,
        what: &'static str,
        [own, other]: [usize; 2],
    ) -> Result<Self, CommandsError> {
        let part = |column: usize, from: usize| -> Vector3<f64> {
            let matrix = actuation.matrix();
            matrix.fixed_view::<3, 1>(from, column).into_owned()
        };
        let alone = |column: &usize| {
            // A force that turns with the body depends on the attitude.
            let turns = actuation.is_fixed_to_body() && own == 0;
            !turns
                && part(*column, own) != Vector3::zeros()
                && part(*column, other) == Vector3::zeros()
        };
        let mut matrix = Matrix3::zeros();
        let mut columns = [None; 3];
        let mut found = 0;
        for column in (0..actuation.commands()).filter(alone) {
            if let Some(place) = columns.get_mut(found) {
                *place = Some(column);
                matrix.set_column(found, &part(column, own));
            }
            found += 1;
        }
        if !(1..=3).contains(&found) {
            return Err(CommandsError { what, found });
        }
        let weight = Matrix3::from_fn(|i, j| match (columns[i], columns[j]) {
            (Some(row), Some(column)) => actuation.weight()[(row, column)],
            _ => f64::from(u8::from(i == j)),
        });
        Ok(Self {
            columns,
            matrix,
            weight,
        })
    }

    /// `B` (3×3); columns beyond the last command are zero.
    pub(crate) fn matrix(&self) -> &Matrix3<f64> {
        &self.matrix
    }

    /// The index in the actuation of a command of the half.
    pub(crate) fn index(&self, own: usize) -> Option<usize> {
        self.columns.get(own).copied().flatten()
    }

    /// `W` (3×3); the identity beyond the last command.
    pub(crate) fn weight(&self) -> &Matrix3<f64> {
        &self.weight
    }

    /// The actuation's commands `w` for given commands of the half; all others are zero.
    pub(crate) fn widened(&self, half: &Vector3<f64>) -> Command {
        let mut all = SVector::zeros();
        for (place, column) in self.columns.iter().enumerate() {
            if let Some(column) = *column {
                all[column] = half[place];
            }
        }
        all
    }

    /// The commands of the half, taken from the actuation's commands `w`.
    pub(crate) fn narrowed(&self, all: &Command) -> Vector3<f64> {
        Vector3::from_fn(|place, _| self.columns[place].map_or(0.0, |column| all[column]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MAX_COMMANDS;

    #[test]
    fn commands_that_move_both_halves_stay_at_zero() {
        let columns = [
            ([0.0, 0.0, 0.0, 1.0, 0.0, 0.0], 2.0),
            ([1.0, 2.0, 0.0, 0.0, 0.0, 0.0], 3.0),
            ([1.0, 0.0, 0.0, 0.0, 1.0, 0.0], 5.0),
            ([0.0, 0.0, 4.0, 0.0, 0.0, 0.0], 7.0),
        ];
        let actuation = Actuation::actuators(&columns).unwrap();
        let forces = DecoupledCommands::forces(&actuation).unwrap();
        let half = Vector3::new(0.1, 0.2, 0.3);
        let all = forces.widened(&half);
        assert_eq!(all.as_slice()[..4], [0.0, 0.1, 0.0, 0.2]);
        assert_eq!(all.rows(4, MAX_COMMANDS - 4).amax(), 0.0);
        assert_eq!(forces.narrowed(&all), Vector3::new(0.1, 0.2, 0.0));
        let load = actuation.load(&all);
        assert_eq!(load.force, forces.matrix() * half);
        assert_eq!(load.moment, Vector3::zeros());
        let weight = Matrix3::from_diagonal(&Vector3::new(3.0, 7.0, 1.0));
        assert_eq!(forces.weight(), &weight);
        let moments = DecoupledCommands::moments(&actuation).unwrap();
        assert_eq!(moments.widened(&half), Command::ith(0, 0.1));
    }

    #[test]
    fn weights_of_forces_and_moments_are_their_own() {
        let [force, moment] =
            [2.0, 3.0].map(|w| Matrix3::new(w, 0.5, 0.0, 0.5, w, 0.0, 0.0, 0.0, w));
        let actuation = Actuation::full(&force, &moment).unwrap();
        let forces = DecoupledCommands::forces(&actuation).unwrap();
        let moments = DecoupledCommands::moments(&actuation).unwrap();
        assert_eq!((forces.weight(), moments.weight()), (&force, &moment));
        assert_eq!(moments.matrix(), &Matrix3::identity());
        let half = Vector3::new(0.1, 0.2, 0.3);
        let all = moments.widened(&half);
        assert_eq!(all.as_slice()[..6], [0.0, 0.0, 0.0, 0.1, 0.2, 0.3]);
    }

    #[test]
    fn none_or_more_than_three_are_refused() {
        let thruster = |x: f64| ([x, 1.0, 0.0, 0.0, 0.0, 0.0], 1.0);
        let four = Actuation::actuators(&[1.0, 2.0, 3.0, 4.0].map(thruster)).unwrap();
        let refused = |what, found| Err(CommandsError { what, found });
        assert_eq!(DecoupledCommands::forces(&four), refused("force", 4));
        assert_eq!(DecoupledCommands::moments(&four), refused("moment", 0));
    }
}
