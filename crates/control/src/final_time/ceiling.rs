use nalgebra::{DMatrix, DVector, Dyn, SVD, SVector};

use super::FinalTimeError;
use crate::discrete::DecoupledCommands;
use crate::problem::CommandInequality;
use crate::{Command, MAX_COMMANDS, Motion, Transfer};

/// An upper bound of the cost per unit of time, `½ wᵀ W w`, of all commands within their limits. It is exact for a
/// diagonal weight and limits by command or component, and for limits on the norm of equally weighted commands.
///
/// Limits `|a_j · w| ≤ m_j` and `|Q_j^½ w| ≤ m_j` bound `y = Y w`, where `Y` has the rows `a_j` and the blocks `Q_j^½`.
/// With `w = Y⁺ y` and `G = Y⁺ᵀ W Y⁺` the cost is `½ Σ y_iᵀ G_ij y_j ≤ ½ Σ |G_ij| m_i m_j`.
///
/// # Errors
/// Returns [`FinalTimeError::Unlimited`] if a planned command can be arbitrarily large.
pub(super) fn rate(transfer: &Transfer) -> Result<f64, FinalTimeError> {
    let planned = planned(transfer)?;
    let limits = limits(transfer, &planned);
    if let Some(place) = unlimited(&limits, planned.len()) {
        let command = planned[place];
        return Err(FinalTimeError::Unlimited { command });
    }
    let all = transfer.actuation.weight();
    let weight = DMatrix::from_fn(planned.len(), planned.len(), |i, j| {
        all[(planned[i], planned[j])]
    });
    // More limits than commands spoil `Y⁺`, so that some of them may give a better bound.
    let (norms, rows): (Vec<_>, Vec<_>) = limits.iter().cloned().partition(|limit| limit.norm);
    let bounds = [limits, norms, rows];
    let bounds = bounds.iter().filter_map(|limits| bound(limits, &weight));
    Ok(bounds.fold(f64::INFINITY, f64::min))
}

/// `|rows · w| ≤ most`.
#[derive(Clone, Debug)]
struct Limit {
    rows: DMatrix<f64>,
    most: f64,
    /// True for a limit on a norm.
    norm: bool,
}

/// Indices of the commands that the transfer's motion is planned with.
fn planned(transfer: &Transfer) -> Result<Vec<usize>, FinalTimeError> {
    let actuation = &transfer.actuation;
    let half = match transfer.motion {
        _ if actuation.is_of_wheels() => None,
        Motion::Full => None,
        Motion::Translation => Some(DecoupledCommands::forces(actuation)),
        Motion::Rotation => Some(DecoupledCommands::moments(actuation)),
    };
    let half = half
        .transpose()
        .map_err(crate::discrete::DecouplingError::from)?;
    let of_half = |command: &usize| {
        let unit: Command = SVector::ith(*command, 1.0);
        half.as_ref()
            .is_none_or(|half| half.narrowed(&unit).amax() > 0.0)
    };
    Ok((0..actuation.commands()).filter(of_half).collect())
}

fn limits(transfer: &Transfer, planned: &[usize]) -> Vec<Limit> {
    let none = Command::zeros();
    let own =
        |row: &Command| DVector::from_iterator(planned.len(), planned.iter().map(|&i| row[i]));
    // What has a price does not limit anything.
    let all = transfer.inequalities.command.iter();
    let all: Vec<_> = all.filter(|row| row.price.is_none()).collect();
    let mut limits = Vec::new();
    for (at, &inequality) in all.iter().enumerate() {
        let bound = -inequality.value(&none);
        let row = own(&inequality.gradient(&none));
        if inequality.hessian().amax() > 0.0 {
            limits.extend(norm(inequality, &row, bound, planned));
            continue;
        }
        // `a · w ≤ b` with `−k a · w ≤ c`.
        for other in &all[at + 1..] {
            let opposite = own(&other.gradient(&none));
            let scale = -opposite.dot(&row) / row.norm_squared();
            let linear = other.hessian().amax() == 0.0;
            if linear
                && scale > 0.0
                && (&opposite + scale * &row).amax() <= ROUNDING * opposite.amax()
            {
                limits.push(Limit {
                    rows: DMatrix::from_rows(&[row.transpose()]),
                    most: bound.abs().max((other.value(&none) / scale).abs()),
                    norm: false,
                });
            }
        }
    }
    limits
}

