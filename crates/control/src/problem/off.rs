//! Commands that are off in some of a transfer's steps.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{SMatrix, SVector};

use super::{MAX_COMMANDS, Transfer, TransferError};

/// The commands that are off in a step: bit i is that of command i.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Off(u16);

impl Off {
    /// No command is off.
    pub(crate) const NONE: Self = Self(0);

    pub(crate) fn is_none(self) -> bool {
        self == Self::NONE
    }

    pub(crate) fn contains(self, command: usize) -> bool {
        command < MAX_COMMANDS && self.0 & (1 << command) != 0
    }

    fn with(self, command: usize) -> Self {
        Self(self.0 | 1 << command)
    }

    /// The commands among `U`.
    fn each<const U: usize>(self) -> impl Iterator<Item = usize> {
        (0..U).filter(move |command| self.contains(*command))
    }

    /// Sets the numbers of these commands to zero.
    pub(crate) fn clear<const U: usize>(self, numbers: &mut SVector<f64, U>) {
        self.each::<U>().for_each(|command| numbers[command] = 0.0);
    }

    /// Sets the columns of these commands to zero.
    pub(crate) fn clear_columns<const U: usize>(self, matrix: &mut SMatrix<f64, 3, U>) {
        self.each::<U>()
            .for_each(|command| matrix.column_mut(command).fill(0.0));
    }

    /// Sets rows and columns of these commands to zero, but for the diagonal, which becomes `diagonal`.
    pub(crate) fn decouple<const U: usize>(
        self,
        matrix: &mut SMatrix<f64, U, U>,
        diagonal: impl Fn(usize) -> f64,
    ) {
        for command in self.each::<U>() {
            matrix.row_mut(command).fill(0.0);
            matrix.column_mut(command).fill(0.0);
            matrix[(command, command)] = diagonal(command);
        }
    }

    /// Sets the rows of these commands to zero.
    pub(crate) fn clear_rows<const U: usize, const X: usize>(
        self,
        matrix: &mut SMatrix<f64, U, X>,
    ) {
        self.each::<U>()
            .for_each(|command| matrix.row_mut(command).fill(0.0));
    }
}

impl Transfer {
    /// The transfer with these commands off in `steps`, beside those that are off anyway. A command that is off is exactly zero.
    ///
    /// # Errors
    /// Returns an error if a step or a command does not exist.
    pub fn without_commands(
        mut self,
        steps: Range<usize>,
        commands: &[usize],
    ) -> Result<Self, TransferError> {
        if steps.is_empty() || steps.end > self.intervals {
            let intervals = self.intervals;
            return Err(TransferError::OffSteps { steps, intervals });
        }
        let count = self.actuation.commands();
        if let Some(&command) = commands.iter().find(|command| **command >= count) {
            return Err(TransferError::OffCommand { command, count });
        }
        let mut all = match &self.off {
            Some(off) => off.to_vec(),
            None => vec![Off::NONE; self.intervals],
        };
        for off in &mut all[steps] {
            *off = commands
                .iter()
                .fold(*off, |off, command| off.with(*command));
        }
        self.off = in_use(all);
        Ok(self)
    }

    /// The commands that are off in a step. At another resolution they are those at its middle.
    pub(crate) fn off(&self, step: usize) -> Off {
        let Some(all) = &self.off else {
            return Off::NONE;
        };
        let at = (2 * step + 1) * all.len() / (2 * self.intervals);
        all.get(at).copied().unwrap_or_default()
    }

    /// Those of each run of equal steps, with its part of all steps.
    pub(crate) fn off_shares(&self) -> Vec<(Off, f64)> {
        if self.off.is_none() {
            return vec![(Off::NONE, 1.0)];
        }
        let all: Vec<Off> = (0..self.intervals).map(|step| self.off(step)).collect();
        let runs = all.chunk_by(|one, other| one == other);
        let share = |run: &[Off]| Some((*run.first()?, run.len() as f64 / all.len() as f64));
        runs.filter_map(share).collect()
    }

    /// Those of each step, where command `i` is the transfer's command `index(i)`, or none.
    pub(crate) fn off_by_step(&self, index: impl Fn(usize) -> Option<usize>) -> Vec<Off> {
        if self.off.is_none() {
            return Vec::new();
        }
        let own = |step: usize| {
            let off = self.off(step);
            let commands = 0..MAX_COMMANDS;
            let shut = commands.filter(|own| index(*own).is_some_and(|index| off.contains(index)));
            shut.fold(Off::NONE, Off::with)
        };
        (0..self.intervals).map(own).collect()
    }

    /// Those of the transfer that starts so many steps later.
    pub(crate) fn off_after(&self, step: usize) -> Option<Arc<[Off]>> {
        let all = self.off.as_ref()?;
        in_use(all.get(step..).unwrap_or_default().to_vec())
    }
}

/// None if no command is off in any step.
fn in_use(all: Vec<Off>) -> Option<Arc<[Off]>> {
    let any = all.iter().any(|off| !off.is_none());
    any.then(|| all.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::transfer::tests::resting;

    #[test]
    fn commands_are_off_in_their_steps_at_every_resolution() {
        let transfer = resting().without_commands(3..6, &[0, 4]).unwrap();
        let transfer = transfer.without_commands(5..7, &[1]).unwrap();
        let off = |transfer: &Transfer, step: usize| {
            let off = transfer.off(step);
            (0..6).filter(|&command| off.contains(command)).collect()
        };
        let expected: [&[usize]; 10] = [
            &[],
            &[],
            &[],
            &[0, 4],
            &[0, 4],
            &[0, 1, 4],
            &[1],
            &[],
            &[],
            &[],
        ];
        for (step, expected) in expected.iter().enumerate() {
            let found: Vec<usize> = off(&transfer, step);
            assert_eq!(&found, expected, "step {step}");
        }
        let mut coarse = transfer.clone();
        coarse.intervals = 5;
        // The middles of five steps are at the ends of the odd ones.
        for (step, at) in [1, 3, 5, 7, 9].into_iter().enumerate() {
            let found: Vec<usize> = off(&coarse, step);
            assert_eq!(&found, expected[at], "step {step} of 5");
        }
        let rest = transfer.remaining(4, *transfer.initial()).unwrap();
        let found: Vec<usize> = off(&rest, 0);
        assert_eq!(&found, expected[4]);
        let over = transfer.remaining(7, *transfer.initial()).unwrap();
        assert_eq!(over.off, None);
        let own = transfer.off_by_step(|own| [Some(4), None, Some(1)].get(own).copied().flatten());
        assert_eq!((own[3], own[6], own[8]), (Off(1), Off(4), Off(0)));
    }

    #[test]
    fn steps_and_commands_that_do_not_exist_are_refused() {
        let refused = |steps: Range<usize>, command| {
            resting()
                .without_commands(steps, &[command])
                .err()
                .map(|error| error.to_string())
        };
        assert_eq!(refused(0..10, 5), None);
        assert_eq!(
            refused(4..11, 0).as_deref(),
            Some("commands are off in steps 4..11, expected steps of the 10 of the transfer")
        );
        assert!(refused(4..4, 0).is_some());
        assert_eq!(
            refused(0..1, 6).as_deref(),
            Some("command 6 is off, expected one of the 6 commands, from 0")
        );
    }
}
