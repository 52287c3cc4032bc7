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
    let all = &transfer.inequalities.command;
    let mut limits = Vec::new();
    for (at, inequality) in all.iter().enumerate() {
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
mod tests {
    use lgvi_dynamics::gravity::Central;
    use lgvi_dynamics::{BodyState, Inertia, RigidBody};
    use nalgebra::{Matrix3, Vector3};

    use super::*;
    use crate::constraint::{CommandLimit, ComponentLimit, NormLimit, Place};
    use crate::{Actuation, Constraint};

    fn transfer(actuation: Actuation, motion: Motion, constraints: &[Constraint]) -> Transfer {
        let state = BodyState {
            position: Vector3::x(),
            linear_momentum: Vector3::zeros(),
            attitude: Matrix3::identity(),
            angular_momentum: Vector3::zeros(),
        };
        let inertia = Inertia::principal([1.0; 3]).expect("inertia");
        let body = RigidBody::new(1.0, inertia, Vec::new()).expect("a body");
        let field = Central { gm: 0.0 };
        Transfer::new(body, field, 0.1, 10, state, state, actuation)
            .expect("a transfer")
            .with_motion(motion)
            .with_constraints(constraints)
    }

    fn loads(force: [f64; 3], moment: [f64; 3]) -> Actuation {
        let weight = |diagonal: [f64; 3]| Matrix3::from_diagonal(&diagonal.into());
        Actuation::full(&weight(force), &weight(moment)).expect("weights")
    }

    fn components(place: Place, limits: [f64; 3]) -> Constraint {
        Constraint::commands(ComponentLimit::new(place, limits.into()).expect("limits"))
    }

    fn norm(place: Place, limit: f64) -> Constraint {
        Constraint::commands(NormLimit::new(place, limit).expect("a limit"))
    }

    fn close(found: Result<f64, FinalTimeError>, expected: f64) {
        let found = found.expect("a bound");
        assert!(
            (found / expected - 1.0).abs() < 1e-12,
            "{found} for {expected}"
        );
    }

    #[test]
    fn the_greatest_cost_of_components_and_norms_is_exact() {
        let boxed = [components(Place::Attitude, [1.0, 2.0, 3.0])];
        let weights = loads([1.0; 3], [2.0, 1.0, 5.0]);
        close(rate(&transfer(weights, Motion::Rotation, &boxed)), 25.5);
        let ball = [norm(Place::Position, 3.0)];
        close(
            rate(&transfer(
                loads([2.0; 3], [1.0; 3]),
                Motion::Translation,
                &ball,
            )),
            9.0,
        );
        let both = [ball[0].clone(), boxed[0].clone()];
        let weights = loads([2.0; 3], [2.0, 1.0, 5.0]);
        close(rate(&transfer(weights, Motion::Full, &both)), 34.5);
        // A wide norm beside narrow components changes nothing.
        let wide = [norm(Place::Attitude, 100.0), boxed[0].clone()];
        let weights = loads([1.0; 3], [2.0, 1.0, 5.0]);
        close(rate(&transfer(weights, Motion::Rotation, &wide)), 25.5);
    }

    #[test]
    fn no_commands_within_the_limits_cost_more() {
        let coupled = Matrix3::new(2.0, 0.8, 0.1, 0.8, 1.0, -0.3, 0.1, -0.3, 4.0);
        let actuation = Actuation::full(&coupled, &coupled).expect("weights");
        let limit = Vector3::new(1.0, 2.0, 0.5);
        for constraint in [
            components(Place::Attitude, limit.into()),
            norm(Place::Attitude, 0.5),
        ] {
            let ball = matches!(&constraint, Constraint::Commands(c) if c.name() == "moment_norm");
            let bound = rate(&transfer(
                actuation.clone(),
                Motion::Rotation,
                &[constraint],
            ))
            .expect("a bound");
            let mut greatest = 0.0_f64;
            for i in 0..40 {
                for j in 0..40 {
                    let (a, b) = (f64::from(i) * 0.16, f64::from(j) * 0.16);
                    let u = Vector3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin());
                    let u = if ball {
                        0.5 * u
                    } else {
                        u.map(f64::signum).component_mul(&limit)
                    };
                    greatest = greatest.max(0.5 * u.dot(&(coupled * u)));
                }
            }
            assert!(
                greatest <= bound && bound <= 1.2 * greatest,
                "{bound} for {greatest}"
            );
        }
    }

    #[test]
    fn thrusters_of_one_side_are_limited_and_skew_actuators_by_their_loads() {
        let column = |x: f64, y: f64| ([x, y, 0.0, 0.0, 0.0, 0.0], 1.0);
        let actuation = Actuation::actuators(&[column(1.0, 0.0), column(-1.0, 0.0)]).expect("two");
        let limit = CommandLimit::new(&[2.0, 3.0]).expect("limits").one_sided();
        let limits = [Constraint::commands(limit)];
        close(rate(&transfer(actuation, Motion::Full, &limits)), 6.5);
        // |w_1 + w_2| ≤ 2 and |w_1 − w_2| ≤ 2: at most w = (2, 0).
        let skew = Actuation::actuators(&[column(1.0, 1.0), column(1.0, -1.0)]).expect("two");
        let limits = [components(Place::Position, [2.0, 2.0, f64::INFINITY])];
        close(rate(&transfer(skew, Motion::Translation, &limits)), 2.0);
    }

    #[test]
    fn the_first_command_without_a_limit_is_named() {
        let unlimited = |motion, constraints: &[Constraint]| match rate(&transfer(
            loads([1.0; 3], [1.0; 3]),
            motion,
            constraints,
        )) {
            Err(FinalTimeError::Unlimited { command }) => command,
            other => panic!("{other:?}"),
        };
        assert_eq!(unlimited(Motion::Rotation, &[]), 3);
        assert_eq!(unlimited(Motion::Full, &[norm(Place::Position, 1.0)]), 3);
        let open = [components(Place::Attitude, [1.0, f64::INFINITY, 1.0])];
        assert_eq!(unlimited(Motion::Rotation, &open), 4);
        // Limits on one side only.
        let limit = CommandLimit::new(&[f64::INFINITY; 6])
            .expect("limits")
            .one_sided();
        assert_eq!(
            unlimited(Motion::Translation, &[Constraint::commands(limit)]),
            0
        );
    }
}