/// `½ wᵀ Q w ≤ b` as `|Q^½ w| ≤ √(2 b)`; nothing if the inequality has a linear term.
fn norm(
    inequality: &CommandInequality<MAX_COMMANDS>,
    linear: &DVector<f64>,
    bound: f64,
    planned: &[usize],
) -> Option<Limit> {
    if linear.amax() > 0.0 {
        return None;
    }
    let hessian = DMatrix::from_fn(planned.len(), planned.len(), |i, j| {
        inequality.hessian()[(planned[i], planned[j])]
    });
    let svd = singular_values(hessian)?;
    let roots = svd.singular_values.map(f64::sqrt);
    Some(Limit {
        rows: DMatrix::from_diagonal(&roots) * svd.v_t?,
        most: (2.0 * bound).max(0.0).sqrt(),
        norm: true,
    })
}

/// Iteration limit of the singular value decomposition; a finite matrix takes a few dozen.
const MOST: usize = 1000;

fn singular_values(matrix: DMatrix<f64>) -> Option<SVD<f64, Dyn, Dyn>> {
    SVD::try_new(matrix, true, true, f64::EPSILON, MOST)
}

/// Relative size below which a number is what rounding left of zero.
const ROUNDING: f64 = 1e-9;

/// `Y` with its rows in units of the limits, and `Y⁺`.
fn inverse(limits: &[Limit]) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let rows = limits.iter().flat_map(|limit| {
        let rows = limit.rows.row_iter();
        rows.map(move |row| row / limit.most.max(f64::MIN_POSITIVE))
    });
    let rows: Vec<_> = rows.collect();
    if rows.is_empty() {
        return None;
    }
    let all = DMatrix::from_rows(&rows);
    // Commands in units of their columns: a weak actuator is an actuator.
    let sizes = all.column_iter().map(|column| match column.norm() {
        size if size > 0.0 => size,
        _ => 1.0,
    });
    let sizes = DVector::from_iterator(all.ncols(), sizes);
    let mut scaled = all.clone();
    for (mut column, size) in scaled.column_iter_mut().zip(&sizes) {
        column /= *size;
    }
    let mut inverse = singular_values(scaled)?.pseudo_inverse(ROUNDING).ok()?;
    for (mut row, size) in inverse.row_iter_mut().zip(&sizes) {
        row /= *size;
    }
    Some((all, inverse))
}

/// The first command that the limits leave unlimited.
fn unlimited(limits: &[Limit], commands: usize) -> Option<usize> {
    let Some((all, inverse)) = inverse(limits) else {
        return (commands > 0).then_some(0);
    };
    let kept = inverse * all;
    (0..commands).find(|&command| (kept[(command, command)] - 1.0).abs() > ROUNDING.sqrt())
}

/// The bound of the cost that these limits give, or nothing if they do not limit all commands.
fn bound(limits: &[Limit], weight: &DMatrix<f64>) -> Option<f64> {
    if unlimited(limits, weight.nrows()).is_some() {
        return None;
    }
    let (_, inverse) = inverse(limits)?;
    let cost = inverse.tr_mul(&(weight * &inverse));
    let mut first = 0;
    let spans: Vec<_> = limits
        .iter()
        .map(|limit| {
            let span = (first, limit.rows.nrows());
            first += span.1;
            span
        })
        .collect();
    let mut sum = 0.0;
    for &i in &spans {
        for &j in &spans {
            let block = cost.view((i.0, j.0), (i.1, j.1)).into_owned();
            sum += if i == j {
                singular_values(block)?.singular_values.max()
            } else {
                block.norm()
            };
        }
    }
    Some(0.5 * sum)
}

#[cfg(test)]
mod tests;
