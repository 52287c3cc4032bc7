use nalgebra::{SMatrix, SVector};

use super::Window;
use crate::problem::Off;
use crate::{Command, MAX_COMMANDS};

/// An inequality on the commands of an interval, quadratic or linear: `½ wᵀ Q w + a · w ≤ b`.
#[derive(Clone, Debug)]
pub struct CommandInequality<const U: usize = MAX_COMMANDS> {
    /// The index of its constraint.
    pub(crate) index: usize,
    /// `Q`
    hessian: SMatrix<f64, U, U>,
    /// `a`
    linear: SVector<f64, U>,
    /// `b`
    bound: f64,
    /// `b` without slack.
    limit: f64,
    /// The price of a violation per unit of time, if it is not forbidden.
    pub(crate) price: Option<f64>,
    /// The steps in which it holds, if it does not hold in all.
    pub(crate) window: Option<Window>,
}

impl CommandInequality {
    /// `a · w ≤ b`, in multiples of the limit: `b` is about 1, or 0.
    pub fn linear(linear: Command, bound: f64) -> Self {
        Self {
            index: 0,
            hessian: SMatrix::zeros(),
            linear,
            bound,
            limit: bound,
            price: None,
            window: None,
        }
    }

    /// `|M w| ≤ 1`, as `½ |M w|² ≤ ½`.
    pub fn norm(matrix: &SMatrix<f64, 3, MAX_COMMANDS>) -> Self {
        Self {
            index: 0,
            hessian: matrix.tr_mul(matrix),
            linear: SVector::zeros(),
            bound: 0.5,
            limit: 0.5,
            price: None,
            window: None,
        }
    }

    /// For each command, the largest value that the inequality allows it alone, or infinity.
    pub(in crate::problem) fn limits(&self) -> Command {
        let largest = |command: usize| {
            let (linear, square) = (self.linear[command], self.hessian[(command, command)]);
            if square > 0.0 {
                (2.0 * self.bound / square).sqrt()
            } else if linear > 0.0 && self.bound > 0.0 {
                self.bound / linear
            } else {
                f64::INFINITY
            }
        };
        Command::from_fn(|command, _| largest(command))
    }

    /// The command that the inequality alone forbids to be negative, if it is of that kind: `−k w_i ≤ 0` without a price.
    pub(super) fn one_sided(&self) -> Option<usize> {
        let forbidden = self.price.is_none() && self.bound == 0.0 && self.hessian.amax() == 0.0;
        let mut given = (0..MAX_COMMANDS).filter(|&command| self.linear[command] != 0.0);
        match (given.next(), given.next()) {
            (Some(command), None) if forbidden && self.linear[command] < 0.0 => Some(command),
            _ => None,
        }
    }

    /// The inequality relaxed by `slack`: `g ≤ slack`; one with a price stays.
    pub(super) fn relaxed(&self, slack: f64) -> Self {
        if self.price.is_some() {
            return self.clone();
        }
        Self {
            bound: self.bound + slack,
            ..self.clone()
        }
    }

    /// The inequality in the units of the commands, where it has none of its own: `b` is 0.
    pub(super) fn normalized(self) -> Self {
        let size = self.linear.amax();
        if self.limit != 0.0 || size == 0.0 {
            return self;
        }
        Self {
            linear: self.linear / size,
            ..self
        }
    }

    /// The inequality on commands `v` from which `selection` makes the commands `w = E v`.
    pub(crate) fn of<const V: usize>(
        &self,
        selection: &SMatrix<f64, MAX_COMMANDS, V>,
    ) -> CommandInequality<V> {
        CommandInequality {
            index: self.index,
            hessian: selection.tr_mul(&(self.hessian * selection)),
            linear: selection.tr_mul(&self.linear),
            bound: self.bound,
            limit: self.limit,
            price: self.price,
            window: self.window,
        }
    }
}

impl<const U: usize> CommandInequality<U> {
    /// An inequality that any command satisfies, `0 ≤ 1`.
    pub(crate) fn idle() -> Self {
        Self {
            index: 0,
            hessian: SMatrix::zeros(),
            linear: SVector::zeros(),
            bound: 1.0,
            limit: 1.0,
            price: None,
            window: None,
        }
    }

    /// Whether it restricts the commands of one of `intervals` steps, in which some are off.
    pub(crate) fn restricts(&self, step: usize, intervals: usize, off: Off) -> bool {
        let holds = self
            .window
            .is_none_or(|window| window.holds_in(step, intervals));
        let on = |command: usize| {
            let involved = self.linear[command] != 0.0 || self.hessian[(command, command)] != 0.0;
            involved && !off.contains(command)
        };
        holds && (off.is_none() || (0..U).any(on))
    }

    /// `g(w)`.
    pub(crate) fn value(&self, command: &SVector<f64, U>) -> f64 {
        (0.5 * (self.hessian * command) + self.linear).dot(command) - self.bound
    }

    /// The relative amount by which a command exceeds its limit when the inequality has the value `g`.
    pub(crate) fn excess(&self, g: f64) -> f64 {
        let reached = g + self.bound;
        if self.hessian.amax() == 0.0 {
            reached - self.limit
        } else {
            (2.0 * reached).max(0.0).sqrt() - 1.0
        }
    }

    /// `∂g/∂w`.
    pub(crate) fn gradient(&self, command: &SVector<f64, U>) -> SVector<f64, U> {
        self.hessian * command + self.linear
    }

    /// `∂²g/∂w²`, which is constant.
    pub(crate) fn hessian(&self) -> &SMatrix<f64, U, U> {
        &self.hessian
    }
}
